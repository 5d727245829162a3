"""One description of each result: the name, meaning and unit of every number in it.

A topic lists the columns of its result next to the record: `Column("delay_ms", "delay of the
reflex", "ms", ...)`. Tables, long tables, JSON, MATLAB, workbooks, labelled arrays, notebooks and
the tables of the docs are made from these columns; none of them guesses a unit. Names of columns
are contracts: a change of a name changes the files. Standard library only.
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
    """Meaning of a number in words, and its unit.

    `unit`: "1" for a pure number, "" for a text or if another column holds the unit.
    `i`, `j`: row and column in its matrix, or index in its list, from 1.
    `along`: what the index of the list counts, such as "muscle".
    `whole`: meaning of the matrix or list; "" for a single number.
    """

    words: str
    unit: str = ""
    i: int | None = None
    j: int | None = None
    along: str = "axis"
    whole: str = ""


@dataclass(frozen=True)
class Beside:
    """A column that belongs to a number's column, such as its standard error.

    `field`: its column in the long table.
    `pure`: True for a pure number; otherwise it has the number's unit.
    """

    words: str
    field: str
    pure: bool = False

    def of(self, means: Meaning) -> Meaning:
        """Meaning of this column for a number of the stated meaning."""
        unit = "1" if self.pure else means.unit
        whole = means.whole and f"{self.words}: {means.whole}"
        return replace(means, words=f"{self.words}: {means.words}", unit=unit, whole=whole)


#: Prefix of a column's name -> its relation to the number.
BESIDE: Final = {
    "sd_": Beside("standard error", "sd"),
    "ci_low_": Beside("lower 95 % limit", "lower"),
    "ci_high_": Beside("upper 95 % limit", "upper"),
    "feasible_low_": Beside("least possible value", "feasible_lower"),
    "feasible_high_": Beside("largest possible value", "feasible_upper"),
    "efficiency_": Beside("efficiency", "efficiency", pure=True),
}


def split_beside(name: str) -> tuple[str, Beside | None]:
    """Return the number's column and the relation to it; the name itself and None without."""
    for beginning, beside in BESIDE.items():
        if name.startswith(beginning):
            return name.removeprefix(beginning), beside
    return name, None


@dataclass(frozen=True)
class Column(Generic[R]):
    """One column of a result's table.

    `name`: a contract; ``{}`` stands for the name of a muscle, an axis or another item, in `words`
    too.
    `words`, `unit`: as in `Meaning`.
    `value`: function that takes the value from the record; None: the attribute of this name.
    `optional`: left out of a row if the value is None.
    """

    name: str
    words: str
    unit: str = ""
    value: Callable[[R], Any] | None = None
    optional: bool = False

    def of(self, record: R) -> Any:
        """Value of this column for a record."""
        return getattr(record, self.name) if self.value is None else self.value(record)


def beside(
    before: str, column: Column[R], value: Callable[[R], Any], *, name: str = ""
) -> Column[R]:
    """Return a column that belongs to another one: its standard error, a limit.

    `before`: a prefix in `BESIDE`.
    `name`: name after the prefix; "": that of the other column.
    """
    means = BESIDE[before].of(Meaning(column.words, column.unit))
    return Column(before + (name or column.name), means.words, means.unit, value)


def cells(columns: Iterable[Column[R]], record: R) -> dict[str, Any]:
    """Return the row of a record: cells by the names of the columns."""
    values = ((column, column.of(record)) for column in columns)
    return {
        column.name: value for column, value in values if not (column.optional and value is None)
    }


def meanings(columns: Iterable[Column[Any]]) -> dict[str, Meaning]:
    """Meanings of the columns, by their names."""
    return {column.name: Meaning(column.words, column.unit) for column in columns}


def meaning_in(described: Mapping[str, Meaning], name: str) -> Meaning | None:
    """Return the meaning of a column, also by a name with ``{}`` that matches, or None."""
    if name in described:
        return described[name]
    for template, means in described.items():
        if "{}" in template and (fits := _pattern(template).fullmatch(name)):
            parts = (part.replace("_", " ") for part in fits.groups())
            return Meaning(means.words.format(*parts), means.unit)
    return None


@cache
def _pattern(template: str) -> re.Pattern[str]:
    return re.compile("(.+)".join(map(re.escape, template.split("{}"))))
