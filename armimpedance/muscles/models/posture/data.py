"""What one matrix, K or B, was measured to be over posture, in the form in which it is fitted."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.muscles.models.angle_scaling import AngleScaling
from armimpedance.muscles.models.rows import ELEMENTS, JointRows

#: Symbol of each matrix and the unit of its elements.
UNITS = {"K": "N m/rad", "B": "N m s/rad"}


@dataclass(frozen=True)
class PostureData(FrozenRecord):
    """P measured matrices.

    Attributes
    ----------
    symbol : "K" or "B"
    scaled : (P, 2)
        Scaled joint angles.
    measured : (P, 2, 2)
        Matrices as given, not necessarily symmetric.
    values : (P, 3)
        ``ss, se, ee``; the cross term is the mean of se and es, so that one polynomial is fitted
        to both (the source's way).
    sd : (P, 3) or None
        Standard errors of `values`.
    """

    symbol: str
    scaled: Annotated[FloatArray, "p 2"]
    measured: Annotated[FloatArray, "p 2 2"]
    values: Annotated[FloatArray, "p 3"]
    sd: Annotated[FloatArray, "p 3"] | None

    @property
    def n_rows(self) -> int:
        """Number of postures P."""
        return len(self.scaled)

    @property
    def weights(self) -> FloatArray:
        """Square roots (P, 3) of what each residual counts in a sum of squares.

        1/sd, or without standard errors 1, sqrt(2), 1: the data hold the cross term twice.
        """
        if self.sd is not None:
            return 1 / self.sd
        return np.tile([1.0, np.sqrt(2.0), 1.0], (self.n_rows, 1))

    def shuffled(self, order: IntArray) -> PostureData:
        """The same measurements at each other's postures."""
        return replace(
            self,
            measured=self.measured[order],
            values=self.values[order],
            sd=None if self.sd is None else self.sd[order],
        )


def posture_data(rows: JointRows, symbol: str, scaling: AngleScaling) -> PostureData:
    """The stiffness ("K", N m/rad) or viscosity ("B", N m s/rad) of rows."""
    values, sd = rows.elements(symbol)
    measured = rows.stiffness if symbol == "K" else rows.viscosity
    return PostureData(symbol, scaling.scaled(rows.joint_angles), measured, values, sd)


def element_names(symbol: str) -> tuple[str, ...]:
    """``K_ss, K_se, K_ee``."""
    return tuple(f"{symbol}_{element}" for element in ELEMENTS)
