"""Cells with special notations of numbers: 1.000,5 and 10:30:00.25, 1.0D-03, typographic minus."""

from __future__ import annotations

import re
from datetime import date
from functools import cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.arrays import FloatArray

#: Marks between thousands, in addition to the other decimal mark: three kinds of blanks, and the
#: apostrophe of Swiss programs.
_BLANKS: Final = " \u00a0\u202f'\u2019"
#: Typographic minus, which spreadsheets write.
MINUS: Final = "\u2212"
#: Exponent of a number in Fortran's notation.
FORTRAN: Final = r"(\.\d*)[dD]([+-]\d\d\d?)$"
#: A time of day, with or without its date.
_STAMP: Final = re.compile(
    r"(?:(\d{4})-(\d\d)-(\d\d)[T ])?(\d{1,2}):(\d\d):(\d\d)(?:[.,](\d{1,9}))?(Z|[+-]\d\d:?\d\d)?"
)
_DAY_S: Final = 86_400.0


def is_grouped(cell: str, decimal: str) -> bool:
    """Return True if a cell is certainly a number with marks between thousands.

    ``1.000,5`` and ``1.000.000`` are thousands; ``1.000`` may be one.
    """
    return bool(_grouped(decimal, sure=True).fullmatch(cell))


@cache
def _grouped(decimal: str, *, sure: bool) -> re.Pattern[str]:
    mark = f"[{re.escape('.' if decimal == ',' else ',')}{_BLANKS}]"
    rest = re.escape(decimal)
    first, group = r"[+-]?[1-9]\d{0,2}", rf"(?P<mark>{mark})\d{{3}}(?:(?P=mark)\d{{3}})"
    if sure:
        return re.compile(rf"{first}{group}*{rest}\d+|{first}{group.replace('mark', 'same')}+")
    return re.compile(rf"{first}{group}*(?:{rest}\d*)?")


def without_groups(cells: list[str], decimal: str) -> FloatArray | None:
    """Parse numbers some of which have marks between thousands, or return None.

    None: a cell is no number, no cell certainly has marks, or a number above a thousand lacks them.

    `cells`: "" for a missing value.
    """
    if not any(is_grouped(cell, decimal) for cell in cells):
        return None
    small = re.compile(rf"[+-]?(?:\d{{1,3}}(?:{re.escape(decimal)}\d*)?|{re.escape(decimal)}\d+)")
    values = np.full(len(cells), np.nan)
    for i, cell in enumerate(cells):
        if not cell:
            continue
        if _grouped(decimal, sure=False).fullmatch(cell):
            cell = re.sub(rf"[{re.escape('.' if decimal == ',' else ',')}{_BLANKS}]", "", cell)
        elif not small.fullmatch(cell):
            return None
        values[i] = float(cell.replace(decimal, "."))
    return values


def seconds_of_stamps(cells: NDArray[np.str_]) -> FloatArray | None:
    """Convert times of day, or dates with times, to seconds from the midnight before the first.

    `cells` (N,).
    Returns: (N,) NaN for empty cells; None if a cell is no such stamp, or all are the same.
    """
    filled = cells[cells != ""]
    if not len(filled) or not all(_STAMP.fullmatch(c) for c in (filled[0], filled[-1])):
        return None
    stamps = [_STAMP.fullmatch(cell) for cell in filled.tolist()]
    if None in stamps or (filled == filled[0]).all():
        return None
    try:
        days = np.array([_day(stamp) for stamp in stamps if stamp])
    except ValueError:  # no such day
        return None
    seconds = np.array([_second(stamp) for stamp in stamps if stamp])
    if (days == days[0]).all():  # a clock without dates restarts at midnight
        days = np.concatenate([[0], np.cumsum(np.diff(seconds) < -_DAY_S / 2)])
    values = np.full(len(cells), np.nan)
    values[cells != ""] = (days - days[0]) * _DAY_S + seconds
    return values


def _day(stamp: re.Match[str]) -> int:
    year, month, day = stamp.group(1, 2, 3)
    return date(int(year), int(month), int(day)).toordinal() if year else 0


def _second(stamp: re.Match[str]) -> float:
    hours, minutes, seconds = (int(part) for part in stamp.group(4, 5, 6))
    return 3600.0 * hours + 60.0 * minutes + seconds + float(f"0.{stamp.group(7) or 0}")
