"""Events of a C3D file: those of the EVENT group, else those in its header."""

from __future__ import annotations

import re
import struct
from collections import Counter
from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.recordings.capture.capture import Capture
from armimpedance.recordings.capture.processor import Processor

#: The header's word 150 says that its events have labels of four characters.
_LABELLED: Final = 12345
_MOST_IN_HEADER: Final = 18


@dataclass(frozen=True)
class Event:
    """Something that happened at a time.

    Attributes
    ----------
    label : str
    context : str
        Such as Left; empty where there is none.
    subject : str
    time_s : float
        On the trial's own clock: 0 is its first frame.
    """

    label: str
    context: str
    subject: str
    time_s: float

    @property
    def name(self) -> str:
        """Context and label as one name."""
        general = self.context.lower() in ("", "general")
        return self.label if general else f"{self.context} {self.label}"


def events_of(capture: Capture) -> tuple[Event, ...]:
    """The events of a file in the order of their times; their clock begins at frame 1."""
    found = _of_group(capture) or _of_header(capture.header, capture.parameters.processor)
    late = (capture.layout.first_frame - 1) / capture.rate_hz
    moved = [Event(e.label, e.context, e.subject, e.time_s - late) for e in found]
    return tuple(sorted((e for e in moved if np.isfinite(e.time_s)), key=lambda e: e.time_s))


def event_columns(events: tuple[Event, ...]) -> dict[str, float]:
    """Columns of the trial table: ``event_<name>_s``, and ``_2``, … where it happened again."""
    columns, seen = {}, Counter[str]()
    for event in events:
        stem = "event_" + (re.sub(r"\W+", "_", event.name).strip("_") or "unnamed")
        seen[stem] += 1
        again = f"_{seen[stem]}" if seen[stem] > 1 else ""
        # rounded to a microsecond: times are float32
        columns[f"{stem}{again}_s"] = round(event.time_s, 6)
    return columns


def _of_group(capture: Capture) -> list[Event]:
    parameters = capture.parameters
    labels = parameters.texts("EVENT", "LABELS")
    contexts = parameters.texts("EVENT", "CONTEXTS")
    subjects = parameters.texts("EVENT", "SUBJECTS")
    # A time is a pair: minutes and seconds.
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
    """Events in the header: words 150 and 151, times from word 153 on, labels from 199 on."""
    key, count = struct.unpack_from(f"{processor.order}2H", header, 298)
    if key != _LABELLED or not 0 < count <= _MOST_IN_HEADER:
        return []
    words = np.frombuffer(header, processor.dtype("f4"), count, 304)
    times = processor.decoded(words)
    raw = [header[396 + 4 * i : 400 + 4 * i] for i in range(count)]
    labels = ["".join(c for c in r.decode("latin-1") if c.isprintable()).strip() for r in raw]
    return [Event(label, "", "", float(t)) for label, t in zip(labels, times, strict=True)]
