"""LEFT_OUT.csv: trials that somebody looked at and left out, with the reason."""

from __future__ import annotations

from pathlib import Path

from armimpedance.core.errors import InputError
from armimpedance.show.files.table_row import table_rows


def read_left_out(path: str | Path) -> dict[int, str]:
    """The trials of a list and why each was left out.

    Parameters
    ----------
    path : path
        A CSV with the column ``trial`` and, where somebody wrote reasons, ``why``.

    Returns
    -------
    dict from int to str
        The number of each trial, in the file's order, and its reason, which may be empty.

    Raises
    ------
    InputError
        The file cannot be read, a number is none, or a trial stands twice; it names the row.
    """
    found: dict[int, str] = {}
    for row in table_rows(Path(path), "a list of trials, as `trials` saves it"):
        number = row.count("trial", low=-(2**31))
        if number in found:
            raise InputError(
                f"trial {number} stands twice", file=path, row=row.line, column="trial"
            )
        found[number] = row.cells.get("why", "")
    return found
