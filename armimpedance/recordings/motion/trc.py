"""Marker files (`.trc`) and tables of ground reaction forces."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd

from armimpedance.core.arrays import FloatArray
from armimpedance.core.delimited import number_of
from armimpedance.core.errors import InputError
from armimpedance.core.findings import not_taken
from armimpedance.core.motion import MarkerRecording
from armimpedance.recordings.motion.moving_metadata import (
    LARGEST_PLACE_M,
    Y_UP,
    lab_rotation,
    metres_per,
)
from armimpedance.recordings.motion.opensim_tables import OpenSimTable, read_opensim_table
from armimpedance.recordings.motion.tabbed_text import (
    NumberRows,
    TextFile,
    cells,
    number_rows,
    sample_rate,
    stated_count,
    text_file,
    times,
)

#: Markers closer together than this are in metres that are called millimetres.
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
    may follow the axes. Markers without a name are not taken.

    `axes`: the file's axes that point forward, left and up; OpenSim's if not stated.
    Raises InputError: it is not a .trc file, it was cut, a cell is not a number, time steps are
    unequal, or the unit or the axes are not known.
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
    """The header's keys in lower case and their values."""
    if len(text.lines) < 6 or not text.lines[0].lstrip(' "').startswith("PathFileType"):
        expected = "PathFileType in the first of five lines of header"
        raise InputError("is no .trc file", file=text.file, row=1, expected=expected)
    keys, values = cells(text.lines[1]), cells(text.lines[2])
    full, filled = [k for k in keys if k], [v for v in values if v]
    # tabs and blanks between values, as aligned by old programs
    for lined_up in (filled, text.lines[2].split()):
        if "" in values[: len(keys)] or len(filled) < len(full) == len(lined_up):
            keys, values = full, lined_up
            break
    # some programs leave the last values out
    pairs = zip(keys, values, strict=False)
    return {key.lower(): value for key, value in pairs if key and value}


def _rate(header: dict[str, str], file: Path) -> float | None:
    text = header.get("datarate")
    if text is None:
        return None
    rate = number_of(text)
    if rate is None or not 0 < rate < 1e6:
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
    """The rows of the named markers, and sentences where the header disagrees."""
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
    """Positions in m in the world's frame; NaN if a coordinate is missing or all are exactly 0."""
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


# Ground reaction forces for markers: an OpenSim table with forces, points and torques.

#: The least load on a plate that is stood on, N.
_LEAST_LOAD_N: Final = 20.0
#: The largest possible force or torque on a body, N or N m.
_LARGEST: Final = 1e6
#: The part of the squared load that must point up, as a body presses on the ground.
_ONE_WAY: Final = 0.95
#: Extra samples, in marker samples, on each side for the filter's ends.
_MARGIN: Final = 10
#: The largest factors by which plates may be slower and faster than the markers.
_SLOWEST: Final = 10
_FASTEST: Final = 500
#: The largest denominator of the ratio of rates.
_FINEST_RATIO: Final = 1000


@dataclass(frozen=True)
class _Plate:
    """The columns of one plate: its force, the point of action and the free torque."""

    name: str
    force: tuple[str, str, str]
    point: tuple[str, str, str]
    torque: tuple[str, str, str]

    @property
    def columns(self) -> tuple[str, ...]:
        return (*self.force, *self.point, *self.torque)


def with_ground_forces(
    markers: MarkerRecording, path: str | os.PathLike[str], axes: Sequence[str]
) -> MarkerRecording:
    """Add the force plates of a table to a recording of markers.

    The table holds for each plate the force on the body (``ground_force_vx``, N), the point where
    it acts (``ground_force_px``, m) and the torque about that point (``ground_torque_x``, N m);
    ``1_``, ``R_``, ``_1_`` and similar parts of names distinguish several plates. Its times are
    the markers' times; another rate is resampled to theirs without delay.

    `markers`: one trial.
    `axes`: the table's axes that point forward, left and up.
    Raises InputError: there is no plate or one lacks a column, the table does not span the markers'
    time, a load points down, or a point is not in m.
    """
    table = read_opensim_table(path)
    plates = _plates(table)
    _check_clock(table, markers)
    rotation = lab_rotation(axes)
    loads = [_wrench(table, plate, rotation) for plate in plates]
    wrenches = np.stack([wrench for wrench, _ in loads], axis=1)
    used = {name for plate in plates for name in plate.columns}
    intro = f"Force plates from {Path(path).name}, the force on the body: "
    remarks = (
        f"{intro}{', '.join(plate.name for plate in plates)}.",
        *_slowed(table.sample_rate_hz, markers.sample_rate_hz),
        *table.remarks,
        *not_taken([n for n in table.columns if n not in used], "no force plate's"),
    )
    return replace(
        markers,
        wrenches=_at_markers(wrenches, table, markers),
        plate_origins_m=np.array([origin for _, origin in loads]),
        provenance=(*markers.provenance, *remarks),
    )


def _plates(table: OpenSimTable) -> tuple[_Plate, ...]:
    """Find the plates by the names of their columns."""
    plates = []
    for first in table.columns:
        if not (first.endswith("vx") and "force" in first.lower()):
            continue
        stem = first.removesuffix("vx")
        torque = stem.replace("force", "torque").replace("Force", "Torque")
        moment = stem.replace("force", "moment").replace("Force", "Moment")
        name_pairs = [(torque, ""), (stem, "m"), (moment, "m"), (moment, ""), (torque, "m")]
        start = next((a + b for a, b in name_pairs if f"{a}{b}x" in table.columns), torque)
        parts = [_three(stem + "v"), _three(stem + "p"), _three(start)]
        plate = _Plate(stem.strip("_") or "plate", *parts)
        for name in plate.columns:
            if name not in table.columns:
                expected = f"it beside {first}"
                raise InputError("no such column", file=table.file, column=name, expected=expected)
        plates.append(plate)
    if not plates:
        expected = "columns such as ground_force_vx, ground_force_px, ground_torque_x"
        raise InputError("no force plate", file=table.file, expected=expected)
    return tuple(plates)


def _three(start: str) -> tuple[str, str, str]:
    return start + "x", start + "y", start + "z"


def _check_clock(table: OpenSimTable, markers: MarkerRecording) -> None:
    time_s, rate = markers.time_s, markers.sample_rate_hz
    if not rate / _SLOWEST <= table.sample_rate_hz <= rate * _FASTEST:
        problem = f"forces at {table.sample_rate_hz:.6g} samples/s"
        expected = f"{rate / _SLOWEST:g} to {rate * _FASTEST:g}, for markers at {rate:g}"
        raise InputError(problem, file=table.file, column="time", expected=expected)
    step = 0.5 / table.sample_rate_hz
    if table.time_s[0] > time_s[0] + step or table.time_s[-1] < time_s[-1] - step:
        problem = f"forces from {table.time_s[0]:.6g} to {table.time_s[-1]:.6g} s"
        expected = f"the markers' time, {time_s[0]:.6g} to {time_s[-1]:.6g} s"
        raise InputError(problem, file=table.file, column="time", expected=expected)


def _wrench(
    table: OpenSimTable, plate: _Plate, rotation: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Wrench (S, 6) on the body in the world's frame about an origin (3,), and this origin.

    The origin is the mean point of action of the load, about which the moments are smallest.
    """
    force, torque = (
        np.column_stack([table.column(name) for name in names]) @ rotation.T
        for names in (plate.force, plate.torque)
    )
    largest = float(np.abs([force, torque]).max())
    if largest > _LARGEST:
        problem = f"{plate.name}: a force or torque of {largest:.4g}"
        raise InputError(problem, file=table.file, expected="N and N m")
    loaded = np.abs(force[:, 2]) > _LEAST_LOAD_N
    load = force[loaded, 2]
    if len(load) and (load[load > 0] ** 2).sum() < _ONE_WAY * (load**2).sum():
        problem = f"{plate.name}: its load does not point up"
        raise InputError(problem, file=table.file, expected="the force on the body; or other axes")
    point = np.column_stack([table.columns[name] for name in plate.point]) @ rotation.T
    lost = ~np.isfinite(point).all(axis=1)
    if (lost & loaded).any():
        at = table.time_s[np.flatnonzero(lost & loaded)[0]]
        problem = f"no point where the force acts at {at:.6g} s"
        column = plate.point[0]
        raise InputError(problem, file=table.file, column=column, expected="a point under a load")
    far = np.abs(point[loaded]).max(initial=0.0)
    if far > LARGEST_PLACE_M:
        problem = f"a force that acts {far:.4g} m away"
        raise InputError(problem, file=table.file, column=plate.point[0], expected="points in m")
    origin = np.average(point[loaded], axis=0, weights=load) if len(load) else np.zeros(3)
    # without a load many programs give no point; the force is noise then
    point[lost] = origin
    return np.hstack([force, torque + np.cross(point - origin, force)]), origin


def _at_markers(wrenches: FloatArray, table: OpenSimTable, markers: MarkerRecording) -> FloatArray:
    """The wrenches (N, K, 6) at the times of the markers."""
    time = markers.time_s
    ratio = _ratio(table.sample_rate_hz, markers.sample_rate_hz)
    up, down = ratio.numerator, ratio.denominator
    # the plates' rate as an exact ratio to the markers' rate, to avoid drift
    rate = markers.sample_rate_hz * down / up
    before = min(int((time[0] - table.time_s[0]) * rate + 1e-6), _MARGIN * down)
    before -= before % down
    after = int(np.ceil((len(time) - 1) * down / up)) + 1 + _MARGIN * down
    # the first sample that is kept is at the markers' first time
    plate_times = time[0] + np.arange(-before, after) / rate
    plate_times = plate_times[plate_times <= max(table.time_s[-1], time[-1]) + 1e-9]
    flat = wrenches.reshape(len(wrenches), -1)
    resampled = np.column_stack([np.interp(plate_times, table.time_s, column) for column in flat.T])
    if ratio != 1:
        resampled = _resampled(resampled, up, down)
    skip = before // down * up
    return resampled[skip : skip + len(time)].reshape(len(time), *wrenches.shape[1:])


def _resampled(values: FloatArray, up: int, down: int) -> FloatArray:
    from scipy.signal import resample_poly

    # the filter removes all above half the lower rate; below, it is flat without phase
    resampled = resample_poly(values, up, down, axis=0, padtype="antireflect")  # type: ignore[call-overload]
    return np.asarray(resampled, dtype=np.float64)


def _ratio(rate_hz: float, wanted_hz: float) -> Fraction:
    return Fraction(wanted_hz / rate_hz).limit_denominator(_FINEST_RATIO)


def _slowed(rate_hz: float, wanted_hz: float) -> tuple[str, ...]:
    if _ratio(rate_hz, wanted_hz) == 1:
        return ()
    return (f"Force plates: {rate_hz:.5g} brought to {wanted_hz:g} samples/s, without delay.",)
