"""The columns of recordings and results in words, with units: for descriptions that others read."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import AXES, force_columns, position_columns
from armimpedance.core.motion import WRENCH, MarkerRecording, MotionRecording
from armimpedance.core.records import Recording
from armimpedance.recordings import AnyRecording
from armimpedance.show.files.sharing.form import Shared
from armimpedance.show.files.words import RowAxes, meaning_of

Kind = Literal["POS", "JNTANG", "MISC"]

#: Ending of a column's name -> its unit as BIDS writes it.
_UNITS: Final = {
    "_m": "m",
    "_rad": "rad",
    "_deg": "deg",
    "_Nm": "N*m",
    "_N": "N",
    "_s": "s",
    "_V": "V",
    "_kg": "kg",
    "_Hz": "Hz",
}
_WRENCH_UNITS: Final = ("N", "N", "N", "N*m", "N*m", "N*m")


@dataclass(frozen=True)
class DescribedColumn:
    """One column of samples.

    `values` (N,).
    `unit`: "n/a" where it has none.
    `kind`: type of a channel in BIDS.
    `component`, `point`: axis and tracked point, where there is one.
    """

    name: str
    words: str
    unit: str
    values: FloatArray
    kind: Kind = "MISC"
    component: str = "n/a"
    point: str = "n/a"

    @property
    def frame(self) -> str:
        """Reference frame of a position."""
        return "lab" if self.kind == "POS" else "n/a"


def unit_of_name(name: str) -> str:
    """The unit that the end of a column's name says, or "n/a"."""
    return next((unit for end, unit in _UNITS.items() if name.endswith(end)), "n/a")


def sample_columns(recording: Any) -> list[DescribedColumn]:
    """All columns of samples of a recording, its time first, without EMG of another rate."""
    time = DescribedColumn("trial_time", "each trial's own clock", "s", recording.time_s)
    if isinstance(recording, Recording):
        return [time, *_of_the_limb(recording)]
    plates = _plates(recording)
    if isinstance(recording, MarkerRecording):
        return [time, *_markers(recording), *plates]
    return [time, *_coordinates(recording), *plates]


def _of_the_limb(recording: Recording) -> list[DescribedColumn]:
    hand = recording.kind == "hand"
    d = recording.axes
    columns = []
    for i, name in enumerate(position_columns(recording.kind, d)):
        words = f"position of the hand, {AXES[i]}" if hand else f"angle of joint {i + 1}"
        kind: Kind = "POS" if hand else "JNTANG"
        component, point = (AXES[i], "hand") if hand else ("n/a", f"joint{i + 1}")
        values = recording.position[:, i]
        columns.append(
            DescribedColumn(name, words, unit_of_name(name), values, kind, component, point)
        )
    for i, name in enumerate(force_columns(recording.kind, d)):
        what = f"force, {AXES[i]}," if hand else f"torque of joint {i + 1}"
        words = f"{what} by the limb on the device"
        columns.append(DescribedColumn(name, words, unit_of_name(name), recording.force[:, i]))
    if recording.joint_angles is not None:
        for i, name in enumerate(arm_angle_names(recording.joint_angles.shape[1])):
            values = recording.joint_angles[:, i]
            words = f"measured angle {i + 1} of the arm"
            columns.append(
                DescribedColumn(name, words, "rad", values, "JNTANG", point=f"joint{i + 1}")
            )
    if recording.emg is not None:
        unit = "V" if recording.emg_unit == "V" else "n/a"
        unit_words = "" if recording.emg_unit == "V" else ", part of a maximal contraction"
        for i, muscle in enumerate(recording.muscles):
            words = f"EMG of {muscle}{unit_words}"
            columns.append(DescribedColumn(f"emg_{muscle}", words, unit, recording.emg[:, i]))
    for name, values in recording.extra.items():
        columns.append(
            DescribedColumn(name, "further column of the recording", unit_of_name(name), values)
        )
    return columns


def arm_angle_names(joints: int) -> tuple[str, ...]:
    """Columns of the arm's measured posture."""
    if joints == 2:
        return ("q_shoulder_rad", "q_elbow_rad")
    return tuple(f"q_{i}_rad" for i in range(1, joints + 1))


def _markers(recording: MarkerRecording) -> list[DescribedColumn]:
    return [
        DescribedColumn(
            name=f"{name}_{axis}",
            words=f"place of marker {name}, {axis}",
            unit="m",
            values=recording.positions[:, p, i],
            kind="POS",
            component=axis,
            point=name,
        )
        for p, name in enumerate(recording.names)
        for i, axis in enumerate(AXES)
    ]


def _coordinates(recording: MotionRecording) -> list[DescribedColumn]:
    columns = []
    for i, name in enumerate(recording.skeleton.columns):
        unit = unit_of_name(name)
        kind: Kind = "JNTANG" if unit == "rad" else "MISC"
        words = "coordinate of the skeleton"
        columns.append(DescribedColumn(name, words, unit, recording.coordinates[:, i], kind))
    if recording.torque is not None:
        for i, name in enumerate(recording.skeleton.coordinates):
            words = f"generalised force of {name}"
            columns.append(DescribedColumn(f"tau_{name}", words, "n/a", recording.torque[:, i]))
    return columns


def _plates(recording: MarkerRecording | MotionRecording) -> list[DescribedColumn]:
    if recording.wrenches is None or recording.plate_origins_m is None:
        return []
    columns = []
    for k in range(recording.wrenches.shape[1]):
        origin = ", ".join(repr(float(v)) for v in recording.plate_origins_m[k])
        for i, name in enumerate(WRENCH):
            what = "force" if name.startswith("f") else "moment about its origin"
            words = f"{what} by plate {k + 1} on the body; origin at {origin} m"
            values = np.ascontiguousarray(recording.wrenches[:, k, i])
            columns.append(DescribedColumn(f"plate{k + 1}_{name}", words, _WRENCH_UNITS[i], values))
    return columns


#: What columns of the trial table mean; others are the laboratory's own.
_OF_TRIALS: Final = {
    "trial": "number of the trial",
    "condition": "condition of the trial",
    "set": "set of trials",
    "day": "day of the experiment, counted",
    "experiment": "experiment",
    "direction_deg": "direction of the disturbance, counter-clockwise from x",
    "elevation_deg": "direction of the disturbance, above the x-y plane",
    "elbow": "whether the upper arm was held from turning about its axis, or free",
    "onset_s": "onset of the disturbance on the trial's own clock",
    "end_s": "end of the disturbance on the trial's own clock",
    "target_activation": "muscle activation that was asked for, part of a maximal contraction",
    "q_shoulder_rad": "angle of the shoulder",
    "q_elbow_rad": "angle of the elbow",
}


def trial_column(name: str) -> tuple[str, str]:
    """Meaning and unit of a column of the trial table; "n/a" if it has no unit."""
    return _OF_TRIALS.get(name, "column of the trial table"), unit_of_name(name)


def result_column(name: str, level: str = "hand") -> tuple[str, str]:
    """Meaning and unit of a column of results; "n/a" if it has no unit or none is known."""
    meaning = meaning_of(name, RowAxes(level))
    return meaning.words, meaning.unit or "n/a"


# What can be said of data without asking their owner: variables, files, numbers of trials.

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
    variables_by_name: dict[str, Variable] = {}
    for _, recording in shared.recordings:
        samples: list[DescribedColumn] = sample_columns(recording)
        variables_by_name |= {c.name: Variable(c.name, c.words, c.unit) for c in samples}
        if not isinstance(recording, Recording) and recording.emg is not None:
            unit = "V" if recording.emg.unit == "V" else "n/a"
            for muscle in recording.emg.muscles:
                variables_by_name[f"emg_{muscle}"] = Variable(
                    f"emg_{muscle}", f"EMG of {muscle}", unit
                )
        for name in map(str, recording.trials.columns):
            variables_by_name.setdefault(name, Variable(name, *trial_column(name)))
    for table in shared.results:
        levels = {row.get("level", "") for row in table.rows}
        level = levels.pop() if len(levels) == 1 else ""
        for name in table.columns:
            words, unit = result_column(name, level or "hand")
            variables_by_name.setdefault(name, Variable(name, words or "column of the table", unit))
    return list(variables_by_name.values())


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
    """Facts of a recording for people to read, as pairs of name and value."""
    kind = recording.kind if isinstance(recording, Recording) else type(recording).__name__
    names = {
        "hand": "position of the hand and its force on a device",
        "joint": "joint angles and torques",
        "MarkerRecording": "markers of motion capture",
        "MotionRecording": "joint motion",
    }
    conditions = list(dict.fromkeys(map(str, recording.trials["condition"])))
    shown = ", ".join(conditions[:20]) + (", …" if len(conditions) > 20 else "")
    pairs = [
        ("what was recorded", names[kind]),
        ("trials", str(len(recording.trials))),
        ("conditions", f"{len(conditions)}: {shown}"),
        ("samples a second", f"{recording.sample_rate_hz:g}"),
        ("samples", str(len(recording.time_s))),
    ]
    if isinstance(recording, Recording):
        pairs.append(("disturbances", recording.perturbation))
    emg = recording.emg
    if emg is not None:
        names_of = recording.muscles if isinstance(recording, Recording) else emg.muscles  # type: ignore[union-attr]
        pairs.append(("EMG", ", ".join(names_of)))
    return pairs


def steps(recording: AnyRecording) -> list[str]:
    """Processing steps so far, without sentences that name a path on a disk."""
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
    statement = shared.statement
    absent = [f"{name} ({o})" for name, o in options.items() if not getattr(statement, name)]
    return (f"Not told, and left out: {', '.join(absent)}.",) if absent else ()
