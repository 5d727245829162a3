"""Tables of results: the file's ending decides the format; written whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from armimpedance.errors import InputError
from armimpedance.files.written.content import About, Cells, Content, Quantity
from armimpedance.files.written.ending import ENDINGS, Ending
from armimpedance.files.written.long import long_table, quantities_of
from armimpedance.outputs import staged_file


def write_table(
    rows: Iterable[Mapping[str, Any]],
    path: str | os.PathLike[str],
    columns: Sequence[str] | None = None,
    *,
    keys: Sequence[str] = (),
    quantities: Callable[[], Sequence[Quantity]] | None = None,
    objects: Any = None,
    structs: Callable[[], Sequence[Cells]] | None = None,
    long: bool = False,
    about: About | None = None,
) -> None:
    """Write rows of cells; a cell that a row does not have stays empty (JSON: null).

    Parameters
    ----------
    rows : mappings from a column's name to a text, a number, a truth or None
    path : path
        Its ending decides the format: .csv, .json, .mat, .parquet, .xlsx.
    columns : sequence of str, optional
        The columns and their order; without it all of them, in the order of their first use.
    keys : sequence of str
        Columns that name a row, in the long table.
    quantities : function without arguments, optional
        Makes the rows of the long table; without it they follow from the names of the columns.
    objects : plain values, optional
        What a JSON file holds in place of the rows.
    structs : function without arguments, optional
        Makes what a MATLAB file holds in place of the rows.
    long : bool
        One row a quantity in place of one row a group.
    about : About, optional
        What stands beside the numbers, where the format has a place for it.

    Raises
    ------
    InputError
        An ending that is none of these or holds no long table, a cell that the format cannot
        hold, or the file cannot be written.
    """
    table = [dict(row) for row in rows]
    header = list(
        dict.fromkeys(name for row in table for name in row) if columns is None else columns
    )
    content = Content(
        header,
        table,
        quantities or (lambda: quantities_of(header, table, keys)),
        objects,
        structs,
        about or About(),
    )
    write_content(content, path, long=long)


def write_content(content: Content, path: str | os.PathLike[str], *, long: bool = False) -> None:
    """Write what is known of a result through a temporary name.

    Parameters
    ----------
    content : Content
    path : path
        Its ending decides the format.
    long : bool
        One row a quantity in place of one row a group.

    Raises
    ------
    InputError
        As for `write_table`.
    """
    ending = ending_of(path)
    if long and not ending.long:
        raise InputError("no long table", file=path, expected="a .csv, .json or .parquet")
    if long:
        columns, rows = long_table(content.long)
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


def ending_of(path: str | os.PathLike[str]) -> Ending:
    """The format that a file's name asks for.

    Parameters
    ----------
    path : path

    Returns
    -------
    Ending

    Raises
    ------
    InputError
        There is no such format.
    """
    ending = Path(path).suffix
    if ending[1:] not in ENDINGS:
        known = ", ".join(f".{name}" for name in ENDINGS)
        raise InputError(f"no ending {ending!r}", file=path, expected=f"one of {known}")
    return ENDINGS[ending[1:]]
