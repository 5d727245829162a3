"""The sheets of a workbook: which there are, and what stands in each."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from numbers import Integral, Real
from statistics import median
from typing import Any, Final

from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding
from armimpedance.show.files.content import Content, Quantity, of_one_cell
from armimpedance.show.files.words import RowAxes, meaning_of

# What a cell of a workbook holds: every double in full, every text a text.
#
# A sheet is XML. What XML forbids (control characters) is written as the standard says,
# ``_x0007_``, and a text that looks so already is kept apart. A text is never a formula.

#: What Excel holds at most.
MOST_ROWS: Final = 1_048_576
MOST_COLUMNS: Final = 16_384
LONGEST_TEXT: Final = 32_767
#: Whole numbers beyond this lose digits: a spreadsheet shows and edits fifteen.
_LARGEST_WHOLE: Final = 10**15
_FORBIDDEN: Final = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff]|_(?=x[0-9A-Fa-f]{4}_)")

Cell = str | bool | float | int | None


def plain(value: Any) -> Cell:
    """A cell's value as a workbook can hold it.

    `value`: a number that is none (NaN) is an empty cell; infinity, and a whole number of more
    digits than a double has, is a text.
    """
    if value is None or isinstance(value, str):
        return value
    # truths of NumPy have no common parent with Python's
    if isinstance(value, bool) or type(value).__name__ in ("bool_", "bool"):
        return bool(value)
    if isinstance(value, Integral):
        whole = int(value)
        return whole if abs(whole) <= _LARGEST_WHOLE else str(whole)
    if isinstance(value, Real):
        double = float(value)
        if math.isinf(double):
            return "inf" if double > 0 else "-inf"
        return None if math.isnan(double) else double
    return str(value)


def as_xml_text(text: str, row: int, column: str) -> str:
    """A text as it stands in a sheet.

    `row`, `column`: where it stands, for the message.
    Raises InputError: it is longer than a cell can hold, or holds half a character.
    """
    if len(text) > LONGEST_TEXT:
        raise InputError(
            f"a text of {len(text)} characters",
            row=row,
            column=column,
            expected=f"at most {LONGEST_TEXT} in a cell of a workbook; a .csv or .json holds more",
        )
    text.encode("utf-8")
    return _FORBIDDEN.sub(lambda match: f"_x{ord(match[0]):04X}_", text)


#: Digits that are shown of a number, and of half an interval.
_DIGITS: Final = 4
_DIGITS_OF_HALF: Final = 2
#: Columns whose texts may be of any length.
_LONG_TEXTS: Final = (
    "covariance",
    "shared_errors",
    "warnings",
    "provenance",
    "notes",
    "reason",
    "verdict",
)
_MOST_DECIMALS: Final = 8


@dataclass(frozen=True)
class SheetColumn:
    """One column of a sheet.

    `width`: in characters.
    `decimals`: that are shown of its numbers; all of them are stored. None: as they come.
    `wrapped`: whether a long text is broken into lines.
    `numbers`: whether its cells are numbers: then its name stands at the right, as they do.
    `by_row`: whether the sheet says row by row how many decimals are shown.
    """

    name: str
    width: float = 12
    decimals: int | None = None
    wrapped: bool = False
    numbers: bool = False
    by_row: bool = False

    def lines(self, cell: Any) -> int:
        """The lines that a cell takes."""
        wrapped = self.wrapped and isinstance(cell, str)
        return max(1, math.ceil(1.15 * len(cell) / self.width)) if wrapped else 1


@dataclass(frozen=True)
class Sheet:
    """One sheet.

    `rows`: cells in the order of the columns.
    `decimals` sequence of (int or None): row by row, for the columns that ask for it.
    `frozen`: columns that stay when the sheet is scrolled sideways.
    """

    name: str
    columns: tuple[SheetColumn, ...]
    rows: Sequence[Sequence[Any]]
    decimals: Sequence[int | None] = ()
    frozen: int = 0


def sheets_of(content: Content) -> list[Sheet]:
    """Results, intervals, checks, methods, provenance, columns; empty sheets are left out.

    Returns: the first is the table.
    """
    found = [
        _results(content),
        _intervals(content),
        _checks(content),
        _methods(content),
        _provenance(content),
        _columns(content),
    ]
    return [found[0], *(sheet for sheet in found[1:] if sheet.rows)]


def _results(content: Content) -> Sheet:
    """The table as it stands in a CSV file: the same names, so that scripts find them."""
    columns = []
    for name in content.columns:
        values = [plain(row.get(name)) for row in content.rows]
        numbers = [v for v in values if isinstance(v, float)]
        texts = [v for v in values if isinstance(v, str)]
        widest = max((len(text) for text in texts), default=8)
        limit = 24 if name in _LONG_TEXTS else 40
        width = max(len(name) + 3, min(widest + 2, limit), 10)
        columns.append(
            SheetColumn(
                name, width, _decimals_of_column(numbers), numbers=not texts and any(values)
            )
        )
    rows = [[row.get(name) for name in content.columns] for row in content.rows]
    return Sheet("results", tuple(columns), rows, frozen=_leading_texts(content))


def _leading_texts(content: Content) -> int:
    """Number of leading text columns, which name the row: at most two."""
    first = [content.rows[0].get(name) for name in content.columns[:2]] if content.rows else []
    return next((i for i, cell in enumerate(first) if not isinstance(cell, str)), len(first))


def _intervals(content: Content) -> Sheet:
    """One row a quantity that has an interval or a standard error."""
    within = [one for one in content.long if one.lower is not None or one.sd is not None]
    ordered = sorted(within, key=lambda one: one.lower is None)
    keys = tuple(dict.fromkeys(name for one in ordered for name in one.keys))
    more = tuple(dict.fromkeys(name for one in ordered for name in one.more))
    columns = (
        *_key_columns(keys, [one.keys for one in ordered]),
        _fitted("what it is", [one.words for one in ordered], most=60),
        _fitted("symbol", [one.quantity for one in ordered]),
        *(
            SheetColumn(n, 13, numbers=True, by_row=True)
            for n in ("value", "lower 95 %", "upper 95 %")
        ),
        _fitted("unit", [one.unit for one in ordered]),
        SheetColumn("standard error", 16, numbers=True, by_row=True),
        *_key_columns(more, [one.more for one in ordered]),
    )
    rows = [_interval_cells(one, keys, more) for one in ordered]
    decimals = [_decimals_of(one) for one in ordered]
    return Sheet("intervals", columns, rows, decimals, frozen=min(len(keys), 1))


def _key_columns(names: Sequence[str], cells: Sequence[Mapping[str, Any]]) -> list[SheetColumn]:
    return [_fitted(name, [row.get(name) for row in cells]) for name in names]


def _interval_cells(one: Quantity, keys: Sequence[str], more: Sequence[str]) -> list[Any]:
    return [
        *map(one.keys.get, keys),
        *(one.words, one.quantity, one.value, one.lower, one.upper, one.unit, one.sd),
        *map(one.more.get, more),
    ]


def _fitted(name: str, cells: Sequence[Any], most: float = 40) -> SheetColumn:
    texts = [cell for cell in cells if isinstance(cell, str)]
    widest = max(map(len, texts), default=8)
    decimals = _decimals_of_column([cell for cell in cells if isinstance(cell, float)])
    return SheetColumn(
        name, max(len(name) + 3, min(widest + 2, most), 9), decimals, numbers=not texts
    )


def _checks(content: Content) -> Sheet:
    """The sheet of checks: those of the data, then the warnings of the rows."""
    sentences = {check.sentence for check in content.about.checks}
    rows: list[list[Any]] = [_check(check) for check in content.about.checks]
    for warning, groups in _of_rows(content, "warnings").items():
        if warning not in sentences:
            rows.append(["warning", "", warning, "", _some(groups, len(content.rows))])
    columns = (
        SheetColumn("verdict", 13),
        SheetColumn("check", 20, wrapped=True),
        SheetColumn("what was seen", 80, wrapped=True),
        SheetColumn("smallest that would have been seen", 36, wrapped=True),
        SheetColumn("where", 30, wrapped=True),
    )
    return Sheet("checks", columns, rows)


def _check(check: Finding) -> list[Any]:
    return [check.verdict, check.name, check.message, check.smallest, ""]


def _of_rows(content: Content, column: str) -> dict[str, list[str]]:
    """The sentences of a column, each with the names of the rows that have it."""
    groups_by_text: dict[str, list[str]] = {}
    naming = _naming(content)
    for row in content.rows:
        text = row.get(column)
        if isinstance(text, str) and text:
            name = ", ".join(str(row[key]) for key in naming if row.get(key) is not None)
            for sentence in of_one_cell(text):
                groups_by_text.setdefault(sentence, []).append(name)
    return groups_by_text


def _naming(content: Content) -> list[str]:
    """The columns that tell rows apart: the first that names a row, and those that differ."""
    different = [key for key in content.keys if len({str(r.get(key)) for r in content.rows}) > 1]
    return list(dict.fromkeys([*content.keys[:1], *different]))


def _some(names: Sequence[str], every: int) -> str:
    if len(names) == every and every > 1:
        return "all rows"
    different = list(dict.fromkeys(names))
    more = f" and {len(different) - 10} more" if len(different) > 10 else ""
    return ", ".join(different[:10]) + more


def _methods(content: Content) -> Sheet:
    """The methods paragraph, and how the result was made."""
    rows = [["methods", content.about.methods]] if content.about.methods else []
    rows += [[name, text] for name, text in content.about.made]
    return Sheet("methods", (SheetColumn("what", 22), SheetColumn("text", 110, wrapped=True)), rows)


def _provenance(content: Content) -> Sheet:
    """The steps that led to each row, in their order."""
    steps = _of_rows(content, "provenance")
    rows = [[step, _some(names, len(content.rows))] for step, names in steps.items()]
    columns = (SheetColumn("step", 100, wrapped=True), SheetColumn("where", 40, wrapped=True))
    return Sheet("provenance", columns, rows)


def _columns(content: Content) -> Sheet:
    """The sheet that explains each column of the results."""
    return Sheet(
        "columns",
        (SheetColumn("column", 30), SheetColumn("what it is", 70), SheetColumn("unit", 14)),
        list(_told_columns(content)),
    )


def _told_columns(content: Content) -> Iterator[list[Any]]:
    first: Any = content.rows[0] if content.rows else {}
    axes = RowAxes.of(first)
    for name in content.columns:
        means = meaning_of(name, axes, content.described)
        yield [name, means.words, means.unit]


def _decimals_of(one: Quantity) -> int | None:
    """Decimals that show two digits of half the interval, or four of the value."""
    half = one.sd
    if one.lower is not None and one.upper is not None:
        half = (one.upper - one.lower) / 2
    if half is not None and math.isfinite(half) and half > 0:
        return _decimals(half, _DIGITS_OF_HALF)
    return None if one.value is None else _decimals(one.value, _DIGITS)


def _decimals_of_column(numbers: Sequence[float]) -> int | None:
    sizes = [abs(value) for value in numbers if value and math.isfinite(value)]
    return _decimals(median(sizes), _DIGITS) if sizes else None


def _decimals(value: float, digits: int) -> int | None:
    """Decimals that show so many digits; None where a power of ten is shorter."""
    if not value or not math.isfinite(value):
        return None
    decimals = digits - 1 - math.floor(math.log10(abs(value)))
    return None if decimals > _MOST_DECIMALS or decimals < -digits - 2 else max(decimals, 0)
