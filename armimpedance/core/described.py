"""A result is described once: every number of it with its name, its meaning and its unit.

A topic writes down the columns of its result beside the record: `Column("delay_ms", "delay of the
reflex", "ms", ...)`. Tables, long tables, JSON, MATLAB, workbooks, labelled arrays, notebooks and
the tables of the docs are made of these columns; no form guesses a unit. Names of columns are
contracts: a change of one changes the files. Standard library only.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Final, Generic, TypeVar

R = TypeVar("R")


@dataclass(frozen=True)
class Meaning:
    """What a number is.

    `unit`: "1" for a pure number, "" of a text or where another column holds the unit.
    `i`, `j`: row and column in its matrix, or number in its list, from 1.
    `along`: what such a list counts, such as "muscle".
    `whole`: what the matrix or the list is; "": a number by itself.
    """

    words: str
    unit: str = ""
    i: int | None = None
    j: int | None = None
    along: str = "axis"
    whole: str = ""


@dataclass(frozen=True)
class Beside:
    """A column beside that of a number, such as its standard error.

    `field`: its column in the long table.
    `pure`: whether it is a pure number; else it has the number's unit.
    """

    words: str
    field: str
    pure: bool = False

    def of(self, means: Meaning) -> Meaning:
        """What it is, of such a number."""
        unit = "1" if self.pure else means.unit
        whole = means.whole and f"{self.words}: {means.whole}"
        return replace(means, words=f"{self.words}: {means.words}", unit=unit, whole=whole)


#: Beginning of the name -> what such a column is of the number.
BESIDE: Final = {
    "sd_": Beside("standard error", "sd"),
    "ci_low_": Beside("lower 95 % limit", "lower"),
    "ci_high_": Beside("upper 95 % limit", "upper"),
    "feasible_low_": Beside("least possible value", "feasible_lower"),
    "feasible_high_": Beside("largest possible value", "feasible_upper"),
    "efficiency_": Beside("efficiency", "efficiency", pure=True),
}


def split_beside(name: str) -> tuple[str, Beside | None]:
    """The column that a column stands beside, and as what; itself and None where it is its own."""
    for beginning, beside in BESIDE.items():
        if name.startswith(beginning):
            return name.removeprefix(beginning), beside
    return name, None


@dataclass(frozen=True)
class Column(Generic[R]):
    """One column of a result's table.

    `name`: a contract; ``{}`` in it stands for a muscle, an axis or whatever else the column is of,
    and stands in `words` for the same.
    `words`, `unit`: as in `Meaning`.
    `value`: takes it from the record; without it the attribute of this name.
    `optional`: left out of a row where it is None.
    """

    name: str
    words: str
    unit: str = ""
    value: Callable[[R], Any] | None = None
    optional: bool = False

    def of(self, record: R) -> Any:
        """The value of a record."""
        return getattr(record, self.name) if self.value is None else self.value(record)


def beside(
    before: str, column: Column[R], value: Callable[[R], Any], *, name: str = ""
) -> Column[R]:
    """A column beside another: its standard error, a limit.

    `before`: a beginning of `BESIDE`.
    `name`: without it that of the other column.
    """
    means = BESIDE[before].of(Meaning(column.words, column.unit))
    return Column(before + (name or column.name), means.words, means.unit, value)


def cells(columns: Iterable[Column[R]], record: R) -> dict[str, Any]:
    """The row of a record, its cells by the names of the columns."""
    taken = ((column, column.of(record)) for column in columns)
    return {
        column.name: value for column, value in taken if not (column.optional and value is None)
    }


def meanings(columns: Iterable[Column[Any]]) -> dict[str, Meaning]:
    """What the columns are, by their names."""
    return {column.name: Meaning(column.words, column.unit) for column in columns}


def meaning_in(described: Mapping[str, Meaning], name: str) -> Meaning | None:
    """What a column is by its name, or by a name with ``{}`` that it fits; None: not described."""
    if name in described:
        return described[name]
    for template, means in described.items():
        if "{}" in template and (fits := _pattern(template).fullmatch(name)):
            what = (part.replace("_", " ") for part in fits.groups())
            return Meaning(means.words.format(*what), means.unit)
    return None


@cache
def _pattern(template: str) -> re.Pattern[str]:
    return re.compile("(.+)".join(map(re.escape, template.split("{}"))))
