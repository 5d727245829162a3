"""A table of text with one row per line: cells read one by one, errors that name their place."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from armimpedance.core.arrays import LARGEST, FloatArray
from armimpedance.core.conventions import LARGEST_ANGLE_RAD, element_names
from armimpedance.core.errors import InputError
from armimpedance.core.inputs import check_regular, unchanged
from armimpedance.show.files.content import unguarded


@dataclass(frozen=True)
class TableRow:
    """The cells of one line, with what an error message needs.

    All that read a cell raise `InputError` with file, row and column of what is not as expected.
    """

    file: Path
    line: int
    cells: dict[str, str]

    def error(self, problem: str, column: str, expected: str) -> InputError:
        """The error for a wrong cell of this row, or for a missing column."""
        if column not in self.cells:
            return InputError("no such column", file=self.file, column=column, expected=expected)
        return InputError(problem, file=self.file, row=self.line, column=column, expected=expected)

    def text(self, column: str, among: Sequence[str] = ()) -> str:
        """A cell that is not empty, one of `among` where given."""
        value = self.cells.get(column, "")
        if not value or (among and value not in among):
            expected = " or ".join(among) if among else "text"
            raise self.error(f"{value!r}" if value else "empty", column, expected)
        return value

    def number(self, column: str, finite: bool = True, low: float = -np.inf) -> float:
        """A cell that is a number of at least `low`."""
        value = self.cells.get(column, "")
        expected = "a finite number" if finite else "a number"
        expected += f" of at least {low:g}" if low > -np.inf else ""
        try:
            number = float(value)
        except ValueError:
            problem = f"not a number: {value!r}" if value else "empty"
            raise self.error(problem, column, expected) from None
        if np.isnan(number) or number < low or (finite and np.isinf(number)):
            raise self.error(f"{value}", column, expected)
        return number

    def angle(self, column: str) -> float:
        """A joint's angle, rad."""
        angle = self.number(column)
        if abs(angle) > LARGEST_ANGLE_RAD:
            raise self.error(f"{angle:g} looks like degrees", column, "radians")
        return angle

    def optional(self, column: str, missing: Any = float("nan"), *, finite: bool = False) -> Any:
        """A number, or `missing` where the cell is empty or the column is not there."""
        return self.number(column, finite) if self.cells.get(column) else missing

    def count(self, column: str, low: int = 1) -> int:
        """A whole number of at least `low`."""
        number = self.number(column, low=low)
        if number != int(number):
            raise self.error(f"{number}", column, "a whole number")
        return int(number)

    def vector(
        self, template: str, names: Sequence[Any], read: Callable[[str], float] | None = None
    ) -> FloatArray | None:
        """The columns of a template up to the last that is filled; None: none is."""
        columns = [template.format(name) for name in names]
        filled = [i for i, column in enumerate(columns) if self.cells.get(column)]
        if not filled:
            return None
        return np.array([(read or self.number)(column) for column in columns[: filled[-1] + 1]])

    def matrix(self, symbol: str, k: int) -> FloatArray:
        """The elements ``symbol_11 … symbol_kk``, all of them numbers, (k, k)."""
        values = [self.number(name) for name in element_names(symbol, k)]
        return np.array(values).reshape(k, k)

    def shared_errors(self, k: int) -> dict[str, FloatArray]:
        """The errors of M, B, K (3 k^2,) that all rows share, by their causes; none where empty."""
        text = self.cells.get("shared_errors", "")
        count = 3 * k * k
        expected = f"a JSON object of lists of {count} finite numbers, or nothing"
        try:
            by_cause = dict(json.loads(text or "{}"))
            errors = {name: np.array(values, dtype=float) for name, values in by_cause.items()}
        except (ValueError, TypeError, OverflowError, RecursionError):
            raise self.error("not what rows share", "shared_errors", expected) from None
        for name, values in errors.items():
            if values.shape != (count,) or not (np.abs(values) < LARGEST).all():
                raise self.error(f"not the errors by {name}", "shared_errors", expected)
        return errors


def table_rows(path: Path, what: str = "a RESULTS.csv") -> list[TableRow]:
    """All rows of a CSV file that are not empty.

    Parameters
    ----------
    path : path
    what : str
        What the file should be, for the error.

    Returns
    -------
    list of TableRow

    Raises
    ------
    InputError
        The file cannot be read (`what` says what it should be), a column appears twice, or there
        is no row.
    """
    check_regular(Path(path), expected=what)
    try:
        with unchanged(path):
            table = pd.read_csv(
                path,
                header=None,
                dtype=str,
                na_filter=False,
                skip_blank_lines=False,
                encoding="utf-8-sig",
            )
    except (OSError, UnicodeDecodeError, pd.errors.EmptyDataError, pd.errors.ParserError) as error:
        system = error.strerror if isinstance(error, OSError) else None
        why = system or str(error).splitlines()[-1]
        raise InputError(f"cannot be read: {why}", file=path, expected=what) from error
    header = [unguarded(str(name)) for name in table.iloc[0]]
    for name in header:
        if name and header.count(name) > 1:
            raise InputError("appears twice in the header", file=path, row=1, column=name)
    rows = [
        TableRow(path, line, dict(zip(header, map(unguarded, map(str, cells)), strict=True)))
        for line, cells in enumerate(table.iloc[1:].itertuples(index=False), start=2)
        if any(cells)
    ]
    if not rows:
        raise InputError("no rows", file=path, expected=f"{what}: a header and at least one row")
    return rows


# LEFT_OUT.csv: trials that somebody looked at and left out, with the reason.


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
        The file cannot be read, a number is none, or a trial appears twice; it names the row.
    """
    reasons: dict[int, str] = {}
    for row in table_rows(Path(path), "a list of trials, as `trials` saves it"):
        number = row.count("trial", low=-(2**31))
        if number in reasons:
            raise InputError(
                f"trial {number} appears twice", file=path, row=row.line, column="trial"
            )
        reasons[number] = row.cells.get("why", "")
    return reasons
