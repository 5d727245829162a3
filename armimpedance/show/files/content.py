"""The content of a result's file, independent of its format. Standard library only."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import chain
from typing import Any, Final

from armimpedance.core.described import Meaning
from armimpedance.core.findings import Finding, checked_sentence
from armimpedance.core.program import software

# Texts in one cell of a table: formulas that are kept text, several sentences in one.
#
# A cell that begins with ``=``, ``+``, ``-``, ``@``, a tab or a line break is a formula to Excel
# and LibreOffice, whatever the quotes around it: ``=cmd|...`` in the name of a condition would run.
# Such a text stands in a CSV file with an apostrophe before it, and so does a text that begins with
# an apostrophe before one of these; `unguarded` takes exactly these apostrophes off again. Numbers,
# also those that are text (``-5``), stay as they are. Standard library only.

#: What a formula begins with; the wide forms are for spreadsheets in East Asian languages.
_STARTS: Final = "=+-@\t\r\n\uff1d\uff0b\uff0d\uff20"
_NUMBER: Final = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-](inf|nan)")
_MARK: Final = "'"


def runs_as_formula(text: str) -> bool:
    """Return True if a spreadsheet would run the text as a formula."""
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
    """Split a cell that `in_one_cell` joined; an empty cell gives no parts."""
    return tuple(part for part in (text or "").split(_BETWEEN) if part)


def shared_steps(steps: Sequence[Sequence[str]]) -> list[str]:
    """Processing steps that all groups share, each once; numbers that differ become a range.

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


#: A row of a table: the name of a column -> a text, a number, a truth or None.
Cells = Mapping[str, Any]


@dataclass(frozen=True)
class About:
    """Text that a file holds beside its numbers, if its format has a place for it.

    Attributes
    ----------
    methods : str
        The methods paragraph.
    made : tuple of (str, str)
        How the result was made, such as ("version", "armimpedance 0.1.0").
    checks : tuple of Finding
        What was held against the data, beside the warnings in the rows.
    """

    methods: str = ""
    made: tuple[tuple[str, str], ...] = ()
    checks: tuple[Finding, ...] = ()


@dataclass(frozen=True)
class Quantity:
    """One number with its interval: a row of the long table.

    Attributes
    ----------
    keys : mapping
        The columns that name the row: the group's own, the level, the method.
    quantity : str
        The name of the number's column in the wide table, such as ``K_12``.
    words : str
        What it is, in words.
    value, lower, upper, sd : float or None
        The number, its 95 % limits and its standard error; None where there is none.
    unit : str
        "1" for a pure number, "" where the unit is not known.
    i, j : int or None
        Row and column in its matrix, or number in its list, from 1.
    more : mapping
        Further cells of the row, such as p values.
    """

    keys: Cells
    quantity: str
    words: str
    value: float | None
    lower: float | None = None
    upper: float | None = None
    sd: float | None = None
    unit: str = ""
    i: int | None = None
    j: int | None = None
    more: Cells = field(default_factory=dict)

    @property
    def cells(self) -> dict[str, Any]:
        """The row of the long table."""
        names = ("i", "j", "value", "lower", "upper", "sd", "unit")
        own = {name: getattr(self, name) for name in names}
        return {**self.keys, "quantity": self.quantity, "name": self.words, **own, **self.more}


@dataclass(frozen=True)
class Content:
    """Everything that a file of results may hold; each format takes what it has a place for.

    Attributes
    ----------
    columns : sequence of str
        The columns of the table in their order.
    rows : sequence of mappings
        Its rows; a cell that a row does not have is empty.
    quantities : function without arguments
        Makes the rows of the long table.
    objects : function without arguments, or None
        Makes the plain values that a JSON file holds in place of the rows.
    structs : function without arguments, or None
        Makes what a MATLAB file holds in place of the rows, one mapping a row.
    about : About
        What stands beside the numbers.
    digits : int or None
        Of the numbers in a CSV file; None: all of them.
    keys : sequence of str
        The columns that name a row.
    described : mapping
        What the columns are, beside those of an impedance (`words`).
    """

    columns: Sequence[str]
    rows: Sequence[Cells]
    quantities: Callable[[], Sequence[Quantity]]
    objects: Callable[[], Any] | None = None
    structs: Callable[[], Sequence[Cells]] | None = None
    about: About = field(default_factory=About)
    digits: int | None = None
    keys: Sequence[str] = ()
    described: Mapping[str, Meaning] = field(default_factory=dict)

    @cached_property
    def long(self) -> tuple[Quantity, ...]:
        """The rows of the long table."""
        return tuple(self.quantities())

    @property
    def long_table(self) -> tuple[list[str], list[dict[str, Any]]]:
        """The columns and rows of the long table."""
        keys = dict.fromkeys(name for one in self.long for name in one.keys)
        fixed = ("quantity", "name", "i", "j", "value", "lower", "upper", "sd", "unit")
        more = dict.fromkeys(name for one in self.long for name in one.more)
        columns = list(dict.fromkeys([*keys, *fixed, *more]))
        return columns, [one.cells for one in self.long]


# The methods paragraph that a file carries where nobody wrote another.

#: More steps than this stand in the sheet of the provenance only.
_MOST_STEPS: Final = 6


def methods_paragraph(content: Content) -> str:
    """Sentences on what was done: program, methods, steps that rows share, intervals, checks."""
    methods = ", ".join(dict.fromkeys(str(r["method"]) for r in content.rows if r.get("method")))
    sentences = [f"The results were computed with {software()}"]
    sentences += [f"Method: {methods}"] if methods else []
    sentences += [f"{step[0].upper()}{step[1:]}" for step in _shared_steps(content)]
    if any(one.lower is not None for one in content.long):
        sentences.append("Intervals are 95 % intervals")
    sentences += [checked_sentence(content.about.checks)]
    return " ".join(s if s.endswith((".", "!", "?")) else f"{s}." for s in sentences if s)


def _shared_steps(content: Content) -> list[str]:
    """Steps of the provenance that every row has, in their order; none where there are many."""
    steps = [of_one_cell(str(row.get("provenance") or "")) for row in content.rows]
    return shared_steps(steps)[:_MOST_STEPS]
