"""How points scatter about a law beyond their stated errors: weights and slopes, in turns."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError
from armimpedance.numerics.regression import ErrorMoments, refuse_unreliable, solve_total

#: Rounds of, and a relative change that ends, the search for weights and slopes.
_ROUNDS, _SETTLED = 200, 1e-9
#: Points without any error weigh as if they had this part of the variance of the values.
_EXACT: Final = 1e-20


def error_covariance(amplitude_sd: FloatArray) -> FloatArray:
    """Covariance (L, m + 1, m + 1) of the errors of each row of W; the constant has none."""
    L, m = amplitude_sd.shape
    S = np.zeros((L, m + 1, m + 1))
    S[:, np.arange(1, m + 1), np.arange(1, m + 1)] = amplitude_sd**2
    return S


def error_moments(
    W: FloatArray, y: FloatArray, S: FloatArray, variance: FloatArray, names: tuple[str, ...]
) -> ErrorMoments:
    """One cluster per point, weighted."""
    w = 1 / variance
    gram = np.einsum("l,li,lj->lij", w, W, W)
    units = ("",) * len(names)
    return ErrorMoments(gram, W * (w * y)[:, None], S * w[:, None, None], names, units)


def settled_variance(
    W: FloatArray, y: FloatArray, sd: FloatArray, S: FloatArray, names: tuple[str, ...]
) -> tuple[FloatArray, float]:
    """Variance (L,) of each point about the law, and its unexplained part as a deviation.

    Weights need the slopes and slopes the weights: in turns until both stay.
    """
    base = np.full(len(y), float(y.var() + (sd**2).mean()) or 1.0)
    refuse_unreliable(error_moments(W, y, S, base, names), points=len(y))
    variance, scatter = base, 0.0
    for _ in range(_ROUNDS):
        before = variance
        beta = solve_total(error_moments(W, y, S, variance, names).corrected)
        # known (L,) = sd^2 + beta^T S_l beta
        known = sd**2 + np.einsum("i,lij,j->l", beta, S, beta)
        scatter = _unexplained(y - W @ beta, known, len(y) - len(beta))
        variance = np.maximum(known + scatter, _EXACT * base)
        if np.abs(variance - before).max() <= _SETTLED * variance.max():
            return variance, float(np.sqrt(scatter))
    raise EstimationError(
        f"weights and slopes of {', '.join(names[1:])} do not settle in {_ROUNDS} rounds: "
        "errors of the amplitudes are too large for these points"
    )


def _unexplained(residual: FloatArray, known: FloatArray, dof: int) -> float:
    """t >= 0 with ``sum residual^2 / (known + t) = dof`` (R. C. Paule, J. Mandel, 1982)."""
    from scipy.optimize import brentq

    squares = residual**2
    most = float(squares.sum()) / dof

    def excess(t: float) -> float:
        total = np.maximum(known + t, np.finfo(float).tiny)
        return float((squares / total).sum()) - dof

    if most == 0 or excess(0.0) <= 0:
        return 0.0
    if excess(most) >= 0:  # nothing else is known of the points' errors
        return most
    return float(brentq(excess, 0.0, most, xtol=1e-14 * most, rtol=1e-13))
