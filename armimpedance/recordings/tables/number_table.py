"""Numeric tables from CSV or Parquet: read fast, and read again after an error to find the cell."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq

from armimpedance.core.arrays import FloatArray, frozen
from armimpedance.core.delimited import check_header, number_of, numbered_rows, opened_text
from armimpedance.core.errors import InputError
from armimpedance.core.inputs import check_claim

#: Rows of a Parquet file that are decoded together: 32 MiB, which are freed at once.
BLOCK_ROWS: Final = 1 << 22


@dataclass(frozen=True)
class NumberTable:
    """Columns of equal length, all finite except for gaps (NaN) where allowed.

    `dropped` are other columns of the file, which are not finite numbers throughout.
    """

    file: Path
    columns: Mapping[str, FloatArray]
    dropped: tuple[str, ...] = ()

    def row(self, index: int) -> int:
        """The position of data row `index` (from 0) for messages.

        For CSV the line in an editor, counted from 1 with the header; for Parquet the data row
        counted from 1.
        """
        if self.file.suffix == ".parquet":
            return index + 1
        with _csv_reader(self.file) as rows:
            next(rows)
            for number, (line, _) in enumerate(rows):
                if number == index:
                    return line
        raise IndexError(index)


def column_names(file: Path) -> tuple[str, ...]:
    """The names of a table's columns, without reading the table.

    Raises InputError: the file is missing, empty or not a table, or a name appears twice.
    """
    if not file.is_file():
        raise InputError("no such file", file=file)
    if file.stat().st_size == 0:
        raise InputError("is empty", file=file, expected="a header and one row per sample")
    names = _parquet_names(file) if file.suffix == ".parquet" else _csv_names(file)
    check_header(file, names)
    return names


def read_numbers(
    file: Path, required: Collection[str], *, gaps: Collection[str] = ()
) -> NumberTable:
    """Read a table whose `required` columns must hold finite numbers.

    `file`: `.csv` or `.parquet`.
    `required`: columns that must exist and be numeric; other columns are kept if they are numeric.
    `gaps`: required columns in which an empty cell or NaN is a missing value.
    Raises InputError: a cell of a required column is empty, text or not finite, or the file cannot
    be read; the error names the cell.
    """
    names = column_names(file)
    missing = [name for name in required if name not in names]
    if missing:
        available = ", ".join(names[:12]) + (", …" if len(names) > 12 else "")
        raise InputError(
            "no such column", file=file, column=missing[0], expected=f"it beside {available}"
        )
    is_parquet = file.suffix == ".parquet"
    named_columns = (
        _parquet_columns(file) if is_parquet else _csv_columns(file, names, required, gaps)
    )
    columns: dict[str, FloatArray] = {}
    dropped = []
    for name, values in named_columns:
        if values is not None and len(values) == 0:
            raise InputError("holds no samples", file=file, expected="one row per sample")
        if values is not None and _is_whole(values, name in gaps):
            columns[name] = frozen(values)
        elif name not in required:
            dropped.append(name)
        elif is_parquet:
            raise _bad_parquet_cell(file, name, name in gaps)
        else:
            raise _bad_csv_cell(file, names, required, gaps)
    return NumberTable(file, columns, tuple(dropped))


def _csv_columns(
    file: Path, names: tuple[str, ...], required: Collection[str], gaps: Collection[str]
) -> Iterator[tuple[str, FloatArray | None]]:
    """The columns one by one, None for a non-numeric one; each is freed after use."""
    table = _read_csv(file, names, required, gaps)
    for name in names:
        column = table.column(0)
        table = table.remove_column(0)
        if pa.types.is_string(column.type) and len(column):
            try:
                column = column.cast(pa.float64())
            except pa.ArrowInvalid:
                yield name, None
                continue
        yield name, _joined(column.chunks)


def _parquet_columns(file: Path) -> Iterator[tuple[str, FloatArray | None]]:
    """The columns one by one, read in blocks so that no second table is in memory."""
    try:
        with pq.ParquetFile(file) as opened:
            check_claim(8 * opened.metadata.num_rows * len(opened.schema_arrow), file)
            for field in opened.schema_arrow:
                if not _is_number(field.type) and opened.metadata.num_rows:
                    yield field.name, None
                    continue
                batches = opened.iter_batches(BLOCK_ROWS, columns=[field.name])
                values = _joined(batch.column(0) for batch in batches)
                # Arrow keeps the bytes it has read for the next column; they may be the whole file.
                pa.default_memory_pool().release_unused()
                yield field.name, values
    except (pa.ArrowException, OSError, ValueError) as error:
        raise _unreadable_parquet(file, error) from None


def _is_number(kind: pa.DataType) -> bool:
    return bool(
        pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind)
    )


def _joined(chunks: Iterable[pa.Array]) -> FloatArray:
    """The chunks of a column as one array of float64, with NaN for missing values."""
    parts = [np.empty(0)]
    for chunk in chunks:
        if chunk.type != pa.float64():
            chunk = (
                chunk.cast(pa.float64(), safe=False) if len(chunk) else pa.array([], pa.float64())
            )
        # an Arrow array would keep more memory than its own
        parts.append(np.array(chunk.to_numpy(zero_copy_only=False)))
    return np.concatenate(parts)


def _is_whole(values: FloatArray, may_be_missing: bool) -> bool:
    """True if all values are finite, or missing where this is allowed."""
    return bool(
        (np.isfinite(values) | np.isnan(values) if may_be_missing else np.isfinite(values)).all()
    )


def _parquet_names(file: Path) -> tuple[str, ...]:
    try:
        return tuple(pq.read_schema(file).names)
    except (pa.ArrowException, OSError, ValueError) as error:
        raise _unreadable_parquet(file, error) from None


def _unreadable_parquet(file: Path, error: Exception) -> InputError:
    first_line = str(error).splitlines()[0] if str(error) else type(error).__name__
    return InputError(f"not a readable Parquet file: {first_line}", file=file)


def _bad_parquet_cell(file: Path, name: str, may_be_missing: bool) -> InputError:
    with pq.ParquetFile(file) as opened:
        column = opened.read(columns=[name]).column(0)
    for row, value in enumerate(column.to_pylist(), start=1):
        problem = _cell_problem("" if value is None else str(value), may_be_missing)
        if problem:
            return InputError(problem, file=file, row=row, column=name, expected="a finite number")
    return InputError(f"holds {column.type}", file=file, column=name, expected="a number type")


def _read_csv(
    file: Path, names: tuple[str, ...], required: Collection[str], gaps: Collection[str]
) -> pa.Table:
    # Names are assigned by position, as the file's names may have blanks around them. Columns that
    # are not required are read as text first, so that none of their cells can stop the reading.
    types = {name: pa.float64() if name in required else pa.string() for name in names}
    options = pa.csv.ConvertOptions(column_types=types)
    try:
        return pa.csv.read_csv(
            file,
            read_options=pa.csv.ReadOptions(column_names=list(names), skip_rows=1),
            convert_options=options,
        )
    except pa.ArrowInvalid as error:
        if "Empty CSV" in str(error):
            raise InputError("holds no samples", file=file, expected="one row each") from None
        raise _bad_csv_cell(file, names, required, gaps, str(error)) from None


def _bad_csv_cell(
    file: Path,
    names: tuple[str, ...],
    required: Collection[str],
    gaps: Collection[str],
    reason: str = "not readable",
) -> InputError:
    """Find the first wrong cell, for the message."""
    wanted = [(i, name) for i, name in enumerate(names) if name in required]
    with _csv_reader(file) as rows:
        next(rows)
        for line, cells in rows:
            if len(cells) != len(names):
                expected = f"{len(names)}, as in the header"
                return InputError(f"{len(cells)} cells", file=file, row=line, expected=expected)
            for index, name in wanted:
                problem = _cell_problem(cells[index], name in gaps)
                if problem:
                    return InputError(
                        problem, file=file, row=line, column=name, expected="a finite number"
                    )
    return InputError(reason.splitlines()[0], file=file, expected="a table of numbers")


def _cell_problem(cell: str, may_be_missing: bool) -> str:
    """The problem with a cell that must hold a finite number; "" if there is none."""
    text = cell.strip()
    if may_be_missing and text.lower() in ("", "nan"):
        return ""
    if not text:
        return "empty cell"
    value = number_of(text)
    if value is None:
        return f"not a number: {text[:40]!r}"
    return "" if math.isfinite(value) else f"not finite: {text}"


def _csv_names(file: Path) -> tuple[str, ...]:
    with _csv_reader(file) as rows:
        first = next(rows, None)
    names = tuple(cell.strip() for cell in first[1]) if first else ()
    if not any(names):
        raise InputError("has no header", file=file, expected="names of columns in the first line")
    return names


@contextmanager
def _csv_reader(file: Path) -> Iterator[Iterator[tuple[int, list[str]]]]:
    """The lines of a CSV file that are not blank, each with its line number."""
    with opened_text(file, errors="replace") as stream:
        yield numbered_rows(stream, file)
