"""Several subjects: the mean change over subjects, and the spread between them.

Random effects: subject s changes by ``y_s = mean + u_s + e_s``, the sd of u (between subjects)
unknown, the variance v_s of the error e_s known from the subject's own trials. A two-level
bootstrap is not used: four to eight subjects drawn with replacement give a spread that is too small
by (n - 1)/n, and percentile intervals with far less than their nominal coverage. The t distribution
with n - 1 degrees of freedom has no such error.

The between-subject variance tau^2 is the root of the generalised Q statistic,
``Q(tau^2) = sum_s (y_s - mean)^2/(v_s + tau^2) = n - 1`` (R. C. Paule and J. Mandel 1982, Consensus
values and weighting factors, J Res Natl Bur Stand 87:377-385). Its 95 % limits are those values at
which Q equals the quantiles of chi^2 (W. Viechtbauer 2007, Confidence intervals for the amount of
heterogeneity in meta-analysis, Stat Med 26:37-52). The interval of the mean is that of J. Hartung
and G. Knapp (2001, Stat Med 20:3875-3889), never narrower than the subjects' own errors imply.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from scipy.special import chdtri, stdtr, stdtrit

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.hand.comparison.differences import LEVEL, Change, InUnits, changes
from armimpedance.hand.comparison.groups import ComparedGroup
from armimpedance.hand.comparison.matrix_test import holm
from armimpedance.hand.ellipses import half_turn


@dataclass(frozen=True)
class SubjectsChange(InUnits):
    """The change of one quantity over several subjects.

    `first`, `second`: names of the groups.
    `matrix`, `quantity`, `unit`, `kind`: the same as in `Change`.
    `value`, `low`, `high`: mean change and its 95 % limits; for a ratio the geometric mean.
    `between_sd`, `between_low`, `between_high`: sd between subjects of the difference, or of the
    logarithm of the ratio.
    `n`: number of subjects that have both groups.
    `p`, `p_adjusted`: p value of the hypothesis that there is no mean change, and the same adjusted
    by Holm's method over the pairs of groups.
    """

    first: str
    second: str
    matrix: str
    quantity: str
    unit: str
    kind: str
    value: float
    low: float
    high: float
    between_sd: float
    between_low: float
    between_high: float
    n: int
    p: float
    p_adjusted: float = float("nan")


@dataclass(frozen=True)
class RandomEffects:
    """Mean over subjects and sd between them.

    `dof`: degrees of freedom of the t distribution.
    `between_limits` (low, high): 95 %.
    """

    mean: float
    standard_error: float
    dof: int
    between_sd: float
    between_limits: tuple[float, float]


def random_effects(values: FloatArray, variances: FloatArray) -> RandomEffects:
    """Mean of subjects' values (n,) whose errors have known variances (n,).

    Parameters
    ----------
    values : (n,)
        One per subject.
    variances : (n,)
        Variances of the values' errors.

    Returns
    -------
    RandomEffects
        The mean, its standard error and limits, and the spread between subjects.

    Raises
    ------
    InputError
        Fewer than two values.
    """
    y, v = np.asarray(values, dtype=np.float64), np.asarray(variances, dtype=np.float64)
    n = len(y)
    if n < 2:
        raise InputError("one subject only", expected="two subjects or more")
    # an error of zero would have infinite weight
    v = np.maximum(v, 1e-12 * (np.mean(v) + np.var(y)) + np.finfo(float).tiny)
    tail = (1 - LEVEL) / 2
    between = _root_of_q(y, v, n - 1)
    # chdtri(n, p): chi^2 exceeds it with probability p
    limits = [_root_of_q(y, v, float(chdtri(n - 1, q))) for q in (tail, 1 - tail)]
    mean, weight, Q = _weighted(y, v + between)
    # Hartung and Knapp: variance q / sum w with q = Q/(n - 1), which is one wherever tau^2 > 0
    error = np.sqrt(max(Q / (n - 1), 1.0) / weight)
    low, high = (float(np.sqrt(limit)) for limit in limits)
    return RandomEffects(mean, float(error), n - 1, float(np.sqrt(between)), (low, high))


def _weighted(y: FloatArray, variance: FloatArray) -> tuple[float, float, float]:
    """Weighted mean, sum of weights, and Q."""
    w = 1 / variance
    mean = float(w @ y / w.sum())
    return mean, float(w.sum()), float(w @ (y - mean) ** 2)


def _root_of_q(y: FloatArray, v: FloatArray, target: float) -> float:
    """Value tau^2 >= 0 at which Q, which decreases with it, equals `target`; 0 if Q(0) is below."""
    if _weighted(y, v)[2] <= target:
        return 0.0
    low, high = 0.0, float((y - y.mean()) @ (y - y.mean()) / target + v.max())
    while _weighted(y, v + high)[2] > target:
        high *= 2
    for _ in range(80):
        middle = (low + high) / 2
        low, high = (middle, high) if _weighted(y, v + middle)[2] > target else (low, middle)
    return (low + high) / 2


def compare_subjects(
    subjects: Mapping[str, Sequence[ComparedGroup]], *, against: str | None = None
) -> list[SubjectsChange]:
    """Estimate mean changes between groups over the subjects that have both.

    `subjects`: name of the subject -> its groups.
    `against`: the group that comes first in every pair.
    Returns: mean changes of each pair of groups that at least two subjects have.
    Raises InputError: fewer than two subjects, or no pair of groups that two subjects have; no
    group `against`.
    """
    if len(subjects) < 2:
        raise InputError(
            f"{len(subjects)} subject", expected="two or more; without --subjects trials decide"
        )
    by_name = [{group.name: group for group in groups} for groups in subjects.values()]
    names = list(dict.fromkeys(name for groups in by_name for name in groups))
    changes_of_pairs = [_over_subjects(*pair, by_name) for pair in _pairs(names, against)]
    changes_of_pairs = [rows for rows in changes_of_pairs if rows]
    if not changes_of_pairs:
        raise InputError(
            f"no two groups that two subjects have both (groups: {'; '.join(names)})",
            expected="the same names of groups in each subject",
        )
    return _adjusted(changes_of_pairs)


def _pairs(names: Sequence[str], against: str | None) -> list[tuple[str, str]]:
    """All pairs of names, or the group `against` with each other group."""
    if against is None:
        return list(combinations(names, 2))
    if against not in names:
        raise InputError(f"no group {against!r}", expected=f"one of {'; '.join(names)}")
    return [(against, name) for name in names if name != against]


def _over_subjects(
    first: str, second: str, by_name: Sequence[Mapping[str, ComparedGroup]]
) -> list[SubjectsChange]:
    """Mean changes over the subjects that have both groups; empty if they are fewer than two."""
    both = [groups for groups in by_name if first in groups and second in groups]
    if len(both) < 2:
        return []
    by_subject = [changes(groups[first].estimate, groups[second].estimate) for groups in both]
    return [_summary(first, second, row) for row in zip(*by_subject, strict=True)]


def _summary(first: str, second: str, over: Sequence[Change]) -> SubjectsChange:
    first_change = over[0]
    ratio = first_change.kind == "ratio"
    with np.errstate(invalid="ignore", divide="ignore"):
        y = np.array([np.log(c.value) if ratio else c.value for c in over])
    v = np.array([c.sd**2 for c in over])
    valid = np.isfinite(y) & np.isfinite(v)
    head = (
        first,
        second,
        first_change.matrix,
        first_change.quantity,
        first_change.unit,
        first_change.kind,
    )
    if valid.sum() < 2:
        nan = float("nan")
        return SubjectsChange(*head, nan, nan, nan, nan, nan, nan, int(valid.sum()), nan)
    if first_change.quantity == "orientation":
        y = _unwrapped(y)
    effects = random_effects(y[valid], v[valid])
    reach = float(stdtrit(effects.dof, 0.5 + LEVEL / 2)) * effects.standard_error
    p = float(2 * stdtr(effects.dof, -abs(effects.mean) / effects.standard_error))
    ends = [effects.mean, effects.mean - reach, effects.mean + reach]
    value, low, high = (float(np.exp(np.clip(x, -300, 300))) if ratio else x for x in ends)
    between = (effects.between_sd, *effects.between_limits)
    return SubjectsChange(*head, value, low, high, *between, int(valid.sum()), p)


def _unwrapped(angles: FloatArray) -> FloatArray:
    """Changes of axes (n,) within a quarter turn of their mean axis."""
    finite = angles[np.isfinite(angles)]
    middle = float(np.angle(np.exp(2j * finite).sum()) / 2)
    return np.array([middle + half_turn(a - middle) for a in angles])


def _adjusted(changes_of_pairs: list[list[SubjectsChange]]) -> list[SubjectsChange]:
    columns = [holm([c.p for c in column]) for column in zip(*changes_of_pairs, strict=True)]
    return [
        replace(change, p_adjusted=float(columns[j][i]))
        for i, row in enumerate(changes_of_pairs)
        for j, change in enumerate(row)
    ]
