"""Small tables in delimited text: one reader of their lines, with a described layout.

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
    """How the cells of a table stand in its lines.

    `delimiter`: what parts them.
    `quoted`: whether a cell may stand between quotation marks.
    `comment`: lines that begin so are passed over; "" where there are no such lines.
    `blank`: whether rows of empty cells are passed over, as lines without any cell always are.
    """

    delimiter: str = ","
    quoted: bool = True
    comment: str = ""
    blank: bool = False

    @property
    def words(self) -> str:
        """What a message adds on the delimiter, where it is not the usual one."""
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
        """The rows by the names of the columns."""
        return [dict(zip(self.header, cells, strict=True)) for cells in self.rows]


@contextmanager
def opened_text(file: Path, errors: str = "strict") -> Iterator[TextIO]:
    """A file of UTF-8 text, with or without a mark at its beginning."""
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
    """The lines that are not passed over, each with its number and its cells.

    Raises InputError: quotation marks that do not end, or bytes that are no UTF-8.
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
    """The names of a table's columns, without reading on; none where it is empty."""
    with opened_text(file) as stream:
        _, names = next(numbered_rows(stream, file, layout), (0, []))
    return tuple(name.strip() for name in names)


def read_text_table(file: Path, layout: Delimited = CSV, expected: str = "a table") -> TextTable:
    """A small table of texts.

    `expected`: what a message wants in the place of an empty file.
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
    """Names of columns must be different, and fit on the line of a message.

    Raises InputError: they are not, or the file has other delimiters.
    """
    for name in names:
        if names.count(name) > 1 or not name.isprintable():
            problem = "appears twice in the header" if name.isprintable() else "cannot be a name"
            raise InputError(problem, file=file, row=1, column=ascii(name).strip("'"))
    others = ";\t" if layout.delimiter == "," else ""
    if len(names) == 1 and any(mark in names[0] for mark in others):
        raise InputError("no commas in the header", file=file, row=1, expected="commas as in CSV")


def number_of(cell: str) -> float | None:
    """The number that a cell holds, NaN and infinity too; None where it holds none.

    An underscore between digits is Python's way to write numbers and no table's.
    """
    try:
        return None if "_" in cell else float(cell)
    except ValueError:
        return None
