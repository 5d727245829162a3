"""Tables of results: CSV, JSON or Parquet by the file's ending, written whole or not at all."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from armimpedance.errors import InputError
from armimpedance.json_text import json_text
from armimpedance.outputs import staged_file


def write_table(
    rows: Iterable[Mapping[str, Any]],
    path: str | os.PathLike[str],
    columns: Sequence[str] | None = None,
) -> None:
    """Write rows of cells; a cell that a row does not have stays empty (JSON: null).

    Parameters
    ----------
    rows : mappings from a column's name to a text, a number, a truth or None
    path : path
        Its ending decides the format: .csv, .json (a list of objects) or .parquet.
    columns : sequence of str, optional
        The columns and their order; without it all of them, in the order of their first use.

    Raises
    ------
    InputError
        An ending that is none of these, or the file cannot be written.
    """
    table = [dict(row) for row in rows]
    header = list(
        dict.fromkeys(name for row in table for name in row) if columns is None else columns
    )
    writers = {".csv": _write_csv, ".json": _write_json, ".parquet": _write_parquet}
    ending = Path(path).suffix
    if ending not in writers:
        raise InputError(
            f"no ending {ending!r}", file=path, expected=f"one of {', '.join(writers)}"
        )
    with staged_file(path) as staged:
        writers[ending](header, table, staged)


def _write_csv(header: list[str], table: list[dict[str, Any]], path: Path) -> None:
    with open(path, "w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(header)
        writer.writerows([["" if row.get(n) is None else row[n] for n in header] for row in table])


def _write_json(header: list[str], table: list[dict[str, Any]], path: Path) -> None:
    path.write_text(json_text([{n: row.get(n) for n in header} for row in table]), "utf-8")


def _write_parquet(header: list[str], table: list[dict[str, Any]], path: Path) -> None:
    import pandas as pd

    pd.DataFrame(table, columns=header).to_parquet(path, index=False)
