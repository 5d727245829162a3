"""Check that a recording can be a body on force plates in SI units, before a fit."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import ArmImpedanceError, InputError
from armimpedance.core.findings import Finding, missing
from armimpedance.core.motion import MotionRecording
from armimpedance.core.skeleton import GRAVITY_M_S2

#: Largest relative difference of the mean vertical force from the weight.
WEIGHT_TOLERANCE: Final = 0.10
#: Largest size of a room, m; largest angle of a joint, rad.
_LARGEST_ROOM_M: Final = 20.0
_LARGEST_ANGLE: Final = 4 * np.pi
#: Largest distance of the centre of pressure from the root, m.
_LONGEST_STEP_M: Final = 2.5
_FEWEST_SAMPLES: Final = 26
#: Factor on the tolerance of the weight for a single trial, which may begin and end at different
#: speeds.
_LOOSER: Final = 2.0


def check_body(recording: MotionRecording, *, weight_tolerance: float = WEIGHT_TOLERANCE) -> None:
    """Refuse a recording of a body in which something is missing or in another unit or frame.

    `recording`: if the skeleton's root is fixed, only the coordinates are checked.
    `weight_tolerance`: largest relative difference of the mean vertical force from the weight.
    Raises InputError: coordinates in mm or degrees, no motion, too few samples, no plates, a plate
    that is missing, forces with the other sign or along another axis, moments in Nmm or about
    another point.
    """
    _check_coordinates(recording)
    if not recording.skeleton.floating:
        return
    if recording.wrenches is None or recording.plate_origins_m is None:
        raise InputError(
            "no force plates in the recording", expected="the wrenches of all contacts"
        )
    _check_forces(recording, recording.wrenches, weight_tolerance)
    # imported here, since every inspection may call this, and few need Pinocchio
    from armimpedance.joint.body.rows import about_world_origin

    _check_moments(recording, about_world_origin(recording.wrenches, recording.plate_origins_m))


def check_plates(recording: MotionRecording) -> list[Finding]:
    """Findings of `inspect` on the contact forces.

    Parameters
    ----------
    recording : MotionRecording

    Returns
    -------
    list of Finding
        A single finding: the result of `check_body`, or that there are no contact forces.
    """
    if recording.wrenches is None:
        return [missing("contact forces (`body` needs plates, or a robot's torque)")]
    try:
        check_body(recording)
    except ArmImpedanceError as error:
        return [Finding("", "unusable", str(error))]
    text = "the plates bear the body's weight, and their moments fit its place"
    return [Finding("", "ok", text)]


def known_mass_kg(recording: MotionRecording) -> float | None:
    """The subject's mass, or else the skeleton's; None if neither is known."""
    mass = recording.subject.mass_kg or recording.skeleton.mass_kg
    return float(mass) if mass else None


def _check_coordinates(recording: MotionRecording) -> None:
    q, skeleton = recording.coordinates, recording.skeleton
    root = len(skeleton.root_coordinates)
    places, angles = q[:, : min(3, root)], q[:, min(3, root) :]
    if places.size and np.abs(places).max() > _LARGEST_ROOM_M:
        raise InputError(
            f"the root is {np.abs(places).max():.0f} m away", expected="metres, not millimetres"
        )
    if angles.size and np.abs(angles).max() > _LARGEST_ANGLE:
        j = int(np.abs(angles).max(axis=0).argmax()) + min(3, root)
        raise InputError(
            f"an angle of {np.abs(q[:, j]).max():.0f} rad",
            column=skeleton.coordinates[j],
            expected="radians, not degrees",
        )
    if len(q) < _FEWEST_SAMPLES:
        raise InputError(f"{len(q)} samples", expected=f"{_FEWEST_SAMPLES} or more")
    if not np.ptp(q, axis=0).any():
        raise InputError("nothing moves: all coordinates are constant", expected="motions")


def _check_forces(recording: MotionRecording, wrenches: FloatArray, tolerance: float) -> None:
    mean = wrenches[..., :3].sum(axis=1).mean(axis=0)
    strongest = int(np.abs(mean).argmax())
    if strongest != 2:
        raise InputError(
            f"the mean force points along {'xyz'[strongest]} ({mean[strongest]:.0f} N)",
            expected="the world's frame, z up",
        )
    if mean[2] < 0:
        raise InputError(
            f"the mean vertical force is {mean[2]:.0f} N",
            expected="the force by the plates on the body, upwards",
        )
    mass = known_mass_kg(recording)
    if mass is None:
        return
    weight = mass * GRAVITY_M_S2
    parts = [wrenches[recording.samples_of(row)] for row in range(recording.n_trials)]
    wrong = [r for r, part in enumerate(parts) if _off(part, weight) > _LOOSER * tolerance]
    if 0 < len(wrong) < len(parts):
        number, condition = recording.trials[["trial", "condition"]].iloc[wrong[0]]
        where = f"trial {number} ({condition}): "
        raise _not_the_weight(parts[wrong[0]], weight, _LOOSER * tolerance, where)
    if _off(wrenches, weight) > tolerance:
        raise _not_the_weight(wrenches, weight, tolerance)


def _off(wrenches: FloatArray, weight: float) -> float:
    """Relative difference of the mean vertical force of wrenches (S, K, 6) from the weight."""
    return abs(float(wrenches[..., 2].sum(axis=1).mean()) / weight - 1)


def _not_the_weight(
    wrenches: FloatArray, weight: float, tolerance: float, where: str = ""
) -> InputError:
    mean = float(wrenches[..., 2].sum(axis=1).mean())
    silent = np.flatnonzero(~wrenches.any(axis=(0, 2))) + 1
    why = "is the mass right?"
    if mean < weight:
        why = "is a plate missing?"
        if len(silent):
            why = f"plate {', '.join(map(str, silent))} shows nothing, {why}"
    return InputError(
        f"{where}the mean vertical force is {mean:.0f} N, the body weighs {weight:.0f} N: {why}",
        expected=f"the two within {100 * tolerance:.0f} %",
    )


def _check_moments(recording: MotionRecording, world: FloatArray) -> None:
    from armimpedance.joint.body.rows import LEAST_LOAD_N

    total = world.sum(axis=1)
    loaded = total[:, 2] > LEAST_LOAD_N
    f = total[loaded]
    cop = np.stack([-f[:, 4] / f[:, 2], f[:, 3] / f[:, 2]], axis=1)
    away = float(np.median(np.linalg.norm(cop - recording.coordinates[loaded, :2], axis=1)))
    if away > _LONGEST_STEP_M:
        raise InputError(
            f"the centre of pressure is {away:.3g} m from the root",
            expected="moments in N m about each plate's origin, that origin in m",
        )
