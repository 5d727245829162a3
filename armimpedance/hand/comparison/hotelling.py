"""Hotelling's test of two means with unequal covariances, for stacks of differences."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.special import chdtrc, fdtrc

from armimpedance.core.arrays import FloatArray

#: ``1/(1 - R^2)`` of one element on the others; above it, an inverse is rounding.
LARGEST_INFLATION: Final = 1e12


def hotelling(
    difference: FloatArray,
    covariances: tuple[FloatArray, FloatArray],
    dof: tuple[FloatArray | float, FloatArray | float],
) -> tuple[FloatArray, FloatArray]:
    """``T2 = d^T (V1 + V2)^-1 d`` and the probability of so large a one by chance.

    ``(nu - p + 1)/(nu p) T2`` is taken to follow F with p and nu - p + 1 degrees of freedom, nu
    after K. Krishnamoorthy and J. Yu (2004), Modified Nel and Van der Merwe test for the
    multivariate Behrens-Fisher problem, Stat Probab Lett 66:161-169. In one dimension it is
    Welch's t test.

    Parameters
    ----------
    difference : (..., p)
    covariances : two of (..., p, p)
        Covariances of the two means.
    dof : two of (...,)
        Degrees of freedom of each covariance; inf: known.

    Returns
    -------
    T2, probability : (...,)
        nan where the sum of the covariances is singular: some direction has no spread.
    """
    total = covariances[0] + covariances[1]
    variance = np.diagonal(total, axis1=-2, axis2=-1)
    sd = np.sqrt(np.where(variance > 0, variance, 1.0))
    # unit diagonal: kg and N/m differ by orders of magnitude
    units = sd[..., :, None] * sd[..., None, :]
    inverse = _inverse(total / units)
    z = difference / sd
    # T2 (...) = z^T (...,p) inverse (..., p, p) z (..., p)
    T2 = np.einsum("...i,...ij,...j->...", z, inverse, z)
    p = difference.shape[-1]
    shares = [covariance / units @ inverse for covariance in covariances]
    spread = [
        np.einsum("...ij,...ji->...", U, U) + np.trace(U, axis1=-2, axis2=-1) ** 2 for U in shares
    ]
    rate = sum(s / f for s, f in zip(spread, dof, strict=True))
    known = np.broadcast_to(rate == 0, T2.shape)
    nu = (p + p * p) / np.where(known, 1.0, rate)
    # Few trials: one degree of freedom at least, so that a p value exists.
    second = np.maximum(nu - p + 1, 1.0)
    return T2, np.where(known, chdtrc(p, T2), fdtrc(p, second, T2 * second / (nu * p)))


def _inverse(correlation: FloatArray) -> FloatArray:
    """Inverses of correlation matrices (..., p, p); nan where a matrix is singular."""
    eye = np.eye(correlation.shape[-1])
    regular = np.linalg.det(correlation) != 0
    inverse = np.linalg.inv(np.where(regular[..., None, None], correlation, eye))
    # its diagonal is 1/(1 - R^2) of each element on the others
    inflation = np.diagonal(inverse, axis1=-2, axis2=-1)
    regular &= ((inflation > 0) & (inflation < LARGEST_INFLATION)).all(axis=-1)
    return np.where(regular[..., None, None], inverse, np.nan)
