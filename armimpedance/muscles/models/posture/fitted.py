"""What each way of fitting one matrix over posture hands over."""

from __future__ import annotations

from dataclasses import dataclass

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.muscles.models.posture.certificate import Gram


@dataclass(frozen=True)
class FittedMatrix:
    """K or B over posture, with what its fit is worth.

    Attributes
    ----------
    symbol : "K" or "B"
    powers : (terms, 2) int
        Exponents of the scaled angles in each term.
    coefficients : (terms, 3)
        Coefficients of ss, se, ee.
    covariance : (3 terms, 3 terms)
        All terms of ss, then se, then ee.
    dof : float
        Degrees of freedom of the t distribution for intervals.
    held_out : (P, 3) or None
        Predictions of each posture by a fit without it.
    null_r : (4,)
        Mean R of ss, se, es, ee over shuffles of the rows.
    spent : three floats
        Coefficients that the fit spent on ss, se, ee.
    cond_scaled : float
    rank : int
    structure : str
        "free" polynomials, or how the sum of squares is built.
    penalty : float
        Weight on the trace of the Gram matrix; 0 without one.
    grams : tuple of Gram
        Gram matrices that prove positive semidefiniteness; empty where nothing proves it.
    warnings : tuple of str
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
