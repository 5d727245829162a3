"""What can be said of data without asking their owner: variables, files, numbers of trials."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from armimpedance.core.records import Recording
from armimpedance.recordings import AnyRecording
from armimpedance.show.files.sharing.columns import (
    Column,
    result_column,
    sample_columns,
    trial_column,
)
from armimpedance.show.files.sharing.form import Shared

_BLOCK = 1 << 20


@dataclass(frozen=True)
class Variable:
    """A variable of the data: its name, what it is, its unit ("n/a": none)."""

    name: str
    words: str
    unit: str


@dataclass(frozen=True)
class DataFile:
    """A file of the data: its name below what was named, its size and its checksum."""

    name: str
    size: int
    sha256: str
    ending: str


def variables(shared: Shared) -> list[Variable]:
    """All variables, each name once: those of samples, of trials, of results."""
    found: dict[str, Variable] = {}
    for _, recording in shared.recordings:
        samples: list[Column] = sample_columns(recording)
        found |= {c.name: Variable(c.name, c.words, c.unit) for c in samples}
        if not isinstance(recording, Recording) and recording.emg is not None:
            unit = "V" if recording.emg.unit == "V" else "n/a"
            for muscle in recording.emg.muscles:
                found[f"emg_{muscle}"] = Variable(f"emg_{muscle}", f"EMG of {muscle}", unit)
        for name in map(str, recording.trials.columns):
            found.setdefault(name, Variable(name, *trial_column(name)))
    for table in shared.results:
        levels = {row.get("level", "") for row in table.rows}
        level = levels.pop() if len(levels) == 1 else ""
        for name in table.columns:
            words, unit = result_column(name, level or "hand")
            found.setdefault(name, Variable(name, words or "column of the table", unit))
    return list(found.values())


def data_files(shared: Shared) -> list[DataFile]:
    """The files that were named, those of a folder one by one."""
    return [_file(file, top) for path in shared.paths for top, file in _inside(path.resolve())]


def _inside(path: Path) -> Iterator[tuple[Path, Path]]:
    if path.is_dir():
        files = sorted(file for file in path.rglob("*") if file.is_file())
        yield from ((path.parent, file) for file in files)
    else:
        yield path.parent, path


def _file(file: Path, top: Path) -> DataFile:
    summed = hashlib.sha256()
    with file.open("rb") as stream:
        while block := stream.read(_BLOCK):
            summed.update(block)
    name = file.relative_to(top).as_posix()
    return DataFile(name, file.stat().st_size, summed.hexdigest(), file.suffix.lower())


def facts(recording: AnyRecording) -> list[tuple[str, str]]:
    """What a recording says of itself, for people: name and value."""
    kind = recording.kind if isinstance(recording, Recording) else type(recording).__name__
    names = {
        "hand": "position of the hand and its force on a device",
        "joint": "joint angles and torques",
        "MarkerRecording": "markers of motion capture",
        "MotionRecording": "joint motion",
    }
    conditions = list(dict.fromkeys(map(str, recording.trials["condition"])))
    shown = ", ".join(conditions[:20]) + (", …" if len(conditions) > 20 else "")
    told = [
        ("what was recorded", names[kind]),
        ("trials", str(len(recording.trials))),
        ("conditions", f"{len(conditions)}: {shown}"),
        ("samples a second", f"{recording.sample_rate_hz:g}"),
        ("samples", str(len(recording.time_s))),
    ]
    if isinstance(recording, Recording):
        told.append(("disturbances", recording.perturbation))
    emg = recording.emg
    if emg is not None:
        names_of = recording.muscles if isinstance(recording, Recording) else emg.muscles  # type: ignore[union-attr]
        told.append(("EMG", ", ".join(names_of)))
    return told


def steps(recording: AnyRecording) -> list[str]:
    """What was done so far; sentences that name a place on somebody's disk are left out."""
    return [s for s in recording.provenance if "/" not in s and "\\" not in s]


def missing_words(shared: Shared) -> tuple[str, ...]:
    """Which of the owner's statements are missing, one sentence."""
    options: dict[str, Any] = {
        "name": "--name",
        "description": "--description",
        "creators": "--creator",
        "licence": "--licence",
        "identifier": "--identifier",
    }
    said = shared.statement
    absent = [f"{name} ({o})" for name, o in options.items() if not getattr(said, name)]
    return (f"Not told, and left out: {', '.join(absent)}.",) if absent else ()
