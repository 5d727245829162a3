"""Measurements of one matrix, K or B, over posture, in the form in which it is fitted."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.muscles.models.posture.certificate import Gram
from armimpedance.muscles.models.rows import ELEMENTS, JointRows
from armimpedance.muscles.models.workspace import AngleScaling

#: Symbol of each matrix and the unit of its elements.
UNITS = {"K": "N m/rad", "B": "N m s/rad"}


@dataclass(frozen=True)
class PostureData(FrozenRecord):
    """P measured matrices.

    `scaled` (P, 2): scaled joint angles.
    `measured` (P, 2, 2): matrices as given, not necessarily symmetric.
    `values` (P, 3): ``ss, se, ee``; the cross term is the mean of se and es, so that one polynomial
    is fitted to both (the source's way).
    `sd` (P, 3) or None: standard errors of `values`.
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


# What each way of fitting one matrix over posture hands over.


@dataclass(frozen=True)
class FittedMatrix:
    """K or B over posture, with what its fit is worth.

    `powers` (terms, 2) int: exponents of the scaled angles in each term.
    `coefficients` (terms, 3): coefficients of ss, se, ee.
    `covariance` (3 terms, 3 terms): all terms of ss, then se, then ee.
    `dof`: degrees of freedom of the t distribution for intervals.
    `held_out` (P, 3) or None: predictions of each posture by a fit without it.
    `null_r` (4,): mean R of ss, se, es, ee over shuffles of the rows.
    `spent`: coefficients that the fit spent on ss, se, ee.
    `structure`: "free" polynomials, or how the sum of squares is built.
    `penalty`: weight on the trace of the Gram matrix; 0 without one.
    `grams`: gram matrices that prove positive semidefiniteness; empty where nothing proves it.
    """

    symbol: str
    powers: IntArray
    coefficients: FloatArray
    covariance: FloatArray
    dof: float
    held_out: FloatArray | None
    null_r: FloatArray
    spent: tuple[float, float, float]
    cond_scaled: float
    rank: int
    structure: str
    penalty: float
    grams: tuple[Gram, ...] = ()
    warnings: tuple[str, ...] = ()
