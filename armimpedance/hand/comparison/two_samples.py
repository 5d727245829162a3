"""How far two samples stand apart: five measures, each with its 95 % interval."""

from __future__ import annotations

from math import sqrt
from typing import Final

import numpy as np
from scipy.optimize import brentq
from scipy.special import gammaln, nctdtrinc
from scipy.stats import norm

from armimpedance.core.arrays import FloatArray
from armimpedance.numerics.regression import t_factor

_LEVEL: Final = 0.95
Interval = tuple[float, float]


def welch(x: FloatArray, y: FloatArray) -> tuple[float, Interval]:
    """Difference of means ``y - x`` and its 95 % interval for unequal variances."""
    vx, vy = x.var(ddof=1) / len(x), y.var(ddof=1) / len(y)
    dof = (vx + vy) ** 2 / (vx**2 / (len(x) - 1) + vy**2 / (len(y) - 1))
    difference, half = float(y.mean() - x.mean()), t_factor(float(dof)) * sqrt(vx + vy)
    return difference, (difference - half, difference + half)


def hedges_g(x: FloatArray, y: FloatArray) -> tuple[float, Interval]:
    """Standardised difference ``J (mean y - mean x)/s`` and its 95 % interval.

    ``J = Gamma(m/2)/(sqrt(m/2) Gamma((m - 1)/2))``, m degrees of freedom (Hedges 1981, J Educ Stat
    6:107-128). The interval inverts the noncentral t distribution of
    ``t = d sqrt(n1 n2/(n1 + n2))``.
    """
    m = len(x) + len(y) - 2
    pooled = ((len(x) - 1) * x.var(ddof=1) + (len(y) - 1) * y.var(ddof=1)) / m
    scale = sqrt(len(x) * len(y) / (len(x) + len(y)))
    t = float(y.mean() - x.mean()) / sqrt(pooled) * scale
    bias = float(np.exp(gammaln(m / 2) - gammaln((m - 1) / 2)) / sqrt(m / 2))
    tail = (1 - _LEVEL) / 2
    low, high = (float(nctdtrinc(m, p, t)) for p in (1 - tail, tail))
    return bias * t / scale, (bias * low / scale, bias * high / scale)


def newcombe_auc(auc: float, n_first: int, n_second: int) -> Interval:
    """95 % limits of an area under the ROC curve: ``|auc - A| = z sqrt(V(A))`` solved for A.

    ``V(A) = A (1 - A) [1 + (N - 1)((1 - A)/(2 - A) + A/(1 + A))]/(n1 n2)``, ``N = (n1 + n2)/2``
    (Newcombe 2006, Stat Med 25:559-573, method 5).
    """
    z = float(norm.ppf(0.5 + _LEVEL / 2))
    mean_size = (n_first + n_second) / 2

    def excess(area: float) -> float:
        spread = 1 + (mean_size - 1) * ((1 - area) / (2 - area) + area / (1 + area))
        variance = area * (1 - area) * spread / (n_first * n_second)
        return (auc - area) ** 2 - z**2 * variance

    # an area of 0 or 1 solves the equation too: the other root is the limit
    edge = 1e-9
    low = 0.0 if auc == 0 else float(brentq(excess, 0.0, min(auc, 1 - edge)))
    high = 1.0 if auc == 1 else float(brentq(excess, max(auc, edge), 1.0))
    return low, high


def leave_one_out(x: FloatArray, y: FloatArray) -> int:
    """How many people fall on their own group's side of the midpoint of the others' means.

    Somebody who falls exactly on it counts as wrong.
    """
    correct = 0
    for own, other in ((x, y), (y, x)):
        rest = (own.sum() - own) / (len(own) - 1)
        middle = (rest + other.mean()) / 2
        correct += int(((own - middle) * (rest - other.mean()) > 0).sum())
    return correct


def wilson(successes: int, trials: int) -> Interval:
    """95 % score interval of a proportion (Wilson 1927)."""
    z = float(norm.ppf(0.5 + _LEVEL / 2))
    share, weight = successes / trials, 1 + z**2 / trials
    middle = (share + z**2 / (2 * trials)) / weight
    half = z * sqrt(share * (1 - share) / trials + z**2 / (4 * trials**2)) / weight
    return max(middle - half, 0.0), min(middle + half, 1.0)
