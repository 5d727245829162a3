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
    """What differs between two groups of people in one quantity.

    Attributes
    ----------
    column : str
        Of the table of people.
    first, second : str
        Its two values.
    table, condition, quantity, unit, kind : str
        As in `Strip`.
    n_first, n_second : int
        People.
    mean_first, mean_second : float
        Of ratios geometric means.
    change, low, high : float
        Second less first, or second over first, with its 95 % limits.
    between_first, between_second : float
        Sd between people of one group; of ratios of their logarithms.
    p, p_adjusted : float
        After Holm over the conditions of the quantity and the pairs of the column.
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

    Parameters
    ----------
    people : mapping
        Person -> column -> value.
    present : sequence of str
        People who have results.

    Returns
    -------
    dict
        Column -> its values, in the order of the alphabet.
    """
    found = {}
    for column in dict.fromkeys(name for row in people.values() for name in row):
        held = [people[who].get(column, "") for who in dict.fromkeys(present) if who in people]
        count = {value: held.count(value) for value in held if value not in _UNKNOWN}
        if 2 <= len(count) <= MOST_GROUPS and min(count.values()) >= FEWEST:
            found[column] = tuple(sorted(count))
    return found


def compare_people(
    strips: Sequence[Strip],
    persons: Sequence[str],
    people: Mapping[str, Mapping[str, str]],
    column: str,
    names: tuple[str, ...],
) -> list[GroupsChange]:
    """What differs between the groups of one column, pair by pair.

    Parameters
    ----------
    strips : sequence of Strip
    persons : sequence of str
        Person of each session, by its number.
    people : mapping
        Person -> column -> value.
    column : str
    names : tuple of str
        Its values.

    Returns
    -------
    list of GroupsChange
        Of every strip and pair with `FEWEST` people in each group.
    """
    found = []
    for strip in strips:
        of = [people.get(persons[i], {}).get(column, "") for i in strip.sessions]
        who = np.array([persons[i] for i in strip.sessions])
        sides = {n: _one_each(strip, who, np.array([v == n for v in of])) for n in names}
        for pair in combinations(names, 2):
            both = [sides[name] for name in pair]
            if min(len(values) for values, _ in both) >= FEWEST:
                found.append(_change(strip, column, pair, both))
    return _adjusted(found)


def difference_of_means(first: Mean, second: Mean) -> tuple[float, ...]:
    """Second mean less the first, its 95 % limits, and p.

    Parameters
    ----------
    first, second : Mean

    Returns
    -------
    change, low, high, p : float
    """
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
    made = list(found)
    for family in families.values():
        least = 0.0
        for rank, i in enumerate(sorted(family, key=lambda i: found[i].p)):
            least = max(least, min(1.0, (len(family) - rank) * found[i].p))
            made[i] = replace(found[i], p_adjusted=least)
    return made
