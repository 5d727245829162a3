"""Whether a file's force plates can be taken, and why not where they cannot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.recordings.capture.capture import Capture
from armimpedance.recordings.capture.forces import PlateForces, check_level, plate_forces
from armimpedance.recordings.capture.left_out import unused
from armimpedance.recordings.capture.plates import MOST_PLATES, Plate, plates_of, plates_used


@dataclass(frozen=True)
class TakenPlates:
    """The force plates of a file, or why there are none.

    Attributes
    ----------
    forces : PlateForces or None
    channels : frozenset of str
        Labels of the analog channels that they were made of.
    left_out : mapping
        Why -> what was not taken.
    """

    forces: PlateForces | None = None
    channels: frozenset[str] = frozenset()
    left_out: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


def plates_taken(
    capture: Capture,
    metres: float,
    positions: FloatArray,
    *,
    rotation: FloatArray,
    stated: bool,
    force_by: Literal["limb", "device"] | None,
) -> TakenPlates:
    """The force plates; all or none: without one of them the others would mislead.

    Parameters
    ----------
    capture : Capture
    metres : float
        The file's unit of length, in m.
    positions : (F, P, 3)
        Markers in the world's frame, m.
    rotation : (3, 3)
        From the file's axes to the world's.
    stated : bool
        Whether the user stated these axes.
    force_by : {"limb", "device"} or None
        Whose force on the other the file holds; None: what the load shows.

    Raises
    ------
    InputError
        The axes were not stated, and plates or markers contradict them.
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
    left = {"it bears nothing, and its place is not told": idle, **unused(capture, plates)}
    channels = frozenset(capture.analog_labels[c] for plate in plates for c in plate.channels)
    return TakenPlates(replace(forces, remarks=(*forces.remarks, *doubt)), channels, left)


def _axes_doubted(
    capture: Capture,
    plates: Sequence[Plate],
    positions: FloatArray,
    rotation: FloatArray,
    stated: bool,
) -> tuple[str, ...]:
    """What plates and markers say against the axes, where these were stated; else it is refused."""
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
