"""Small tables in delimited text: one reader of their lines for all layouts.

Tables of samples are read by Arrow (`recordings.tables.number_table`, `recordings.sources.csv`);
where one fails, these lines name the cell.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final, TextIO

from armimpedance.core.errors import InputError
from armimpedance.core.inputs import check_regular


@dataclass(frozen=True)
class Delimited:
    """Layout of a table in text.

    `delimiter`: the character between cells.
    `quoted`: whether a cell may be in quotation marks.
    `comment`: beginning of comment lines, which are skipped; "" if there are none.
    `blank`: whether rows of empty cells are skipped; empty lines always are.
    """

    delimiter: str = ","
    quoted: bool = True
    comment: str = ""
    blank: bool = False

    @property
    def words(self) -> str:
        """Text on the delimiter for an error message; "" for commas."""
        return ", with tabs between them" if self.delimiter == "\t" else ""


CSV: Final = Delimited()
TSV: Final = Delimited("\t", quoted=False, blank=True)


@dataclass(frozen=True)
class TextTable:
    """A header and rows of as many cells, each row with its line as an editor shows it."""

    file: Path
    header: tuple[str, ...]
    lines: tuple[int, ...]
    rows: tuple[list[str], ...]

    def dicts(self) -> list[dict[str, str]]:
        """Rows as dictionaries, keyed by the names of the columns."""
        return [dict(zip(self.header, cells, strict=True)) for cells in self.rows]


@contextmanager
def opened_text(file: Path, errors: str = "strict") -> Iterator[TextIO]:
    """Open a file of UTF-8 text, with or without a byte-order mark."""
    check_regular(file)
    try:
        stream = file.open(encoding="utf-8-sig", errors=errors, newline="")
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=file) from None
    with stream:
        yield stream


def numbered_rows(
    stream: TextIO, file: Path, layout: Delimited = CSV
) -> Iterator[tuple[int, list[str]]]:
    """Yield the line number and the cells of every line that is not skipped.

    Raises InputError: quotation marks that are not closed, or bytes that are not UTF-8.
    """
    reader = (
        csv.reader(stream, delimiter=layout.delimiter)
        if layout.quoted
        else csv.reader(stream, delimiter=layout.delimiter, quoting=csv.QUOTE_NONE)
    )
    try:
        for cells in reader:
            if not cells or (layout.blank and not any(cell.strip() for cell in cells)):
                continue
            if not (layout.comment and cells[0].lstrip().startswith(layout.comment)):
                yield reader.line_num, cells
    except UnicodeDecodeError:
        raise InputError("is not UTF-8 text", file=file, expected="a table") from None
    except csv.Error as error:
        raise InputError(f"not CSV: {error}", file=file, row=reader.line_num + 1) from None


def text_header(file: Path, layout: Delimited = CSV) -> tuple[str, ...]:
    """Read the names of a table's columns only; empty if the table is empty."""
    with opened_text(file) as stream:
        _, names = next(numbered_rows(stream, file, layout), (0, []))
    return tuple(name.strip() for name in names)


def read_text_table(file: Path, layout: Delimited = CSV, expected: str = "a table") -> TextTable:
    """Read a small table of texts.

    `expected`: what was expected instead of an empty file, for the message.
    Raises InputError: it cannot be read or is empty, a name appears twice, or a row has another
    number of cells than the header.
    """
    with opened_text(file) as stream:
        numbered = list(numbered_rows(stream, file, layout))
    if not numbered:
        raise InputError("is empty", file=file, expected=expected)
    (_, names), *rest = numbered
    header = tuple(name.strip() for name in names)
    check_header(file, header, layout)
    for line, cells in rest:
        if len(cells) != len(header):
            wanted = f"{len(header)}, as in the header{layout.words}"
            raise InputError(f"{len(cells)} cells", file=file, row=line, expected=wanted)
    return TextTable(file, header, tuple(line for line, _ in rest), tuple(row for _, row in rest))


def check_header(file: Path, names: Sequence[str], layout: Delimited = CSV) -> None:
    """Refuse column names that are repeated or cannot be printed, and other delimiters.

    Raises InputError: a name is wrong, or the file has other delimiters.
    """
    for name in names:
        if names.count(name) > 1 or not name.isprintable():
            problem = "appears twice in the header" if name.isprintable() else "cannot be a name"
            raise InputError(problem, file=file, row=1, column=ascii(name).strip("'"))
    others = ";\t" if layout.delimiter == "," else ""
    if len(names) == 1 and any(mark in names[0] for mark in others):
        raise InputError("no commas in the header", file=file, row=1, expected="commas as in CSV")


def number_of(cell: str) -> float | None:
    """Return the number in a cell, NaN and infinity included; None if it holds no number.

    Underscores between digits, which Python allows, are not accepted.
    """
    try:
        return None if "_" in cell else float(cell)
    except ValueError:
        return None
