"""A submission: one CSV of claims, in whatever language it was made. Standard library only."""

from __future__ import annotations

import csv
import math
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Final, NamedTuple

from armimpedance.core.errors import InputError
from armimpedance.core.inputs import unchanged
from armimpedance.lab.benchmark.asked import Asked

_REQUIRED: Final = ("task", "record", "quantity", "value")
_OPTIONAL: Final = ("low", "high", "unit", "warned", "time_s")
_YES: Final = {"1": True, "true": True, "yes": True, "0": False, "false": False, "no": False}

#: Squares and sums of such numbers are still numbers.
LARGEST: Final = 1e60
#: Task, record, quantity.
Place = tuple[str, str, str]


class Claim(NamedTuple):
    """What a method says of one quantity.

    Attributes
    ----------
    value : float
        NaN or infinite: nothing was said.
    low, high : float
        The 95 % interval; NaN where there is none.
    warned : bool
    time_s : float
        That the record took; NaN where it was not told.
    """

    value: float
    low: float = math.nan
    high: float = math.nan
    warned: bool = False
    time_s: float = math.nan

    @property
    def answers(self) -> bool:
        """Whether a value was said at all."""
        return math.isfinite(self.value)

    @property
    def has_interval(self) -> bool:
        """Whether limits were said, be they infinite."""
        return self.answers and not (math.isnan(self.low) or math.isnan(self.high))


def read_submission(file: Path, asked: Collection[Asked]) -> dict[Place, Claim]:
    """The claims in a CSV with the columns task, record, quantity, value and perhaps more.

    Parameters
    ----------
    file : Path
        Optional columns: low, high (both or none), unit, warned (0 or 1), time_s. Rows in any
        order; those that are missing are missing.
    asked : collection of Asked
        What the benchmark asks for.

    Raises
    ------
    InputError
        A column, task, record, quantity or unit that is not asked for, a row that stands twice, a
        cell that is no number, limits the wrong way round: with row and column.
    """
    units = {(a.task, a.record, a.quantity): a.unit for a in asked}
    claims: dict[Place, Claim] = {}
    with unchanged(file), _opened(file) as stream:
        reader = csv.DictReader(stream, strict=True)
        try:
            _check_header(file, reader.fieldnames)
            for cells in reader:
                row = _Row(file, reader.line_num, cells)
                place = row.place(units)
                if place in claims:
                    raise row.wrong("quantity", f"{' '.join(place)} stands twice", "one row")
                claims[place] = row.claim()
        except UnicodeDecodeError:
            raise InputError("is not UTF-8 text", file=file, expected="a CSV") from None
        except csv.Error as error:
            raise InputError(f"broken CSV: {error}", file=file, row=reader.line_num) from None
    if not claims:
        raise InputError("holds no rows", file=file, expected="one row a quantity")
    return claims


def _opened(file: Path):  # type: ignore[no-untyped-def]
    try:
        return file.open(encoding="utf-8-sig", newline="")
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=file) from None


def _check_header(file: Path, names: Collection[str] | None) -> None:
    found = list(names or ())
    for name in _REQUIRED:
        if name not in found:
            raise InputError("no such column", file=file, column=name, expected="a submission")
    for name in found:
        if name not in (*_REQUIRED, *_OPTIONAL) or found.count(name) > 1:
            expected = f"each at most once: {', '.join((*_REQUIRED, *_OPTIONAL))}"
            raise InputError(
                "unknown or repeated column", file=file, column=name, expected=expected
            )
    if ("low" in found) != ("high" in found):
        raise InputError("low without high", file=file, expected="both columns, or none")


class _Row:
    """One line of the file."""

    def __init__(self, file: Path, line: int, cells: Mapping[str, str | None]) -> None:
        self.file, self.line = file, line
        if None in cells or None in cells.values():
            raise InputError("another number of cells than the header", file=file, row=line)
        self.cells = {name: (text or "").strip() for name, text in cells.items()}

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
        """What the row says."""
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
