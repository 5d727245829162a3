"""Groups of people, such as patients and controls: what differs between them on average.

Of each person there is one value with its own standard error. Within a group it is random effects,
as with `compare --subjects`: people differ, and are measured with errors. The difference of the two
means has the variance of both; its degrees of freedom are those of Welch and Satterthwaite. Of
three and more groups every pair is compared.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Final, Protocol

import numpy as np
from scipy.special import stdtr, stdtrit
from scipy.stats import chi2

from armimpedance.app.study.strips import Strip
from armimpedance.core.arrays import FloatArray
from armimpedance.hand.comparison import random_effects

#: A column with more values is a measure, such as an age, and parts nobody.
MOST_GROUPS: Final = 6
#: Fewer people say nothing of the spread between them.
FEWEST: Final = 3
#: What stands for a value that is not known in BIDS, and elsewhere.
_UNKNOWN: Final = ("", "n/a", "N/A", "NA", "nan")


class Mean(Protocol):
    """The mean of a group of people, as `random_effects` gives it."""

    @property
    def mean(self) -> float: ...
    @property
    def standard_error(self) -> float: ...
    @property
    def dof(self) -> int: ...


@dataclass(frozen=True)
class GroupsChange:
    """Difference between two groups of people in one quantity.

    `column`: of the table of people.
    `first`, `second`: its two values.
    `table`, `condition`, `quantity`, `unit`, `kind`: as in `Strip`.
    `n_first`, `n_second`: people.
    `mean_first`, `mean_second`: of ratios geometric means.
    `change`, `low`, `high`: second less first, or second over first, with its 95 % limits.
    `between_first`, `between_second`: sd between people of one group; of ratios of their
    logarithms.
    `p`, `p_adjusted`: after Holm over the conditions of the quantity and the pairs of the column.
    """

    column: str
    first: str
    second: str
    table: str
    condition: str
    quantity: str
    unit: str
    kind: str
    n_first: int
    n_second: int
    mean_first: float
    mean_second: float
    change: float
    low: float
    high: float
    between_first: float
    between_second: float
    p: float
    p_adjusted: float = math.nan


def groups_of_people(
    people: Mapping[str, Mapping[str, str]], present: Sequence[str]
) -> dict[str, tuple[str, ...]]:
    """Columns that part the people into two groups or more, each large enough.

    `people`: person -> column -> value.
    `present`: people who have results.
    Returns: column -> its values, in the order of the alphabet.
    """
    groups = {}
    for column in dict.fromkeys(name for row in people.values() for name in row):
        cells = [people[who].get(column, "") for who in dict.fromkeys(present) if who in people]
        count = {value: cells.count(value) for value in cells if value not in _UNKNOWN}
        if 2 <= len(count) <= MOST_GROUPS and min(count.values()) >= FEWEST:
            groups[column] = tuple(sorted(count))
    return groups


def compare_people(
    strips: Sequence[Strip],
    persons: Sequence[str],
    people: Mapping[str, Mapping[str, str]],
    column: str,
    names: tuple[str, ...],
) -> list[GroupsChange]:
    """Differences between the groups of one column, pair by pair.

    `persons`: person of each session, by its number.
    `people`: person -> column -> value.
    `names`: its values.
    Returns: of every strip and pair with `FEWEST` people in each group.
    """
    changes = []
    for strip in strips:
        of = [people.get(persons[i], {}).get(column, "") for i in strip.sessions]
        who = np.array([persons[i] for i in strip.sessions])
        sides = {n: _one_each(strip, who, np.array([v == n for v in of])) for n in names}
        for pair in combinations(names, 2):
            both = [sides[name] for name in pair]
            if min(len(values) for values, _ in both) >= FEWEST:
                changes.append(_change(strip, column, pair, both))
    return _adjusted(changes)


def difference_of_means(first: Mean, second: Mean) -> tuple[float, ...]:
    """Second mean less the first, its 95 % limits, and p."""
    parts = first.standard_error**2, second.standard_error**2
    change, error = second.mean - first.mean, math.sqrt(sum(parts))
    dof = sum(parts) ** 2 / (parts[0] ** 2 / first.dof + parts[1] ** 2 / second.dof)
    reach = float(stdtrit(dof, 0.975)) * error
    return change, change - reach, change + reach, float(2 * stdtr(dof, -abs(change) / error))


def _one_each(strip: Strip, who: np.ndarray, inside: np.ndarray) -> tuple[FloatArray, FloatArray]:
    """One value a person and its variance: the mean of several sessions."""
    values, variances = strip.scaled[inside], strip.errors[inside] ** 2
    rows = [np.flatnonzero(who[inside] == name) for name in dict.fromkeys(who[inside])]
    means = [values[at].mean() for at in rows]
    return np.array(means), np.array([variances[at].sum() / len(at) ** 2 for at in rows])


def _change(
    strip: Strip,
    column: str,
    names: tuple[str, str],
    sides: Sequence[tuple[FloatArray, FloatArray]],
) -> GroupsChange:
    first, second = (random_effects(*side) for side in sides)
    change, low, high, p = difference_of_means(first, second)
    means = strip.told(first.mean), strip.told(second.mean)
    head = (strip.table, strip.condition, strip.quantity, strip.unit, strip.kind)
    counts = len(sides[0][0]), len(sides[1][0])
    limits = (strip.told(change), strip.told(low), strip.told(high))
    between = first.between_sd, second.between_sd
    return GroupsChange(column, *names, *head, *counts, *means, *limits, *between, p)


def _adjusted(found: Sequence[GroupsChange]) -> list[GroupsChange]:
    """With p after Holm over the conditions of each quantity and the pairs of groups."""
    families: dict[tuple[str, str], list[int]] = {}
    for i, one in enumerate(found):
        families.setdefault((one.table, one.quantity), []).append(i)
    adjusted = list(found)
    for family in families.values():
        least = 0.0
        for rank, i in enumerate(sorted(family, key=lambda i: found[i].p)):
            least = max(least, min(1.0, (len(family) - rank) * found[i].p))
            adjusted[i] = replace(found[i], p_adjusted=least)
    return adjusted


# Who is far from the others: median and MAD, with each session's own error taken off.
#
# Session i has the value ``x_i`` with the standard error ``e_i``. Centre: the median. Spread
# between people: the tau at which half of the ``(x_i - median)^2 / (tau^2 + e_i^2)`` are below the
# median of chi^2 with one degree of freedom, which without errors is 1.4826 MAD; 0 where the errors
# explain all. How far a session is: ``z_i = (x_i - median) / sqrt(tau^2 + e_i^2)``: who was
# measured badly is not named for it.
#
# A spread found by the MAD of n people is known with about a third of n - 1 degrees of freedom (its
# efficiency is .37), so z is held against Student's t with as many.
#
# All values of a session are looked at: its p is its least one times their number (Bonferroni).
# Those sessions are named that Benjamini and Hochberg (1995) would call findings at 5 % among all
# sessions. In a cohort of alike people the chance that anybody is named is about 5 %: measured were
# .5 % for 10 people, up to 6 % for 30, 5 % for 100 and 8 % for 300, errors 0 to 3 times as large as
# what people differ by. Of several that are named about one in twenty is by chance. It is sessions
# that are counted, not values: one person with a hundred values far away would otherwise let others
# be named for little.

#: Fewer say too little of their own spread.
FEWEST_OTHERS: Final = 8
LEVEL: Final = 0.05
#: Degrees of freedom of the MAD of n values, over n - 1.
EFFICIENCY: Final = 1 / 3
_HALF: Final = float(chi2.median(1))


@dataclass(frozen=True)
class Outlier:
    """A value far from those of the others.

    `row`: in the strip.
    `middle`: median of all, as the table would have it.
    `spreads`: how many spreads it lies above, or below.
    `p`: before the number of looks is allowed for.
    """

    strip: Strip
    row: int
    middle: float
    spreads: float
    p: float

    @property
    def session(self) -> int:
        """Number of the session."""
        return int(self.strip.sessions[self.row])


def far_from_others(strips: Sequence[Strip]) -> list[Outlier]:
    """The values that chance does not explain, of sessions that are named; the farthest first.

    `strips`: those of fewer than `FEWEST_OTHERS` sessions are passed over.
    """
    scores = [one for strip in strips for one in _scored(strip)]
    own: dict[int, list[Outlier]] = {}
    for one in scores:
        own.setdefault(one.session, []).append(one)
    limit = _limit(
        np.array([len(values) * min(one.p for one in values) for values in own.values()])
    )
    named = (one for values in own.values() for one in values if len(values) * one.p <= limit)
    return sorted(named, key=lambda one: (one.p, -abs(one.spreads)))


def _scored(strip: Strip) -> list[Outlier]:
    """Every value of a strip; none where too few sessions have it."""
    if len(strip.sessions) < FEWEST_OTHERS:
        return []
    centre, z = robust_scores(strip.scaled, strip.errors)
    p = 2 * stdtr(EFFICIENCY * (len(z) - 1), -np.abs(z))
    middle = strip.told(centre)
    return [Outlier(strip, row, middle, float(z[row]), float(p[row])) for row in range(len(z))]


def robust_scores(values: FloatArray, errors: FloatArray) -> tuple[float, FloatArray]:
    """The median, and how many spreads each value lies from it.

    `values`, `errors` (n,).
    Returns: `z` (n,): zero where nothing differs at all.
    """
    centre = float(np.median(values))
    squares, own = (values - centre) ** 2, errors**2
    between = _between(squares, own)
    spread = np.sqrt(between + own)
    with np.errstate(divide="ignore", invalid="ignore"):
        z = np.where(values == centre, 0.0, (values - centre) / spread)
    return centre, z


def _between(squares: FloatArray, own: FloatArray) -> float:
    """The tau^2 >= 0 at which the median of squares/(tau^2 + own) is that of chi^2."""

    def middle(between: float) -> float:
        with np.errstate(divide="ignore", invalid="ignore"):
            return float(np.median(np.nan_to_num(squares / (between + own), posinf=np.inf)))

    if middle(0.0) <= _HALF:
        return 0.0
    low, high = 0.0, float(np.median(squares)) / _HALF
    for _ in range(60):
        between = (low + high) / 2
        low, high = (between, high) if middle(between) > _HALF else (low, between)
    return high


def _limit(p: FloatArray) -> float:
    """The largest p that is a finding; below every p where none is."""
    ordered = np.sort(p)
    passed = np.flatnonzero(ordered <= LEVEL * np.arange(1, len(p) + 1) / max(len(p), 1))
    return float(ordered[passed[-1]]) if len(passed) else -1.0
