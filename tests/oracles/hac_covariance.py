"""Newey-West covariance of autocorrelated residuals, against which others can be held."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_triangular

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError


def hac_covariance(
    W: Sequence[ArrayLike] | ArrayLike,
    E: Sequence[ArrayLike] | ArrayLike,
    triangle: ArrayLike,
    lag: int,
) -> FloatArray:
    """Newey-West covariance (p q, p q) with Bartlett weights, within trials, never across.

    ``(W^T W)^-1 [sum_t sum_|l|<=lag (1 - |l|/(lag+1)) sum_i u_i u_(i+l)^T] (W^T W)^-1`` with the
    scores ``u_i = vec(w_i e_i^T)``; no small-sample factor; ``lag = 0`` is White's covariance.

    Parameters
    ----------
    W : (T, S, p), or a sequence of (S_t, p)
    E : (T, S, q), or a sequence of (S_t, q)
        Residuals ``Y - fit.predict(W)``.
    triangle : (p, p)
        `Fit.triangle`.
    lag : int
        Samples.

    Raises
    ------
    InputError
        Shapes that do not belong together, or a negative lag.
    """
    R = np.asarray(triangle, dtype=np.float64)
    blocks_w = [np.asarray(w, dtype=np.float64) for w in W]  # type: ignore[union-attr]
    blocks_e = [np.asarray(e, dtype=np.float64) for e in E]  # type: ignore[union-attr]
    fits = len(blocks_w) == len(blocks_e) and all(
        w.ndim == e.ndim == 2 and len(w) == len(e) and w.shape[1] == len(R)
        for w, e in zip(blocks_w, blocks_e, strict=False)
    )
    if lag < 0 or not fits:
        raise InputError(
            f"HAC with lag {lag} on {len(blocks_w)} and {len(blocks_e)} trials",
            expected=f"lag >= 0, (samples, {len(R)}) and (samples, outputs) per trial",
        )
    scale = np.linalg.norm(R, axis=0)
    meat = sum(
        _bartlett_sum(_row_scores(w / scale, e, R / scale), lag)
        for w, e in zip(blocks_w, blocks_e, strict=True)
    )
    p, q = len(R), blocks_e[0].shape[1]
    inverse = np.kron(np.eye(q), solve_triangular(R / scale, np.eye(p)) / scale[:, None])
    # C (q p, q p) = (I (x) R^-1) meat (I (x) R^-T), the meat in the orthonormal basis
    return np.asarray(inverse @ meat @ inverse.T)


def _row_scores(w: FloatArray, e: FloatArray, triangle: FloatArray) -> FloatArray:
    """Scores of single rows in the orthonormal basis, (S, q p)."""
    z = solve_triangular(triangle, w.T, trans="T").T
    return np.asarray((e[:, :, None] * z[:, None, :]).reshape(len(w), -1))


def _bartlett_sum(u: FloatArray, lag: int) -> FloatArray:
    """Bartlett-weighted autocovariance sum of scores u (S, n).

    The triangle is a box convolved with itself, so the weighted sum over lags is the plain cross
    product of moving sums over lag + 1 rows: positive semidefinite by construction.
    """
    padded = np.pad(u, ((lag + 1, lag), (0, 0)))
    running = np.cumsum(padded, axis=0)
    moving = running[lag + 1 :] - running[: -(lag + 1)]
    return np.asarray(moving.T @ moving / (lag + 1))
