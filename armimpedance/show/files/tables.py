"""Tables of results in the format of the file's ending."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from armimpedance.core.described import Meaning
from armimpedance.core.errors import InputError
from armimpedance.core.json_text import json_text
from armimpedance.core.outputs import staged_file
from armimpedance.core.program import software
from armimpedance.show.files.content import (
    About,
    Cells,
    Content,
    Quantity,
    methods_paragraph,
)
from armimpedance.show.files.endings import ENDINGS, Ending
from armimpedance.show.files.words import quantities_of

#: Rows that the long table holds in memory at once.
_MOST_LONG: Final = 400_000


def table_content(
    rows: Iterable[Mapping[str, Any]],
    columns: Sequence[str] | None = None,
    *,
    keys: Sequence[str] = (),
    described: Mapping[str, Meaning] | None = None,
    quantities: Callable[[], Sequence[Quantity]] | None = None,
    objects: Callable[[], Any] | None = None,
    structs: Callable[[], Sequence[Cells]] | None = None,
    about: About | None = None,
    digits: int | None = None,
) -> Content:
    """The content of a table's file; cells that a row lacks stay empty (null in JSON).

    Parameters
    ----------
    rows : mappings from a column's name to a text, a number, a truth or None
    columns : sequence of str, optional
        The columns and their order; without it all of them, in the order of their first use.
    keys : sequence of str
        Columns that name a row, in the long table.
    described : mapping, optional
        What the columns are, beside those of an impedance (`words`).
    quantities : function without arguments, optional
        Makes the rows of the long table; without it they follow from the names of the columns.
    objects : function without arguments, optional
        Makes the plain values that a JSON file holds in place of the rows.
    structs : function without arguments, optional
        Makes what a MATLAB file holds in place of the rows.
    about : About, optional
        What stands beside the numbers.
    digits : int, optional
        Of the numbers in a CSV file; without it all of them.

    Returns
    -------
    Content
    """
    table = [dict(row) for row in rows]
    header = list(
        dict.fromkeys(name for row in table for name in row) if columns is None else columns
    )
    named = [name for name in keys if name in header]
    meanings = described or {}
    quantities_or_default = quantities or (lambda: quantities_of(header, table, named, meanings))
    return Content(
        header,
        table,
        quantities_or_default,
        objects,
        structs,
        about or About(),
        digits,
        named,
        meanings,
    )


def write_table(
    rows: Iterable[Mapping[str, Any]],
    path: str | os.PathLike[str],
    columns: Sequence[str] | None = None,
) -> None:
    """Write rows of cells.

    `path`: its ending decides the format.
    `columns`: as for `table_content`.
    Raises InputError: as for `write_content`.
    """
    write_content(table_content(rows, columns), path)


def write_content(
    content: Content,
    path: str | os.PathLike[str],
    *,
    long: bool = False,
    about: About | None = None,
) -> None:
    """Write a result, whole or not at all.

    Parameters
    ----------
    content : Content
    path : path
        Its ending decides the format: .csv, .json, .mat, .parquet, .xlsx.
    long : bool
        One row a quantity in place of one row a group: .csv, .json and .parquet.
    about : About, optional
        What stands beside the numbers, where the format has a place for it.

    Raises
    ------
    InputError
        An ending that is none of these or holds no long table, a cell that the format cannot
        hold, or the file cannot be written.
    """
    ending = ending_of(path)
    if about is not None:
        checks = (*content.about.checks, *about.checks)
        content = replace(content, about=replace(about, checks=tuple(dict.fromkeys(checks))))
    if ending.about:
        content = replace(content, about=_told(content))
    if long and not ending.long:
        raise InputError("no long table", file=path, expected="a .csv, .json or .parquet")
    most = min(ending.most_rows, _MOST_LONG) if long else ending.most_rows
    if len(content.rows) > most:
        raise InputError(
            f"{len(content.rows)} rows", file=path, expected=f"at most {most}, or a .csv not long"
        )
    if long:
        columns, rows = content.long_table
        content = replace(content, columns=columns, rows=rows, objects=None)
    with staged_file(path) as staged:
        try:
            ending.write(content, staged)
        except UnicodeEncodeError as error:
            text = f"a text holds {error.object[error.start : error.end]!r}, which is no character"
            raise InputError(text, file=path, expected="texts of whole characters") from None
        except InputError as error:
            # the temporary name says nothing to a user
            raise InputError(
                error.problem,
                file=path,
                row=error.row,
                column=error.column,
                expected=error.expected,
            ) from None


def _told(content: Content) -> About:
    """The text beside the numbers, with the program's version and a methods paragraph."""
    about = content.about
    facts = dict((("software", software()), *about.made))
    return replace(
        about, methods=about.methods or methods_paragraph(content), made=tuple(facts.items())
    )


def ending_of(path: str | os.PathLike[str]) -> Ending:
    """The format that a file's name asks for.

    Raises InputError: there is no such format.
    """
    ending = Path(path).suffix
    if ending[1:] not in ENDINGS:
        endings = ", ".join(f".{name}" for name in ENDINGS)
        raise InputError(f"no ending {ending!r}", file=path, expected=f"one of {endings}")
    return ENDINGS[ending[1:]]


def write_json(content: Any, path: str | Path) -> None:
    """Write plain values as JSON through a temporary name.

    Parameters
    ----------
    content : Any
        Plain values: mappings, lists, numbers, text and None.
    path : path
        Where the file is written.
    """
    with staged_file(path) as staged:
        staged.write_text(json_text(content), encoding="utf-8")
