"""Texts that a spreadsheet would run as a formula, and how a CSV file keeps them text.

A cell that begins with ``=``, ``+``, ``-``, ``@``, a tab or a line break is a formula to Excel and
LibreOffice, whatever the quotes around it: ``=cmd|...`` in the name of a condition would run. Such
a text stands in a CSV file with an apostrophe before it, and so does a text that begins with an
apostrophe before one of these; `unguarded` takes exactly these apostrophes off again. Numbers,
also those that are text (``-5``), stay as they are. Standard library only.
"""

from __future__ import annotations

import re
from typing import Any, Final

#: What a formula begins with; the wide forms are for spreadsheets in East Asian languages.
_STARTS: Final = "=+-@\t\r\n\uff1d\uff0b\uff0d\uff20"
_NUMBER: Final = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-](inf|nan)")
_MARK: Final = "'"


def runs_as_formula(text: str) -> bool:
    """Whether a spreadsheet would take a text for a formula.

    Parameters
    ----------
    text : str

    Returns
    -------
    bool
    """
    return text[:1] in _STARTS and text != "" and not _NUMBER.fullmatch(text)


def guarded(cell: Any) -> Any:
    """The cell as a CSV file holds it.

    Parameters
    ----------
    cell : text, number or truth
        Only texts are changed.

    Returns
    -------
    text, number or truth
    """
    if not isinstance(cell, str):
        return cell
    marked = cell[:1] == _MARK and (cell == _MARK or cell[1] in _STARTS + _MARK)
    return _MARK + cell if marked or runs_as_formula(cell) else cell


def unguarded(text: str) -> str:
    """The text that `guarded` was given; a text that it did not change comes back as it is.

    Parameters
    ----------
    text : str
        A cell of a CSV file.

    Returns
    -------
    str
    """
    guard = text[:1] == _MARK and len(text) > 1 and text[1] in _STARTS + _MARK
    return text[1:] if guard else text
