"""Content of a file of any layout before a mapping is applied: runs of named columns.

A run is one continuous recording: one trial, or a whole session. Its columns have one clock or
several (topics of a bag, groups of a file); each clock is a table.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.errors import InputError, RecordError
from armimpedance.recordings.mapped.mapping import ColumnMapping

#: Function of a column's name: True if it is wanted; a reader may skip the others.
Wanted = Callable[[str], bool]


@dataclass(frozen=True)
class RawColumn:
    """One column as in the file.

    `values` (N,): float64, NaN for missing values; or texts.
    `unit`: as stated in the file, not interpreted.
    `label`: a further name in the file, as for a channel of an array.
    """

    values: NDArray[np.float64] | NDArray[np.str_]
    unit: str | None = None
    label: str | None = None

    @property
    def is_text(self) -> bool:
        """True if the column holds texts."""
        return self.values.dtype.kind == "U"


@dataclass(frozen=True)
class RawTable:
    """Columns of one clock, of equal length.

    `columns`: name -> column. Names are different over all tables of a run.
    `time_s` (N,) or None: the time of the rows if the file itself has it (stamps of messages, a
    start and a rate); None if it is at most in a column.
    `rate_hz`: the rate, if the file states it.
    `first_row`: position of the first row in the file, for messages: the line of a text file, else
    1.
    """

    columns: Mapping[str, RawColumn]
    time_s: NDArray[np.float64] | None = None
    rate_hz: float | None = None
    first_row: int = 1

    def __post_init__(self) -> None:
        lengths = {len(column.values) for column in self.columns.values()}
        if self.time_s is not None:
            lengths.add(len(self.time_s))
        if len(lengths) > 1:
            raise RecordError(f"columns of {sorted(lengths)} rows", expected="one clock a table")

    @property
    def rows(self) -> int:
        """Number of rows N."""
        if self.time_s is not None:
            return len(self.time_s)
        return next((len(column.values) for column in self.columns.values()), 0)


@dataclass(frozen=True)
class RawRun:
    """One continuous recording: its tables, and facts on it as a whole.

    `name`: the file, or the part of it, for messages.
    `facts`: numbers and texts on the run, such as a condition or a subject's mass.
    """

    name: str
    tables: tuple[RawTable, ...]
    facts: Mapping[str, float | str] = field(default_factory=dict)


@dataclass(frozen=True)
class RawFile:
    """All runs of a file or folder, and sentences on contents that are left out."""

    runs: tuple[RawRun, ...]
    not_taken: tuple[str, ...] = ()


@dataclass(frozen=True)
class ReadFile:
    """A file and its content."""

    path: Path
    raw: RawFile


@dataclass(frozen=True)
class Source:
    """A kind of file that can be read with a mapping.

    `name`: name in messages, such as "a MATLAB file (.mat)".
    `recognises`: function that returns True for an existing file or folder of this kind, without
    any optional package.
    `read`: function that reads the wanted columns; `InputError` for any fault of the file.
    """

    name: str
    recognises: Callable[[Path], bool]
    read: Callable[[Path, Wanted], RawFile]


def plain(value: Any) -> str:
    """Return a trial's number or name in a standard form: the same for 1, 1.0, "1" or "001"."""
    if isinstance(value, str):
        text = value.strip()
        return str(int(text)) if re.fullmatch(r"[+-]?\d{1,15}", text) else text
    number = float(value)
    return str(int(number)) if number.is_integer() else repr(number)


def names_in(pattern: str, file: Path) -> dict[str, str] | None:
    """Parts of a file's name by a pattern such as ``{condition}_{trial}``; None if it differs."""
    names = re.findall(r"\{(\w+)\}", pattern)
    parts = re.split(r"\{\w+\}", pattern)
    expression = "".join(
        re.escape(part) + (f"(?P<v{i}>.+)" if i < len(names) else "")
        for i, part in enumerate(parts)
    )
    match = re.fullmatch(expression, file.stem) or re.fullmatch(expression, file.name)
    return None if match is None else {name: match.group(f"v{i}") for i, name in enumerate(names)}


# Trials side by side, as columns with a number in their names: one run each.


@dataclass(frozen=True)
class OneOfMany:
    """A run of one trial, with the number or name that its columns had."""

    run: RawRun
    key: str


def natural(text: str) -> list[tuple[int, int | str]]:
    """Sort key by which ``trial10`` comes after ``trial9``."""
    parts = re.split(r"(\d+)", text)
    return [(0, int(p)) if p.isdigit() and len(p) < 19 else (1, p) for p in parts]


def _columns_by_key(
    run: RawRun, patterns: list[str], file: Path
) -> tuple[dict[str, dict[str, str]], list[str]]:
    """Map of patterns to keys (text for ``*``) to columns; and the keys in natural order."""
    names = [name for table in run.tables for name in table.columns]
    by_pattern = {pattern: _keys(pattern, names) for pattern in patterns}
    keys = sorted({key for by_key in by_pattern.values() for key in by_key}, key=natural)
    if not keys:
        problem = f"no columns like {patterns[0]}"
        raise InputError(problem, file=file, expected=f"among {', '.join(names[:12])}")
    for pattern, by_key in by_pattern.items():
        if missing := [key for key in keys if key not in by_key]:
            problem = f"trial {missing[0]} has no column like {pattern}"
            raise InputError(problem, file=file, expected="the columns of every trial")
    return by_pattern, keys


def trials_beside(run: RawRun, mapping: ColumnMapping, file: Path) -> tuple[OneOfMany, ...]:
    """Split a run into one run per trial, with the mapping's column names, ``*`` included.

    Columns without a ``*``, such as a common time, are in all of them. Rows at the end in which all
    columns of a trial are empty are removed, since trials differ in length.

    Raises InputError: no name has a ``*``, no column matches, or a trial lacks a column.
    """
    patterns = [name for name in mapping.names if "*" in name]
    if not patterns:
        expected = 'a name with a *, such as "x_*", for trials by "columns"'
        raise InputError("no * in any name", file=mapping.file, expected=expected)
    by_pattern, keys = _columns_by_key(run, patterns, file)
    starred = {name for by_key in by_pattern.values() for name in by_key.values()}
    runs = (
        _run_of(run, key, position, len(keys), by_pattern, starred)
        for position, key in enumerate(keys)
    )
    return tuple(OneOfMany(trial_run, key) for trial_run, key in zip(runs, keys, strict=True))


def _keys(pattern: str, names: list[str]) -> dict[str, str]:
    """Map of the text for ``*`` to the column."""
    expression = _expression(pattern)
    matches = ((expression.fullmatch(name), name) for name in names)
    return {match.group(1): name for match, name in matches if match}


def _expression(pattern: str) -> re.Pattern[str]:
    before, _, after = pattern.partition("*")
    return re.compile(f"{re.escape(before)}(.+?){re.escape(after)}")


def _run_of(
    run: RawRun,
    key: str,
    position: int,
    trials: int,
    by_pattern: Mapping[str, Mapping[str, str]],
    starred: set[str],
) -> RawRun:
    wanted = {by_key[key]: pattern for pattern, by_key in by_pattern.items()}
    facts: dict[str, float | str] = dict(run.facts)
    tables = []
    for table in run.tables:
        columns = {
            wanted.get(name, name): column
            for name, column in table.columns.items()
            if name in wanted or name not in starred
        }
        if table.rows == trials and not set(wanted) & set(table.columns):
            facts |= {name: _fact(column, position) for name, column in columns.items()}
            continue
        tables.append(_without_padding(replace(table, columns=columns), set(wanted.values())))
    return RawRun(f"{run.name}, trial {key}", tuple(tables), facts)


def _fact(column: RawColumn, position: int) -> float | str:
    value = column.values[position]
    return str(value) if column.is_text else float(value)


def _without_padding(table: RawTable, starred: set[str]) -> RawTable:
    values = [c.values for n, c in table.columns.items() if n in starred]
    empty = [v == "" if v.dtype.kind == "U" else np.isnan(v) for v in values]
    if not empty or not table.rows:
        return table
    full = np.flatnonzero(~np.logical_and.reduce(empty))
    rows = int(full[-1]) + 1 if len(full) else 0
    return _cut(table, rows) if rows < table.rows else table


def _cut(table: RawTable, rows: int) -> RawTable:
    def columns() -> Iterator[tuple[str, RawColumn]]:
        for name, column in table.columns.items():
            yield name, replace(column, values=column.values[:rows])

    time = None if table.time_s is None else table.time_s[:rows]
    return replace(table, columns=dict(columns()), time_s=time)
