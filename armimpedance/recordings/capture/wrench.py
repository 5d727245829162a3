"""Force and moment of a plate from its channels, by the types of the C3D manual.

Wrenches (S, 6) here are in the plate's own axes, the moment about the middle of its surface, and
by whom the file has them.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.recordings.capture.capture import Capture
from armimpedance.recordings.capture.plates import LEAST_LOAD_N, Plate
from armimpedance.recordings.capture.units import force_unit, length_unit, moment_unit

#: An amplifier's offset is at most this, N, and this part of the largest load; it hardly moves, N.
_LARGEST_ZERO_N: Final = 60.0
_LARGEST_ZERO: Final = 0.1
_STEADY_N: Final = 10.0
_LARGEST_N: Final = 1e5


def local_wrench(capture: Capture, plate: Plate, metres: float, up: FloatArray) -> FloatArray:
    """The wrench (S, 6) of a plate at the analog rate.

    Parameters
    ----------
    capture : Capture
    plate : Plate
    metres : float
        The file's unit of length, in m.
    up : (3,)
        The vertical in the plate's axes.

    Raises
    ------
    InputError
        A value is not finite or no force that a plate bears, or the sensors' distances are missing.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        values = capture.analog(plate.channels) * _factors(capture, plate, metres)
    if not np.isfinite(values).all():
        raise _wrong(capture, plate, "a value that is not finite", "numbers")
    if plate.matrix is not None:
        newton_metres = np.array([1.0, 1.0, 1.0, metres, metres, metres])
        values = values @ plate.matrix.T * newton_metres
    wrench = _OF_TYPE[plate.kind](values, plate, up)
    largest = float(np.abs(wrench[:, :3]).max(initial=0.0))
    if not largest < _LARGEST_N:
        raise _wrong(capture, plate, f"a force of {largest:.3g} N", "what a plate bears, in N")
    if plate.kind == 3 and not (plate.origin_m[:2] != 0).all():
        raise _wrong(capture, plate, "type 3 without its sensors' distances", "ORIGIN with a, b")
    return wrench


def baseline(capture: Capture, wrench: FloatArray) -> tuple[FloatArray, str]:
    """What a plate shows where the file says that nothing is on it, (6,), and why it is zero.

    Parameters
    ----------
    capture : Capture
    wrench : (S, 6)

    Returns
    -------
    offset : (6,)
    reason : str
        Empty where the offset is to be taken off.
    """
    nothing = np.zeros(6)
    zero = capture.parameters.numbers("FORCE_PLATFORM", "ZERO")[:2]
    layout = capture.layout
    if len(zero) < 2 or not (np.isfinite(zero).all() and zero[1] >= max(zero[0], 1)):
        return nothing, "the file names no frames without load"
    # Frames are counted from 1 in the recording that the file may be a part of.
    first, last = max(int(zero[0]), 1) - layout.first_frame, int(zero[1]) - layout.first_frame
    if first < 0 or last >= layout.frames:
        return nothing, f"frames {zero[0]:g} to {zero[1]:g} are not in the file"
    n = layout.samples_per_frame
    part = wrench[first * n : (last + 1) * n]
    mean = part.mean(axis=0)
    size = float(np.linalg.norm(mean[:3]))
    largest = float(np.linalg.norm(wrench[:, :3], axis=1).max(initial=0.0))
    offset = size <= min(_LARGEST_ZERO_N, max(_LARGEST_ZERO * largest, LEAST_LOAD_N))
    if not offset or part[:, :3].std(axis=0).max() > _STEADY_N:
        return nothing, f"it bears a load in frames {zero[0]:g} to {zero[1]:g}"
    return mean, ""


def _factors(capture: Capture, plate: Plate, metres: float) -> FloatArray:
    """What makes each channel SI; 1 of those that a matrix turns into forces."""
    if plate.kind == 4:
        return np.ones(6)
    units = capture.parameters.texts("ANALOG", "UNITS")
    own = [units[c] if c < len(units) else "" for c in plate.channels]
    # The manual's units where the channel's own is none: N, N times the points' unit, that unit.
    force = [force_unit(u) or 1.0 for u in own]
    moment = [moment_unit(u) or metres for u in own]
    length = [length_unit(u) or metres for u in own]
    if plate.kind == 3:
        return np.array(force)
    if plate.kind == 2:
        return np.array([*force[:3], *moment[3:]])
    return np.array([*force[:3], *length[3:5], moment[5]])


def _pressed(values: FloatArray, plate: Plate, up: FloatArray) -> FloatArray:
    """Type 1: force, where it presses on the surface, and the free moment about the normal."""
    del plate, up
    force, free = values[:, :3], values[:, 5]
    place = np.column_stack([values[:, 3:5], np.zeros(len(values))])
    moment = np.cross(place, force)
    moment[:, 2] += free
    return np.hstack([force, moment])


def _of_six(values: FloatArray, plate: Plate, up: FloatArray) -> FloatArray:
    """Types 2 and 4: force, and moment about the sensors' origin."""
    return _about_surface(values, _to_surface(plate.origin_m, up))


def _of_eight(values: FloatArray, plate: Plate, up: FloatArray) -> FloatArray:
    """Type 3: two shear sensors an axis, four vertical ones at (+-a, +-b)."""
    a, b, depth = np.abs(plate.origin_m)
    fx12, fx34, fy14, fy23, fz1, fz2, fz3, fz4 = values.T
    wrench = np.column_stack(
        [
            fx12 + fx34,
            fy14 + fy23,
            fz1 + fz2 + fz3 + fz4,
            b * (fz1 + fz2 - fz3 - fz4),
            a * (-fz1 + fz2 + fz3 - fz4),
            b * (fx34 - fx12) + a * (fy14 - fy23),
        ]
    )
    return _about_surface(wrench, _to_surface(np.array([0.0, 0.0, -depth]), up))


def _to_surface(origin_m: FloatArray, up: FloatArray) -> FloatArray:
    """The way from the sensors' origin to the surface: it leads up, whatever sign the file has."""
    # A plate on a wall: the manual's sign, its z axis pointing into the plate.
    outward = np.sign(up[2]) if abs(up[2]) > 0.5 else -1.0
    return -origin_m if origin_m[2] * outward < 0 else origin_m


def _about_surface(wrench: FloatArray, to_surface: FloatArray) -> FloatArray:
    moved = wrench.copy()
    # m_s = m_o - d x f
    moved[:, 3:] -= np.cross(to_surface, wrench[:, :3])
    return moved


_OF_TYPE: Final = {1: _pressed, 2: _of_six, 3: _of_eight, 4: _of_six}


def _wrong(capture: Capture, plate: Plate, problem: str, expected: str) -> InputError:
    problem = f"force plate {plate.number}: {problem}"
    return InputError(problem, file=capture.name, expected=expected)
