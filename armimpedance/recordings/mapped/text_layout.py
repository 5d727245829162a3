"""Layout of a table of text: encoding, delimiter, decimal mark, names, units, first row."""

from __future__ import annotations

import codecs
import csv
import math
import re
from collections import Counter
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Final

from armimpedance.core.delimited import number_of
from armimpedance.core.errors import InputError
from armimpedance.recordings.mapped.mapping import known_unit
from armimpedance.recordings.mapped.text_numbers import MINUS, is_grouped

#: Part of the file from which the layout is determined: bytes, lines, and length of a line.
HEAD_BYTES: Final = 2_000_000
_LINES: Final = 300
_LONGEST_LINE: Final = 500_000
#: Number of similar rows with which a table begins.
_ROWS: Final = 5
_DELIMITERS: Final = (",", ";", "\t", "|", " ")
#: Texts for a missing value.
MISSING: Final = ("", "nan", "NaN", "NAN", "-nan", "NA", "N/A", "#N/A", "null", "NULL", "None", "-")
#: Names of the sections of an export by Vicon Nexus; the next line has the rate.
SECTIONS: Final = ("trajectories", "devices", "model outputs", "joints", "segments")
_RATE: Final = re.compile(r"(?:sampl\w*|frame|capture|export|data)[ _]*(?:rate|freq)", re.I)
#: A rate in a separate line: ``fs: 1000 Hz``, ``# sampling rate = 2 kHz``.
_RATE_SAID: Final = re.compile(
    rf"(?:fs|{_RATE.pattern}\w*)\s*(?:[\[(]?hz[\])]?)?\s*[:=]\s*(\d+\.?\d*)\s*(k?)(?:hz)?", re.I
)
_IN_DEGREES: Final = re.compile(r"\bin_?degrees\W+(yes|no)\b", re.I)
_COMMENT: Final = re.compile(r"^\s*(?:#+|%+|//+)\s?")
#: A number, with typographic minus or Fortran's exponent: 1.0D-03.
_NUMBER: Final = re.compile(
    rf"[+{MINUS}-]?(?:\d+\.\d*D[+-]\d\d\d?|(?:\d+\.?\d*|\.\d+)(?:E[+{MINUS}-]?\d+)?)"
    r"|[+-]?inf(?:inity)?",
    re.I,
)
_IN_BRACKETS: Final = re.compile(r"^(.*?)\s*[\[(]\s*([^\[\]()]*?)\s*[\])]\s*$")
_AFTER_SLASH: Final = re.compile(r"^(.*?)(?:\s*/\s*|\s+in\s+)(\S+)\s*$")


#: A cell such as ``0.12 m``.
_NUMBER_WITH_UNIT: Final = re.compile(
    r"(?:^|[,;\t])\s*\"?([-+]?\d+(?:[.,]\d+)? ?[A-Za-z°%/]+)\"?\s*(?:$|[,;\t])"
)


@dataclass(frozen=True)
class TextLayout:
    """Layout of a table of text.

    `encoding`: name of the encoding in Python.
    `delimiter`: one character; a blank stands for any number of blanks.
    `names`: names of the columns; "" for a column without a name.
    `units`: units as stated.
    `skip`: number of lines before the first row of numbers.
    `texts`: for each column, True if it holds texts in the first rows.
    `rate_hz`: the rate, if a line above the header states it, as in Nexus and Motive.
    `angle_unit`: unit of angles, if a line above the header states it, as in OpenSim.
    """

    encoding: str
    delimiter: str
    decimal: str
    names: tuple[str, ...]
    units: tuple[str | None, ...]
    skip: int
    has_header: bool
    texts: tuple[bool, ...]
    rate_hz: float | None = None
    angle_unit: str | None = None


@dataclass(frozen=True)
class _Try:
    """A delimiter and a decimal mark, and the table that results from them."""

    delimiter: str
    decimal: str
    first: int
    score: tuple[bool, int, float, int]
    width: int


def text_layout(file: Path) -> TextLayout:
    """Determine the layout of a table from its beginning.

    Raises InputError: the file is empty or no text, or its beginning has no rows of numbers.
    """
    encoding, lines = text_beginning(file)
    stated = re.fullmatch(r'"?sep=(.)"?', lines[0].strip("\ufeff ").lower() or "-")
    # only delimiters that occur are tried
    present = [d for d in _DELIMITERS if any(d in line for line in lines)] or [","]
    delimiters = [stated.group(1)] if stated else present
    marks = ".," if "," in present else "."
    tries = [t for d in delimiters for mark in marks if (t := _try(lines, d, mark)) is not None]
    if not tries:
        with_unit = next(filter(None, map(_NUMBER_WITH_UNIT.search, lines)), None)
        if with_unit is not None:
            problem = f"{with_unit.group(1)!r} is no number: a unit stands behind it"
            raise InputError(problem, file=file, expected="numbers alone, units in the header")
        expected = "a table with at least half of its cells numbers, below its header"
        raise InputError("no rows of numbers in its beginning", file=file, expected=expected)
    best = max(tries, key=lambda t: t.score)
    names, units, header = _header(lines, best)
    return TextLayout(
        encoding,
        best.delimiter,
        best.decimal,
        names,
        units,
        best.first,
        header,
        _texts(lines, best),
        _stated_rate(lines[: best.first], best.delimiter),
        _angle_unit(lines[: best.first]),
    )


def text_beginning(file: Path) -> tuple[str, list[str]]:
    """Read the beginning of a file; return encoding and lines."""
    encoding, text, is_complete = _head(file)
    lines = lines_of(text)
    if len(lines) > 1 and not is_complete:
        lines = lines[:-1]
    while lines and not lines[-1].strip():
        lines.pop()
    if not lines:
        raise InputError("is empty", file=file, expected="a header and rows of numbers")
    lines = lines[:_LINES]
    if max(map(len, lines)) > _LONGEST_LINE:
        problem = f"a line of more than {_LONGEST_LINE} characters"
        raise InputError(problem, file=file, expected="one row a sample")
    return encoding, lines


def lines_of(text: str) -> list[str]:
    """Split a text into lines, as an editor counts them."""
    return re.split(r"\r\n|\n|\r", text)


def _texts(lines: list[str], table: _Try) -> tuple[bool, ...]:
    """True for each column that holds something other than numbers."""
    plain = _all_numbers(table.delimiter, table.decimal)
    below = (line for line in lines[table.first :] if not plain.fullmatch(line))
    rows = [cells_of(line, table.delimiter) for line in below]
    return tuple(
        any(not _is_value(row[i], table.decimal) for row in rows if i < len(row))
        for i in range(table.width)
    )


def cells_of(line: str, delimiter: str) -> list[str]:
    """Split a line into cells, without blanks around them."""
    if delimiter == " ":
        return line.split()
    if line and '"' not in line and len(line) < csv.field_size_limit():
        return [cell.strip() for cell in line.split(delimiter)]
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])]
    except csv.Error:
        return []


def stated_unit(name: str) -> str | None:
    """Return the unit that a name states: ``Fx [N]``, ``x (mm)``, ``x / mm``, ``F in N``."""
    for pattern in (_IN_BRACKETS, _AFTER_SLASH):
        match = pattern.match(name)
        if match and match.group(1) and known_unit(match.group(2)) is not None:
            return match.group(2)
    match = _IN_BRACKETS.match(name)
    if match and match.group(1).strip() and re.search(r"[^\W\d_]", match.group(2)):
        return match.group(2)
    return None


def _head(file: Path) -> tuple[str, str, bool]:
    """Encoding and text of a file's beginning, and whether that is the whole file."""
    try:
        with file.open("rb") as stream:
            data = stream.read(HEAD_BYTES + 1)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=file) from None
    is_complete, data = len(data) <= HEAD_BYTES, data[:HEAD_BYTES]
    for mark, name in (
        (codecs.BOM_UTF8, "utf-8-sig"),
        (codecs.BOM_UTF16_LE, "utf-16"),
        (codecs.BOM_UTF16_BE, "utf-16"),
    ):
        if data.startswith(mark):
            return name, _decoded(data, name, file), is_complete
    if b"\0" in data[:4000]:
        even_zeros, odd_zeros = data[:4000:2].count(0), data[1:4000:2].count(0)
        if (
            max(even_zeros, odd_zeros) < 0.3 * len(data[:4000]) / 2
            or min(even_zeros, odd_zeros) > 2
        ):
            raise InputError("is no text", file=file, expected="a table of text")
        name = "utf-16-le" if odd_zeros > even_zeros else "utf-16-be"
        return name, _decoded(data, name, file), is_complete
    try:
        return (
            "utf-8",
            codecs.getincrementaldecoder("utf-8")().decode(data, is_complete),
            is_complete,
        )
    except UnicodeDecodeError:
        # a degree sign or a mu from an older Windows program
        return "latin-1", data.decode("latin-1"), is_complete


def _decoded(data: bytes, encoding: str, file: Path) -> str:
    try:
        return codecs.getincrementaldecoder(encoding)().decode(data)
    except UnicodeDecodeError as error:
        problem = f"is not text in {encoding}: byte {error.start}"
        raise InputError(problem, file=file, expected="a table of text") from None


def _try(lines: list[str], delimiter: str, decimal: str) -> _Try | None:
    """Find the first rows of numbers with this delimiter and decimal mark; None without any."""
    if decimal == delimiter:
        return None
    rows = [cells_of(line, delimiter) for line in lines]
    numbers = _counts(lines, rows, delimiter, decimal)
    holds = [_holds_numbers(row, count) for row, count in zip(rows, numbers, strict=True)]
    widths = Counter(len(row) for row, fits in zip(rows, holds, strict=True) if fits)
    if not widths:
        return None
    # of equal counts the larger width is used: a lost cell does not make a table narrower
    width = max(widths, key=lambda w: (widths[w], w))
    fits = [
        i
        for i, (row, hold) in enumerate(zip(rows, holds, strict=True))
        if hold and len(row) == width
    ]
    usual = sorted(numbers[i] for i in fits)[len(fits) // 2]
    for first in fits:
        if 2 * numbers[first] < usual:
            continue  # a line above the header, padded with empty cells
        block = [r for r in rows[first : first + _ROWS] if len(r) == width]
        above = _above(rows, first)
        if _has_words(rows[first : first + _ROWS], numbers[first : first + _ROWS]):
            continue  # a header is still to come
        if not _begins(block, _is_named(above, holds, width), decimal):
            continue
        share = _share(block, width, decimal)
        header = bool(above) and len(above[-1][1]) in (width, width - 1)
        return _Try(delimiter, decimal, first, (header, usual, round(share, 2), width), width)
    return None


def _has_words(rows: list[list[str]], numbers: list[int]) -> bool:
    """True if one of these rows holds words and no number."""
    return any(any(row) and not count for row, count in zip(rows, numbers, strict=True))


def _counts(lines: list[str], rows: list[list[str]], delimiter: str, decimal: str) -> list[int]:
    """Number of cells of each line that are numbers."""
    plain = _all_numbers(delimiter, decimal)
    return [
        len(row) if plain.fullmatch(line) else _numbers(row, decimal)
        for line, row in zip(lines, rows, strict=True)
    ]


def _is_named(above: list[tuple[int, list[str]]], holds: list[bool], width: int) -> bool:
    """True if one of the lines above can be the header."""
    return any(len(row) == width and not holds[i] for i, row in above)


def _share(block: list[list[str]], width: int, decimal: str) -> float:
    """Share of the cells of these rows that hold a number or a missing value."""
    return sum(_is_value(c, decimal) for row in block for c in row) / (width * len(block))


def _begins(block: list[list[str]], named: bool, decimal: str) -> bool:
    """True if the table's numbers begin with the first of these rows."""
    row, *below = block
    if any(not any(_is_value(c, decimal) for c in r) for r in below):
        return False  # a header is still to come
    return named or not _names_numbers(row, below, decimal)


@cache
def _all_numbers(delimiter: str, decimal: str) -> re.Pattern[str]:
    """Pattern for a line whose cells are all numbers, which avoids testing each cell."""
    number = f"(?>{_NUMBER.pattern})".replace(r"\.", re.escape(decimal))
    around = "[ \t]*" if delimiter == " " else " *"
    between = "[ \t]+" if delimiter == " " else f"{around}{re.escape(delimiter)}{around}"
    return re.compile(f"{around}{number}(?:{between}{number})*{around}", re.I)


def _holds_numbers(row: list[str], numbers: int) -> bool:
    """True if at least half of a row's cells are numbers or missing, at least one a number."""
    return numbers > 0 and 2 * (numbers + sum(cell in MISSING for cell in row)) >= len(row)


def _numbers(row: list[str], decimal: str) -> int:
    return sum(bool(cell) and is_number(cell, decimal) for cell in row)


def _names_numbers(row: list[str], below: list[list[str]], decimal: str) -> bool:
    """True if a row holds names that are numbers, as for trials side by side."""
    words = [i for i, cell in enumerate(row) if cell and not _is_value(cell, decimal)]
    return bool(below) and any(all(is_number(r[i], decimal) for r in below) for i in words)


def _above(rows: list[list[str]], first: int) -> list[tuple[int, list[str]]]:
    return [(i, r) for i, r in enumerate(rows[:first]) if any(r)]


def _header(lines: list[str], table: _Try) -> tuple[tuple[str, ...], tuple[str | None, ...], bool]:
    """Names and units from the lines above the rows, and whether there is a header."""
    full = (_COMMENT.sub("", line) for line in lines[: table.first] if line.strip())
    fitting = [_fitted(cells_of(line, table.delimiter), table.width) for line in full]
    units: list[str] | None = None
    names = fitting.pop() if fitting else None
    if names is not None and fitting and fitting[-1] is not None and _are_units(names):
        units, names = names, fitting.pop()
    if names is None:
        return ("",) * table.width, (None,) * table.width, False
    above = [cells for cells in reversed(fitting) if cells is not None]
    # LabVIEW's units are in a separate line, far above the names
    units = units or next((cells for cells in above if cells[0] == "Y_Unit_Label"), None)
    names = _with_groups(names, above)
    stated = tuple(
        (units[i].strip("[]() ") or None) if units is not None else stated_unit(name)
        for i, name in enumerate(names)
    )
    return tuple(names), stated, True


def _with_groups(names: list[str], above: list[list[str]]) -> list[str]:
    """Extend repeated names by the cell above: a marker or device above its axes.

    `above`: lines of as many cells, the nearest first; the first line that makes the names unique
    is used.
    """
    for line in above if len(set(names)) < len(names) else ():
        group, full = "", []
        for name, over in zip(names, line, strict=True):
            group = over or group
            full.append(f"{group} {name}".strip())
        if any(line) and len(set(full)) == len(full):
            return full
    return names


def _stated_rate(above: list[str], delimiter: str) -> float | None:
    """Rate above the header: below the name of a section, or after a word for a rate."""
    cells = [[c for c in cells_of(line, delimiter) if c] for line in above]
    for row, below in zip(cells, [*cells[1:], []], strict=False):
        if len(row) == 1 and row[0].lower() in SECTIONS and len(below) == 1:
            return _rate(below[0])
        for name, value in zip(row, row[1:], strict=False):
            if _RATE.search(name) and (rate := _rate(value)) is not None:
                return rate
    for line in above:
        if match := _RATE_SAID.fullmatch(_COMMENT.sub("", line).strip(' ",;\t')):
            return _rate(match.group(1), 1000.0 if match.group(2) else 1.0)
    return None


def _angle_unit(above: list[str]) -> str | None:
    matches = [match for line in above if (match := _IN_DEGREES.search(line))]
    return None if not matches else "deg" if matches[0].group(1).lower() == "yes" else "rad"


def _rate(cell: str, unit: float = 1.0) -> float | None:
    rate = number_of(cell)
    return unit * rate if rate is not None and 0 < rate < math.inf else None


def _fitted(cells: list[str], width: int) -> list[str] | None:
    """Fit the cells of a header line to the width: one cell may be missing, or be a remark."""
    if len(cells) == width:
        return cells
    # LabVIEW's last column holds at most a remark in the first row
    if len(cells) == width + 1 and cells[-1].lower() in ("", "comment"):
        return cells[:width]
    return [*cells, ""] if len(cells) == width - 1 and width > 1 else None


def _are_units(cells: list[str]) -> bool:
    known = [known_unit(cell) is not None for cell in cells]
    bare = [not cell.strip("[]()-– ") or cell in ("a.u.", "1", "#") for cell in cells]
    bracketed = [bool(re.fullmatch(r"[\[(].*[\])]", cell)) for cell in cells]
    return any(known) and all(map(any, zip(known, bare, bracketed, strict=True)))


def is_number(cell: str, decimal: str) -> bool:
    """Return True if a cell is a number in any notation of tables of text."""
    if decimal == ",":
        if "." in cell:
            return is_grouped(cell, decimal)
        cell = cell.replace(",", ".")
    return bool(_NUMBER.fullmatch(cell)) or is_grouped(cell, decimal)


def _is_value(cell: str, decimal: str) -> bool:
    """True if a cell is a number or marks a missing value."""
    return cell in MISSING or is_number(cell, decimal)
