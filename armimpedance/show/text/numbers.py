"""Tables, names and notes as a terminal of 100 columns has them."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

from armimpedance.core.findings import Finding
from armimpedance.core.shown import percent, with_interval
from armimpedance.numerics.regression import NamedParameter

#: Columns of the terminal that tables are made for.
TABLE_WIDTH = 100


def counted(number: int, noun: str) -> str:
    """``1 trial``, ``2 trials``: a number with its noun.

    Parameters
    ----------
    number : int
        How many there are.
    noun : str
        The noun in the singular; its plural ends in s.

    Returns
    -------
    str
        The number and the noun, in the plural unless the number is 1.
    """
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def short(text: str, width: int) -> str:
    """The text, its middle left out where it is longer than the width: names differ at the end."""
    if len(text) <= width:
        return text
    tail = width // 2
    return text[: width - 1 - tail] + "…" + text[len(text) - tail :]


def aligned_table(header: Sequence[str], rows: Sequence[Sequence[str]], gap: str = "  ") -> str:
    """Columns as wide as they must be; the first to the left, the others to the right.

    Parameters
    ----------
    header : sequence of str
        Titles of the columns.
    rows : sequence of sequence of str
        Cells of each row, as many as there are titles.
    gap : str
        Text between two columns.

    Returns
    -------
    str
        The header and the rows, one line each.
    """
    table = [list(header), *map(list, rows)]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    lines = []
    for first, *others in table:
        cells = [text.rjust(width) for text, width in zip(others, widths[1:], strict=True)]
        lines.append(gap.join([first.ljust(widths[0]), *cells]).rstrip())
    return "\n".join(lines)


def note_numbers(own: Sequence[str], every: Sequence[str]) -> str:
    """``[1,3]``: which of all notes are a row's own; nothing where it has none."""
    numbers = sorted({every.index(note) + 1 for note in own})
    return "[" + ",".join(map(str, numbers)) + "]" if numbers else ""


def numbered_notes(every: Sequence[str]) -> list[str]:
    """All notes with their numbers, broken into lines."""
    return [
        textwrap.fill(f"[{i}] {text}", TABLE_WIDTH, subsequent_indent="    ")
        for i, text in enumerate(every, start=1)
    ]


def table_by_condition(
    names: Sequence[str], header: Sequence[str], rows: Sequence[Sequence[str]]
) -> str:
    """A table that starts with the condition, whose name gets the room that is left."""
    numbers = aligned_table(["", *header], [["", *row] for row in rows])
    room = max(TABLE_WIDTH - max(map(len, numbers.splitlines())), len("condition"))
    named = [[short(name, room), *row] for name, row in zip(names, rows, strict=True)]
    return aligned_table(["condition", *header], named)


# What the checks of a fit found, as lines of text.


def checks_lines(checks: Sequence[Finding]) -> list[str]:
    """One line a check: its mark, what was seen, the smallest violation it would have seen.

    Parameters
    ----------
    checks : sequence of Finding

    Returns
    -------
    list of str
        A heading above them; empty where nothing was checked.
    """
    if not checks:
        return []
    indent = " " * 8
    lines = [textwrap.fill(f"  {check}", TABLE_WIDTH, subsequent_indent=indent) for check in checks]
    return ["", "Checks of the model's assumptions", *lines]


# The table of a fit's parameters, as every command prints it.


def parameter_table(parameters: Sequence[NamedParameter], plain_sd: str) -> str:
    """Value with interval, unit, both standard errors in per cent, and the source's verdict.

    Parameters
    ----------
    parameters : sequence of NamedParameter
    plain_sd : str
        Heading of `NamedParameter.sd`.
    """
    header = ("", "value (95 % interval)", "unit", plain_sd, "robust sd", "well identified")
    rows = [
        [
            p.name,
            with_interval(p.value, *p.ci95),
            p.unit,
            percent(p.relative_sd_percent),
            percent(100 * p.sd_robust / abs(p.value)) if p.value else "-",
            "yes" if p.well_identified else "no",
        ]
        for p in parameters
    ]
    return aligned_table(header, rows)
