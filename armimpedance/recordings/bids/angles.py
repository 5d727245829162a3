"""Joint angles of Motion-BIDS (channels JNTANG) as the motion of a skeleton."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.findings import not_taken
from armimpedance.core.motion import MotionRecording
from armimpedance.core.records import Subject
from armimpedance.core.skeleton import Skeleton
from armimpedance.recordings.bids.dataset import Person
from armimpedance.recordings.bids.runs import Clocked, Run, clock_of, clocked, trial_table
from armimpedance.recordings.bids.systems import Channel, System
from armimpedance.recordings.mapped.mapping import known_unit


def has_angles(runs: Sequence[Run]) -> bool:
    """Return True if a tracking system has channels of joint angles."""
    return any(system.of_kind("JNTANG") for run in runs for system in run.systems)


def bids_angles(
    person: Person,
    runs: Sequence[Run],
    skeleton: Skeleton | None,
    names: Mapping[str, str],
    *,
    system: str | None = None,
    in_degrees: bool | None = None,
) -> MotionRecording:
    """Read the joint angles of one person's runs.

    `skeleton`: coordinates that no channel has are set to 0, which the provenance states.
    `names`: coordinate -> channel, if the names differ; ``-channel`` reverses the sign.
    `system`: the tracking system, if several have angles.
    `in_degrees`: unit of angles whose channel has none.
    Raises InputError: no skeleton, none of its angles, a channel without unit, or a value that is
    missing.
    """
    if skeleton is None:
        expected = "a skeleton, --skeleton FILE.json"
        raise InputError(
            "joint angles say nothing of the body", file=person.within, expected=expected
        )
    for coordinate in names:
        skeleton.coordinate(coordinate)
    trials: list[Clocked] = []
    remarks: dict[str, None] = {"Read from Motion-BIDS, joint angles.": None}
    for run in runs:
        index = _chosen(run, system)
        if index is None:
            remarks |= dict.fromkeys(not_taken([run.name], "no joint angles in it"))
            continue
        cut, notes = _trials(run, index, skeleton, names, in_degrees)
        trials += cut
        remarks |= dict.fromkeys((*notes, *run.notes))
    rates = {trial.rate_hz for trial in trials}
    if len(rates) != 1:
        raise InputError(f"runs of {len(rates)} rates", file=person.within, expected="one rate")
    mass, height = (person.facts.get(name) for name in ("mass_kg", "height_m"))
    return MotionRecording(
        sample_rate_hz=rates.pop(),
        trials=trial_table(trials),
        offsets=np.cumsum([0, *(len(trial.time_s) for trial in trials)]),
        time_s=np.concatenate([trial.time_s for trial in trials]),
        coordinates=np.concatenate([trial.values for trial in trials]),
        skeleton=skeleton,
        subject=Subject(
            id=person.label,
            mass_kg=mass if isinstance(mass, float) else None,
            height_m=height if isinstance(height, float) else None,
        ),
        provenance=tuple(remarks),
    )


def _chosen(run: Run, label: str | None) -> int | None:
    """Index of the system of a run that has joint angles; None if no system has."""
    systems = [i for i, s in enumerate(run.systems) if s.of_kind("JNTANG")]
    named = [i for i in systems if label in (None, run.systems[i].name)]
    if len(named) > 1 or (systems and not named):
        names = ", ".join(run.systems[i].name for i in systems)
        file = run.systems[0].file.path.parent
        problem = f"joint angles of {len(systems)} systems in {run.name}"
        raise InputError(problem, file=file, expected=f"--prefix NAME, one of {names}")
    return named[0] if named else None


def _trials(
    run: Run, index: int, skeleton: Skeleton, names: Mapping[str, str], in_degrees: bool | None
) -> tuple[list[Clocked], tuple[str, ...]]:
    system = run.systems[index]
    pairs = _pairs(system, skeleton, names)
    channels = list(dict.fromkeys(column for _, column, _ in pairs))
    clock = clock_of(system)
    values = system.read([*channels, *clock])
    q = np.zeros((len(values), len(skeleton.coordinates)))
    for coordinate, column, sign in pairs:
        angle = _in_si(
            values[:, channels.index(column)], system.channels[column], system.file.path, in_degrees
        )
        q[:, coordinate] = sign * angle
    used = {system.channels[column].name for column in (*channels, *clock)}
    unused_names = [channel.name for channel in system.channels if channel.name not in used]
    others = [s for i, s in enumerate(run.systems) if i != index]
    notes = not_taken(unused_names, f"{system.name}: no coordinate of the skeleton")
    for unused in others:
        notes += not_taken([channel.name for channel in unused.channels], f"of {unused.name}")
    chosen = {coordinate for coordinate, _, _ in pairs}
    absent = [c for i, c in enumerate(skeleton.coordinates) if i not in chosen]
    if absent:
        notes += (f"Not in the dataset, set to 0: {', '.join(absent)}.",)
    return clocked(run, index, q, values[:, -1] if clock else None), notes


def _pairs(
    system: System, skeleton: Skeleton, names: Mapping[str, str]
) -> list[tuple[int, int, float]]:
    """Coordinate, channel and sign of all angles that are in the file."""
    index_of = {channel.name: i for i, channel in enumerate(system.channels)}
    pairs = []
    for number, (coordinate, column) in enumerate(
        zip(skeleton.coordinates, skeleton.columns, strict=True)
    ):
        stated = names.get(coordinate)
        wanted = [stated.removeprefix("-")] if stated is not None else [coordinate, column]
        index = next((index_of[name] for name in wanted if name in index_of), None)
        if index is not None:
            pairs.append((number, index, -1.0 if stated and stated.startswith("-") else 1.0))
        elif stated is not None:
            expected = f"one of {', '.join(list(index_of)[:12])}"
            raise InputError(f"no channel {stated!r:.60}", file=system.file.path, expected=expected)
    if not pairs:
        expected = f"one of {', '.join(skeleton.coordinates[-12:])}, or --angle"
        raise InputError("none of the skeleton's angles", file=system.file.path, expected=expected)
    return pairs


def _in_si(values: FloatArray, channel: Channel, file: Path, in_degrees: bool | None) -> FloatArray:
    """Convert the values of a channel to rad or m; refuse missing values."""
    unit = known_unit(channel.unit or "")
    if unit is None and channel.unit is None and in_degrees is not None:
        unit = known_unit("deg" if in_degrees else "rad")
    if unit is None or unit.dimension not in ("angle", "length"):
        expected = "deg or rad in its _channels.tsv, or --in-degrees"
        problem = f"unit {channel.unit!r:.20}"
        raise InputError(problem, file=file, column=channel.name, expected=expected)
    lost = np.flatnonzero(np.isnan(values))
    if len(lost):
        location = {"file": file, "column": channel.name, "expected": "a number"}
        raise InputError("is missing", row=int(lost[0]) + 1, **location)  # type: ignore[arg-type]
    return unit.to_si(values)
