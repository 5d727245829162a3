"""Formats of result files: which ending is which."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from armimpedance.core.errors import needed
from armimpedance.core.method_table import RecordTable

if TYPE_CHECKING:
    from armimpedance.show.files.content import Content


@dataclass(frozen=True)
class Ending:
    """One format of result files; its ending is its name in the table.

    `what`: what such a file is, for help texts.
    `write` function (content, path): writes the whole file. The path is a temporary one, beside the
    final one and with its ending; it is renamed when the function returns.
    `every_table`: whether any table of results can be written so. A command that offers an ending
    of few results names it beside the others.
    `long`: whether the long table may stand in place of the wide one.
    `about`: whether it has a place for methods, checks and options.
    `most_rows`: rows beyond which a table is refused: all of them are held in memory at once. inf
    where they are written one after another, or where the format says its own limit.
    """

    what: str
    write: Callable[[Content, Path], None]
    every_table: bool = True
    long: bool = False
    about: bool = False
    most_rows: float = 400_000


# CSV: UTF-8, commas, a header; every number in full.


def _csv(content: Content, path: Path) -> None:
    """Write the table; a text that a spreadsheet would run as a formula is guarded."""
    import csv

    from armimpedance.show.files.content import guarded

    shown = _csv_cells(content.digits)
    with open(path, "w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([guarded(name) for name in content.columns])
        writer.writerows(shown(map(row.get, content.columns)) for row in content.rows)


def _csv_cells(digits: int | None) -> Callable[[Iterable[Any]], list[Any]]:
    """Return the function that formats the cells of a CSV row; None becomes an empty cell."""
    from armimpedance.show.files.content import guarded

    # names and units stand in every row: each is looked at once
    text = lru_cache(maxsize=4096)(guarded)

    def number(cell: Any) -> Any:
        return f"{cell:.{digits}g}" if isinstance(cell, float) else cell

    def in_full(row: Iterable[Any]) -> list[Any]:
        return [text(cell) if isinstance(cell, str) else cell for cell in row]

    def rounded(row: Iterable[Any]) -> list[Any]:
        return [number(cell) for cell in in_full(row)]

    return in_full if digits is None else rounded


# JSON: matrices nested where the result has them, else a list of objects.


def _json(content: Content, path: Path) -> None:
    """Write the objects of the result, or one object a row."""
    from armimpedance.core.json_text import json_text

    rows = [{name: row.get(name) for name in content.columns} for row in content.rows]
    path.write_text(json_text(rows if content.objects is None else content.objects()), "utf-8")


# Parquet: the columns of the CSV file with their types.


def _parquet(content: Content, path: Path) -> None:
    """Write the table."""
    import pandas as pd

    pd.DataFrame(list(content.rows), columns=list(content.columns)).to_parquet(path, index=False)


# An Excel workbook: results, intervals, checks, methods, provenance, what the columns are.


def _xlsx(content: Content, path: Path) -> None:
    """Write all sheets."""
    from armimpedance.show.files.workbook import check_size, write_book
    from armimpedance.show.files.workbook_sheets import sheets_of

    openpyxl = needed("openpyxl", "excel", "an Excel workbook (.xlsx)")
    check_size("results", len(content.rows), len(content.columns))
    write_book(openpyxl, sheets_of(content), "armimpedance results", path)


def _mat(content: Content, path: Path) -> None:
    from armimpedance.show.files.matlab import write_mat

    write_mat(content, path)


def _sto(content: Content, path: Path) -> None:
    from armimpedance.show.files.sto import write_sto

    write_sto(content, path)


#: ``csv`` -> how a .csv is written.
ENDINGS: Final = RecordTable(
    {
        "csv": Ending("a table that everything reads", _csv, long=True, most_rows=inf),
        "json": Ending("nested matrices, for scripts", _json, long=True),
        "parquet": Ending("columns with types, for large tables", _parquet, long=True),
        "xlsx": Ending("an Excel workbook", _xlsx, about=True, most_rows=inf),
        "mat": Ending("MATLAB structs with units", _mat, about=True),
        "sto": Ending("columns of numbers over time, for OpenSim", _sto),
    },
    "ending",
    default="csv",
)
