"""Marker files of OpenSim and Motion Analysis (`.trc`)."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.motion import MarkerRecording
from armimpedance.core.not_taken import not_taken
from armimpedance.recordings.motion.lab_axes import Y_UP, lab_rotation, metres_per
from armimpedance.recordings.motion.moving_metadata import LARGEST_PLACE_M
from armimpedance.recordings.motion.tabbed_text import (
    NumberRows,
    TextFile,
    cells,
    number_rows,
    stated_count,
    text_file,
)
from armimpedance.recordings.motion.table_times import sample_rate, times

#: Markers that are all so near to each other are no body: metres that are called millimetres.
_SMALLEST_BODY_M: Final = 0.02
_AXIS: Final = re.compile(r"[XYZxyz]\d*")


@dataclass(frozen=True)
class _Markers:
    """Names of the markers, and the line (from 0) of the first row."""

    names: tuple[str, ...]
    first: int


def read_trc(path: str | os.PathLike[str], *, axes: Sequence[str] = Y_UP) -> MarkerRecording:
    """Read the markers of one trial.

    Three lines of header (the second names `DataRate` and `Units`, the third holds their values),
    the markers' names, their axes, then `Frame#`, `Time` and three numbers per marker; empty or
    "nan" where a marker was not seen. Cells are separated by tabs, commas or blanks; a blank line
    below the axes may be there. Markers beyond those that are named are not taken.

    Parameters
    ----------
    path : path
    axes : sequence of three str
        The file's axes that point forward, left and up; OpenSim's if not stated.

    Raises
    ------
    InputError
        It is no such file, it was cut, a cell is no number, time does not run in equal steps, or
        the unit or the axes are not known.
    """
    rotation = lab_rotation(axes)
    text = text_file(Path(path))
    header = _header(text)
    markers = _markers(text)
    rows, remarks = _rows(text, header, markers)
    time, rows, twice = times(rows, 1, text.file)
    if twice:
        remarks += (f"Rows that stand there twice, read once: {twice}.",)
    rate = sample_rate(time, text.file, _rate(header, text.file))
    places = rows.values[:, 2:].reshape(len(time), len(markers.names), 3)
    unit = header.get("units", "")
    return MarkerRecording(
        sample_rate_hz=rate,
        trials=pd.DataFrame({"trial": [1], "condition": [text.file.stem]}),
        offsets=np.array([0, len(time)]),
        time_s=time,
        positions=_world(places, unit, rotation, text.file),
        names=markers.names,
        provenance=(
            f"Read from .trc; forward, left and up are the file's {', '.join(axes)}.",
            *text.remarks,
            *remarks,
        ),
    )


def _header(text: TextFile) -> dict[str, str]:
    """The header's keys in small letters and their values."""
    if len(text.lines) < 6 or not text.lines[0].lstrip(' "').startswith("PathFileType"):
        expected = "PathFileType in the first of five lines of header"
        raise InputError("is no .trc file", file=text.file, row=1, expected=expected)
    keys, values = cells(text.lines[1]), cells(text.lines[2])
    full, apart = [k for k in keys if k], [v for v in values if v]
    # tabs and blanks between values, as old programs line them up
    for lined_up in (apart, text.lines[2].split()):
        if "" in values[: len(keys)] or len(apart) < len(full) == len(lined_up):
            keys, values = full, lined_up
            break
    # some programs leave the last values out
    pairs = zip(keys, values, strict=False)
    return {key.lower(): value for key, value in pairs if key and value}


def _rate(header: dict[str, str], file: Path) -> float | None:
    text = header.get("datarate")
    try:
        rate = None if text is None else float(text)
    except ValueError:
        rate = -1.0
    if rate is not None and not 0 < rate < 1e6:
        raise InputError(f"DataRate {text}", file=file, row=3, expected="a positive number")
    return rate


def _markers(text: TextFile) -> _Markers:
    line = cells(text.line(3))
    if not _begins(line):
        line = text.line(3).split()
    if not _begins(line):
        expected = "Frame#, Time and the markers' names"
        raise InputError("no names of markers", file=text.file, row=4, expected=expected)
    names = tuple(name for name in line[2:] if name)
    if not names:
        raise InputError("no markers", file=text.file, row=4, expected="names after Time")
    twice = [name for i, name in enumerate(names) if name in names[:i]]
    if twice:
        problem = f"two of one name: {twice[0]}"
        raise InputError(problem, file=text.file, row=4, expected="markers of different names")
    under = [c for c in cells(text.line(4)) if c]
    if not under or not all(_AXIS.fullmatch(c) for c in under):
        return _Markers(names, 4)
    if len(under) != 3 * len(names):
        problem = f"{len(under)} axes for {len(names)} markers"
        raise InputError(problem, file=text.file, row=5, expected="X1, Y1, Z1, …")
    return _Markers(names, 5)


def _begins(line: list[str]) -> bool:
    return [c.lower() for c in line[:2]] in (["frame#", "time"], ["frame#", "times"])


def _rows(
    text: TextFile, header: dict[str, str], markers: _Markers
) -> tuple[NumberRows, tuple[str, ...]]:
    """The rows of the named markers, and sentences on what the header says otherwise."""
    named, stated = len(markers.names), header.get("nummarkers", "")
    nameless = stated.isascii() and stated.isdigit() and int(stated[:9]) > named
    width = 2 + 3 * named
    rows = number_rows(text, markers.first, width, gaps=True, further=nameless)
    remarks = stated_count(header.get("numframes"), len(rows.values), "rows", text)
    remarks += stated_count(stated or None, named, "markers with a name", text)
    if rows.further:
        remarks += not_taken([f"{rows.further} columns"], "beyond the markers with a name")
    return rows, remarks


def _world(places: FloatArray, unit: str, rotation: FloatArray, file: Path) -> FloatArray:
    """Places in m in the world's frame; lost where a coordinate is lost or all are exactly 0."""
    if not unit:
        raise InputError("no unit of length", file=file, row=3, expected="Units of m or mm")
    lost = np.isnan(places).any(axis=2) | ~places.any(axis=2)
    metres = places * metres_per(unit, file) @ rotation.T
    metres[lost] = np.nan
    seen = metres[~lost]
    far = np.abs(seen).max(initial=0.0)
    if far > LARGEST_PLACE_M:
        expected = "the file's Units"
        raise InputError(f"a marker {far:.4g} m away in {unit}", file=file, expected=expected)
    if len(seen) and places.shape[1] > 2 and np.ptp(seen, axis=0).max() < _SMALLEST_BODY_M:
        problem = f"all markers within {1000 * np.ptp(seen, axis=0).max():.3g} mm in {unit}"
        raise InputError(problem, file=file, expected="the file's Units")
    return metres
