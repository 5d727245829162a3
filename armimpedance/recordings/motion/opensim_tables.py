"""OpenSim's tables (`.mot`, `.sto`): headers, numbers, and joint motion from them."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Final

import numpy as np
import pandas as pd

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.conventions import LARGEST_ANGLE_RAD
from armimpedance.core.errors import InputError
from armimpedance.core.findings import not_taken
from armimpedance.core.motion import MotionRecording
from armimpedance.core.skeleton import Skeleton
from armimpedance.recordings.motion.tabbed_text import (
    TextFile,
    cells,
    in_even_steps,
    number_rows,
    stated_count,
    text_file,
    times,
)

# Headers of OpenSim's and SIMM's tables: keys, the names of the columns, the unit of angles.

#: The longest header in lines.
_LONGEST_HEADER: Final = 200
#: The number of comma-separated numbers in a cell, by the header's DataType.
_PARTS: Final = {
    "double": 1,
    "vec2": 2,
    "vec3": 3,
    "unitvec3": 3,
    "vec4": 4,
    "quaternion": 4,
    "vec5": 5,
    "vec6": 6,
    "spatialvec": 6,
}
#: Sentences by which older programs state the unit.
_SENTENCES: Final = {"angles are in degrees": True, "angles are in radians": False}


@dataclass(frozen=True)
class OpenSimHeader:
    """The header above the rows.

    `names`: of all columns except the first, which is the time; as in the file.
    `parts`: number of numbers in each of their cells.
    `in_degrees`: None where the header does not state it, or is contradictory.
    `rows`: the number of rows as stated.
    `first`: the line (from 0) after the names.
    """

    names: tuple[str, ...]
    parts: int
    in_degrees: bool | None
    rows: str | None
    first: int
    remarks: tuple[str, ...]

    @property
    def columns(self) -> tuple[str, ...]:
        """A name for each column of numbers except the time; "" where the name is not unique.

        Parts of a cell are numbered as OpenSim does: ``marker_1, marker_2, marker_3``.
        """
        if self.parts == 1:
            flat = list(self.names)
        else:
            flat = [f"{n}_{i}" for n in self.names for i in range(1, self.parts + 1)]
        often = Counter(flat)
        return tuple(name if often[name] == 1 else "" for name in flat)

    @property
    def twice(self) -> tuple[str, ...]:
        """Names of two or more columns."""
        return tuple(name for name, count in Counter(self.names).items() if name and count > 1)


def read_header(text: TextFile) -> OpenSimHeader:
    """Read the header above the rows: either form in use, ending with `endheader`.

    Raises InputError: there is no such header, the first column is not the time, or the header's
    entry on angles or cells is not known.
    """
    end = _end_of_header(text)
    keys = _keys(text.lines[:end])
    at = next((i for i in range(end + 1, len(text.lines)) if text.lines[i].strip(' \t,"')), None)
    if at is None:
        expected = "time, …"
        raise InputError(
            "no columns after endheader", file=text.file, row=end + 1, expected=expected
        )
    stated = [keys[key] for key in ("ncolumns", "datacolumns") if key in keys]
    names = _names(text.lines[at], stated)
    if not names or names[0].lower() != "time":
        shown = names[0] if names else ""
        problem = f"the first column is {shown!r}"
        raise InputError(problem, file=text.file, row=at + 1, expected="time")
    degrees, remarks = _in_degrees(keys, text.lines[:end], text)
    for count in dict.fromkeys(stated):
        remarks += stated_count(count, len(names), "columns", text)
    rows = [keys[key] for key in ("nrows", "datarows") if key in keys]
    return OpenSimHeader(
        names=tuple(names[1:]),
        parts=_parts(keys.get("datatype", "double"), text),
        in_degrees=degrees,
        rows=rows[0] if rows else None,
        first=at + 1,
        remarks=(*text.remarks, *remarks),
    )


def _plain(line: str) -> str:
    """A header line without the characters that a spreadsheet adds."""
    return line.strip(' \t\r,;"')


def _end_of_header(text: TextFile) -> int:
    for i, line in enumerate(text.lines[:_LONGEST_HEADER]):
        if _plain(line).lower() == "endheader":
            return i
    expected = "an OpenSim table (.mot or .sto)"
    raise InputError("no line 'endheader'", file=text.file, expected=expected)


def _keys(lines: list[str]) -> dict[str, str]:
    """Keys of the header: ``nRows=700`` and ``datarows 700``."""
    keys: dict[str, str] = {}
    for line in map(_plain, lines):
        parts = line.split("=", 1) if "=" in line else line.split(None, 1)
        if len(parts) == 2 and parts[1].strip():
            keys[parts[0].strip().lower()] = parts[1].strip()
    return keys


def _names(line: str, stated: list[str]) -> list[str]:
    names = cells(line)
    while names and not names[-1]:
        names.pop()
    while names and not names[0]:
        names.pop(0)
    # a mixture of tabs and blanks, as in files edited by hand
    split_at_blanks = line.split()
    return (
        split_at_blanks
        if str(len(names)) not in stated and str(len(split_at_blanks)) in stated
        else names
    )


def _parts(kind: str, text: TextFile) -> int:
    parts = _PARTS.get(kind.lower())
    if parts is None:
        expected = "double, Vec3, Quaternion or SpatialVec"
        raise InputError(f"DataType={kind[:40]}", file=text.file, expected=expected)
    return parts


def _in_degrees(
    keys: Mapping[str, str], lines: list[str], text: TextFile
) -> tuple[bool | None, tuple[str, ...]]:
    """True if the key or a sentence states degrees, False for radians; None if they disagree."""
    plain = {_plain(line).rstrip(".").lower() for line in lines}
    statements = {degrees for sentence, degrees in _SENTENCES.items() if sentence in plain}
    key = keys.get("indegrees")
    if key is not None:
        if key.lower() not in ("yes", "no"):
            raise InputError(f"inDegrees={key[:40]}", file=text.file, expected="yes or no")
        statements.add(key.lower() == "yes")
    if len(statements) > 1:
        return None, ("Its header says of its angles both degrees and radians.",)
    return (statements.pop() if statements else None), ()


@dataclass(frozen=True)
class OpenSimTable(FrozenRecord):
    """Columns over time, as in the file.

    `time_s` (S,).
    `columns` mapping str -> (S,): in the file's own units; NaN where the file has no number.
    `in_degrees`: the unit of angles that the file states; None if it states none.
    `twice`: names of two or more columns, which are not among `columns`.
    `remarks`: sentences on content that contradicts the header or was not taken.
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

        Raises InputError: there is no such column or more than one, or it has gaps.
        """
        if name in self.twice:
            expected = "another name for one of the two"
            raise InputError(
                "appears twice in the header", file=self.file, column=name, expected=expected
            )
        if name not in self.columns:
            available = ", ".join(self.columns)
            raise InputError(
                "no such column", file=self.file, column=name, expected=f"one of {available}"
            )
        values = self.columns[name]
        gaps = np.flatnonzero(np.isnan(values))
        if len(gaps):
            problem = f"not a finite number: 'nan' at {self.time_s[gaps[0]]:.6g} s"
            raise InputError(problem, file=self.file, column=name, expected="numbers without gaps")
        return values

    def angles(self, names: tuple[str, ...], in_degrees: bool | None = None) -> FloatArray:
        """These columns side by side in rad, (S, len(names)).

        `in_degrees`: unit of the angles where the file does not state it; the file's statement
        has priority.
        Raises InputError: no such column, it has gaps, its unit is not stated, or degrees are
        called radians.
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
                expected="radians, as stated",
            )
        return angles


def read_opensim_table(path: str | os.PathLike[str]) -> OpenSimTable:
    """Read a `.mot` or `.sto` file.

    The header ends with `endheader`; the line after it names the columns, the first of which is
    `time`. Cells are separated by tabs, blanks or commas. Of cells of several numbers
    (``DataType=Vec3``) each number is a column, named as in OpenSim: ``marker_1``. A row that
    appears twice, as integrators write them, is read once.

    Raises InputError: there is no such header, a cell is not a number, the file was cut, or time
    steps are unequal and the columns are too rough to be interpolated.
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
    time, columns, rate, step_remarks = in_even_steps(time, columns, text.file)
    remarks += step_remarks
    return OpenSimTable(str(path), time, rate, columns, header.in_degrees, header.twice, remarks)


def _nameless(header: OpenSimHeader) -> tuple[str, ...]:
    """Sentences on columns without a unique name."""
    unnamed = [f"column {i}" for i, name in enumerate(header.names, start=2) if not name]
    return (
        *not_taken(unnamed, "without a name"),
        *not_taken(header.twice, "two columns or more of this name"),
    )


# Joint motion of a skeleton from a table of OpenSim.


def opensim_motion(
    path: str | os.PathLike[str],
    skeleton: Skeleton,
    names: Mapping[str, str] | None = None,
    *,
    in_degrees: bool | None = None,
) -> MotionRecording:
    """Read the joint motion of a skeleton from a table of angles.

    `skeleton`: its root's coordinates are 0 if the table has none, as the table's root belongs to
    another model.
    `names`: coordinate -> column of the table, where the names differ; ``-column`` turns the sign.
    The skeleton's other coordinates have their own names, also as paths
    (``/jointset/elbow/elbow_flexion/value``), or are 0, which the provenance states.
    `in_degrees`: unit of the angles where the file does not state it.
    Raises InputError: see `OpenSimTable.angles`; or none of the skeleton's coordinates is in the
    table.
    """
    table = read_opensim_table(path)
    renamed = dict(names or {})
    for coordinate in renamed:
        skeleton.coordinate(coordinate)
    hinges = [c for c in skeleton.coordinates if c not in skeleton.root_coordinates]
    plain = {name: name for name in (*table.columns, *table.twice)}
    column_of = {**_by_path(table.columns), **plain, **renamed}
    chosen = {c: column_of[c] for c in hinges if c in column_of}
    if not chosen:
        expected = f"one of {', '.join(hinges)}, or names"
        raise InputError("none of the skeleton's angles", file=path, expected=expected)
    columns = tuple(column.removeprefix("-") for column in chosen.values())
    angles = table.angles(columns, in_degrees)
    q = np.zeros((len(table.time_s), len(skeleton.coordinates)))
    for i, (coordinate, column) in enumerate(chosen.items()):
        q[:, skeleton.coordinate(coordinate)] = angles[:, i] * (-1 if column.startswith("-") else 1)
    absent = [c for c in skeleton.coordinates if c not in chosen]
    remarks = ["Read from an OpenSim table.", *table.remarks]
    if absent:
        remarks.append(f"Not in the table, set to 0: {', '.join(absent)}.")
    remarks += not_taken(
        [name for name in table.columns if name not in columns], "no coordinate of the skeleton"
    )
    return MotionRecording(
        sample_rate_hz=table.sample_rate_hz,
        trials=pd.DataFrame({"trial": [1], "condition": [Path(path).stem]}),
        offsets=np.array([0, len(q)]),
        time_s=table.time_s,
        coordinates=q,
        skeleton=skeleton,
        provenance=tuple(remarks),
    )


def _by_path(columns: Iterable[str]) -> dict[str, str]:
    """Coordinate -> column, where columns are named by their path in a model."""
    paths = [name.split("/") for name in columns]
    return {path[-2]: "/".join(path) for path in paths if len(path) > 2 and path[-1] == "value"}
