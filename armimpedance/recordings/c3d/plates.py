"""Force plates of a C3D file: description, units, and force and moment from channels."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.recordings.c3d.c3d_file import C3dFile

#: Number of channels of each type that is read.
CHANNELS: Final = {1: 6, 2: 6, 3: 8, 4: 6}
#: Names of other types, for messages.
_OTHERS: Final = {
    5: "Kistler with eight channels and a 6 x 8 matrix",
    6: "twelve channels",
    7: "Kistler with an 8 x 8 matrix",
    11: "Kistler split-belt treadmill",
    12: "Kistler split-belt treadmill",
    21: "AMTI stairs",
}
#: Largest cosine between edges of a plate, and shortest edge, m.
_SKEW: Final = 0.1
_SHORTEST_M: Final = 0.05
#: Largest force of a plate without a load, N.
LEAST_LOAD_N: Final = 20.0
#: Most plates of a laboratory.
MOST_PLATES: Final = 64


@dataclass(frozen=True)
class Plate:
    """One force plate.

    `number`: its number from 1.
    `kind`: its type in the C3D manual.
    `channels`: indices of its channels, from 0.
    `centre_m` (3,): the middle of its surface, in the file's axes.
    `half_m` (2,): half of its edges along its own x and y.
    `turn` (3, 3): its own axes as columns, in the file's axes.
    `origin_m` (3,): as in the file; for types 2 and 4 from the sensors' origin to the surface's
    middle.
    `matrix` (6, 6) or None: for type 4, from channels to force and moment.
    """

    number: int
    kind: int
    channels: tuple[int, ...]
    centre_m: FloatArray
    half_m: FloatArray
    turn: FloatArray
    origin_m: FloatArray
    matrix: FloatArray | None = None


def plates_used(capture: C3dFile) -> int:
    """Number of force plates that the file states."""
    used = capture.parameters.first("FORCE_PLATFORM", "USED", 0.0)
    return int(used) if np.isfinite(used) and used > 0 else 0


def plates_of(capture: C3dFile, metres: float) -> tuple[Plate, ...]:
    """Read the force plates of a file, except those without a valid description and load.

    `metres`: the file's unit of length, in m.
    Raises InputError: a plate with a load has a type that is not read, or lacks descriptions.
    """
    used = plates_used(capture)
    if used > MOST_PLATES:
        problem = f"{used} force plates"
        raise InputError(problem, file=capture.name, expected=f"at most {MOST_PLATES}")
    plates = []
    for i in range(used):
        try:
            plates.append(_plate(capture, i, metres))
        except InputError:
            if not _idle(capture, i):
                raise
    return tuple(plates)


def _idle(capture: C3dFile, i: int) -> bool:
    """True if plate `i` was never filled in: it never bears a load."""
    types = capture.parameters.numbers("FORCE_PLATFORM", "TYPE")
    if i >= len(types) or types[i] not in CHANNELS:
        return False
    kind = int(types[i])
    try:
        values = capture.analog(_channels(capture, i, kind))
    except InputError:
        return False
    if kind == 4:
        return not values.any()
    forces = values if kind == 3 else values[:, :3]
    return bool(np.abs(forces).max(initial=0.0) < LEAST_LOAD_N)


def _plate(capture: C3dFile, i: int, metres: float) -> Plate:
    types = capture.parameters.numbers("FORCE_PLATFORM", "TYPE")
    if i >= len(types) or not np.isfinite(types[i]):
        raise _wrong(capture, i, "no TYPE", "one for each plate")
    kind = int(types[i])
    if kind not in CHANNELS:
        description = f" ({_OTHERS[kind]})" if kind in _OTHERS else ""
        raise _wrong(capture, i, f"type {kind}{description}", "types 1 to 4, which are read")
    corners = _numbers(capture, i, "CORNERS", 12).reshape(4, 3) * metres
    turn, half = _frame(capture, i, corners)
    return Plate(
        number=i + 1,
        kind=kind,
        channels=_channels(capture, i, kind),
        centre_m=corners.mean(axis=0),
        half_m=half,
        turn=turn,
        origin_m=_numbers(capture, i, "ORIGIN", 3) * metres,
        matrix=_matrix(capture, i) if kind == 4 else None,
    )


def _numbers(capture: C3dFile, i: int, name: str, count: int) -> FloatArray:
    """Numbers of plate `i` in a parameter with `count` numbers per plate."""
    stored = capture.parameters.numbers("FORCE_PLATFORM", name)
    plate_numbers = stored[count * i : count * (i + 1)]
    if len(plate_numbers) < count or not np.isfinite(plate_numbers).all():
        raise _wrong(capture, i, f"{name} is not complete", f"{count} numbers a plate")
    return plate_numbers


def _channels(capture: C3dFile, i: int, kind: int) -> tuple[int, ...]:
    """Indices of the plate's channels; further rows of the parameter are not used."""
    entry = capture.parameters.entry("FORCE_PLATFORM", "CHANNEL")
    count, available = CHANNELS[kind], capture.layout.channels
    rows = entry.sizes[0] if entry is not None and entry.sizes else 0
    if entry is None or rows < count:
        raise _wrong(capture, i, "CHANNEL is not complete", f"{count} channels of type {kind}")
    plate_channels = entry.numbers[rows * i : rows * i + count]
    if len(plate_channels) < count or not np.isfinite(plate_channels).all():
        raise _wrong(capture, i, "CHANNEL is not complete", f"{count} channels of type {kind}")
    if plate_channels.min() < 1 or plate_channels.max() > available:
        worst = int(
            plate_channels.max() if plate_channels.max() > available else plate_channels.min()
        )
        raise _wrong(capture, i, f"channel {worst}", f"one of the {available} analog channels")
    return tuple(int(c) - 1 for c in plate_channels)


def _frame(capture: C3dFile, i: int, corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Axes of a plate (3, 3) as columns, and half of its edges (2,), m.

    Corner 1 is at +x +y, corner 2 at -x +y, corner 3 at -x -y, corner 4 at +x -y.
    """
    along, across = corners[0] - corners[1], corners[0] - corners[3]
    edges = np.array([np.linalg.norm(along), np.linalg.norm(across)])
    largest = np.abs(corners).max()
    if edges.min() < _SHORTEST_M or largest > 1e3:
        raise _wrong(capture, i, "CORNERS are no plate", "four corners of a rectangle")
    x, y = along / edges[0], across / edges[1]
    opposite = corners[1] + corners[3] - corners[2]
    off = np.abs(opposite - corners[0]).max()
    if abs(x @ y) > _SKEW or off > _SKEW * edges.max():
        raise _wrong(capture, i, "CORNERS are no rectangle", "four corners in their order")
    z = np.cross(x, y)
    z /= np.linalg.norm(z)
    return np.column_stack([x, np.cross(z, x), z]), edges / 2


def _matrix(capture: C3dFile, i: int) -> FloatArray:
    """Calibration matrix C of plate `i`: force and moment = C (channels)."""
    flat = _numbers(capture, i, "CAL_MATRIX", 36)
    entry = capture.parameters.entry("FORCE_PLATFORM", "CAL_MATRIX")
    if entry is None or entry.sizes[:2] != (6, 6):
        raise _wrong(capture, i, "CAL_MATRIX is not 6 x 6", "6 x 6 for each plate of type 4")
    # the file stores columns one after another; some programs state that they store rows
    by_row = capture.parameters.text("FORCE_PLATFORM", "MATRIX_STORE").upper() == "BYROW"
    C = flat.reshape(6, 6) if by_row else flat.reshape(6, 6).T
    if np.linalg.matrix_rank(C) < 6:
        raise _wrong(capture, i, "CAL_MATRIX is singular", "a calibration of six channels")
    return C


def _wrong(capture: C3dFile, i: int, problem: str, expected: str) -> InputError:
    return InputError(f"force plate {i + 1}: {problem}", file=capture.name, expected=expected)


# Units of force and moment in C3D files, in SI.

#: Units of force, in N.
_NEWTONS: Final = {
    "n": 1.0, "nt": 1.0, "newton": 1.0, "newtons": 1.0, "kn": 1e3,
    "kgf": 9.80665, "kp": 9.80665, "lbf": 4.4482216152605, "lb": 4.4482216152605,
    "lbs": 4.4482216152605,
}  # fmt: skip
#: Units of length, in m, as part of a unit of moment or for points.
_METRES: Final = {
    "m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254, "inch": 0.0254, "inches": 0.0254,
    "ft": 0.3048,
}  # fmt: skip


def force_unit(unit: str) -> float | None:
    """Return a unit of force in N; None if it is not one."""
    return _NEWTONS.get(unit.strip().lower())


def length_unit(unit: str) -> float | None:
    """Return a unit of length in m; None if it is not one."""
    return _METRES.get(unit.strip().lower())


def moment_unit(unit: str) -> float | None:
    """Return a unit of moment, such as Nmm, N.m, N*mm or ntmm, in N m; None if it is not one."""
    plain = re.sub(r"[\s.*·\-_]", "", unit.lower())
    for force in sorted(_NEWTONS, key=len, reverse=True):
        length = _METRES.get(plain.removeprefix(force))
        if plain.startswith(force) and length is not None:
            return _NEWTONS[force] * length
    return None


# Force and moment of a plate from its channels, by the types of the C3D manual.
#
# These wrenches (S, 6) are in the plate's own axes, with the moment about the middle of its surface
# and the sign of the file.

#: Limits of an amplifier's offset: in N, as a share of the largest load, and its scatter in N.
_LARGEST_ZERO_N: Final = 60.0
_LARGEST_ZERO: Final = 0.1
_STEADY_N: Final = 10.0
_LARGEST_N: Final = 1e5


def local_wrench(capture: C3dFile, plate: Plate, metres: float, up: FloatArray) -> FloatArray:
    """Compute the wrench (S, 6) of a plate at the analog rate.

    `metres`: the file's unit of length, in m.
    `up` (3,): the vertical in the plate's axes.
    Raises InputError: a value is not finite or too large for a plate, or the sensors' distances are
    missing.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        values = capture.analog(plate.channels) * _factors(capture, plate, metres)
    if not np.isfinite(values).all():
        raise _wrong_type(capture, plate, "a value that is not finite", "numbers")
    if plate.matrix is not None:
        newton_metres = np.array([1.0, 1.0, 1.0, metres, metres, metres])
        values = values @ plate.matrix.T * newton_metres
    wrench = _OF_TYPE[plate.kind](values, plate, up)
    largest = float(np.abs(wrench[:, :3]).max(initial=0.0))
    if not largest < _LARGEST_N:
        raise _wrong_type(capture, plate, f"a force of {largest:.3g} N", "what a plate bears, in N")
    if plate.kind == 3 and not (plate.origin_m[:2] != 0).all():
        raise _wrong_type(
            capture, plate, "type 3 without its sensors' distances", "ORIGIN with a, b"
        )
    return wrench


def baseline(capture: C3dFile, wrench: FloatArray) -> tuple[FloatArray, str]:
    """Offset (6,) of a plate in frames that the file states to be without load, or 0 and why.

    `wrench` (S, 6).
    Returns: `offset` (6,).
    `reason`: why it is 0; empty if the offset is to be subtracted.
    """
    nothing = np.zeros(6)
    zero = capture.parameters.numbers("FORCE_PLATFORM", "ZERO")[:2]
    layout = capture.layout
    if len(zero) < 2 or not (np.isfinite(zero).all() and zero[1] >= max(zero[0], 1)):
        return nothing, "the file names no frames without load"
    # frames are counted from 1 in the whole recording, of which the file may be a part
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


def _factors(capture: C3dFile, plate: Plate, metres: float) -> FloatArray:
    """Factors that convert each channel to SI; 1 for channels with a calibration matrix."""
    if plate.kind == 4:
        return np.ones(6)
    units = capture.parameters.texts("ANALOG", "UNITS")
    stated = [units[c] if c < len(units) else "" for c in plate.channels]
    # the manual's units if the channel has none: N, N times the points' unit, that unit
    force = [force_unit(u) or 1.0 for u in stated]
    moment = [moment_unit(u) or metres for u in stated]
    length = [length_unit(u) or metres for u in stated]
    if plate.kind == 3:
        return np.array(force)
    if plate.kind == 2:
        return np.array([*force[:3], *moment[3:]])
    return np.array([*force[:3], *length[3:5], moment[5]])


def _pressed(values: FloatArray, plate: Plate, up: FloatArray) -> FloatArray:
    """Type 1: force, centre of pressure on the surface, free moment about the normal."""
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
    """Type 3: two shear sensors per axis, four vertical sensors at (+-a, +-b)."""
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
    """Vector from the sensors' origin to the surface: upwards, whatever the sign in the file."""
    # a plate on a wall: the manual's sign, with the z axis into the plate
    outward = np.sign(up[2]) if abs(up[2]) > 0.5 else -1.0
    return -origin_m if origin_m[2] * outward < 0 else origin_m


def _about_surface(wrench: FloatArray, to_surface: FloatArray) -> FloatArray:
    shifted = wrench.copy()
    # m_s = m_o - d x f
    shifted[:, 3:] -= np.cross(to_surface, wrench[:, :3])
    return shifted


_OF_TYPE: Final = {1: _pressed, 2: _of_six, 3: _of_eight, 4: _of_six}


def _wrong_type(capture: C3dFile, plate: Plate, problem: str, expected: str) -> InputError:
    problem = f"force plate {plate.number}: {problem}"
    return InputError(problem, file=capture.name, expected=expected)
