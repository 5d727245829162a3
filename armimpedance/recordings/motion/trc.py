"""Marker files of OpenSim and Motion Analysis (`.trc`)."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from armimpedance.arrays import FloatArray
from armimpedance.errors import InputError
from armimpedance.motion import MarkerRecording
from armimpedance.recordings.motion.lab_axes import Y_UP, lab_rotation, metres_per
from armimpedance.recordings.motion.moving_metadata import LARGEST_PLACE_M
from armimpedance.recordings.motion.tabbed_text import cells, number_rows, sample_rate, text_lines


def read_trc(path: str | os.PathLike[str], *, axes: Sequence[str] = Y_UP) -> MarkerRecording:
    """Read the markers of one trial.

    Three lines of header (the second names `DataRate` and `Units`, the third holds their values),
    the markers' names, their axes, then `Frame#`, `Time` and three numbers per marker; empty where
    a marker was not seen.

    Parameters
    ----------
    path : path
    axes : sequence of three str
        The file's axes that point forward, left and up; OpenSim's if not stated.

    Raises
    ------
    InputError
        It is no such file, a cell is no number, time does not run in equal steps, or the unit or
        the axes are not known.
    """
    file = Path(path)
    rotation = lab_rotation(axes)
    lines = text_lines(file)
    header = _header(lines, file)
    names, first = _markers(lines, file)
    rows = number_rows(lines, first, 2 + 3 * len(names), file, gaps=True)
    time = rows[:, 1]
    if not np.isfinite(time).all():
        raise InputError("a row without a time", file=file, column="Time", expected="a number")
    rate = sample_rate(time, file, _rate(header, file))
    places = rows[:, 2:].reshape(len(rows), len(names), 3)
    return MarkerRecording(
        sample_rate_hz=rate,
        trials=pd.DataFrame({"trial": [1], "condition": [file.stem]}),
        offsets=np.array([0, len(rows)]),
        time_s=time,
        positions=_world(places, header.get("Units", "mm"), rotation, file),
        names=names,
        provenance=(f"Read from .trc; forward, left and up are the file's {', '.join(axes)}.",),
    )


def _header(lines: list[str], file: Path) -> dict[str, str]:
    if len(lines) < 6 or not lines[0].startswith("PathFileType"):
        expected = "PathFileType in the first of five lines of header"
        raise InputError("is no .trc file", file=file, row=1, expected=expected)
    # some programs leave the last values out
    pairs = zip(cells(lines[1]), cells(lines[2]), strict=False)
    return {key: value for key, value in pairs if key and value}


def _rate(header: dict[str, str], file: Path) -> float | None:
    text = header.get("DataRate")
    try:
        rate = None if text is None else float(text)
    except ValueError:
        rate = -1.0
    if rate is not None and not 0 < rate < 1e6:
        raise InputError(f"DataRate {text}", file=file, row=3, expected="a positive number")
    return rate


def _markers(lines: list[str], file: Path) -> tuple[tuple[str, ...], int]:
    """Names of the markers, and the line (from 0) of the first row."""
    line = cells(lines[3])
    if [c.lower() for c in line[:2]] != ["frame#", "time"]:
        expected = "Frame#, Time and the markers' names"
        raise InputError("no names of markers", file=file, row=4, expected=expected)
    names = tuple(name for name in line[2:] if name)
    if not names or len(set(names)) < len(names):
        raise InputError("no markers, or two of one name", file=file, row=4)
    under = [c for c in cells(lines[4]) if c]
    if len(under) != 3 * len(names):
        problem = f"{len(under)} axes for {len(names)} markers"
        raise InputError(problem, file=file, row=5, expected="X1, Y1, Z1, …")
    return names, 5


def _world(places: FloatArray, unit: str, rotation: FloatArray, file: Path) -> FloatArray:
    """Places in m in the world's frame; lost where a coordinate is lost or all are exactly 0."""
    lost = np.isnan(places).any(axis=2) | ~places.any(axis=2)
    metres = places * metres_per(unit, file) @ rotation.T
    metres[lost] = np.nan
    far = np.nanmax(np.abs(metres), initial=0.0)
    if far > LARGEST_PLACE_M:
        expected = "the file's Units"
        raise InputError(f"a marker {far:.4g} m away in {unit}", file=file, expected=expected)
    return metres
