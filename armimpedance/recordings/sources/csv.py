"""Text tables with any delimiter, decimal mark and header, from labs and spreadsheets."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv

from armimpedance.core.errors import InputError
from armimpedance.core.findings import not_taken
from armimpedance.recordings.mapped.evidence import read_name
from armimpedance.recordings.mapped.raw_file import (
    RawColumn,
    RawFile,
    RawRun,
    RawTable,
    Source,
    Wanted,
)
from armimpedance.recordings.mapped.text_clocks import distinct_names, tables_of_clocks
from armimpedance.recordings.mapped.text_layout import (
    MISSING,
    TextLayout,
    cells_of,
    lines_of,
    text_layout,
)
from armimpedance.recordings.mapped.text_numbers import (
    FORTRAN,
    MINUS,
    seconds_of_stamps,
    without_groups,
)
from armimpedance.recordings.mapped.text_sections import (
    read_repeated,
    read_sections,
    repeated_headers,
    sections_of,
    without_last_words,
)

_ENDINGS: Final = (".csv", ".tsv", ".txt", ".dat", ".asc", ".lvm")
#: The most bytes in a column of texts, each row as wide as the longest cell.
_LARGEST_TEXTS: Final = 100_000_000
#: Tables with more columns hold the samples in a row.
_MOST_COLUMNS: Final = 20_000
#: The ending of OpenSim's coordinates that are lengths.
_TRANSLATION: Final = re.compile(r"_t[xyz]$", re.I)
#: Arrow reads a file in pieces of this size; no line is longer.
_BLOCK_BYTES: Final = 4_000_000


def _read(file: Path, wanted: Wanted) -> RawFile:
    if sections := sections_of(file):
        return read_sections(file, sections, lambda part: _read_one(part, wanted))
    try:
        return _read_one(file, wanted)
    except _HeaderAgainError as found:
        return read_repeated(file, found.parts, lambda part: _read(part, wanted))


class _HeaderAgainError(Exception):
    """A table repeats its header: `parts` are the result of `repeated_headers`."""

    def __init__(self, parts: list[tuple[int, str]]) -> None:
        super().__init__()
        self.parts = parts


def _read_one(file: Path, wanted: Wanted) -> RawFile:
    """Read a text with one table; a remark below its rows is not taken."""
    layout = text_layout(file)
    try:
        return _read_table(file, wanted, layout)
    except InputError as error:
        without_end = None if error.row is None else without_last_words(file, layout, error.row)
        if without_end is None:
            raise
    with TemporaryDirectory() as folder:
        part = Path(folder, file.name)
        part.write_text(without_end, encoding=layout.encoding)
        result = _read_table(part, wanted, layout)
    remarks = (
        *result.not_taken,
        "Lines below the rows of a table hold no number and were left out.",
    )
    return RawFile((replace(result.runs[0], name=str(file)),), remarks)


def _read_table(file: Path, wanted: Wanted, layout: TextLayout) -> RawFile:
    names, clocks = _names(file, layout)
    chosen = [name for name in names if wanted(name) or name in clocks]
    skipped = [name for name in names if name not in chosen]
    index = {name: i for i, name in enumerate(names)}
    if not chosen:
        return RawFile((RawRun(str(file), (RawTable({}),)),), _skipped(skipped))
    table = _table(file, layout, names, chosen)
    columns, too_long = {}, []
    for name in chosen:
        unit = layout.units[index[name]] or _unit_of_angle(name, layout)
        values = _values(table.column(name), layout.decimal)
        if values is None:
            too_long.append(name)
        elif layout.names[index[name]] or not _is_empty(values):
            # Rows that end with a delimiter create an empty column without a name.
            columns[name] = RawColumn(values, unit)
    tables = tables_of_clocks(columns, clocks, layout.skip + 1, layout.rate_hz)
    remarks = (*_skipped(skipped), *not_taken(too_long, "its texts are too long"))
    return RawFile((RawRun(str(file), tables),), remarks)


def _unit_of_angle(name: str, layout: TextLayout) -> str | None:
    """The unit of all angles in the file; None for positions and times."""
    if layout.angle_unit is None or _TRANSLATION.search(name):
        return None
    return layout.angle_unit if read_name(name).role in ("angle", "unknown") else None


def _skipped(names: Sequence[str]) -> tuple[str, ...]:
    return not_taken(names, "the mapping gives them no meaning")


def _names(file: Path, layout: TextLayout) -> tuple[list[str], dict[str, list[str]]]:
    """Unique names for all columns, and the channels of each time column."""
    if len(layout.names) > _MOST_COLUMNS:
        problem = f"{len(layout.names)} columns"
        raise InputError(problem, file=file, expected=f"at most {_MOST_COLUMNS}: one row a sample")
    names = [name or f"column {i}" for i, name in enumerate(layout.names, start=1)]
    for name in names:
        if not name.isprintable():
            shown = ascii(name).strip("'")
            raise InputError("cannot be a name", file=file, row=layout.skip, column=shown)
    return distinct_names(names)


def _table(file: Path, layout: TextLayout, names: list[str], chosen: list[str]) -> pa.Table:
    """The cells of the wanted columns, as numbers where the first rows hold numbers."""
    numbers = {n for n, text in zip(names, layout.texts, strict=True) if not text}
    try:
        return _parsed(file, layout, names, chosen, numbers)
    except pa.ArrowInvalid:
        if parts := repeated_headers(file, layout):
            raise _HeaderAgainError(parts) from None
    except (pa.ArrowException, OSError, ValueError, UnicodeError) as error:
        raise _unreadable(file, error) from None
    try:
        # A later cell is not a number: read as texts, so that only its column is affected.
        return _parsed(file, layout, names, chosen, set())
    except (pa.ArrowException, OSError, ValueError, UnicodeError) as error:
        raise _bad_line(file, layout, len(names)) or _unreadable(file, error) from None


def _parsed(
    file: Path, layout: TextLayout, names: list[str], chosen: list[str], numbers: set[str]
) -> pa.Table:
    source: Any = file
    delimiter, encoding, skip = layout.delimiter, layout.encoding, layout.skip
    if delimiter == " ":
        text = file.read_text(encoding=encoding)
        lines = lines_of(text)[skip:]
        source = io.BytesIO("\n".join(" ".join(line.split()) for line in lines).encode())
        encoding, skip = "utf-8", 0
    return pyarrow.csv.read_csv(
        source,
        read_options=pyarrow.csv.ReadOptions(
            column_names=names, skip_rows=skip, encoding=encoding, block_size=_BLOCK_BYTES
        ),
        parse_options=pyarrow.csv.ParseOptions(delimiter=delimiter),
        convert_options=pyarrow.csv.ConvertOptions(
            column_types={n: pa.float64() if n in numbers else pa.string() for n in names},
            include_columns=chosen,
            null_values=list(MISSING),
            quoted_strings_can_be_null=True,
            strings_can_be_null=False,
            decimal_point=layout.decimal,
        ),
    )


def _values(column: pa.ChunkedArray, decimal: str) -> np.ndarray[Any, Any] | None:
    """A column as numbers, or as texts if a cell is not a number; None if texts are too long."""
    if pa.types.is_floating(column.type):
        return np.asarray(column.to_numpy(), dtype=np.float64)
    texts = pc.utf8_trim_whitespace(column)
    missing = pc.is_in(texts, value_set=pa.array(MISSING))
    numbers = pc.if_else(missing, pa.scalar(None, pa.string()), texts)
    if decimal == ",":
        numbers = pc.replace_substring(numbers, ",", ".")
    numbers = pc.replace_substring(numbers, MINUS, "-")
    numbers = pc.replace_substring_regex(numbers, FORTRAN, r"\1e\2")
    try:
        return np.asarray(numbers.cast(pa.float64()).to_numpy(), dtype=np.float64)
    except pa.ArrowInvalid:
        pass
    grouped = without_groups(pc.if_else(missing, "", texts).to_pylist(), decimal)
    if grouped is not None:
        return grouped
    longest = pc.max(pc.utf8_length(texts)).as_py() or 1
    if 4 * longest * len(texts) > _LARGEST_TEXTS:
        return None
    cells = np.array(texts.to_pylist(), dtype=np.str_)
    stamps = seconds_of_stamps(cells)
    return cells if stamps is None else stamps


def _is_empty(values: np.ndarray[Any, Any]) -> bool:
    return values.dtype.kind == "f" and bool(np.isnan(values).all())


def _bad_line(file: Path, layout: TextLayout, width: int) -> InputError | None:
    """An error for the first line with a wrong number of cells."""
    with file.open(encoding=layout.encoding, errors="replace", newline=None) as stream:
        for number, line in enumerate(stream, start=1):
            cells = cells_of(line.rstrip("\n"), layout.delimiter)
            if number > layout.skip and line.strip() and len(cells) != width:
                expected = f"{width}, as above"
                return InputError(f"{len(cells)} cells", file=file, row=number, expected=expected)
    return None


def _unreadable(file: Path, error: Exception) -> InputError:
    message = str(error).splitlines()[0][:200] if str(error) else type(error).__name__
    return InputError(
        f"is no readable table: {message}", file=file, expected="rows of equal length"
    )


SOURCE = Source(
    name="a table of text (.csv, .tsv, .txt, .dat, .asc, .lvm)",
    recognises=lambda path: path.suffix.lower() in _ENDINGS and path.is_file(),
    read=_read,
)
