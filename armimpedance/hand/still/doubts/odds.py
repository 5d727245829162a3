"""Odds of a departure against none, and the tails of a mixture with no departure.

H. Jeffreys, *Theory of Probability* (Oxford, 1961), chapter 5: the Bayes factor of a normal mean.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from armimpedance.core.arrays import FloatArray


def tails(probability: ArrayLike) -> FloatArray:
    """Factor for normal variances, so that their 95 % interval holds 95 % of a mixture with zero.

    A number that is zero with probability 1 - p and otherwise normal lies beyond x with probability
    ``2 p (1 - Phi(x))``, x in its standard deviations.
    """
    p = np.asarray(probability, dtype=float)
    often = np.maximum(p, 0.05)
    limit = ndtri(1 - 0.025 / often) / ndtri(0.975)
    return np.asarray(np.where(p <= 0.05, 1.0, np.maximum(limit**2 / often, 1.0)))


def odds_of(
    k: ArrayLike, error2: ArrayLike, usual2: FloatArray | float
) -> tuple[FloatArray, FloatArray]:
    """Log Bayes factor of a departure against none, and the mean square of k if there is one."""
    k, error2 = np.asarray(k, dtype=float), np.asarray(error2, dtype=float)
    part = usual2 / (error2 + usual2)
    factor = 0.5 * np.log(error2 / (error2 + usual2)) + k**2 * part / (2 * error2)
    return np.asarray(factor), np.asarray((part * k) ** 2 + part * error2)
