"""An Excel workbook: results, intervals, checks, methods, provenance, what the columns are."""

from __future__ import annotations

from pathlib import Path

from armimpedance.errors import InputError
from armimpedance.files.written.content import Content
from armimpedance.files.written.ending import Ending


def write(content: Content, path: Path) -> None:
    """Write all sheets."""
    from armimpedance.files.workbook.book import check_size, write_book
    from armimpedance.files.workbook.sheets import sheets_of

    try:
        import openpyxl
    except ImportError:
        raise InputError(
            "the package openpyxl is not installed",
            expected="it: pip install 'armimpedance[excel]'",
        ) from None
    check_size("results", len(content.rows), len(content.columns))
    write_book(openpyxl, sheets_of(content), "armimpedance results", path)


ENDING = Ending("an Excel workbook", write, about=True)
