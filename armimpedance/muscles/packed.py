"""Symmetric matrices as their elements on and above the diagonal, row by row."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from armimpedance.arrays import FloatArray, IntArray


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
