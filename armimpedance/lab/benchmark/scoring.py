"""Submissions, and how their claims are scored against truths. Standard library only.

Every error and width is told in parts of the quantity's scale. Sums are exact (`math.fsum`), so
that the order of rows does not matter.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Final, NamedTuple

from armimpedance.core.delimited import read_text_table
from armimpedance.core.errors import InputError
from armimpedance.core.inputs import unchanged
from armimpedance.lab.benchmark.layout import AskedQuantity, Half, KnownTruth, half_of

# A submission: one CSV of claims, in whatever language it was made. Standard library only.

_REQUIRED: Final = ("task", "record", "quantity", "value")
_OPTIONAL: Final = ("low", "high", "unit", "warned", "time_s")
_YES: Final = {"1": True, "true": True, "yes": True, "0": False, "false": False, "no": False}

#: Squares and sums of such numbers are still numbers.
LARGEST: Final = 1e60
#: Task, record, quantity.
Place = tuple[str, str, str]


class Claim(NamedTuple):
    """A method's claim on one quantity.

    `value`: NaN or infinite: nothing was said.
    `low`, `high`: the 95 % interval; NaN where there is none.
    `time_s`: that the record took; NaN where it was not told.
    """

    value: float
    low: float = math.nan
    high: float = math.nan
    warned: bool = False
    time_s: float = math.nan

    @property
    def answers(self) -> bool:
        """True if the claim has a value."""
        return math.isfinite(self.value)

    @property
    def has_interval(self) -> bool:
        """True if the claim has limits, even infinite ones."""
        return self.answers and not (math.isnan(self.low) or math.isnan(self.high))


def read_submission(file: Path, asked: Collection[AskedQuantity]) -> dict[Place, Claim]:
    """The claims in a CSV with the columns task, record, quantity, value and perhaps more.

    `file`: optional columns: low, high (both or none), unit, warned (0 or 1), time_s. Rows in any
    order; those that are missing are missing.
    `asked`: what the benchmark asks for.
    Raises InputError: a column, task, record, quantity or unit that is not asked for, a row that
    appears twice, a cell that is no number, limits the wrong way round: with row and column.
    """
    units = {(a.task, a.record, a.quantity): a.unit for a in asked}
    claims: dict[Place, Claim] = {}
    with unchanged(file):
        table = read_text_table(file, expected="a submission")
    _check_header(file, table.header)
    for line, cells in zip(table.lines, table.dicts(), strict=True):
        row = _Row(file, line, cells)
        place = row.place(units)
        if place in claims:
            raise row.wrong("quantity", f"{' '.join(place)} appears twice", "one row")
        claims[place] = row.claim()
    if not claims:
        raise InputError("holds no rows", file=file, expected="one row a quantity")
    return claims


def _check_header(file: Path, columns: Sequence[str]) -> None:
    for name in _REQUIRED:
        if name not in columns:
            raise InputError("no such column", file=file, column=name, expected="a submission")
    for name in columns:
        if name not in (*_REQUIRED, *_OPTIONAL):
            expected = f"each at most once: {', '.join((*_REQUIRED, *_OPTIONAL))}"
            raise InputError(
                "unknown or repeated column", file=file, column=name, expected=expected
            )
    if ("low" in columns) != ("high" in columns):
        raise InputError("low without high", file=file, expected="both columns, or none")


class _Row:
    """One line of the file."""

    def __init__(self, file: Path, line: int, cells: Mapping[str, str]) -> None:
        self.file, self.line = file, line
        self.cells = {name: text.strip() for name, text in cells.items()}

    def wrong(self, column: str, problem: str, expected: str) -> InputError:
        return InputError(problem, file=self.file, row=self.line, column=column, expected=expected)

    def place(self, units: Mapping[Place, str]) -> Place:
        """Which quantity the row is of."""
        place = (self.cells["task"], self.cells["record"], self.cells["quantity"])
        if place not in units:
            among: Collection[Place] = units
            for n, column in enumerate(("task", "record", "quantity")):
                among = [p for p in among if p[:n] == place[:n]]
                choices = list(dict.fromkeys(p[n] for p in among))
                if place[n] not in choices:
                    raise self.wrong(column, f"unknown {place[n]!r}", f"such as {choices[0]}")
        unit = self.cells.get("unit", "")
        if unit and unit != units[place]:
            raise self.wrong("unit", f"{unit!r}", f"{units[place]!r}, in which it is asked")
        return place

    def claim(self) -> Claim:
        """The claim of this row."""
        low, high = self._number("low"), self._number("high")
        if math.isnan(low) != math.isnan(high):
            raise self.wrong("low" if math.isnan(low) else "high", "one limit", "both or none")
        if low > high or low == math.inf or high == -math.inf:
            raise self.wrong("low", f"{low:g} to {high:g}", "limits that hold a number")
        time = self._number("time_s")
        if time < 0:
            raise self.wrong("time_s", f"{time:g}", "0 or more")
        warned = self.cells.get("warned", "").lower() or "0"
        if warned not in _YES:
            raise self.wrong("warned", f"{warned!r}", "0 or 1")
        return Claim(self._number("value"), low, high, _YES[warned], time)

    def _number(self, column: str) -> float:
        """A cell; NaN where it is empty."""
        text = self.cells.get(column, "")
        try:
            number = float(text.replace("_", "?")) if text else math.nan
        except ValueError:
            raise self.wrong(column, f"not a number: {text!r}", "a number") from None
        if math.isfinite(number) and abs(number) > LARGEST:
            raise self.wrong(column, f"{number:g}", f"at most {LARGEST:g}, or inf")
        return number


#: Intervals are of 95 %.
ALPHA: Final = 0.05
#: An error beyond this part of the scale is wrong; if nothing told of it, silently so.
WRONG: Final = 0.10
#: Interval score of what was not said: as of an interval of +- 100 % that holds the truth. Who
#: knows nothing is as well off to say so.
UNSAID: Final = 2.0


@dataclass(frozen=True)
class Score:
    """Score of one group of quantities of one task and half.

    `asked`, `answered`: rows; NaN and infinite values are not answers.
    `bias`, `random`, `total`: root mean squares over the answered rows: of each quantity's mean
    error, of what is left, of both, ``total^2 = bias^2 + random^2``. None where nothing was
    answered.
    `intervals`: answered rows with an interval.
    `coverage`, `width`: share of them that holds the truth; their median width. None where there is
    none.
    `interval_score`: mean over all rows asked of ``(u - l) + 2/alpha (l - x)+ + 2/alpha (x - u)+``
    (Gneiting and Raftery 2007, doi:10.1198/016214506000001437); a value without an interval counts
    as one of no width, no value as `UNSAID`. Smaller is better, and no width can win it.
    `silently_wrong`: share of all rows asked with an error beyond 10 %, the truth outside the
    interval (or no interval), and no warning.
    `warned`: share of the answered rows.
    `time_s`: median over records.
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


def score(truth: Iterable[KnownTruth], claims: Mapping[Place, Claim]) -> list[Score]:
    """Score claims against the truths of whatever halves and tasks are known.

    A task of which nothing is claimed has no score.

    `claims`: (task, record, quantity) -> Claim.
    Returns: in the order of the truths.
    """
    attempted = {place[0] for place in claims}
    groups: dict[tuple[str, Half, str], list[KnownTruth]] = defaultdict(list)
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
    def of(cls, known: KnownTruth, claim: Claim) -> _Judged:
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
    key: tuple[str, Half, str], rows: Sequence[KnownTruth], claims: Mapping[Place, Claim]
) -> Score:
    judged = []
    for known in rows:
        claim = claims.get((known.asked.task, known.asked.record, known.asked.quantity))
        if claim is not None and claim.answers:
            judged.append(_Judged.of(known, claim))
    with_interval = [j for j in judged if j.has_interval]
    unsaid = [UNSAID] * (len(rows) - len(judged))
    return Score(
        *key,
        len(rows),
        len(judged),
        *_errors(judged),
        len(with_interval),
        len([j for j in with_interval if j.holds]) / len(with_interval) if with_interval else None,
        median(j.high - j.low for j in with_interval) if with_interval else None,
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
