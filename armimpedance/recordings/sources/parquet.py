"""Parquet files: columns of samples, or one row per trial with lists of samples in its cells."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from armimpedance.core.errors import InputError
from armimpedance.core.findings import not_taken
from armimpedance.core.inputs import check_claim
from armimpedance.recordings.mapped.raw_file import (
    RawColumn,
    RawFile,
    RawRun,
    RawTable,
    Source,
    Wanted,
)
from armimpedance.recordings.mapped.text_layout import stated_unit


def _read(file: Path, wanted: Wanted) -> RawFile:
    try:
        parquet = pq.ParquetFile(file)
        schema: pa.Schema = parquet.schema_arrow
        names = list(schema.names)
        check_claim(8 * parquet.metadata.num_rows * max(len(names), 1), file)
    except (pa.ArrowException, OSError, ValueError) as error:
        raise _unreadable(file, error) from None
    for name, count in Counter(names).items():
        if count > 1:
            raise InputError("appears twice", file=file, column=name, expected="different names")
    chosen = [name for name in names if wanted(name)]
    skipped = not_taken([n for n in names if not wanted(n)], "the mapping gives them no meaning")
    try:
        table = parquet.read(columns=chosen)
        table.validate(full=True)
    except (pa.ArrowException, OSError, ValueError, MemoryError) as error:
        raise _unreadable(file, error) from None
    units = _units(schema)
    if any(pa.types.is_list(field.type) or _is_large_list(field.type) for field in table.schema):
        return RawFile(_rows(table, units), skipped)
    columns, others = {}, []
    for name in chosen:
        values = _values(table.column(name))
        if values is None:
            others.append(name)
        else:
            unit = "s" if pa.types.is_temporal(table.column(name).type) else units.get(name)
            columns[name] = RawColumn(values, unit)
    remarks = (*skipped, *not_taken(others, "neither numbers nor texts"))
    return RawFile((RawRun(str(file), (RawTable(columns),)),), remarks)


def _rows(table: pa.Table, units: Mapping[str, str]) -> tuple[RawRun, ...]:
    """One run per row: lists of samples are its columns, single values its facts."""
    runs = []
    for row in range(table.num_rows):
        facts: dict[str, float | str] = {}
        columns: dict[str, RawColumn] = {}
        for name in table.schema.names:
            cell = table.column(name)[row]
            if isinstance(cell, pa.ListScalar | pa.LargeListScalar):
                values = None if cell.values is None else _values(cell.values)
                if values is not None:
                    columns[name] = RawColumn(values, units.get(name))
            elif isinstance(value := cell.as_py(), str | int | float):
                facts[name] = value if isinstance(value, str) else float(value)
        runs.append(RawRun(f"row {row + 1}", _by_length(columns), facts))
    return tuple(runs)


def _by_length(columns: Mapping[str, RawColumn]) -> tuple[RawTable, ...]:
    lengths = dict.fromkeys(len(column.values) for column in columns.values())
    return tuple(
        RawTable({n: c for n, c in columns.items() if len(c.values) == length})
        for length in lengths
    )


def _is_large_list(kind: Any) -> bool:
    return bool(pa.types.is_large_list(kind) or pa.types.is_fixed_size_list(kind))


def _seconds(column: Any) -> np.ndarray[Any, Any]:
    """Times of any unit in s."""
    kind = column.type
    per_second = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}[kind.unit]
    integers = column.cast(pa.int32() if kind.bit_width == 32 else pa.int64())
    return np.asarray(integers.cast(pa.float64(), safe=False).to_numpy(False)) / per_second


def _values(column: Any) -> np.ndarray[Any, Any] | None:
    """Numbers as float64, texts as texts, times in s; None for anything else."""
    kind = column.type
    if pa.types.is_dictionary(kind):
        column = column.cast(kind.value_type)
        kind = column.type
    if pa.types.is_timestamp(kind) or pa.types.is_duration(kind) or pa.types.is_time(kind):
        return _seconds(column)
    if pa.types.is_boolean(kind):
        column = column.cast(pa.uint8())
        kind = column.type
    if pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind):
        if kind != pa.float64():
            column = column.cast(pa.float64(), safe=False)
        is_chunked = isinstance(column, pa.ChunkedArray)
        values = column.to_numpy() if is_chunked else column.to_numpy(False)
        return np.asarray(values, dtype=np.float64)
    return _texts(column) if pa.types.is_string(kind) or pa.types.is_large_string(kind) else None


def _texts(column: Any) -> np.ndarray[Any, Any] | None:
    """Texts; None if they are too long."""
    texts = [text or "" for text in column.to_pylist()]
    longest = max(map(len, texts), default=0)
    return np.array(texts, dtype=np.str_) if 4 * longest * len(texts) < 100_000_000 else None


def _units(schema: pa.Schema) -> dict[str, str]:
    """Units from the fields' metadata, pandas' `attrs`, or the names."""
    units = {name: unit for name in schema.names if (unit := stated_unit(name)) is not None}
    attributes = (schema.metadata or {}).get(b"PANDAS_ATTRS", b"{}")
    try:
        stored = json.loads(attributes)
        stored_units = stored.get("units", {}) if isinstance(stored, dict) else {}
    except (ValueError, RecursionError):
        stored_units = {}
    if isinstance(stored_units, dict):
        units |= {str(n): u for n, u in stored_units.items() if isinstance(u, str)}
    for field in schema:
        for key in (b"unit", b"units"):
            text = (field.metadata or {}).get(key)
            if text:
                units[field.name] = text.decode("utf-8", errors="replace")
    return units


def _unreadable(file: Path, error: Exception) -> InputError:
    message = str(error).splitlines()[0][:200] if str(error) else type(error).__name__
    return InputError(f"not a readable Parquet file: {message}", file=file)


SOURCE = Source(
    name="a Parquet file (.parquet)",
    recognises=lambda path: path.suffix.lower() in (".parquet", ".pq") and path.is_file(),
    read=_read,
)
