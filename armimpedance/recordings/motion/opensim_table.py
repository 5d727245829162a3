"""OpenSim's tables of motion (`.mot`, `.sto`), with either header in use."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd

from armimpedance.arrays import FloatArray, FrozenRecord
from armimpedance.errors import InputError
from armimpedance.motion import MotionRecording
from armimpedance.recordings.motion.tabbed_text import cells, number_rows, sample_rate, text_lines
from armimpedance.recordings.tables.sample_table import LARGEST_ANGLE_RAD
from armimpedance.skeleton import Skeleton

#: So many lines without `endheader` are no header.
_LONGEST_HEADER = 200


@dataclass(frozen=True)
class OpenSimTable(FrozenRecord):
    """Columns over time, as in the file.

    Attributes
    ----------
    file : str
    time_s : (S,)
    sample_rate_hz : float
    columns : mapping str -> (S,)
        In the file's own units.
    in_degrees : bool or None
        Whether the file says that its angles are in degrees; None where it does not say.
    """

    file: str
    time_s: Annotated[FloatArray, "S"]
    sample_rate_hz: float
    columns: Mapping[str, FloatArray] = field(default_factory=dict)
    in_degrees: bool | None = None

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
            No such column, nobody says which unit it is, or degrees are called radians.
        """
        degrees = self.in_degrees if self.in_degrees is not None else in_degrees
        for name in names:
            if name not in self.columns:
                there = ", ".join(self.columns)
                raise InputError(
                    "no such column", file=self.file, column=name, expected=f"one of {there}"
                )
        if degrees is None:
            expected = "inDegrees=yes or no in its header, or in_degrees"
            raise InputError("says no unit of its angles", file=self.file, expected=expected)
        values = np.column_stack([self.columns[name] for name in names])
        if degrees:
            return np.deg2rad(values)
        large = np.flatnonzero(np.abs(values).max(axis=0) > LARGEST_ANGLE_RAD)
        if len(large):
            most = np.abs(values[:, large[0]]).max()
            raise InputError(
                f"{most:g} looks like degrees",
                file=self.file,
                column=names[large[0]],
                expected="radians, as its header says",
            )
        return values


def read_opensim_table(path: str | os.PathLike[str]) -> OpenSimTable:
    """Read a `.mot` or `.sto` file.

    The header ends with `endheader`; the line after it names the columns, the first of which is
    `time`. Cells are separated by tabs, blanks or commas.

    Raises
    ------
    InputError
        No such header, a column stands twice, a cell is no number, or time does not run in equal
        steps.
    """
    file = Path(path)
    lines = text_lines(file)
    end = _end_of_header(lines, file)
    at = next((i for i in range(end + 1, len(lines)) if lines[i].strip()), None)
    if at is None:
        raise InputError("no columns after endheader", file=file, row=end + 1, expected="time, …")
    names = [name for name in cells(lines[at]) if name]
    if not names or names[0].lower() != "time":
        shown = names[0] if names else ""
        raise InputError(f"the first column is {shown!r}", file=file, row=at + 1, expected="time")
    for name in names:
        if names.count(name) > 1:
            raise InputError("stands twice in the header", file=file, row=at + 1, column=name)
    rows = number_rows(lines, at + 1, len(names), file)
    header = _keys(lines[:end])
    _check_size(header, rows, file)
    columns = {name: rows[:, i].copy() for i, name in enumerate(names) if i > 0}
    rate = sample_rate(rows[:, 0], file)
    return OpenSimTable(str(path), rows[:, 0], rate, columns, _in_degrees(header, file))


def opensim_motion(
    path: str | os.PathLike[str],
    skeleton: Skeleton,
    names: Mapping[str, str] | None = None,
    *,
    in_degrees: bool | None = None,
) -> MotionRecording:
    """Joint motion of a skeleton from a table of angles.

    Parameters
    ----------
    path : path
    skeleton : Skeleton
        Its root's coordinates are 0 where the table has none: the table's own root is another
        model's.
    names : mapping, optional
        Coordinate -> column of the table, where the names differ; ``-column`` turns the sign. The
        skeleton's other coordinates have their own names, or are 0, which the provenance tells.
    in_degrees : bool, optional
        Unit of the angles where the file does not state it.

    Raises
    ------
    InputError
        See `OpenSimTable.angles`; or none of the skeleton's coordinates is in the table.
    """
    table = read_opensim_table(path)
    given = dict(names or {})
    for coordinate in given:
        skeleton.coordinate(coordinate)
    hinges = [c for c in skeleton.coordinates if c not in skeleton.root_coordinates]
    chosen = {c: given.get(c, c) for c in hinges if c in given or c in table.columns}
    if not chosen:
        expected = f"one of {', '.join(hinges)}, or names"
        raise InputError("none of the skeleton's angles", file=path, expected=expected)
    columns = tuple(column.removeprefix("-") for column in chosen.values())
    angles = table.angles(columns, in_degrees)
    q = np.zeros((len(table.time_s), len(skeleton.coordinates)))
    for i, (coordinate, column) in enumerate(chosen.items()):
        q[:, skeleton.coordinate(coordinate)] = angles[:, i] * (-1 if column.startswith("-") else 1)
    absent = [c for c in skeleton.coordinates if c not in chosen]
    remarks = ["Read from an OpenSim table."]
    if absent:
        remarks.append(f"Not in the table, set to 0: {', '.join(absent)}.")
    return MotionRecording(
        sample_rate_hz=table.sample_rate_hz,
        trials=pd.DataFrame({"trial": [1], "condition": [Path(path).stem]}),
        offsets=np.array([0, len(q)]),
        time_s=table.time_s,
        coordinates=q,
        skeleton=skeleton,
        provenance=tuple(remarks),
    )


def _end_of_header(lines: list[str], file: Path) -> int:
    for i, line in enumerate(lines[:_LONGEST_HEADER]):
        if line.strip().lower() == "endheader":
            return i
    raise InputError("no line 'endheader'", file=file, expected="an OpenSim table (.mot or .sto)")


def _keys(lines: list[str]) -> dict[str, str]:
    """Keys of the header: ``nRows=700`` and ``datarows 700``."""
    keys = {}
    for line in lines:
        parts = line.split("=", 1) if "=" in line else line.split(None, 1)
        if len(parts) == 2 and parts[1].strip():
            keys[parts[0].strip().lower()] = parts[1].strip()
    return keys


def _in_degrees(header: Mapping[str, str], file: Path) -> bool | None:
    text = header.get("indegrees")
    if text is None:
        return None
    if text.lower() not in ("yes", "no"):
        raise InputError(f"inDegrees={text}", file=file, expected="yes or no")
    return text.lower() == "yes"


def _check_size(header: Mapping[str, str], rows: FloatArray, file: Path) -> None:
    for keys, have, what in (
        (("nrows", "datarows"), len(rows), "rows"),
        (("ncolumns", "datacolumns"), rows.shape[1], "columns"),
    ):
        for key in keys:
            text = header.get(key)
            if text is not None and text != str(have):
                expected = f"{text}, as its header says"
                raise InputError(f"{have} {what}", file=file, expected=expected)
