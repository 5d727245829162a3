"""`trials.csv`: one row per trial, with line numbers for messages."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd

from armimpedance.core.conventions import LARGEST_ANGLE_RAD
from armimpedance.core.delimited import number_of, read_text_table
from armimpedance.core.errors import InputError

#: Optional columns that hold a number in every row.
NUMBER_COLUMNS: Final = (
    "direction_deg",
    "elevation_deg",
    "onset_s",
    "end_s",
    "q_shoulder_rad",
    "q_elbow_rad",
)

#: Columns of numbers that apply to some experiments only: a cell may be empty.
OPTIONAL_NUMBER_COLUMNS: Final = ("target_activation", "target_force_x_N", "target_force_y_N")

_WHOLE_NUMBER: Final = re.compile(r"[+-]?\d{1,18}")


@dataclass(frozen=True)
class TrialTable:
    """The trial table and the line of each row in the file."""

    file: Path
    trials: pd.DataFrame
    lines: tuple[int, ...]

    def error(self, problem: str, row: int, column: str, expected: str) -> InputError:
        """An error at row `row` (from 0) of the table."""
        line = self.lines[row]
        return InputError(problem, file=self.file, row=line, column=column, expected=expected)


def read_trials(file: Path) -> TrialTable:
    """Read and check `trials.csv`.

    Whole numbers stay integers; a column of numbers with empty cells is float with NaN; `True` and
    `False` are booleans; the rest is text. `condition` is always text.

    Raises InputError: the file is missing or empty, a column is missing or appears twice, a cell is
    empty or invalid, or a trial appears twice.
    """
    header, lines, rows = _read_cells(file)
    return trials_of_cells(file, header, lines, rows)


def trials_of_cells(
    file: Path, header: Sequence[str], lines: tuple[int, ...], rows: Sequence[Sequence[str]]
) -> TrialTable:
    """The checked table of these cells, one list per trial, with line numbers for messages.

    Raises InputError: as `read_trials`.
    """
    columns = {name: [cells[i] for cells in rows] for i, name in enumerate(header)}
    table = TrialTable(file, pd.DataFrame(index=range(len(rows))), lines)
    for name in ("trial", "condition"):
        if name not in columns:
            available = ", ".join(header)
            raise InputError(
                "no such column", file=file, column=name, expected=f"it beside {available}"
            )
    for row, cell in enumerate(columns["trial"]):
        if not _WHOLE_NUMBER.fullmatch(cell.strip()):
            problem = f"not a whole number: {cell!r}" if cell.strip() else "empty cell"
            raise table.error(problem, row, "trial", "the number of a trial")
    for row, cell in enumerate(columns["condition"]):
        if not cell.strip():
            raise table.error("empty cell", row, "condition", "the name of the condition")
    _check_numbers(table, columns)
    typed = {
        name: pd.Series(cells, dtype="str") if name == "condition" else _typed(cells)
        for name, cells in columns.items()
    }
    checked = TrialTable(file, pd.DataFrame(typed), lines)
    _check_rows(checked)
    return checked


def trials_text(trials: pd.DataFrame) -> str:
    """The text of `trials.csv`; `read_trials` returns the same table."""
    stream = io.StringIO()
    trials.to_csv(stream, index=False, lineterminator="\n")
    return stream.getvalue()


def check_onsets(table: TrialTable, first_s: np.ndarray, last_s: np.ndarray, dt: float) -> None:
    """Check that onset and end lie within the trial, the end after the onset.

    `first_s`, `last_s` (T,): first and last time of each trial's samples.
    `dt`: time between two samples; half of it is allowed for rounding.
    """
    trials = table.trials
    for name in ("onset_s", "end_s"):
        if name not in trials:
            continue
        times = trials[name].to_numpy(float)
        outside = np.flatnonzero((times < first_s - dt / 2) | (times > last_s + dt / 2))
        if len(outside):
            row = int(outside[0])
            expected = f"a time from {first_s[row]:g} to {last_s[row]:g} s"
            raise table.error(f"{times[row]:g} s lies outside of the trial", row, name, expected)
    if "onset_s" in trials and "end_s" in trials:
        late = np.flatnonzero(trials["end_s"].to_numpy(float) <= trials["onset_s"].to_numpy(float))
        if len(late):
            row = int(late[0])
            onset = trials["onset_s"].iloc[row]
            raise table.error(
                f"{trials['end_s'].iloc[row]:g} s is not after the onset",
                row,
                "end_s",
                f"a time after {onset:g} s",
            )


def _check_numbers(table: TrialTable, columns: dict[str, list[str]]) -> None:
    for name in (*NUMBER_COLUMNS, *OPTIONAL_NUMBER_COLUMNS):
        for row, cell in enumerate(columns.get(name, ())):
            value = number_of(cell)
            if value is not None and math.isfinite(value):
                continue
            missing = not cell.strip() or (value is not None and math.isnan(value))
            if missing and name in OPTIONAL_NUMBER_COLUMNS:
                continue
            problem = f"not a finite number: {cell!r}" if cell.strip() else "empty cell"
            raise table.error(problem, row, name, "a finite number")


def _check_rows(table: TrialTable) -> None:
    trial = table.trials["trial"]
    again = np.flatnonzero(trial.duplicated())
    if len(again):
        row = int(again[0])
        raise table.error(
            f"trial {trial.iloc[row]} appears twice", row, "trial", "one row per trial"
        )
    for name in ("q_shoulder_rad", "q_elbow_rad"):
        if name in table.trials:
            angle = table.trials[name].to_numpy(float)
            wrong = np.flatnonzero(np.abs(angle) > LARGEST_ANGLE_RAD)
            if len(wrong):
                row = int(wrong[0])
                raise table.error(f"{angle[row]:g} looks like degrees", row, name, "radians")


def _typed(cells: list[str]) -> pd.Series:
    """A column in the narrowest type for all cells: int, float, bool or text."""
    if all(_WHOLE_NUMBER.fullmatch(cell.strip()) for cell in cells):
        return pd.Series([int(cell) for cell in cells], dtype=np.int64)
    if set(cells) <= {"True", "False"}:
        return pd.Series([cell == "True" for cell in cells], dtype=bool)
    numbers = [number_of(cell) if cell.strip() else math.nan for cell in cells]
    if any(cell.strip() for cell in cells) and None not in numbers:
        return pd.Series(numbers, dtype=np.float64)
    return pd.Series(cells, dtype="str")


def _read_cells(file: Path) -> tuple[list[str], tuple[int, ...], list[list[str]]]:
    """Header, line numbers and cells of a CSV file; blank lines are skipped."""
    table = read_text_table(file, expected="a header and one row per trial")
    if not table.rows:
        raise InputError("holds no trials", file=file, expected="one row per trial")
    return list(table.header), table.lines, list(table.rows)
