"""Symmetric matrices as their elements on and above the diagonal, row by row."""

from __future__ import annotations

from functools import cache

import numpy as np

from armimpedance.arrays import FloatArray, IntArray


@cache
def elements(n: int) -> tuple[IntArray, IntArray]:
    """Row and column of each element of a packed matrix (n, n)."""
    i, j = np.triu_indices(n)
    return i, j


@cache
def _places(n: int) -> IntArray:
    """Number (n, n) of the packed element that stands at each place."""
    i, j = elements(n)
    places = np.empty((n, n), dtype=np.int64)
    places[i, j] = places[j, i] = np.arange(len(i))
    return places


def unpacked(packed: FloatArray, n: int) -> FloatArray:
    """The symmetric matrix (n, n) of packed elements."""
    return packed[_places(n)]
