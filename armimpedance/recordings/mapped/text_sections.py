"""A text file with several tables one below the other.

Vicon Nexus exports sections in this way: a line with the section's name, a line with its rate, then
header and rows as in a separate file. All sections begin at the same time. Programs that append
trial after trial repeat the header instead, often with a title above it: each part is then a run.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.core.inputs import check_regular
from armimpedance.recordings.mapped.raw_file import RawFile, RawRun, RawTable
from armimpedance.recordings.mapped.text_layout import (
    SECTIONS,
    TextLayout,
    cells_of,
    is_number,
    lines_of,
    text_beginning,
)

#: Longest line with the name of a section, empty cells included.
_LONGEST: Final = 2000
_LARGEST_BYTES: Final = 250_000_000
#: Most lines below a table that count as a remark.
_LAST_WORDS: Final = 20


def sections_of(file: Path) -> list[tuple[int, str]]:
    """Split a text into sections with their first lines, from 0; [] if it is a single table."""
    with file.open("rb") as stream:
        if not _is_name(stream.readline(_LONGEST).decode("latin-1")):
            return []
    check_regular(file, _LARGEST_BYTES, "a table in text")
    encoding, _ = text_beginning(file)
    text = lines_of(file.read_bytes().decode(encoding))
    starts = [i for i, line in enumerate(text) if _is_name(line)]
    if len(starts) < 2:
        return []
    ends = [*starts[1:], len(text)]
    return [(a, "\n".join(text[a:b]).rstrip() + "\n") for a, b in zip(starts, ends, strict=True)]


def _is_name(line: str) -> bool:
    return line.strip('\ufeff\xef\xbb\xbf \r\n,;\t"').lower() in SECTIONS


def read_sections(
    file: Path, sections: list[tuple[int, str]], read: Callable[[Path], RawFile]
) -> RawFile:
    """Read sections as one run with a table for each, on its own clock from 0.

    `read`: function that reads a file of one table.
    Raises InputError: as `read`, with the line of the whole text.
    """
    tables: list[RawTable] = []
    not_taken: list[str] = []
    for first, text in sections:
        section = _read_part(file, first, text, read)
        earlier = {name for table in tables for name in table.columns}
        tables += [
            _without_used(table, first, earlier)
            for table in section.runs[0].tables
            if table.columns
        ]
        not_taken += section.not_taken
    return RawFile((RawRun(str(file), tuple(tables)),), tuple(dict.fromkeys(not_taken)))


def _read_part(file: Path, first: int, text: str, read: Callable[[Path], RawFile]) -> RawFile:
    """Read a part that begins at a line, counted from 0; errors name the line of the whole text."""
    with TemporaryDirectory() as folder:
        part = Path(folder, file.name)
        part.write_text(text, encoding="utf-8")
        try:
            return read(part)
        except InputError as error:
            row = None if error.row is None else error.row + first
            raise InputError(
                error.problem, file=file, row=row, column=error.column, expected=error.expected
            ) from None


def repeated_headers(file: Path, layout: TextLayout) -> list[tuple[int, str]]:
    """Split a text at repeated headers, with first lines from 0; [] for a single header."""
    if not layout.has_header or file.stat().st_size > _LARGEST_BYTES:
        return []
    _, beginning = text_beginning(file)
    header = next((line for line in beginning[layout.skip - 1 :: -1] if line.strip()), "")
    data = file.read_bytes()
    if not header.strip() or data.count(header.encode(layout.encoding.removesuffix("-sig"))) < 2:
        return []
    text = lines_of(data.decode(layout.encoding))
    starts = [i for i, line in enumerate(text) if line == header]
    if len(starts) < 2:  # it was part of other lines
        return []
    starts[0] = 0
    ends = [*starts[1:], len(text)]
    return [(a, "\n".join(text[a:b]) + "\n") for a, b in zip(starts, ends, strict=True)]


def read_repeated(
    file: Path, parts: list[tuple[int, str]], read: Callable[[Path], RawFile]
) -> RawFile:
    """Read a run for each part; arguments and errors as in `read_sections`."""
    runs: list[RawRun] = []
    not_taken: list[str] = []
    for first, text in parts:
        content = _read_part(file, first, text, read)
        tables = tuple(replace(t, first_row=t.first_row + first) for t in content.runs[0].tables)
        runs.append(RawRun(str(file), tables))
        not_taken += content.not_taken
    return RawFile(tuple(runs), tuple(dict.fromkeys(not_taken)))


def without_last_words(file: Path, layout: TextLayout, row: int) -> str | None:
    """Text above a row after which no cell is a number; None if one is, or the rest is long."""
    text = lines_of(file.read_bytes().decode(layout.encoding))
    tail = text[row - 1 :]
    cells = [cell for line in tail for cell in cells_of(line, layout.delimiter)]
    if len(tail) > _LAST_WORDS or any(is_number(cell, layout.decimal) for cell in cells):
        return None
    return "\n".join(text[: row - 1]) + "\n"


def _without_used(table: RawTable, first: int, used: set[str]) -> RawTable:
    """Remove columns that an earlier section has, such as frames, and add times from the rate."""
    columns = {name: column for name, column in table.columns.items() if name not in used}
    time = table.time_s
    if time is None and table.rate_hz is not None:
        time = np.arange(table.rows) / table.rate_hz
    return replace(table, columns=columns, time_s=time, first_row=table.first_row + first)
