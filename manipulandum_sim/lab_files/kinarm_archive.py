"""A simulated session as a Kinarm archive (`.kinarm`), the newer export of Dexterit-E.

A folder a trial, a member a channel: `header.bin`, `parameters.bin`, `examevents.bin`,
`videoack.bin`, `<channel>.kinematics`, `<hand>.position`; numbers little-endian, texts UTF-16.
"""

from __future__ import annotations

import struct
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from armimpedance.core.outputs import staged_file
from armimpedance.core.records import Recording
from manipulandum_sim.lab_files.c3d_bytes import Groups, Value
from manipulandum_sim.lab_files.kinarm_exam import (
    UNITS,
    KinarmTrial,
    Side,
    kinarm_exam,
    write_member,
)


def write_kinarm_archive(
    recording: Recording, path: Path, side: Side = "right", version: int = 3
) -> None:
    """Write an exam as an archive.

    Parameters
    ----------
    recording : Recording
        Of the hand in a plane.
    path : Path
        The file, `.kinarm`.
    side : {"right", "left"}
        The arm; a left one is the mirror image.
    version : {2, 3}
        Of headers, parameters and events.

    Raises
    ------
    InputError
        The recording is of another kind, or the file cannot be written.
    """
    exam = kinarm_exam(recording, side)
    begin = struct.pack("<i", version)
    with staged_file(path) as temporary, zipfile.ZipFile(temporary, "w") as archive:
        shared = {
            "header.bin": _header("common", 0, 0.0, (), ()),
            "parameters.bin": _parameters(exam.common()),
        }
        for name, data in shared.items():
            write_member(archive, f"raw/common/{name}", begin + data)
        for trial in exam.trials():
            for name, data in _members(trial, exam.side, recording.sample_rate_hz):
                versioned = begin if name.endswith(".bin") else struct.pack("<i", 1)
                write_member(archive, f"raw/{trial.name}/{name}", versioned + data)


def _members(trial: KinarmTrial, side: Side, rate_hz: float) -> Iterator[tuple[str, bytes]]:
    hand, frames = f"{side.title()}_Hand", len(trial.hand)
    labels, events = tuple(trial.channels), len(trial.events)
    yield "header.bin", _header(trial.name, frames, rate_hz, labels, (hand,), events)
    yield "parameters.bin", _parameters(trial.groups)
    times = b"".join(
        _text(label) + _text("") + struct.pack("<f", time_s) for label, time_s in trial.events
    )
    yield "examevents.bin", struct.pack("<i", events) + times
    yield "videoack.bin", struct.pack("<i", 0)
    yield (
        f"{hand}.position",
        _text(hand) + _text("") + struct.pack("<i", frames) + _floats(trial.hand),
    )
    for label, values in trial.channels.items():
        unit = UNITS.get(label.split("_", 1)[-1], "V")
        texts = _text(label) + _text("") + _text(unit)
        yield f"{label}.kinematics", texts + struct.pack("<i", frames) + _floats(values)


def _header(
    name: str,
    frames: int,
    rate_hz: float,
    channels: tuple[str, ...],
    positions: tuple[str, ...],
    events: int = 0,
) -> bytes:
    counts = struct.pack("<5if", frames, len(channels), len(positions), events, 0, rate_hz)
    return counts + b"".join(map(_text, (name, *channels, *positions)))


def _parameters(groups: Groups) -> bytes:
    written = b""
    for group, parameters in groups.items():
        written += struct.pack("<i", 1) + _text(group) + _text("")
        for name, value in parameters.items():
            written += struct.pack("<i", 2) + _text(name) + _text("") + _value(value)
    return written


def _value(value: Value) -> bytes:
    """Type, count and values of a parameter."""
    if isinstance(value, str):
        value = (value,)
    if isinstance(value, tuple):
        return struct.pack("<2i", 0, len(value)) + b"".join(map(_text, value))
    numbers = np.asarray(value)
    whole = numbers.dtype.kind in "iu"
    data = numbers.astype("<i4" if whole else "<f4").tobytes()
    return struct.pack("<2i", 2 if whole else 3, numbers.size) + data


def _text(text: str) -> bytes:
    units = text.encode("utf-16-le")
    return struct.pack("<i", len(units) // 2) + units


def _floats(values: np.ndarray) -> bytes:
    return values.astype("<f4").tobytes()
