"""How claims are scored against truths. Standard library only: the same bits on every machine.

Every error and width is told in parts of the quantity's scale. Sums are exact (`math.fsum`), so
that the order of rows does not matter.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Final

from armimpedance.lab.benchmark.asked import Known
from armimpedance.lab.benchmark.layout import Half, half_of
from armimpedance.lab.benchmark.submission import Claim, Place

#: Intervals are of 95 %.
ALPHA: Final = 0.05
#: An error beyond this part of the scale is wrong; if nothing told of it, silently so.
WRONG: Final = 0.10
#: Interval score of what was not said: as of an interval of +- 100 % that holds the truth. Who
#: knows nothing is as well off to say so.
UNSAID: Final = 2.0


@dataclass(frozen=True)
class Score:
    """How one group of quantities of one task and half was answered.

    Attributes
    ----------
    task, half, group : str
    asked, answered : int
        Rows; NaN and infinite values are not answers.
    bias, random, total : float or None
        Root mean squares over the answered rows: of each quantity's mean error, of what is left,
        of both, ``total^2 = bias^2 + random^2``. None where nothing was answered.
    intervals : int
        Answered rows with an interval.
    coverage, width : float or None
        Share of them that holds the truth; their median width. None where there is none.
    interval_score : float
        Mean over all rows asked of ``(u - l) + 2/alpha (l - x)+ + 2/alpha (x - u)+`` (Gneiting and
        Raftery 2007, doi:10.1198/016214506000001437); a value without an interval counts as one of
        no width, no value as `UNSAID`. Smaller is better, and no width can win it.
    silently_wrong : float
        Share of all rows asked with an error beyond 10 %, the truth outside the interval (or no
        interval), and no warning.
    warned : float
        Share of the answered rows.
    time_s : float or None
        Median over records.
    """

    task: str
    half: Half
    group: str
    asked: int
    answered: int
    bias: float | None
    random: float | None
    total: float | None
    intervals: int
    coverage: float | None
    width: float | None
    interval_score: float
    silently_wrong: float
    warned: float
    time_s: float | None


def score(truth: Iterable[Known], claims: Mapping[Place, Claim]) -> list[Score]:
    """Score claims against the truths of whatever halves and tasks are known.

    A task of which nothing is claimed has no score.

    Parameters
    ----------
    truth : iterable of Known
    claims : mapping
        (task, record, quantity) -> Claim.

    Returns
    -------
    list of Score
        In the order of the truths.
    """
    attempted = {place[0] for place in claims}
    groups: dict[tuple[str, Half, str], list[Known]] = defaultdict(list)
    for known in truth:
        if known.asked.task in attempted:
            key = (known.asked.task, half_of(known.asked.record), known.asked.group)
            groups[key].append(known)
    return [_scored(key, rows, claims) for key, rows in groups.items()]


@dataclass(frozen=True)
class _Judged:
    """One answered row, in parts of its scale."""

    record: str
    quantity: str
    error: float
    low: float
    high: float
    has_interval: bool
    warned: bool
    time_s: float

    @classmethod
    def of(cls, known: Known, claim: Claim) -> _Judged:
        low, high = (claim.low, claim.high) if claim.has_interval else (claim.value,) * 2
        return cls(
            known.asked.record,
            known.asked.quantity,
            (claim.value - known.value) / known.scale,
            (low - known.value) / known.scale,
            (high - known.value) / known.scale,
            claim.has_interval,
            claim.warned,
            claim.time_s,
        )

    @property
    def holds(self) -> bool:
        return self.has_interval and self.low <= 0 <= self.high

    @property
    def interval_score(self) -> float:
        outside = max(self.low, 0.0) + max(-self.high, 0.0)
        return (self.high - self.low) + 2 / ALPHA * outside

    @property
    def silently_wrong(self) -> bool:
        return abs(self.error) > WRONG and not self.holds and not self.warned


def _scored(
    key: tuple[str, Half, str], rows: Sequence[Known], claims: Mapping[Place, Claim]
) -> Score:
    judged = []
    for known in rows:
        claim = claims.get((known.asked.task, known.asked.record, known.asked.quantity))
        if claim is not None and claim.answers:
            judged.append(_Judged.of(known, claim))
    told = [j for j in judged if j.has_interval]
    unsaid = [UNSAID] * (len(rows) - len(judged))
    return Score(
        *key,
        len(rows),
        len(judged),
        *_errors(judged),
        len(told),
        len([j for j in told if j.holds]) / len(told) if told else None,
        median(j.high - j.low for j in told) if told else None,
        _mean([j.interval_score for j in judged] + unsaid),
        len([j for j in judged if j.silently_wrong]) / len(rows),
        len([j for j in judged if j.warned]) / len(judged) if judged else 0.0,
        _time(judged),
    )


def _mean(values: Sequence[float]) -> float:
    if math.inf in values:
        return math.inf
    return math.fsum(values) / len(values)


def _errors(judged: Sequence[_Judged]) -> tuple[float | None, float | None, float | None]:
    """Bias, random and total error."""
    if not judged:
        return None, None, None
    by_quantity: dict[str, list[float]] = defaultdict(list)
    for j in judged:
        by_quantity[j.quantity].append(j.error)
    means = {name: _mean(errors) for name, errors in by_quantity.items()}
    bias = _mean([means[j.quantity] ** 2 for j in judged])
    random = _mean([(j.error - means[j.quantity]) ** 2 for j in judged])
    total = _mean([j.error**2 for j in judged])
    return math.sqrt(bias), math.sqrt(random), math.sqrt(total)


def _time(judged: Sequence[_Judged]) -> float | None:
    by_record: dict[str, float] = {}
    for j in judged:
        if not math.isnan(j.time_s):
            by_record[j.record] = max(j.time_s, by_record.get(j.record, 0.0))
    return median(by_record.values()) if by_record else None
