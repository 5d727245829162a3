"""Errors that all rows of a fit have in common, in the covariance of what was fitted.

Errors of single rows average out over many rows; a reflex, a gain or a length of the arm makes all
rows wrong together. With the change d of the coefficients when the rows move by one standard
deviation of such a cause, it adds ``d d^T`` to their covariance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray

#: Part of the causes' variance, in the rows' own variances, that is followed.
_FOLLOWED: Final = 0.99


def shared_blocks(errors: Sequence[Mapping[str, FloatArray]], axes: int) -> FloatArray:
    """What each cause makes wrong in M, B and K of each row.

    A cause of one name is the same in all rows; a row that does not name it has none of it.

    Parameters
    ----------
    errors : sequence of mapping of str to (3 d^2,)
        Of P rows, by the names of the causes.
    axes : int
        d.

    Returns
    -------
    (P, s, 3, d, d)
    """
    names = dict.fromkeys(name for one in errors for name in one)
    none = np.zeros(3 * axes**2)
    found = [[one.get(name, none) for name in names] for one in errors]
    return np.reshape(found, (len(errors), len(names), 3, axes, axes)).astype(float)


def main_errors(shared: FloatArray, sd: FloatArray | None) -> FloatArray:
    """The fewest errors (t, P, E) with nearly the same covariance of the rows as `shared`.

    Parameters
    ----------
    shared : (s, P, E)
        Of each cause one standard deviation.
    sd : (P, E) or None
        Standard errors of the rows, which say what is large; None: all alike.

    Returns
    -------
    (t, P, E)
    """
    weight = np.ones(shared.shape[1:]) if sd is None else 1 / sd
    # U (s, P E) = sum_i s_i u_i v_i^T; U^T U = sum_i s_i^2 v_i v_i^T
    found = np.linalg.svd((shared * weight).reshape(len(shared), weight.size), full_matrices=False)
    energy = found.S**2
    beyond = energy.sum() - np.cumsum(energy) + energy
    kept = beyond > (1 - _FOLLOWED) * energy.sum()
    return np.asarray((found.S[:, None] * found.Vh)[kept].reshape(-1, *weight.shape) / weight)


def spread_of(
    covariance: FloatArray, design: FloatArray, weight: FloatArray, shared: FloatArray
) -> FloatArray:
    """What shared errors add to the covariance (p, p) of a weighted linear fit.

    Parameters
    ----------
    covariance : (p, p)
        C of the fit, of rows of unit variance.
    design : (P, E, p)
        Weighted regressors.
    weight : (P, E, E)
        ``L^-1`` of each row's covariance ``L L^T``.
    shared : (s, P, E)

    Returns
    -------
    (p, p)
    """
    moved = np.einsum("pij,spj->spi", weight, shared)
    # d (s, p) = W f (s, P E) X (P E, p) C (p, p)
    d = np.einsum("spi,piq->sq", moved, design) @ covariance
    return np.asarray(d.T @ d)
