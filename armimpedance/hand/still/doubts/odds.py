"""Odds of a departure against none, and the tails of a mixture with none.

H. Jeffreys, *Theory of Probability* (Oxford, 1961), chapter 5: the Bayes factor of a normal mean.
"""

from __future__ import annotations

import numpy as np
from scipy.special import ndtri


def tails(probability: float) -> float:
    """By how much a normal variance must be larger to hold 95 % of a mixture with zero.

    A number that is zero with probability 1 - p and else normal lies beyond x with probability
    ``2 p (1 - Phi(x))``, x in its standard deviations.
    """
    if probability <= 0.05:
        return 1.0
    limit = ndtri(1 - 0.025 / probability) / ndtri(0.975)
    return float(max(limit**2 / probability, 1.0))


def odds_of(k: float, error2: float, usual2: float) -> tuple[float, float]:
    """Logarithm of the Bayes factor against none, and the mean square of k if it is there."""
    part = usual2 / (error2 + usual2)
    factor = 0.5 * np.log(error2 / (error2 + usual2)) + k**2 * part / (2 * error2)
    return float(factor), float((part * k) ** 2 + part * error2)
