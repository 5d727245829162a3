"""Trials that stand side by side, as columns with a number in their names: one run each."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.recordings.mapped.mapping import ColumnMapping
from armimpedance.recordings.mapped.raw_file import RawColumn, RawRun, RawTable


@dataclass(frozen=True)
class OneOfMany:
    """A run that holds one of the trials, with the number or name that its columns had."""

    run: RawRun
    key: str


def natural(text: str) -> list[tuple[int, int | str]]:
    """A key of sorting by which ``trial10`` comes after ``trial9``."""
    parts = re.split(r"(\d+)", text)
    return [(0, int(p)) if p.isdigit() and len(p) < 19 else (1, p) for p in parts]


def trials_beside(run: RawRun, mapping: ColumnMapping, file: Path) -> tuple[OneOfMany, ...]:
    """One run for each trial; its columns have the names of the mapping, ``*`` included.

    Columns without a ``*``, such as a common time, are in all of them. Rows at the end in which all
    columns of a trial are empty are not part of it: trials differ in length.

    Raises
    ------
    InputError
        No column has a ``*``, none is found, or a trial has other columns than the first.
    """
    patterns = [name for name in mapping.names if "*" in name]
    if not patterns:
        expected = 'a name with a *, such as "x_*", for trials by "columns"'
        raise InputError("no * in any name", file=mapping.file, expected=expected)
    names = [name for table in run.tables for name in table.columns]
    found = {pattern: _keys(pattern, names) for pattern in patterns}
    keys = sorted({key for by_key in found.values() for key in by_key}, key=natural)
    if not keys:
        problem = f"no columns like {patterns[0]}"
        raise InputError(problem, file=file, expected=f"among {', '.join(names[:12])}")
    for pattern, by_key in found.items():
        if missing := [key for key in keys if key not in by_key]:
            problem = f"trial {missing[0]} has no column like {pattern}"
            raise InputError(problem, file=file, expected="the columns of every trial")
    starred = {name for by_key in found.values() for name in by_key.values()}
    runs = (
        _run_of(run, key, position, len(keys), found, starred) for position, key in enumerate(keys)
    )
    return tuple(OneOfMany(each, key) for each, key in zip(runs, keys, strict=True))


def _keys(pattern: str, names: list[str]) -> dict[str, str]:
    """What stands for the * -> the column."""
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
    found: Mapping[str, Mapping[str, str]],
    starred: set[str],
) -> RawRun:
    wanted = {by_key[key]: pattern for pattern, by_key in found.items()}
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
    own = [c.values for n, c in table.columns.items() if n in starred]
    empty = [v == "" if v.dtype.kind == "U" else np.isnan(v) for v in own]
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
