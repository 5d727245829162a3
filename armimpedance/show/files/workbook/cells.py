"""What a cell of a workbook holds: every double in full, every text a text.

A sheet is XML. What XML forbids (control characters) is written as the standard says, ``_x0007_``,
and a text that looks so already is kept apart. A text is never a formula.
"""

from __future__ import annotations

import math
import re
from numbers import Integral, Real
from typing import Any, Final

from armimpedance.core.errors import InputError

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

    Parameters
    ----------
    value : Any
        A number that is none (NaN) is an empty cell; infinity, and a whole number of more digits
        than a double has, is a text.

    Returns
    -------
    text, truth, number or None
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

    Parameters
    ----------
    text : str
    row, column : int, str
        Where it stands, for the message.

    Returns
    -------
    str

    Raises
    ------
    InputError
        It is longer than a cell can hold, or holds half a character.
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
