"""Force plates as the FORCE_PLATFORM group describes them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.recordings.capture.capture import Capture

#: Types that are read -> their channels.
CHANNELS: Final = {1: 6, 2: 6, 3: 8, 4: 6}
#: What other types are called, for messages.
_OTHERS: Final = {
    5: "Kistler with eight channels and a 6 x 8 matrix",
    6: "twelve channels",
    7: "Kistler with an 8 x 8 matrix",
    11: "Kistler split-belt treadmill",
    12: "Kistler split-belt treadmill",
    21: "AMTI stairs",
}
#: Edges at a corner may be so far from square, and no plate is shorter, m.
_SKEW: Final = 0.1
_SHORTEST_M: Final = 0.05
#: What a plate may show without a load, N.
LEAST_LOAD_N: Final = 20.0
#: More plates are no laboratory's.
MOST_PLATES: Final = 64


@dataclass(frozen=True)
class Plate:
    """One force plate.

    Attributes
    ----------
    number : int
        From 1.
    kind : int
        Its type in the C3D manual.
    channels : tuple of int
        From 0.
    centre_m : (3,)
        The middle of its surface, in the file's axes.
    half_m : (2,)
        Half of its edges along its own x and y.
    turn : (3, 3)
        Its own axes as columns, in the file's axes.
    origin_m : (3,)
        As the file has it; of types 2 and 4 from the sensors' origin to the surface's middle.
    matrix : (6, 6) or None
        Of type 4: from channels to force and moment.
    """

    number: int
    kind: int
    channels: tuple[int, ...]
    centre_m: FloatArray
    half_m: FloatArray
    turn: FloatArray
    origin_m: FloatArray
    matrix: FloatArray | None = None


def plates_used(capture: Capture) -> int:
    """How many force plates the file says to hold."""
    used = capture.parameters.first("FORCE_PLATFORM", "USED", 0.0)
    return int(used) if np.isfinite(used) and used > 0 else 0


def plates_of(capture: Capture, metres: float) -> tuple[Plate, ...]:
    """The force plates of a file, but those that are listed without a place and bear no load.

    Parameters
    ----------
    capture : Capture
    metres : float
        The file's unit of length, in m.

    Raises
    ------
    InputError
        A plate is of a type that is not read, or its description is not complete.
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


def _idle(capture: Capture, i: int) -> bool:
    """Whether plate `i` is a form that was never filled in: nothing is ever on it."""
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


def _plate(capture: Capture, i: int, metres: float) -> Plate:
    types = capture.parameters.numbers("FORCE_PLATFORM", "TYPE")
    if i >= len(types) or not np.isfinite(types[i]):
        raise _wrong(capture, i, "no TYPE", "one for each plate")
    kind = int(types[i])
    if kind not in CHANNELS:
        what = f" ({_OTHERS[kind]})" if kind in _OTHERS else ""
        raise _wrong(capture, i, f"type {kind}{what}", "types 1 to 4, which are read")
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


def _numbers(capture: Capture, i: int, name: str, count: int) -> FloatArray:
    """The numbers of plate `i` in a parameter that has so many of each."""
    given = capture.parameters.numbers("FORCE_PLATFORM", name)
    own = given[count * i : count * (i + 1)]
    if len(own) < count or not np.isfinite(own).all():
        raise _wrong(capture, i, f"{name} is not complete", f"{count} numbers a plate")
    return own


def _channels(capture: Capture, i: int, kind: int) -> tuple[int, ...]:
    """The plate's channels: as many rows as the parameter has, those beyond the type's unused."""
    entry = capture.parameters.entry("FORCE_PLATFORM", "CHANNEL")
    count, there = CHANNELS[kind], capture.layout.channels
    rows = entry.sizes[0] if entry is not None and entry.sizes else 0
    if entry is None or rows < count:
        raise _wrong(capture, i, "CHANNEL is not complete", f"{count} channels of type {kind}")
    own = entry.numbers[rows * i : rows * i + count]
    if len(own) < count or not np.isfinite(own).all():
        raise _wrong(capture, i, "CHANNEL is not complete", f"{count} channels of type {kind}")
    if own.min() < 1 or own.max() > there:
        worst = int(own.max() if own.max() > there else own.min())
        raise _wrong(capture, i, f"channel {worst}", f"one of the {there} analog channels")
    return tuple(int(c) - 1 for c in own)


def _frame(capture: Capture, i: int, corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The plate's axes (3, 3) as columns, and half of its edges (2,).

    Corner 1 lies at its +x +y, corner 2 at -x +y, corner 3 at -x -y, corner 4 at +x -y.
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


def _matrix(capture: Capture, i: int) -> FloatArray:
    """The calibration matrix of plate `i`: force and moment = C (channels)."""
    flat = _numbers(capture, i, "CAL_MATRIX", 36)
    entry = capture.parameters.entry("FORCE_PLATFORM", "CAL_MATRIX")
    if entry is None or entry.sizes[:2] != (6, 6):
        raise _wrong(capture, i, "CAL_MATRIX is not 6 x 6", "6 x 6 for each plate of type 4")
    # The file stores columns one after another; some programs say that theirs are rows.
    by_row = capture.parameters.text("FORCE_PLATFORM", "MATRIX_STORE").upper() == "BYROW"
    C = flat.reshape(6, 6) if by_row else flat.reshape(6, 6).T
    if np.linalg.matrix_rank(C) < 6:
        raise _wrong(capture, i, "CAL_MATRIX is singular", "a calibration of six channels")
    return C


def _wrong(capture: Capture, i: int, problem: str, expected: str) -> InputError:
    return InputError(f"force plate {i + 1}: {problem}", file=capture.name, expected=expected)
