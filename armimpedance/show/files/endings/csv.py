"""CSV: UTF-8, commas, a header; every number in full."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable
from functools import lru_cache
from math import inf
from pathlib import Path
from typing import Any

from armimpedance.show.files.content import Content, guarded
from armimpedance.show.files.endings import Ending


def write(content: Content, path: Path) -> None:
    """Write the table; a text that a spreadsheet would run as a formula is guarded."""
    shown = _cells(content.digits)
    with open(path, "w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([guarded(name) for name in content.columns])
        writer.writerows(shown(map(row.get, content.columns)) for row in content.rows)


def _cells(digits: int | None) -> Callable[[Iterable[Any]], list[Any]]:
    """How the cells of a row are written; one of None stays empty."""
    # names and units stand in every row: each is looked at once
    text = lru_cache(maxsize=4096)(guarded)

    def number(cell: Any) -> Any:
        return f"{cell:.{digits}g}" if isinstance(cell, float) else cell

    def in_full(row: Iterable[Any]) -> list[Any]:
        return [text(cell) if isinstance(cell, str) else cell for cell in row]

    def rounded(row: Iterable[Any]) -> list[Any]:
        return [number(cell) for cell in in_full(row)]

    return in_full if digits is None else rounded


ENDING = Ending("a table that everything reads", write, long=True, most_rows=inf)
