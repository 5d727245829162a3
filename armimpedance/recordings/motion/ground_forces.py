"""Ground reaction forces beside markers: a table of OpenSim with forces, points and torques."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.motion import MarkerRecording
from armimpedance.core.not_taken import not_taken
from armimpedance.recordings.motion.lab_axes import lab_rotation
from armimpedance.recordings.motion.moving_metadata import LARGEST_PLACE_M
from armimpedance.recordings.motion.opensim_table import OpenSimTable, read_opensim_table

#: A plate that bears less than this is not stood upon, N.
_LEAST_LOAD_N: Final = 20.0
#: No body is under such a force or torque, N or N m.
_LARGEST: Final = 1e6
#: Part of the load (its square) that must point up: a body presses on the ground.
_ONE_WAY: Final = 0.95
#: So many of the markers' samples beside their time steady the filter's ends.
_BESIDE: Final = 10
#: How many times slower and faster than the markers plates may be.
_SLOWEST: Final = 10
_FASTEST: Final = 500
#: Rates are told apart by less than one part in this.
_FINEST_RATIO: Final = 1000


@dataclass(frozen=True)
class _Plate:
    """Columns of one plate: of its force, of the point it acts at, of the free torque."""

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
    """A recording of markers with the force plates of a table beside it.

    The table holds for each plate the force on the body (``ground_force_vx``, N), the point where
    it acts (``ground_force_px``, m) and the torque about that point (``ground_torque_x``, N m);
    ``1_``, ``R_`` or ``_1_`` and the like tell several plates apart. Its times are the markers'
    times; another rate is brought to theirs without delay.

    Parameters
    ----------
    markers : MarkerRecording
        One trial.
    path : path
    axes : three str
        The table's axes that point forward, left and up.

    Raises
    ------
    InputError
        There is no plate or a column of one is missing, the table does not span the markers' time,
        a load points down, or a point is no point in m.
    """
    table = read_opensim_table(path)
    plates = _plates(table)
    _check_clock(table, markers)
    rotation = lab_rotation(axes)
    found = [_wrench(table, plate, rotation) for plate in plates]
    wrenches = np.stack([wrench for wrench, _ in found], axis=1)
    taken = {name for plate in plates for name in plate.columns}
    told = f"Force plates from {Path(path).name}, the force on the body: "
    remarks = (
        f"{told}{', '.join(plate.name for plate in plates)}.",
        *_slowed(table.sample_rate_hz, markers.sample_rate_hz),
        *table.remarks,
        *not_taken([n for n in table.columns if n not in taken], "no force plate's"),
    )
    return replace(
        markers,
        wrenches=_at_markers(wrenches, table, markers),
        plate_origins_m=np.array([origin for _, origin in found]),
        provenance=(*markers.provenance, *remarks),
    )


def _plates(table: OpenSimTable) -> tuple[_Plate, ...]:
    """The plates by the names of their columns."""
    plates = []
    for first in table.columns:
        if not (first.endswith("vx") and "force" in first.lower()):
            continue
        stem = first.removesuffix("vx")
        torque = stem.replace("force", "torque").replace("Force", "Torque")
        moment = stem.replace("force", "moment").replace("Force", "Moment")
        ways = [(torque, ""), (stem, "m"), (moment, "m"), (moment, ""), (torque, "m")]
        start = next((a + b for a, b in ways if f"{a}{b}x" in table.columns), torque)
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
    """Wrench (S, 6) on the body in the world's frame about an origin (3,), and that origin.

    The origin is where the load acts on average, about which the moments are smallest.
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
    # without a load many programs have no point; the force is noise, wherever it acts
    point[lost] = origin
    return np.hstack([force, torque + np.cross(point - origin, force)]), origin


def _at_markers(wrenches: FloatArray, table: OpenSimTable, markers: MarkerRecording) -> FloatArray:
    """The wrenches (N, K, 6) at the markers' times."""
    time = markers.time_s
    ratio = _ratio(table.sample_rate_hz, markers.sample_rate_hz)
    up, down = ratio.numerator, ratio.denominator
    # the plates' rate, made an exact ratio to the markers' so that nothing drifts
    rate = markers.sample_rate_hz * down / up
    before = min(int((time[0] - table.time_s[0]) * rate + 1e-6), _BESIDE * down)
    before -= before % down
    after = int(np.ceil((len(time) - 1) * down / up)) + 1 + _BESIDE * down
    # the first sample that counts is at the time of the markers' first
    own = time[0] + np.arange(-before, after) / rate
    own = own[own <= max(table.time_s[-1], time[-1]) + 1e-9]
    flat = wrenches.reshape(len(wrenches), -1)
    even = np.column_stack([np.interp(own, table.time_s, column) for column in flat.T])
    if ratio != 1:
        even = _resampled(even, up, down)
    skip = before // down * up
    return even[skip : skip + len(time)].reshape(len(time), *wrenches.shape[1:])


def _resampled(values: FloatArray, up: int, down: int) -> FloatArray:
    from scipy.signal import resample_poly

    # beyond half the lower rate nothing is left; below it the filter is flat and has no phase
    other = resample_poly(values, up, down, axis=0, padtype="antireflect")  # type: ignore[call-overload]
    return np.asarray(other, dtype=np.float64)


def _ratio(rate_hz: float, wanted_hz: float) -> Fraction:
    return Fraction(wanted_hz / rate_hz).limit_denominator(_FINEST_RATIO)


def _slowed(rate_hz: float, wanted_hz: float) -> tuple[str, ...]:
    if _ratio(rate_hz, wanted_hz) == 1:
        return ()
    return (f"Force plates: {rate_hz:.5g} brought to {wanted_hz:g} samples/s, without delay.",)
