"""A chain of blocks: Kalman filter in information form and Rauch-Tung-Striebel backward pass.

A Gaussian posterior whose information matrix couples neighbours only is a Markov chain of blocks.
Filtering forward and smoothing backward cost one small factorisation per block: linear in samples.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError


@dataclass(frozen=True)
class Smoothed:
    """Mean (n, q) of q right-hand sides, and the marginal variances (n,)."""

    mean: FloatArray
    variance: FloatArray


def smooth_chain(banded: FloatArray, right: FloatArray, size: int) -> Smoothed:
    """Mean ``H^-1 g`` and ``diag(H^-1)`` of information H (n, n) and g (n, q).

    Parameters
    ----------
    banded : (w, n)
        H in lower banded form: ``banded[k, i] = H[i + k, i]``.
    right : (n, q)
    size : int
        Unknowns of a block, at least w - 1.

    Raises
    ------
    EstimationError
        H is not positive definite.
    """
    n, q = right.shape
    own, below = _blocks(banded, size)
    count = len(own)
    padded = np.zeros((count * size, q))
    padded[:n] = right
    g: FloatArray = padded.reshape(count, size, q)
    inverse, gain = np.empty_like(own), np.empty_like(own)
    filtered = np.empty_like(g)
    information: FloatArray = own[0]
    carried: FloatArray = g[0]
    for k in range(count):
        inverse[k] = _inverse(information)
        filtered[k] = inverse[k] @ carried
        # gain G (s, s) = D_k^-1 H_(k+1,k)^T
        gain[k] = inverse[k] @ below[k].T
        if k + 1 < count:
            information = own[k + 1] - below[k] @ gain[k]
            carried = g[k + 1] - below[k] @ filtered[k]
    mean, covariance = filtered, inverse
    for k in range(count - 2, -1, -1):
        # x_k = D_k^-1 g_k - G_k x_(k+1), P_k = D_k^-1 + G_k P_(k+1) G_k^T
        mean[k] -= gain[k] @ mean[k + 1]
        covariance[k] += gain[k] @ covariance[k + 1] @ gain[k].T
    variance = np.diagonal(covariance, axis1=1, axis2=2).reshape(-1)[:n]
    return Smoothed(mean.reshape(-1, q)[:n], np.array(variance))


def _inverse(information: FloatArray) -> FloatArray:
    """Symmetric inverse with rows and columns scaled first: units differ by orders."""
    diagonal = np.diagonal(information)
    if not (diagonal > 0).all():
        raise EstimationError("the smoother's information matrix is not positive definite")
    scale = 1 / np.sqrt(diagonal)
    inverse = np.linalg.inv(information * scale[:, None] * scale) * scale[:, None] * scale
    return np.asarray((inverse + inverse.T) / 2)


def _blocks(banded: FloatArray, size: int) -> tuple[FloatArray, FloatArray]:
    """Diagonal blocks (c, s, s), and those below them (c, s, s), padded by an identity."""
    width, n = banded.shape
    count = -(-n // size)
    own, below = np.zeros((count, size, size)), np.zeros((count, size, size))
    at = np.arange(n)
    for k in range(width):
        values = banded[k, : n - k] if k else banded[0]
        column = at[: n - k]
        row = column + k
        same = row // size == column // size
        c, i, j = column // size, row % size, column % size
        own[c[same], i[same], j[same]] = values[same]
        own[c[same], j[same], i[same]] = values[same]
        below[c[~same], i[~same], j[~same]] = values[~same]
    rest = np.arange(n % size or size, size)
    own[-1, rest, rest] = 1.0
    return own, below
