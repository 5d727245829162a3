"""Polynomials in Bernstein form: coefficients that are nonnegative make a curve that is.

``f(alpha) = sum_k beta_k C(N, k) s^k (1 - s)^(N - k)``, ``s = (alpha - low) / (high - low)``. The
curve stays between its least and its largest coefficient for s in 0..1, and rises where the
coefficients do: bounds on the coefficients are bounds on the curve, over the whole range and not
only at measured points.
"""

from __future__ import annotations

from math import comb

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray


def bernstein_basis(s: ArrayLike, order: int) -> FloatArray:
    """The N + 1 Bernstein polynomials at s (...,), as (..., N + 1)."""
    x = np.asarray(s, dtype=float)[..., None]
    k = np.arange(order + 1)
    return np.array([comb(order, i) for i in k]) * x**k * (1 - x) ** (order - k)


def bernstein_slopes(s: ArrayLike, order: int) -> FloatArray:
    """Their derivatives by s, (..., N + 1): ``N (b_{k-1, N-1} - b_{k, N-1})``."""
    below = bernstein_basis(s, order - 1) if order else np.zeros((*np.shape(s), 0))
    nothing = np.zeros((*below.shape[:-1], 1))
    left, right = np.concatenate([nothing, below], -1), np.concatenate([below, nothing], -1)
    return order * (left - right)


def to_powers(low: float, high: float, order: int) -> FloatArray:
    """Matrix (N + 1, N + 1) from Bernstein coefficients over low..high to powers of alpha.

    ``f(alpha) = sum_j a_j alpha^j`` with ``a = to_powers(low, high, N) @ beta``.
    """
    width = high - low
    columns = []
    for k in range(order + 1):
        # C(N, k) s^k (1 - s)^(N - k), each factor a polynomial of alpha
        rising = np.polynomial.Polynomial([-low / width, 1 / width]) ** k
        falling = np.polynomial.Polynomial([high / width, -1 / width]) ** (order - k)
        column = np.zeros(order + 1)
        coefficients = (comb(order, k) * rising * falling).coef
        column[: len(coefficients)] = coefficients
        columns.append(column)
    return np.stack(columns, axis=1)


def increments(order: int, *, increasing: bool) -> FloatArray:
    """Matrix (N + 1, N + 1) from numbers >= 0 to the coefficients.

    The coefficients themselves, or, for a curve that never falls, the running sum of them.
    """
    n = order + 1
    return np.tri(n) if increasing else np.eye(n)
