"""Tail of a sum of weighted chi-squares over one more chi-square, by a saddlepoint, without draws.

``P(sum_j w_j X_j > q Y/nu)``, X_j of one degree of freedom, Y of nu, all independent: the tail of
the quadratic form of a difference that is t distributed. It is that of
``S = sum_j w_j X_j - (q/nu) Y`` beyond zero, whose cumulant generating function is known
(R. Lugannani and S. Rice 1980, Saddle point approximation for the distribution of the sum of
independent random variables, Adv Appl Probab 12:475-490, in the form of O. E. Barndorff-Nielsen;
D. Kuonen 1999, Saddlepoint approximations for distributions of quadratic forms in normal variables,
Biometrika 86:929-935). Its relative error is a few per cent, however small the tail.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.special import ndtr

from armimpedance.core.arrays import FloatArray

#: Halvings of the bracket of the saddlepoint, then steps of Newton's.
_HALVINGS: Final = 40
_NEWTON: Final = 4
#: Degrees of freedom that stand for a covariance that is known.
_KNOWN_DOF: Final = 1e7
#: Nearer to the mean than this many standard deviations the formula is 0/0; its limit holds.
_NEAR_MEAN: Final = 1e-3


def mixture_tail(weights: FloatArray, dof: FloatArray, statistic: FloatArray) -> FloatArray:
    """``P(sum_j w_j X_j > q Y/nu)``.

    Parameters
    ----------
    weights : (R, J)
        At least 0, and not all of them 0.
    dof : (R,)
        nu; inf: Y/nu is one.
    statistic : (R,)
        q, at least 0.

    Returns
    -------
    (R,)
        nan where an argument is.
    """
    weights = np.maximum(weights, 1e-12 * weights.max(axis=1, keepdims=True))
    nu, scale = np.minimum(dof, _KNOWN_DOF), weights.sum(axis=1)
    # a statistic of zero is exceeded always; a little above, nothing divides by zero
    against = np.maximum(statistic, 1e-9 * scale) / nu
    rates = np.concatenate([weights, -against[:, None]], axis=1)
    counts = np.ones_like(rates)
    counts[:, -1] = nu
    with np.errstate(all="ignore"):
        return _tail(rates, counts, _saddlepoint(rates, counts))


def _saddlepoint(rates: FloatArray, counts: FloatArray) -> FloatArray:
    """The root t (R,) of ``K'(t) = sum_j n_j r_j/(1 - 2 t r_j)``, which rises from -inf to inf."""
    low, high = 0.5 / rates.min(axis=1), 0.5 / rates.max(axis=1)
    for _ in range(_HALVINGS):
        t = (low + high) / 2
        above = (counts * rates / (1 - 2 * t[:, None] * rates)).sum(axis=1) > 0
        low, high = np.where(above, low, t), np.where(above, t, high)
    t = (low + high) / 2
    for _ in range(_NEWTON):
        shares = rates / (1 - 2 * t[:, None] * rates)
        slope = (counts * shares).sum(axis=1)
        low, high = np.where(slope > 0, low, t), np.where(slope > 0, t, high)
        step = t - slope / (2 * (counts * shares**2).sum(axis=1))
        # a step that leaves the bracket is a halving instead
        t = np.where((step > low) & (step < high), step, (low + high) / 2)
    return np.asarray(t)


def _tail(rates: FloatArray, counts: FloatArray, t: FloatArray) -> FloatArray:
    """P(S > 0) from the saddlepoint t of S."""
    moved = 1 - 2 * t[:, None] * rates
    K = -0.5 * (counts * np.log1p(-2 * t[:, None] * rates)).sum(axis=1)
    K2 = 2 * (counts * (rates / moved) ** 2).sum(axis=1)
    K3 = 8 * (counts * (rates / moved) ** 3).sum(axis=1)
    w, v = np.sign(t) * np.sqrt(np.maximum(-2 * K, 0)), t * np.sqrt(K2)
    far = ndtr(-(w + np.log(v / w) / w))
    near = 0.5 - K3 / (6 * np.sqrt(2 * np.pi) * K2**1.5)
    return np.asarray(np.where(np.abs(v) > _NEAR_MEAN, far, near))
