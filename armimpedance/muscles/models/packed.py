"""Symmetric matrices as their elements on and above the diagonal, row by row."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray, IntArray

#: Cross terms that differ by less, as a part of the largest element, are one number: a symmetric
#: matrix that was mapped from the hand is symmetric up to rounding.
_ROUNDING = 1e-9


@cache
def elements(n: int) -> tuple[IntArray, IntArray]:
    """Row and column of each of the E = n (n + 1) / 2 elements of a packed matrix (n, n).

    Parameters
    ----------
    n : int

    Returns
    -------
    rows, columns : (E,) int
    """
    i, j = np.triu_indices(n)
    return i, j


def order_of(count: int) -> int:
    """The n of a matrix (n, n) that has `count` packed elements."""
    return (math.isqrt(8 * count + 1) - 1) // 2


def congruence(V: FloatArray) -> FloatArray:
    """``A -> V^T A V`` of symmetric A (n, n) as matrices (..., E_d, E_n) on packed elements.

    Parameters
    ----------
    V : (..., n, d)

    Returns
    -------
    (..., E_d, E_n)
    """
    n, d = V.shape[-2:]
    i, j = elements(n)
    a, b = elements(d)
    left, right = V[..., i, :], V[..., j, :]
    both = left[..., a] * right[..., b] + right[..., a] * left[..., b]
    return np.asarray(np.swapaxes(both, -1, -2) * np.where(i == j, 0.5, 1.0))


@cache
def _places(n: int) -> IntArray:
    """Number (n, n) of the packed element that stands at each place."""
    i, j = elements(n)
    places = np.empty((n, n), dtype=np.int64)
    places[i, j] = places[j, i] = np.arange(len(i))
    return places


def unpacked(packed: FloatArray, n: int) -> FloatArray:
    """The symmetric matrices (..., n, n) of packed elements (..., E).

    Parameters
    ----------
    packed : (..., E)
    n : int

    Returns
    -------
    (..., n, n)
    """
    return packed[..., _places(n)]


def kept_elements(n: int, moving: tuple[int, ...]) -> IntArray:
    """Which of the packed elements of n joints belong to those that move.

    Parameters
    ----------
    n : int
    moving : (r,) tuple of int

    Returns
    -------
    (E_r,) int
    """
    i, j = elements(n)
    return np.flatnonzero(np.isin(i, moving) & np.isin(j, moving))


def triple(matrices: ArrayLike) -> FloatArray:
    """Packed elements (..., E) of matrices (..., n, n), a cross term the mean of both.

    Of shoulder and elbow they are ``ss, se, ee``.

    Parameters
    ----------
    matrices : (..., n, n)

    Returns
    -------
    (..., E)
    """
    A = np.asarray(matrices, dtype=float)
    i, j = elements(A.shape[-1])
    return np.asarray((A[..., i, j] + A[..., j, i]) / 2)


def matrix(triples: ArrayLike) -> FloatArray:
    """Symmetric matrices (..., n, n) of packed elements (..., E), such as ``ss, se, ee``.

    Parameters
    ----------
    triples : (..., E)

    Returns
    -------
    (..., n, n)
    """
    t = np.asarray(triples, dtype=float)
    return unpacked(t, order_of(t.shape[-1]))


def triple_sd(measured: ArrayLike, sd: ArrayLike) -> FloatArray:
    """Standard errors (P, E) of `triple` from those of the elements (P, n, n).

    Where both cross terms are one number up to rounding (a symmetric part was taken before) so is
    their error; else they count as independent.
    """
    A, s = np.asarray(measured, dtype=float), np.asarray(sd, dtype=float)
    i, j = elements(A.shape[-1])
    size = np.abs(A).max(axis=(-2, -1))[..., None]
    same = np.abs(A[..., i, j] - A[..., j, i]) <= _ROUNDING * size
    apart = np.hypot(s[..., i, j], s[..., j, i]) / 2
    return np.where(same, (s[..., i, j] + s[..., j, i]) / 2, apart)
