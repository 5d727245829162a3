"""Events of a C3D file, and its contents that a recording leaves out."""

from __future__ import annotations

import re
import struct
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.findings import not_taken
from armimpedance.recordings.c3d.c3d_file import C3dFile
from armimpedance.recordings.c3d.parameters import Processor
from armimpedance.recordings.c3d.plates import Plate

#: Value of the header's word 150 if its events have labels of four characters.
_LABELLED: Final = 12345
_MOST_IN_HEADER: Final = 18


@dataclass(frozen=True)
class Event:
    """An event at one time.

    `context`: such as Left; empty if there is none.
    `time_s`: time on the trial's own clock; 0 is its first frame.
    """

    label: str
    context: str
    subject: str
    time_s: float

    @property
    def name(self) -> str:
        """Context and label in one name."""
        general = self.context.lower() in ("", "general")
        return self.label if general else f"{self.context} {self.label}"


def events_of(capture: C3dFile) -> tuple[Event, ...]:
    """Events of a file in the order of their times, with times from its first frame."""
    stored = _of_group(capture) or _of_header(capture.header, capture.parameters.processor)
    late = (capture.layout.first_frame - 1) / capture.rate_hz
    shifted = [Event(e.label, e.context, e.subject, e.time_s - late) for e in stored]
    return tuple(sorted((e for e in shifted if np.isfinite(e.time_s)), key=lambda e: e.time_s))


def event_columns(events: tuple[Event, ...]) -> dict[str, float]:
    """Columns of the trial table: ``event_<name>_s``, with ``_2``, … for repeated events."""
    columns, seen = {}, Counter[str]()
    for event in events:
        stem = "event_" + (re.sub(r"\W+", "_", event.name).strip("_") or "unnamed")
        seen[stem] += 1
        repeat = f"_{seen[stem]}" if seen[stem] > 1 else ""
        # rounded to a microsecond: times are float32
        columns[f"{stem}{repeat}_s"] = round(event.time_s, 6)
    return columns


def _of_group(capture: C3dFile) -> list[Event]:
    parameters = capture.parameters
    labels = parameters.texts("EVENT", "LABELS")
    contexts = parameters.texts("EVENT", "CONTEXTS")
    subjects = parameters.texts("EVENT", "SUBJECTS")
    # a time is a pair of minutes and seconds
    times = parameters.numbers("EVENT", "TIMES")
    used = parameters.first("EVENT", "USED", len(labels))
    count = min(len(labels), len(times) // 2, int(used) if np.isfinite(used) else 0)
    return [
        Event(
            labels[i],
            contexts[i] if i < len(contexts) else "",
            subjects[i] if i < len(subjects) else "",
            float(60.0 * times[2 * i] + times[2 * i + 1]),
        )
        for i in range(max(count, 0))
    ]


def _of_header(header: bytes, processor: Processor) -> list[Event]:
    """Read events from the header: words 150 and 151, times from 153 on, labels from 199 on."""
    key, count = struct.unpack_from(f"{processor.order}2H", header, 298)
    if key != _LABELLED or not 0 < count <= _MOST_IN_HEADER:
        return []
    words = np.frombuffer(header, processor.dtype("f4"), count, 304)
    times = processor.decoded(words)
    raw = [header[396 + 4 * i : 400 + 4 * i] for i in range(count)]
    labels = ["".join(c for c in r.decode("latin-1") if c.isprintable()).strip() for r in raw]
    return [Event(label, "", "", float(t)) for label, t in zip(labels, times, strict=True)]


# Contents of a C3D file that a recording of markers leaves out.

#: Points that are not places: outputs of a model, as listed in the group POINT.
_OUTPUTS: Final = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "REACTIONS")
#: Groups that the reader uses, or that describe only the file's layout and display.
_READ: Final = {
    "POINT", "ANALOG", "FORCE_PLATFORM", "EVENT", "EVENT_CONTEXT", "TRIAL", "ROTATION",
    "DATA_BLOCKS",
}  # fmt: skip
#: More names than these are counted instead of listed.
_MOST: Final = 80

#: Reason -> names that are left out; merged over the trials of a recording.
LeftOut = Mapping[str, tuple[str, ...]]


def model_outputs(capture: C3dFile) -> dict[str, str]:
    """Map of labels of points that are not places to their kinds, in lower case."""
    further = {t.upper() for t in capture.parameters.texts("POINT", "TYPE_GROUPS")}
    # positions from a model are places, as markers are
    kinds = [k for k in (*_OUTPUTS, *sorted(further - {*_OUTPUTS})) if "MARKER" not in k]
    return {
        label: kind.lower()
        for kind in kinds
        for label in capture.parameters.texts("POINT", kind)
        if label
    }


def beside(capture: C3dFile, channels: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """Names that are left out of every file, by the reason.

    `channels`: analog channels that were read.
    """
    used = set(channels)
    free = tuple(c or "without a name" for c in capture.analog_labels if c not in used)
    rotations = capture.parameters.texts("ROTATION", "LABELS")
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
        "rotations of segments have no place in a recording of markers": rotations,
        "groups of parameters that are not read": groups,
        "only whether a marker was seen is kept": ("residuals and cameras",) if cameras else (),
    }


def unused(capture: C3dFile, plates: Iterable[Plate]) -> dict[str, tuple[str, ...]]:
    """Descriptions of the plates that their wrenches do not use, by the reason."""
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
    """Sentences of the provenance on everything left out of any trial, each once."""
    merged: dict[str, dict[str, None]] = {}
    for trial in trials:
        for reason, left_names in trial.items():
            merged.setdefault(reason, {}).update(dict.fromkeys(left_names))
    messages: list[str] = []
    for reason, names in merged.items():
        listed = [*names][:_MOST]
        more = len(names) - len(listed)
        messages += not_taken([*listed, f"{more} more"] if more else listed, reason)
    return tuple(messages)
