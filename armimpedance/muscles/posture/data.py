"""What one matrix, K or B, was measured to be over posture, in the form in which it is fitted."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from armimpedance.arrays import FloatArray, IntArray, frozen_array
from armimpedance.muscles.angle_scaling import AngleScaling
from armimpedance.muscles.rows import ELEMENTS, JointRows, triple, triple_sd

#: Symbol of each matrix and the unit of its elements.
UNITS = {"K": "Nm/rad", "B": "Nms/rad"}


@dataclass(frozen=True)
class PostureData:
    """P measured matrices.

    Attributes
    ----------
    symbol : "K" or "B"
    scaled : (P, 2)
        Scaled joint angles.
    measured : (P, 2, 2)
        As given, not necessarily symmetric.
    values : (P, 3)
        ``ss, se, ee``; the cross term is the mean of se and es, so that one polynomial is fitted
        to both (the source's way).
    sd : (P, 3) or None
        Standard errors of `values`.
    """

    symbol: str
    scaled: FloatArray
    measured: FloatArray
    values: FloatArray
    sd: FloatArray | None

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "scaled", frozen_array(self.scaled, "scaled", (None, 2)))
        p = len(self.scaled)
        put(self, "measured", frozen_array(self.measured, "measured", (p, 2, 2)))
        put(self, "values", frozen_array(self.values, "values", (p, 3)))
        if self.sd is not None:
            put(self, "sd", frozen_array(self.sd, "sd", (p, 3)))

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


def stiffness_data(rows: JointRows, scaling: AngleScaling) -> PostureData:
    """Stiffness of rows, Nm/rad."""
    return _data("K", rows.stiffness, rows.stiffness_sd, scaling.scaled(rows.joint_angles))


def viscosity_data(rows: JointRows, scaling: AngleScaling) -> PostureData:
    """Viscosity of rows, Nms/rad."""
    return _data("B", rows.viscosity, rows.viscosity_sd, scaling.scaled(rows.joint_angles))


def _data(
    symbol: str, measured: FloatArray, sd: FloatArray | None, scaled: FloatArray
) -> PostureData:
    spread = None if sd is None else triple_sd(measured, sd)
    return PostureData(symbol, scaled, measured, triple(measured), spread)


def element_names(symbol: str) -> tuple[str, ...]:
    """``K_ss, K_se, K_ee``."""
    return tuple(f"{symbol}_{element}" for element in ELEMENTS)
