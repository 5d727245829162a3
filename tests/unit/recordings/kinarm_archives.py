"""Kinarm archives (`.kinarm`), written byte by byte from the same trials as the C3D exams.

Slow and plain on purpose; nothing of the readers or of the simulator's writers is used.
"""

from __future__ import annotations

import struct
import zipfile
from pathlib import Path

import numpy as np


def number(value):
    return struct.pack("<i", value)


def text(value):
    written = value.encode("utf-16-le")
    return number(len(written) // 2) + written


def reals(values):
    return b"".join(struct.pack("<f", value) for value in np.ravel(values))


def parameter(value):
    """A C3D parameter's type, count and values as an archive has them."""
    if value.code == -1:
        width = value.sizes[0] if value.sizes else 0
        starts = range(0, len(value.data), width) if width else []
        parts = [value.data[i : i + width].decode() for i in starts]
        return number(0) + number(len(parts)) + b"".join(text(part) for part in parts)
    if value.code == 2:
        whole = struct.unpack(f"<{len(value.data) // 2}h", value.data)
        return number(2) + number(len(whole)) + b"".join(number(each) for each in whole)
    assert value.code == 4
    return number(3) + number(len(value.data) // 4) + value.data


def parameters(groups, version=3):
    written = number(version)
    for group, held in groups.items():
        written += number(1) + text(group) + text(f"what {group} is")
        for name, value in held.items():
            written += number(2) + text(name) + text("") + parameter(value)
    return written


def header(name, frames, rate, channels, positions, events=0, shown=0, version=3):
    counts = (frames, len(channels), len(positions), events, shown)
    written = b"".join(number(each) for each in (version, *counts)) + struct.pack("<f", rate)
    return written + b"".join(text(each) for each in (name, *channels, *positions))


def series(label, values, unit="V"):
    return number(1) + text(label) + text("") + text(unit) + number(len(values)) + reals(values)


def places(label, values):
    return number(1) + text(label) + text("") + number(len(values)) + reals(values)


def events(times, version=3):
    written = number(version) + number(len(times))
    for label, time_s in times:
        written += text(label) + text("what it is") + struct.pack("<f", time_s)
    return written


def shown(times, version=3):
    return number(version) + number(len(times)) + reals(times)


def trial_members(exams, trial, robot, version=3):
    """The members of one trial's folder by their names."""
    points, channels, groups = exams.content(trial, robot)
    kept = {name: groups[name] for name in groups if name not in ("POINT", "ANALOG", "EVENTS")}
    hands = ("Right_Hand", "Left_Hand")
    rate, frames = trial.rate, trial.samples
    stem = trial.name.removesuffix(".c3d")
    return {
        "header.bin": header(stem, frames, rate, channels, hands, len(trial.events), 0, version),
        "parameters.bin": parameters(kept, version),
        "examevents.bin": events(trial.events, version),
        "videoack.bin": shown([], version),
        **{f"{hands[i]}.position": places(hands[i], points[:, i, :2]) for i in (0, 1)},
        **{f"{name}.kinematics": series(name, values) for name, values in channels.items()},
    }


def members(exams, trials=None, robot=None, version=3, root="raw/"):
    """All members of an archive by their names."""
    robot = robot or exams.Robot()
    files = {
        f"{root}common/header.bin": header("common", 0, 0.0, (), (), version=version),
        f"{root}common/parameters.bin": parameters(exams.shared(robot), version),
    }
    for trial in [exams.Trial()] if trials is None else trials:
        folder = f"{root}{trial.name.removesuffix('.c3d')}"
        of_trial = trial_members(exams, trial, robot, version)
        files |= {f"{folder}/{name}": data for name, data in of_trial.items()}
    return files


def packed(path: Path, files: dict[str, bytes]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return path
