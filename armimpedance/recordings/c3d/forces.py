"""Force plates in the toolkit's frame, and reasons why some cannot be used."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.recordings.c3d.c3d_file import C3dFile
from armimpedance.recordings.c3d.events import unused
from armimpedance.recordings.c3d.plates import (
    LEAST_LOAD_N,
    MOST_PLATES,
    Plate,
    baseline,
    local_wrench,
    plates_of,
    plates_used,
)

#: Least share of the squared load in one direction, and least cosine of normal and vertical.
_ONE_WAY: Final = 0.95
_LEVEL: Final = 0.86
#: Least share of the load that must press on the plate, and tolerance of its edges, m.
_INSIDE: Final = 0.9
_MARGIN_M: Final = 0.03
#: The centre of pressure is computed for loads above this share of the largest load.
_HEAVY: Final = 0.2


@dataclass(frozen=True)
class PlateForces:
    """Force plates at the frames of the markers.

    `wrenches` (F, K, 6): by each plate on the body, in the world's frame, about the plate's origin.
    `origins_m` (K, 3): the middle of each plate's surface in the world's frame.
    `remarks`: how the signs were determined, and which zeros were subtracted.
    """

    wrenches: FloatArray
    origins_m: FloatArray
    remarks: tuple[str, ...]


def check_level(
    plates: Sequence[Plate], rotation: FloatArray, marker_height_m: float, file: str
) -> None:
    """Refuse axes with which no plate is level, or the markers lie below the plates.

    Raises InputError: the message names axes that fit the plates and the markers.
    """
    normals = np.array([plate.turn[:, 2] for plate in plates])
    up = rotation[2]
    below = marker_height_m < min(float(plate.centre_m @ up) for plate in plates)
    level = np.abs(normals @ up).max() > _LEVEL
    if level and not below:
        return
    axis = int(np.argmax(np.abs(normals).mean(axis=0)))
    problem = f"the force plates lie level if the file's {'xyz'[axis]} axis is vertical"
    if level:
        problem = f"the markers lie below the force plates if the file's {_name(up)} points up"
    suggestions = {0: "y,z,x", 1: "x,-z,y", 2: "x,y,z"}
    against = {0: "y,-z,-x", 1: "x,z,-y", 2: "x,-y,-z"}
    hint = against[axis] if level else suggestions[axis]
    raise InputError(problem, file=file, expected=f"axes such as {hint}: forward, left and up")


def plate_forces(
    capture: C3dFile,
    plates: Sequence[Plate],
    metres: float,
    rotation: FloatArray,
    force_by: Literal["limb", "device"] | None = None,
) -> PlateForces:
    """Compute the wrenches of a file's force plates.

    No file states whether it holds the force on the plate (as in the C3D manual) or on the body (as
    some programs write it). Since a body can only press on a plate, the sign follows from the
    vertical part of the load; a remark states it.

    `plates`: at least one.
    `metres`: the file's unit of length, in m.
    `rotation` (3, 3): from the file's axes to the world's.
    `force_by`: whether the file holds the force by the limb or by the device; None: determined from
    the load.
    Raises InputError: a plate's channels cannot be read, or its load contradicts its description.
    """
    read = [_of_plate(capture, plate, metres, rotation) for plate in plates]
    local = [wrench for wrench, _ in read]
    directions = [
        _direction(capture, p, w, rotation, force_by) for p, w in zip(plates, local, strict=True)
    ]
    signs = _signs(directions, force_by)
    n, remarks = capture.layout.samples_per_frame, [remark for _, remark in read]
    wrenches = []
    for plate, wrench, sign in zip(plates, local, signs, strict=True):
        offset, reason = baseline(capture, wrench)
        remarks.append(_offset_remark(plate, offset, reason))
        world = rotation @ plate.turn
        pair = sign * _at_frames(wrench - offset, n).reshape(-1, 2, 3)
        # each of f, m (3,) in the plate's axes -> the world's: R f
        wrenches.append((pair @ world.T).reshape(-1, 6))
    return PlateForces(
        wrenches=np.stack(wrenches, axis=1),
        origins_m=np.array([rotation @ plate.centre_m for plate in plates]),
        remarks=(
            _force_remark(plates, directions, signs, force_by),
            *filter(None, remarks),
            *_slowed(n),
        ),
    )


def _of_plate(
    capture: C3dFile, plate: Plate, metres: float, rotation: FloatArray
) -> tuple[FloatArray, str]:
    """Wrench (S, 6) in the plate's axes, and a remark if ORIGIN has the other sign.

    Raises InputError: the load presses beside the plate: a unit, the origin or corners are wrong.
    """
    up = plate.turn.T @ rotation[2]
    wrench = local_wrench(capture, plate, metres, up)
    inside, far = _pressed_inside(plate, wrench)
    if inside >= _INSIDE:
        return wrench, ""
    if plate.kind in (2, 4) and plate.origin_m[2] == 0 and plate.origin_m.any():
        # without a depth the sign of ORIGIN follows from the centre of pressure
        rotated = local_wrench(capture, replace(plate, origin_m=-plate.origin_m), metres, up)
        if _pressed_inside(plate, rotated)[0] >= _INSIDE:
            return rotated, f"Force plate {plate.number}: ORIGIN taken with the other sign."
    beside = f"{100 * (1 - inside):.0f} % of its load presses beside it"
    problem = f"force plate {plate.number}: {beside}"
    expected = f"moments, ORIGIN and CORNERS that fit (median {far:.2g} m from its middle)"
    raise InputError(problem, file=capture.name, expected=expected)


def _direction(
    capture: C3dFile,
    plate: Plate,
    wrench: FloatArray,
    rotation: FloatArray,
    force_by: Literal["limb", "device"] | None,
) -> float:
    """Direction of the load: 1 if it points up, -1 if it points down, 0 without a load."""
    vertical = wrench[:, :3] @ (plate.turn.T @ rotation[2])
    load = vertical[np.abs(vertical) > LEAST_LOAD_N]
    if not len(load):
        return 0.0
    upward = float((load[load > 0] ** 2).sum() / (load**2).sum())
    if max(upward, 1 - upward) < _ONE_WAY and force_by is None:
        problem = f"force plate {plate.number}: its load points up and down"
        expected = "a body that presses on it; or whose force it holds"
        raise InputError(problem, file=capture.name, expected=expected)
    return 1.0 if upward > 0.5 else -1.0


def _signs(shown: list[float], force_by: Literal["limb", "device"] | None) -> list[float]:
    """Factors that turn each plate's force into the force on the body."""
    if force_by is not None:
        return [1.0 if force_by == "device" else -1.0] * len(shown)
    loaded = {s for s in shown if s}
    # a plate without a load gets the sign of the others, or the manual's
    default = loaded.pop() if len(loaded) == 1 else -1.0
    return [s or default for s in shown]


def _pressed_inside(plate: Plate, wrench: FloatArray) -> tuple[float, float]:
    """Share of the load that presses on the plate, and its median distance from the middle, m."""
    normal = wrench[:, 2]
    heavy = np.abs(normal) > max(LEAST_LOAD_N, _HEAVY * float(np.abs(normal).max(initial=0.0)))
    if not heavy.any():
        return 1.0, 0.0
    w = wrench[heavy]
    pressed = np.abs(np.column_stack([-w[:, 4], w[:, 3]]) / w[:, 2:3])
    inside = (pressed <= plate.half_m + _MARGIN_M).all(axis=1).mean()
    return float(inside), float(np.median(pressed.max(axis=1)))


def _at_frames(wrench: FloatArray, samples_per_frame: int) -> FloatArray:
    """Resample the wrench to the frames (F, 6), at their first analog samples, without delay."""
    if samples_per_frame == 1 or not len(wrench):
        return wrench
    from scipy.signal import resample_poly

    # the filter stops frequencies above half the frames' rate, and is flat without phase below it
    slow = resample_poly(wrench, 1, samples_per_frame, axis=0, padtype="antireflect")  # type: ignore[call-overload]
    return np.asarray(slow, dtype=np.float64)


def _force_remark(
    plates: Sequence[Plate], shown: list[float], signs: list[float], force_by: str | None
) -> str:
    """Sentence on who exerts the force in the file."""
    types = ", ".join(str(plate.kind) for plate in plates)
    start = f"Force plates of type {types}: "
    if force_by is not None:
        against = [p.number for p, s, t in zip(plates, shown, signs, strict=True) if s == -t]
        message = f"the file holds the force by the {force_by}, as stated"
        wrong = f"; the load of plate {', '.join(map(str, against))} says the opposite"
        return start + message + (wrong if against else "") + "."
    if not any(shown):
        return start + "none bears a load; taken as the force on the plate, as the manual has it."
    words = {1.0: "by the plate on the body", -1.0: "on the plate, which was turned"}
    if len(set(signs)) == 1:
        direction = "up" if signs[0] > 0 else "down"
        return f"{start}the load points {direction}: the file holds the force {words[signs[0]]}."
    parts = [f"{p.number} {words[s]}" for p, s in zip(plates, signs, strict=True)]
    return f"{start}by their loads the file holds the force of plate {'; '.join(parts)}."


def _offset_remark(plate: Plate, offset: FloatArray, reason: str) -> str:
    """Sentence on the plate's zero that was subtracted, or why not; "" if the file states none."""
    if offset.any():
        size = float(np.linalg.norm(offset[:3]))
        return (
            f"Force plate {plate.number}: {size:.2g} N taken off, its zero in FORCE_PLATFORM:ZERO."
        )
    if "frames" in reason and "names" not in reason:
        return f"Force plate {plate.number}: no zero taken off, for {reason}."
    return ""


def _slowed(samples_per_frame: int) -> tuple[str, ...]:
    if samples_per_frame == 1:
        return ()
    return (f"Force plates: {samples_per_frame} samples a frame brought to one, without delay.",)


def _name(axis: FloatArray) -> str:
    at = int(np.argmax(np.abs(axis)))
    return ("-" if axis[at] < 0 else "") + "xyz"[at]


# Force plates that can be used, and reasons for those that cannot.


@dataclass(frozen=True)
class TakenPlates:
    """Force plates of a file, or reasons why there are none.

    `channels`: labels of their analog channels.
    `left_out`: reason -> names that are left out.
    """

    forces: PlateForces | None = None
    channels: frozenset[str] = frozenset()
    left_out: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


def plates_taken(
    capture: C3dFile,
    metres: float,
    positions: FloatArray,
    *,
    rotation: FloatArray,
    stated: bool,
    force_by: Literal["limb", "device"] | None,
) -> TakenPlates:
    """Read all force plates or none: without one of them the others would mislead.

    `metres`: the file's unit of length, in m.
    `positions` (F, P, 3): markers in the world's frame, m.
    `rotation` (3, 3): from the file's axes to the world's.
    `stated`: whether the user stated these axes.
    `force_by`: as in `plate_forces`.
    Raises InputError: the axes were not stated, and plates or markers contradict them.
    """
    used = plates_used(capture)
    names = tuple(f"force plate {i + 1}" for i in range(min(used, MOST_PLATES)))
    if not used:
        return TakenPlates()
    try:
        plates = plates_of(capture, metres)
    except InputError as error:
        return TakenPlates(left_out={_reason(error): names})
    if not plates:
        return TakenPlates(left_out={"they bear nothing, and their places are not told": names})
    doubt = _axes_doubted(capture, plates, positions, rotation, stated)
    try:
        forces = plate_forces(capture, plates, metres, rotation, force_by)
    except InputError as error:
        return TakenPlates(left_out={_reason(error): names})
    kept = {plate.number for plate in plates}
    idle = tuple(name for i, name in enumerate(names, start=1) if i not in kept)
    left_out = {"it bears nothing, and its place is not told": idle, **unused(capture, plates)}
    channels = frozenset(capture.analog_labels[c] for plate in plates for c in plate.channels)
    return TakenPlates(replace(forces, remarks=(*forces.remarks, *doubt)), channels, left_out)


def _axes_doubted(
    capture: C3dFile,
    plates: Sequence[Plate],
    positions: FloatArray,
    rotation: FloatArray,
    stated: bool,
) -> tuple[str, ...]:
    """Warn if plates or markers contradict the stated axes; refuse axes that were not stated."""
    seen = positions[np.isfinite(positions[..., 2])]
    height = float(np.median(seen[:, 2])) if len(seen) else np.inf
    try:
        check_level(plates, rotation, height, capture.name)
    except InputError as error:
        if not stated:
            raise
        return (f"Doubt, against the stated axes: {error.problem}.",)
    return ()


def _reason(error: InputError) -> str:
    return f"{error.problem}; expected {error.expected}"
