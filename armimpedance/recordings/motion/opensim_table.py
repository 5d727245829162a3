"""OpenSim's tables of motion (`.mot`, `.sto`), with any header in use."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.conventions import LARGEST_ANGLE_RAD
from armimpedance.core.errors import InputError
from armimpedance.core.not_taken import not_taken
from armimpedance.recordings.motion.opensim_header import OpenSimHeader, read_header
from armimpedance.recordings.motion.tabbed_text import number_rows, stated_count, text_file
from armimpedance.recordings.motion.table_times import sample_rate, times


@dataclass(frozen=True)
class OpenSimTable(FrozenRecord):
    """Columns over time, as in the file.

    Attributes
    ----------
    file : str
    time_s : (S,)
    sample_rate_hz : float
    columns : mapping str -> (S,)
        In the file's own units; NaN where the file has no number.
    in_degrees : bool or None
        Whether the file says that its angles are in degrees; None where it does not say.
    twice : tuple of str
        Names of two columns or more, none of which is among `columns`.
    remarks : tuple of str
        Sentences on what in the file is not as its header says, or was not taken.
    """

    file: str
    time_s: Annotated[FloatArray, "S"]
    sample_rate_hz: float
    columns: Mapping[str, FloatArray] = field(default_factory=dict)
    in_degrees: bool | None = None
    twice: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()

    def column(self, name: str) -> FloatArray:
        """One column, (S,).

        Raises
        ------
        InputError
            There is no such column or more than one, or it has gaps.
        """
        if name in self.twice:
            expected = "another name for one of the two"
            raise InputError(
                "stands twice in the header", file=self.file, column=name, expected=expected
            )
        if name not in self.columns:
            there = ", ".join(self.columns)
            raise InputError(
                "no such column", file=self.file, column=name, expected=f"one of {there}"
            )
        values = self.columns[name]
        gaps = np.flatnonzero(np.isnan(values))
        if len(gaps):
            problem = f"not a finite number: 'nan' at {self.time_s[gaps[0]]:.6g} s"
            raise InputError(problem, file=self.file, column=name, expected="numbers without gaps")
        return values

    def angles(self, names: tuple[str, ...], in_degrees: bool | None = None) -> FloatArray:
        """These columns side by side in rad, (S, len(names)).

        Parameters
        ----------
        names : tuple of str
        in_degrees : bool, optional
            Unit of the angles where the file does not state it; what the file states comes first.

        Raises
        ------
        InputError
            No such column, it has gaps, nobody says which unit it is, or degrees are called
            radians.
        """
        degrees = self.in_degrees if self.in_degrees is not None else in_degrees
        values = [self.column(name) for name in names]
        angles = np.column_stack(values)
        if degrees is None:
            problem = f"says no unit of its angles, which reach {np.abs(angles).max():.4g}"
            expected = "inDegrees=yes or no in its header, or in_degrees"
            raise InputError(problem, file=self.file, expected=expected)
        if degrees:
            return np.deg2rad(angles)
        large = np.flatnonzero(np.abs(angles).max(axis=0) > LARGEST_ANGLE_RAD)
        if len(large):
            most = np.abs(angles[:, large[0]]).max()
            raise InputError(
                f"{most:g} looks like degrees",
                file=self.file,
                column=names[large[0]],
                expected="radians, as told",
            )
        return angles


def read_opensim_table(path: str | os.PathLike[str]) -> OpenSimTable:
    """Read a `.mot` or `.sto` file.

    The header ends with `endheader`; the line after it names the columns, the first of which is
    `time`. Cells are separated by tabs, blanks or commas. Of cells of several numbers
    (``DataType=Vec3``) each number is a column, named as OpenSim does: ``marker_1``. A row that
    stands there twice, as integrators write them, is read once.

    Raises
    ------
    InputError
        No such header, a cell is no number, the file was cut, or time does not run in equal steps.
    """
    text = text_file(Path(path))
    header = read_header(text)
    width = 1 + len(header.columns)
    rows = number_rows(text, header.first, width, parts=header.parts)
    remarks = header.remarks + stated_count(header.rows, len(rows.values), "rows", text)
    time, rows, twice = times(rows, 0, text.file)
    if twice:
        remarks += (f"Rows that stand there twice, read once: {twice}.",)
    remarks += _nameless(header)
    columns = {n: rows.values[:, i].copy() for i, n in enumerate(header.columns, start=1) if n}
    rate = sample_rate(time, text.file)
    return OpenSimTable(str(path), time, rate, columns, header.in_degrees, header.twice, remarks)


def _nameless(header: OpenSimHeader) -> tuple[str, ...]:
    """Sentences on columns that no name tells apart."""
    unnamed = [f"column {i}" for i, name in enumerate(header.names, start=2) if not name]
    return (
        *not_taken(unnamed, "without a name"),
        *not_taken(header.twice, "two columns or more of this name"),
    )
