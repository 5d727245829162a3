"""OpenSim's .sto: columns of numbers over a first column `time`.

Texts have no place among numbers: they stand in the header, a line for each column of texts. An
empty cell is NaN. Where the table has no `time_s` that rises, the time is the row's number from 0.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from armimpedance.core.errors import InputError
from armimpedance.show.files.content import Content

#: Letters that end a cell or a line of such a file, or that its readers take for the end.
_BREAKS: Final = str.maketrans(dict.fromkeys("\t\r\n\v\f\x1c\x1d\x1e\x85\u2028\u2029\0", " "))
_CLOCK: Final = "time_s"


def write_sto(content: Content, path: Path) -> None:
    """Write the numbers of the table, its texts in the header."""
    rows = content.rows
    texts = [n for n in content.columns if any(isinstance(row.get(n), str) for row in rows)]
    times = _times([row.get(_CLOCK) for row in rows])
    names = [n for n in content.columns if n not in texts and not (n == _CLOCK and times)]
    if not names or not rows:
        raise InputError("no numbers to write", file=path, expected="a table with numbers")
    clock = times or range(len(rows))
    numbers = [[_number(row.get(name), name, i) for name in names] for i, row in enumerate(rows)]
    table = ("\t".join(map(_cell, (t, *row))) for t, row in zip(clock, numbers, strict=True))
    lines = [
        "armimpedance results",
        "inDegrees=no",
        f"nColumns={1 + len(names)}",
        f"nRows={len(rows)}",
        "DataType=double",
        "version=3",
        *_clock_told(times),
        *(_told(name, [row.get(name) for row in rows]) for name in texts),
        "endheader",
        "\t".join(["time", *_labels(names)]),
        *table,
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="")


def _clock_told(times: Sequence[float] | None) -> list[str]:
    return ["The time is the number of the row, from 0."] if times is None else []


def _times(cells: Sequence[Any]) -> list[float] | None:
    """The times of the rows, where every row has one and they rise."""
    if not all(isinstance(cell, int | float) and math.isfinite(cell) for cell in cells):
        return None
    times = [float(cell) for cell in cells]
    rises = all(b > a for a, b in zip(times, times[1:], strict=False))
    return times if rises else None


def _number(cell: Any, column: str, row: int) -> float:
    if cell is None:
        return math.nan
    try:
        return float(cell)
    except (TypeError, ValueError, OverflowError):
        problem = f"no number in row {row + 1}: {str(cell)[:40]!r}"
        raise InputError(problem, column=column, expected="numbers and texts") from None


def _cell(value: float) -> str:
    return "NaN" if math.isnan(value) else repr(value)


def _labels(names: Sequence[str]) -> list[str]:
    """Names without what ends a cell; none is `time`, none appears twice."""
    labels = ["_".join(name.translate(_BREAKS).split()) or "column" for name in names]
    used = {"time"}
    for i in range(len(labels)):
        while labels[i].lower() in used:
            labels[i] += "_"
        used.add(labels[i].lower())
    return labels


def _told(name: str, cells: Sequence[Any]) -> str:
    """A line of the header on a column of texts; no line of it can be taken for a key."""
    texts = ["" if cell is None else str(cell).translate(_BREAKS) for cell in cells]
    label = name.translate(_BREAKS)
    if len(set(texts)) == 1:
        sentence = f"all rows: {texts[0]}"
    else:
        sentence = "; ".join(f"row {i}: {text}" for i, text in enumerate(texts) if text)
    return f"Not in the table: {label}: {sentence}".replace("=", ":")
