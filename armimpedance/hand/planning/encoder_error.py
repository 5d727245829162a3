"""What an encoder adds to a motion that is known beforehand.

A reading is the position rounded to steps of q on a grid whose place is unknown, uniformly. The
errors e at positions x and x' then have

    E[e e'] = q^2 (1/12 - f (1 - f)/2),   f the fractional part of (x - x')/q:

fully alike while the hand stands, unrelated on average once it has moved some steps. Displacements
are measured from the rest before the onset, whose error is taken off all others.
"""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import FloatArray


def rounding_covariance(displacement: FloatArray, step: float) -> FloatArray:
    """Covariance (..., S, S) of the error of displacements (..., S) from rest at 0.

    Parameters
    ----------
    displacement : (..., S)
    step : float
    """
    between = _products(displacement[..., :, None] - displacement[..., None, :], step)
    to_rest = _products(displacement, step)
    # cov(e - e0, e' - e0)
    at_rest = step**2 / 12
    return np.asarray(between - to_rest[..., :, None] - to_rest[..., None, :] + at_rest)


def _products(apart: FloatArray, step: float) -> FloatArray:
    f = np.mod(apart / step, 1.0)
    return np.asarray(step**2 * (1 / 12 - f * (1 - f) / 2))
