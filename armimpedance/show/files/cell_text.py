"""Texts in one cell of a table: formulas that are kept text, several sentences in one.

A cell that begins with ``=``, ``+``, ``-``, ``@``, a tab or a line break is a formula to Excel and
LibreOffice, whatever the quotes around it: ``=cmd|...`` in the name of a condition would run. Such
a text stands in a CSV file with an apostrophe before it, and so does a text that begins with an
apostrophe before one of these; `unguarded` takes exactly these apostrophes off again. Numbers,
also those that are text (``-5``), stay as they are. Standard library only.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from itertools import chain
from typing import Any, Final

#: What a formula begins with; the wide forms are for spreadsheets in East Asian languages.
_STARTS: Final = "=+-@\t\r\n\uff1d\uff0b\uff0d\uff20"
_NUMBER: Final = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-](inf|nan)")
_MARK: Final = "'"


def runs_as_formula(text: str) -> bool:
    """Whether a spreadsheet would take a text for a formula."""
    return text[:1] in _STARTS and text != "" and not _NUMBER.fullmatch(text)


def guarded(cell: Any) -> Any:
    """The cell as a CSV file holds it.

    `cell`: only texts are changed.
    """
    if not isinstance(cell, str):
        return cell
    marked = cell[:1] == _MARK and (cell == _MARK or cell[1] in _STARTS + _MARK)
    return _MARK + cell if marked or runs_as_formula(cell) else cell


def unguarded(text: str) -> str:
    """The text that `guarded` was given; a text that it did not change comes back as it is.

    `text`: a cell of a CSV file.
    """
    guard = text[:1] == _MARK and len(text) > 1 and text[1] in _STARTS + _MARK
    return text[1:] if guard else text


# Several sentences in one cell of a table, and out of it again; those that all rows share.

_BETWEEN: Final = "; "
_LIST: Final = re.compile(r"\d, \d")
#: A number that stands by itself, not one in a name such as "cr3".
_NUMBERED: Final = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?:e[+-]?\d+)?(?!\w|\.\d)")


def in_one_cell(sentences: Iterable[str]) -> str:
    """The sentences with ``"; "`` between them; within a sentence it becomes a comma.

    A sentence that kept it would come back as two.
    """
    return _BETWEEN.join(sentence.replace(_BETWEEN, ", ") for sentence in sentences)


def of_one_cell(text: str | None) -> tuple[str, ...]:
    """What `in_one_cell` put into a cell; none of an empty one."""
    return tuple(part for part in (text or "").split(_BETWEEN) if part)


def shared_steps(steps: Sequence[Sequence[str]]) -> list[str]:
    """What was done to all groups, each step once; a number that differs is given as a range.

    Parameters
    ----------
    steps : sequence of sequence of str
        The provenance of each group.

    Returns
    -------
    list of str
        The steps of the first group that all groups have, apart from their numbers.
    """
    shared = []
    for step in dict.fromkeys(steps[0] if steps else ()):
        words = _NUMBERED.split(step)
        like = [[one for one in own if _NUMBERED.split(one) == words] for own in steps]
        # numbers of a list, such as those of trials, make no range
        listed = _LIST.search(step) and len(set(chain(*like))) > 1
        if all(like) and not listed:
            columns = zip(*map(_NUMBERED.findall, chain(*like)), strict=True)
            numbers = [_span(column) for column in columns]
            shared.append("".join(a + b for a, b in zip(words, [*numbers, ""], strict=True)))
    return list(dict.fromkeys(shared))


def _span(numbers: Sequence[str]) -> str:
    """The number, or the smallest and the largest of them."""
    low, high = min(numbers, key=float), max(numbers, key=float)
    return low if float(low) == float(high) else f"{low} to {high}"
