"""CSV: UTF-8, commas, a header; every number in full."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

from armimpedance.files.written.content import Content
from armimpedance.files.written.ending import Ending
from armimpedance.files.written.formula import guarded


def write(content: Content, path: Path) -> None:
    """Write the table; a text that a spreadsheet would run as a formula is guarded."""
    with open(path, "w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([guarded(name) for name in content.columns])
        for row in content.rows:
            cells = (row.get(name) for name in content.columns)
            writer.writerow([_cell(cell, content.digits) for cell in cells])


def _cell(cell: Any, digits: int | None) -> Any:
    if cell is None:
        return ""
    if digits is not None and isinstance(cell, float):
        return f"{cell:.{digits}g}"
    return guarded(cell)


ENDING = Ending("a table that everything reads", write, long=True)
