"""Sheets to a file: styles, widths, a header that stays, the same bytes for the same result."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path
from typing import Any, Final
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from armimpedance.core.errors import InputError
from armimpedance.show.files.content import runs_as_formula
from armimpedance.show.files.workbook_sheets import (
    MOST_COLUMNS,
    MOST_ROWS,
    Sheet,
    SheetColumn,
    as_xml_text,
    plain,
)

#: Earliest time that a ZIP archive knows: it stands for "no time".
_NO_TIME: Final = (1980, 1, 1, 0, 0, 0)
_A4: Final = 9
#: Of a line, and the most that Excel takes, in points.
_LINE_HEIGHT: Final = 15.5
_HIGHEST: Final = 409
_FONT: Final = "Calibri"
_INK: Final = "1F2A37"
_SHADE: Final = "DCE6F1"
_LINE: Final = "8EA4BF"
#: Verdict -> colour of its letters and of its cell.
_VERDICTS: Final = {
    "ok": ("1E6B3A", "E6F4EA"),
    "warning": ("8A4B00", "FFF3D6"),
    "unusable": ("9B1C1C", "FDE2E2"),
    "missing": ("5B6470", "F0F2F5"),
    "cannot tell": ("5B6470", "F0F2F5"),
}


class _WithoutTimes(ZipFile):
    """An archive that does not say when it was written: equal contents are equal bytes."""

    def writestr(self, zinfo_or_arcname: Any, data: Any, *_: Any, **__: Any) -> None:
        name = getattr(zinfo_or_arcname, "filename", zinfo_or_arcname)
        super().writestr(_member(name), data)

    def write(self, filename: Any, arcname: Any = None, *_: Any, **__: Any) -> None:
        with open(filename, "rb") as source, self.open(_member(arcname or filename), "w") as target:
            shutil.copyfileobj(source, target)


def _member(name: Any) -> ZipInfo:
    info = ZipInfo(str(name), _NO_TIME)
    info.compress_type = ZIP_DEFLATED
    return info


def write_book(openpyxl: Any, sheets: Sequence[Sheet], title: str, path: Path) -> None:
    """Write all sheets, row by row.

    `title`: of the document.
    Raises InputError: a sheet with more rows or columns than Excel holds, or a text that no cell
    holds.
    """
    for sheet in sheets:
        check_size(sheet.name, len(sheet.rows), len(sheet.columns))
    from openpyxl.writer.excel import ExcelWriter

    with _new_book(openpyxl) as book:
        for sheet in sheets:
            _write_sheet(openpyxl, book, sheet)
        properties = book.properties
        properties.creator, properties.title = "armimpedance", title
        properties.created = properties.modified = datetime(*_NO_TIME)
        # the workbook's own `save` would stamp the time
        with _WithoutTimes(path, "w", ZIP_DEFLATED, allowZip64=True) as archive:
            ExcelWriter(book, archive).write_data()


@contextmanager
def _new_book(openpyxl: Any) -> Iterator[Any]:
    """A workbook whose sheets are closed, also after an error, and their temporary files removed.

    Else the interpreter would close them when it ends, and complain of a full disk once for each.
    """
    book = openpyxl.Workbook(write_only=True)
    try:
        yield book
    finally:
        writers = [page._writer for page in book.worksheets if page._writer is not None]
        rows = [page._rows for page in book.worksheets if page._rows is not None]
        ends = (each.close for each in (*rows, *(writer.xf for writer in writers)))
        for end in (*ends, *(writer.cleanup for writer in writers)):
            with suppress(OSError, ValueError):
                end()


def check_size(name: str, rows: int, columns: int) -> None:
    """Refuse a sheet of more rows or columns than Excel holds.

    `rows`, `columns`: the rows without the header.
    """
    for what, number, most in (("rows", rows + 1, MOST_ROWS), ("columns", columns, MOST_COLUMNS)):
        if number > most:
            raise InputError(
                f"{number} {what} in the sheet {name}",
                expected=f"at most {most} in a workbook; a .csv or .parquet holds more",
            )


def _write_sheet(openpyxl: Any, book: Any, sheet: Sheet) -> None:
    page = book.create_sheet(sheet.name)
    letter = openpyxl.utils.get_column_letter
    for number, column in enumerate(sheet.columns, 1):
        page.column_dimensions[letter(number)].width = column.width
    page.freeze_panes = f"{letter(sheet.frozen + 1)}2"
    page.sheet_view.showGridLines = False
    page.print_title_rows = "1:1"
    page.page_setup.orientation = "landscape"
    page.page_setup.paperSize = _A4
    page.sheet_properties.pageSetUpPr = openpyxl.worksheet.properties.PageSetupProperties(
        fitToPage=True
    )
    page.page_setup.fitToWidth = 1 if sum(c.width for c in sheet.columns) < 260 else 0
    page.page_setup.fitToHeight = 0
    if sheet.rows:
        page.auto_filter.ref = f"A1:{letter(len(sheet.columns))}{len(sheet.rows) + 1}"
    looks = _Looks(openpyxl, page)
    page.append([looks.header(column.name, column) for column in sheet.columns])
    wraps = any(column.wrapped for column in sheet.columns)
    for row in range(len(sheet.rows)):
        if wraps:
            cells = zip(sheet.columns, sheet.rows[row], strict=True)
            # no spreadsheet makes room by itself for what it did not write
            lines = max(column.lines(cell) for column, cell in cells)
            page.row_dimensions[row + 2].height = min(_LINE_HEIGHT * lines, _HIGHEST)
        page.append(_cells(sheet, row, looks))


def _cells(sheet: Sheet, row: int, looks: _Looks) -> Iterator[Any]:
    for column, value in zip(sheet.columns, sheet.rows[row], strict=True):
        decimals = sheet.decimals[row] if column.by_row else column.decimals
        yield looks.cell(plain(value), column, decimals, row + 2)


class _Looks:
    """The cells of one page: one prototype for each look, filled anew for each cell.

    openpyxl writes each cell before it asks for the next, so that a prototype can be used again;
    to style every cell of a large table by itself takes several times as long.
    """

    def __init__(self, openpyxl: Any, page: Any) -> None:
        self._openpyxl, self._page = openpyxl, page
        self._made: dict[tuple[Any, ...], Any] = {}

    def header(self, name: str, column: SheetColumn) -> Any:
        """A cell of the first row."""
        cell = self._new()
        styles = self._openpyxl.styles
        cell.font = styles.Font(name=_FONT, bold=True, color=_INK)
        cell.fill = styles.PatternFill("solid", fgColor=_SHADE)
        cell.border = styles.Border(bottom=styles.Side("thin", color=_LINE))
        cell.alignment = styles.Alignment(
            horizontal="right" if column.numbers else "left",
            indent=1,
            vertical="center",
            wrap_text=column.wrapped,
        )
        return _filled(cell, as_xml_text(name, 1, name))

    def cell(self, value: Any, column: SheetColumn, decimals: int | None, row: int) -> Any:
        """A cell of the table; None where there is nothing."""
        if value is None or value == "":
            return None
        if isinstance(value, bool):
            cell = self._like("truth")
            cell.value = value
            return cell
        if isinstance(value, int):
            return _number(self._like("number", "0"), value)
        if isinstance(value, float):
            return _number(self._like("number", _format(value, decimals)), value)
        look = value if column.name == "verdict" and value in _VERDICTS else ""
        quoted = runs_as_formula(value)
        cut = not column.wrapped and len(value) > column.width
        cell = self._like("text", look, column.wrapped, cut, quoted)
        return _filled(cell, as_xml_text(value, row, column.name))

    def _like(self, *look: Any) -> Any:
        if look not in self._made:
            self._made[look] = self._styled(*look)
        return self._made[look]

    def _styled(self, kind: str, *look: Any) -> Any:
        cell, styles = self._new(), self._openpyxl.styles
        cell.font = styles.Font(name=_FONT, color=_INK)
        cell.alignment = styles.Alignment(horizontal="right", indent=1, vertical="top")
        if kind == "number":
            cell.number_format = look[0]
        elif kind == "text":
            verdict, wrapped, cut, quoted = look
            # "fill" ends a long text at the edge of its cell, also where the next one is empty
            cell.alignment = styles.Alignment(
                horizontal="fill" if cut else "left",
                indent=0 if cut else 1,
                vertical="top",
                wrap_text=wrapped,
            )
            cell.quotePrefix = quoted
            if verdict:
                ink, shade = _VERDICTS[verdict]
                cell.font = styles.Font(name=_FONT, bold=True, color=ink)
                cell.fill = styles.PatternFill("solid", fgColor=shade)
        return cell

    def _new(self) -> Any:
        return self._openpyxl.cell.WriteOnlyCell(self._page)


def _filled(cell: Any, text: str) -> Any:
    """A text: never a formula, never the code of an error, whatever it begins with."""
    cell.value = text
    cell.data_type = "s"
    return cell


def _number(cell: Any, value: float) -> Any:
    """A number with all its digits: openpyxl itself would write 16 of the 17 of a double."""
    cell.value = repr(value)
    cell.data_type = "n"
    return cell


def _format(value: float, decimals: int | None) -> str:
    if decimals is None or (value and not 1e-6 < abs(value) < 1e9):
        return "General" if value == int(value) and abs(value) < 1e9 else "0.000E+00"
    return "0." + "0" * decimals if decimals else "0"
