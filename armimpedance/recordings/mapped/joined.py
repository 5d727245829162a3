"""A log and its trial table: columns of a second table, joined by a trial's number or name."""

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

#: Function that reads a whole table.
ReadTable = Callable[[Path], RawFile]


def with_tables(
    files: Sequence[ReadFile],
    tables: Sequence[JoinedTable],
    read: ReadTable,
    pattern: str | None = None,
) -> tuple[ReadFile, ...]:
    """Join the columns of trial tables to files.

    `read`: function that reads a whole table, which is beside the first file unless it is a part of
    the log. A key may also come from the file's name by the pattern.
    Raises InputError: a table or its key is missing, or a trial is in it twice or not at all.
    """
    joined = tuple(files)
    for table in tables:
        path = joined[0].path.parent / table.file if table.file is not None else None
        full_run = None if path is None else read(path).runs[0]
        joined = tuple(
            replace(file, raw=replace(file.raw, runs=_joined(file, pattern, table, full_run, path)))
            for file in joined
        )
    return joined


def _joined(
    file: ReadFile,
    pattern: str | None,
    table: JoinedTable,
    full_run: RawRun | None,
    path: Path | None,
) -> tuple[RawRun, ...]:
    facts = names_in(pattern or "", file.path) or {}
    runs = file.raw.runs
    if table.log_key in facts:
        runs = tuple(replace(run, facts={**facts, **run.facts}) for run in runs)
    paths = (file.path, path or file.path)
    return tuple(_join(run, table, run if full_run is None else full_run, *paths) for run in runs)


def _join(run: RawRun, table: JoinedTable, source: RawRun, log: Path, path: Path) -> RawRun:
    """Join to a run the columns of the rows with its keys."""
    rows = _rows(source, table, path)
    keys = table_keys(rows.columns[table.table_key], path, table.table_key, rows.first_row)
    if source is run:
        # a table of the log itself: its columns move to the samples
        run = replace(run, tables=tuple(part for part in run.tables if part is not rows))
    log_names = {name for part in run.tables for name in part.columns} | set(run.facts)
    further = {n: c for n, c in rows.columns.items() if n not in log_names and n != table.table_key}
    if table.log_key in run.facts:
        at = keys.get(plain(run.facts[table.log_key]))
        if at is None:
            raise _no_row(run.facts[table.log_key], table, log, None, path)
        facts = {n: _plain_fact(c.values[at], c.is_text) for n, c in further.items()}
        return replace(run, facts={**run.facts, **facts})
    extended = [_extended(part, table, keys, further, log, path) for part in run.tables]
    if all(new is old for new, old in zip(extended, run.tables, strict=True)):
        expected = f"the key of [[tables]], one of {', '.join(sorted(log_names)[:12])}"
        raise InputError("no such column", file=log, column=table.log_key, expected=expected)
    return replace(run, tables=tuple(extended))


def _extended(
    log_table: RawTable,
    table: JoinedTable,
    keys: Mapping[str, int],
    further: Mapping[str, RawColumn],
    log: Path,
    path: Path,
) -> RawTable:
    """Add the further columns to the table of the log with the key; others are not changed."""
    column = log_table.columns.get(table.log_key)
    if column is None:
        return log_table
    different, which = np.unique(column.values, return_inverse=True)
    row_of = np.full(len(different), -1)
    for i, value in enumerate(different):
        if _is_missing(value) or plain(value) in table.between:
            continue
        match = keys.get(plain(value))
        if match is None:
            row = log_table.first_row + int(np.argmax(which == i))
            raise _no_row(value, table, log, row, path)
        row_of[i] = match
    rows = row_of[which]
    return replace(
        log_table,
        columns={**log_table.columns, **{n: _repeated(c, rows) for n, c in further.items()}},
    )


def _repeated(column: RawColumn, rows: NDArray[Any]) -> RawColumn:
    """Repeat the values of the trial table for each sample; missing between trials."""
    values: NDArray[Any] = column.values[np.maximum(rows, 0)]
    empty: Any = "" if column.is_text else np.nan
    return replace(column, values=np.where(rows >= 0, values, empty))


def _rows(source: RawRun, table: JoinedTable, path: Path) -> RawTable:
    """Table with the key."""
    for part in source.tables:
        if table.table_key in part.columns:
            return part
    available = [name for part in source.tables for name in part.columns]
    raise InputError(
        "no such column",
        file=path,
        column=table.table_key,
        expected=f"one of {', '.join(available[:12])}, as the key of [[tables]]",
    )


#: Most rows of a trial table, and most bytes of its file.
_MOST_ROWS: Final = 20_000
_MOST_BYTES: Final = 5_000_000
#: Most rows per trial in a column whose name does not mention trials.
_MOST_UNNAMED: Final = 2


def table_beside(
    log: ReadFile, key: str, trials: Sequence[Any], candidates: Iterable[Path], read: ReadTable
) -> JoinedTable | None:
    """Find the table beside a log that has a row for each of its trials; None if there is none.

    `key`: the log's column of trials. `trials`: their numbers or names.
    `candidates`: files that may be the table.
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
    """Find the column with all trials, each once; the log's name is tried first."""
    if len(table.columns) < 2 or not len(wanted) <= table.rows <= _MOST_ROWS:
        return None
    for name in sorted(table.columns, key=lambda name: (name != key, "tri" not in name.lower())):
        named = name == key or "tri" in name.lower()
        if not named and table.rows > _MOST_UNNAMED * len(wanted):
            continue  # numbers of frames include those of the trials
        with suppress(InputError):
            if wanted <= set(table_keys(table.columns[name], path, name, 1)):
                return name
    return None


def table_keys(column: RawColumn, where: Path, name: str, first_row: int) -> dict[str, int]:
    """Map of trial numbers or names to rows, from 0.

    Raises InputError: a trial occurs twice.
    """
    row_of: dict[str, int] = {}
    for row, value in enumerate(column.values):
        if _is_missing(value):
            continue
        key = plain(value)
        if key in row_of:
            raise InputError(
                f"trial {key} occurs twice", file=where, row=first_row + row, column=name,
                expected="one row a trial",
            )  # fmt: skip
        row_of[key] = row
    return row_of


def _no_row(value: Any, table: JoinedTable, log: Path, row: int | None, path: Path) -> InputError:
    return InputError(
        f"trial {plain(value)} has no row in {path.name}",
        file=log,
        row=row,
        column=table.log_key,
        expected="a row for each trial, or what the log has between trials as `between`",
    )


def _is_missing(value: Any) -> bool:
    return not value.strip() if isinstance(value, str) else bool(np.isnan(value))


def _plain_fact(value: Any, is_text: bool) -> float | str:
    return str(value) if is_text else float(value)
