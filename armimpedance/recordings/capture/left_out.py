"""What a C3D file holds and no recording of markers has a place for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from armimpedance.core.not_taken import not_taken
from armimpedance.recordings.capture.capture import Capture
from armimpedance.recordings.capture.plates import Plate

#: Points that are no places: outputs of a model, as the group POINT lists them.
_OUTPUTS: Final = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "REACTIONS")
#: What the reader itself reads, or what only tells how the file is laid out and shown.
_READ: Final = {
    "POINT", "ANALOG", "FORCE_PLATFORM", "EVENT", "EVENT_CONTEXT", "TRIAL", "ROTATION",
    "DATA_BLOCKS",
}  # fmt: skip
#: More names than these are counted instead of listed.
_MOST: Final = 80

#: Why -> what: merged over the trials of a recording.
LeftOut = Mapping[str, tuple[str, ...]]


def model_outputs(capture: Capture) -> dict[str, str]:
    """Labels of points that are no places -> what they are, in lower case."""
    given = {t.upper() for t in capture.parameters.texts("POINT", "TYPE_GROUPS")}
    # Positions that a model found are places as markers are.
    kinds = [k for k in (*_OUTPUTS, *sorted(given - {*_OUTPUTS})) if "MARKER" not in k]
    return {
        label: kind.lower()
        for kind in kinds
        for label in capture.parameters.texts("POINT", kind)
        if label
    }


def beside(capture: Capture, channels: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """What is left out of every file: by why, the names.

    Parameters
    ----------
    capture : Capture
    channels : iterable of str
        Analog channels that were taken.
    """
    taken = set(channels)
    free = tuple(c or "without a name" for c in capture.analog_labels if c not in taken)
    turned = capture.parameters.texts("ROTATION", "LABELS")
    groups = tuple(
        name or "without a name"
        for name, entries in capture.parameters.groups.items()
        if name not in _READ
        and any(e.texts or e.numbers.any() for key, e in entries.items() if key != "USED")
    )
    index = range(len(capture.point_labels))
    cameras = capture.residuals(index).max(initial=0.0) > 0 if len(index) else False
    return {
        "analog channels that no muscle was given to": free,
        "rotations of segments have no place in a recording of markers": turned,
        "groups of parameters that are not read": groups,
        "only whether a marker was seen is kept": ("residuals and cameras",) if cameras else (),
    }


def unused(capture: Capture, plates: Iterable[Plate]) -> dict[str, tuple[str, ...]]:
    """What the file says of its plates and their wrenches do not use."""
    kinds = {plate.kind for plate in plates}
    lifted = any(plate.kind == 1 and plate.origin_m.any() for plate in plates)
    bent = 3 in kinds and capture.parameters.numbers("FORCE_PLATFORM", "FPCOPPOLY").any()
    matrix = 4 not in kinds and capture.parameters.numbers("FORCE_PLATFORM", "CAL_MATRIX").any()
    return {
        "a plate of type 1 tells where the load presses itself": ("ORIGIN",) if lifted else (),
        "centres of pressure of a plate of type 3 are not corrected": ("FPCOPPOLY",)
        if bent
        else (),
        "only plates of type 4 are to be calibrated": ("CAL_MATRIX",) if matrix else (),
    }


def sentences(trials: Iterable[LeftOut]) -> tuple[str, ...]:
    """What was left out of any trial, each once, as sentences of the provenance."""
    merged: dict[str, dict[str, None]] = {}
    for trial in trials:
        for why, what in trial.items():
            merged.setdefault(why, {}).update(dict.fromkeys(what))
    told: list[str] = []
    for why, names in merged.items():
        listed = [*names][:_MOST]
        more = len(names) - len(listed)
        told += not_taken([*listed, f"{more} more"] if more else listed, why)
    return tuple(told)
