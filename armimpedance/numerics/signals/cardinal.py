"""B-splines on whole numbers: the pieces that kernels and test functions are made of.

By the recursion over degrees, which adds nothing but positive parts. The general splines of SciPy
give the same to rounding; to import them takes longer than to estimate a session.
"""

from __future__ import annotations

from math import comb

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray


def cardinal_spline(places: ArrayLike, degree: int, order: int = 0) -> FloatArray:
    """Values of the B-spline with knots 0, 1, ..., degree + 1, or of a derivative of it.

    Parameters
    ----------
    places : array
        Any numbers; outside the knots the spline is zero.
    degree : int
    order : int
        Of the derivative, at most `degree` - 1.

    Returns
    -------
    array of the same shape
    """
    x = np.asarray(places, dtype=np.float64)
    # the derivative of order m is the m-th difference of a spline of so much lower degree
    parts = [(-1) ** k * comb(order, k) * _spline(x - k, degree - order) for k in range(order + 1)]
    return np.asarray(sum(parts))


def _spline(x: FloatArray, degree: int) -> FloatArray:
    pieces = [((x >= k) & (x < k + 1)).astype(np.float64) for k in range(degree + 1)]
    for p in range(1, degree + 1):
        # pieces[k] of x becomes that of degree p which begins at k
        pieces = [
            ((x - k) * pieces[k] + (k + p + 1 - x) * pieces[k + 1]) / p
            for k in range(len(pieces) - 1)
        ]
    return pieces[0]
