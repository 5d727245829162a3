"""An Excel workbook: results, intervals, checks, methods, provenance, what the columns are."""

from __future__ import annotations

from math import inf
from pathlib import Path

from armimpedance.core.errors import needed
from armimpedance.show.files.content import Content
from armimpedance.show.files.endings import Ending


def write(content: Content, path: Path) -> None:
    """Write all sheets."""
    from armimpedance.show.files.workbook import check_size, write_book
    from armimpedance.show.files.workbook_sheets import sheets_of

    openpyxl = needed("openpyxl", "excel", "an Excel workbook (.xlsx)")
    check_size("results", len(content.rows), len(content.columns))
    write_book(openpyxl, sheets_of(content), "armimpedance results", path)


ENDING = Ending("an Excel workbook", write, about=True, most_rows=inf)
