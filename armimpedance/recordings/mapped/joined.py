"""A log and its trial table: columns of a second table, found by the number or name of a trial."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.errors import InputError
from armimpedance.recordings.mapped.mapping import JoinedTable
from armimpedance.recordings.mapped.raw_file import (
    RawColumn,
    RawFile,
    RawRun,
    RawTable,
    ReadFile,
    names_in,
    plain,
)

#: Reads a whole table.
ReadTable = Callable[[Path], RawFile]


def with_tables(
    files: Sequence[ReadFile],
    tables: Sequence[JoinedTable],
    read: ReadTable,
    pattern: str | None = None,
) -> tuple[ReadFile, ...]:
    """The files with the columns of their trial tables.

    `read`: reads a whole table; it stands beside the first file unless it is a part of the log. A
    key may also be what the pattern takes from the name of a file.
    Raises InputError: a table or its key is missing, a trial stands twice in it or is not there.
    """
    made = tuple(files)
    for table in tables:
        where = made[0].path.parent / table.file if table.file is not None else None
        whole = None if where is None else read(where).runs[0]
        made = tuple(
            replace(file, raw=replace(file.raw, runs=_joined(file, pattern, table, whole, where)))
            for file in made
        )
    return made


def _joined(
    file: ReadFile,
    pattern: str | None,
    table: JoinedTable,
    whole: RawRun | None,
    where: Path | None,
) -> tuple[RawRun, ...]:
    said = names_in(pattern or "", file.path) or {}
    runs = file.raw.runs
    if table.log_key in said:
        runs = tuple(replace(run, facts={**said, **run.facts}) for run in runs)
    paths = (file.path, where or file.path)
    return tuple(_join(run, table, run if whole is None else whole, *paths) for run in runs)


def _join(run: RawRun, table: JoinedTable, source: RawRun, log: Path, where: Path) -> RawRun:
    """A run with the columns of the rows that its key names."""
    rows = _rows(source, table, where)
    keys = table_keys(rows.columns[table.table_key], where, table.table_key, rows.first_row)
    if source is run:
        # a table of the log itself: its columns move to the samples
        run = replace(run, tables=tuple(each for each in run.tables if each is not rows))
    own = {name for each in run.tables for name in each.columns} | set(run.facts)
    further = {n: c for n, c in rows.columns.items() if n not in own and n != table.table_key}
    if table.log_key in run.facts:
        at = keys.get(plain(run.facts[table.log_key]))
        if at is None:
            raise _no_row(run.facts[table.log_key], table, log, None, where)
        facts = {n: _plain_fact(c.values[at], c.is_text) for n, c in further.items()}
        return replace(run, facts={**run.facts, **facts})
    made = [_extended(each, table, keys, further, log, where) for each in run.tables]
    if all(new is old for new, old in zip(made, run.tables, strict=True)):
        expected = f"the key of [[tables]], one of {', '.join(sorted(own)[:12])}"
        raise InputError("no such column", file=log, column=table.log_key, expected=expected)
    return replace(run, tables=tuple(made))


def _extended(
    log_table: RawTable,
    table: JoinedTable,
    keys: Mapping[str, int],
    further: Mapping[str, RawColumn],
    log: Path,
    where: Path,
) -> RawTable:
    """The table of the log that holds the key, with the further columns; others as they are."""
    column = log_table.columns.get(table.log_key)
    if column is None:
        return log_table
    different, which = np.unique(column.values, return_inverse=True)
    at = np.full(len(different), -1)
    for i, value in enumerate(different):
        if _is_missing(value) or plain(value) in table.between:
            continue
        found = keys.get(plain(value))
        if found is None:
            row = log_table.first_row + int(np.argmax(which == i))
            raise _no_row(value, table, log, row, where)
        at[i] = found
    rows = at[which]
    return replace(
        log_table,
        columns={**log_table.columns, **{n: _repeated(c, rows) for n, c in further.items()}},
    )


def _repeated(column: RawColumn, rows: NDArray[Any]) -> RawColumn:
    """A value of the trial table at each sample of the trial; missing between trials."""
    values: NDArray[Any] = column.values[np.maximum(rows, 0)]
    empty: Any = "" if column.is_text else np.nan
    return replace(column, values=np.where(rows >= 0, values, empty))


def _rows(source: RawRun, table: JoinedTable, where: Path) -> RawTable:
    """The table that holds the key."""
    for each in source.tables:
        if table.table_key in each.columns:
            return each
    there = [name for each in source.tables for name in each.columns]
    raise InputError(
        "no such column",
        file=where,
        column=table.table_key,
        expected=f"one of {', '.join(there[:12])}, as the key of [[tables]]",
    )


#: A trial table has no more rows, and its file no more bytes.
_MOST_ROWS: Final = 20_000
_MOST_BYTES: Final = 5_000_000
#: A column whose name says nothing of trials has no more rows than so many for each.
_MOST_UNNAMED: Final = 2


def table_beside(
    log: ReadFile, key: str, trials: Sequence[Any], candidates: Iterable[Path], read: ReadTable
) -> JoinedTable | None:
    """The table beside a log that has a row for each of its trials; None: there is none.

    `key`: what the log calls a trial. `trials`: their numbers or names.
    `candidates`: files that may hold it.
    """
    wanted = {plain(value) for value in trials if not _is_missing(value)}
    for path in candidates:
        if path == log.path or path.stat().st_size > _MOST_BYTES:
            continue
        with suppress(InputError):
            for table in read(path).runs[0].tables:
                if name := _key_among(table, key, wanted, path):
                    return JoinedTable(path.name, key, name)
    return None


def _key_among(table: RawTable, key: str, wanted: set[str], path: Path) -> str | None:
    """The column that names all trials, each once: of the log's name first."""
    if len(table.columns) < 2 or not len(wanted) <= table.rows <= _MOST_ROWS:
        return None
    for name in sorted(table.columns, key=lambda name: (name != key, "tri" not in name.lower())):
        named = name == key or "tri" in name.lower()
        if not named and table.rows > _MOST_UNNAMED * len(wanted):
            continue  # numbers of frames hold those of the trials, too
        with suppress(InputError):
            if wanted <= set(table_keys(table.columns[name], path, name, 1)):
                return name
    return None


def table_keys(column: RawColumn, where: Path, name: str, first_row: int) -> dict[str, int]:
    """Number or name of a trial -> its row, from 0.

    Raises InputError: one stands twice.
    """
    found: dict[str, int] = {}
    for row, value in enumerate(column.values):
        if _is_missing(value):
            continue
        key = plain(value)
        if key in found:
            raise InputError(
                f"trial {key} occurs twice", file=where, row=first_row + row, column=name,
                expected="one row a trial",
            )  # fmt: skip
        found[key] = row
    return found


def _no_row(value: Any, table: JoinedTable, log: Path, row: int | None, where: Path) -> InputError:
    return InputError(
        f"trial {plain(value)} has no row in {where.name}",
        file=log,
        row=row,
        column=table.log_key,
        expected="a row for each trial, or what the log has between trials as `between`",
    )


def _is_missing(value: Any) -> bool:
    return not value.strip() if isinstance(value, str) else bool(np.isnan(value))


def _plain_fact(value: Any, is_text: bool) -> float | str:
    return str(value) if is_text else float(value)
