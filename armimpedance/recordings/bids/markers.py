"""Tracked points of Motion-BIDS as a recording of markers, with EMG."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.findings import not_taken
from armimpedance.core.json_text import is_number
from armimpedance.core.motion import EmgSignals, MarkerRecording
from armimpedance.core.records import Subject
from armimpedance.recordings.bids.dataset import Person
from armimpedance.recordings.bids.runs import (
    TRIAL_TIME,
    Clocked,
    Run,
    clock_of,
    clocked,
    rows_of,
    times_of,
    trial_table,
)
from armimpedance.recordings.bids.systems import System
from armimpedance.recordings.mapped.mapping import known_unit
from armimpedance.recordings.motion.moving_metadata import LARGEST_PLACE_M, lab_rotation

_AXES: Final = ("x", "y", "z")
#: Direction of an axis in BIDS -> its components forward, left, up.
_DIRECTIONS: Final = {
    "A": (1.0, 0.0, 0.0),
    "P": (-1.0, 0.0, 0.0),
    "L": (0.0, 1.0, 0.0),
    "R": (0.0, -1.0, 0.0),
    "S": (0.0, 0.0, 1.0),
    "I": (0.0, 0.0, -1.0),
}


@dataclass(frozen=True)
class _Trial:
    """Markers of a trial, in the world's frame, and its EMG."""

    names: tuple[str, ...]
    samples: Clocked
    emg: FloatArray | None


def bids_markers(
    person: Person,
    runs: Sequence[Run],
    *,
    system: str | None = None,
    emg_channels: Mapping[str, str] | None = None,
    axes: Sequence[str] | None = None,
) -> MarkerRecording:
    """Read the tracked points of one person's runs.

    `runs`: each is a trial, or has events that are trials.
    `system`: the tracking system, if several track points in space.
    `emg_channels`: channel -> muscle.
    `axes`: the file's axes that point forward, left and up; None: as in the reference frame.
    Raises InputError: no points in space, or several systems, frames or rates; or unknown axes.
    """
    muscles = dict(emg_channels or {})
    cut: list[_Trial] = []
    remarks: dict[str, None] = {}
    emg_rates = set()
    for run in runs:
        chosen = _tracking(run, system)
        if chosen is None:
            message = not_taken([run.name], "no points in space are tracked in it")
            remarks |= dict.fromkeys(message)
            continue
        amplifier = _amplifier(run, muscles) if muscles else None
        emg_rates |= {run.systems[amplifier].rate_hz} if amplifier is not None else set()
        trials, notes = _trials(run, chosen, amplifier, muscles, axes)
        cut += trials
        remarks |= dict.fromkeys((*notes, *run.notes, *_others(run, chosen, amplifier)))
    if not cut:
        expected = "channels POS x, y and z of a point; or --mapping for other channels"
        raise InputError("no points in space", file=person.within, expected=expected)
    _same_rates({t.samples.rate_hz for t in cut}, person.within)
    _same_rates(emg_rates, person.within)
    return _recording(person, cut, tuple(muscles.values()), emg_rates, tuple(remarks))


def _tracking(run: Run, label: str | None) -> int | None:
    """Index of the system of a run that tracks points in space; None if no system does."""
    tracking = [i for i, s in enumerate(run.systems) if s.sort == "motion" and _points(s)]
    names = [run.systems[i].name for i in tracking]
    if label is not None:
        if tracking and label not in names:
            file = run.systems[0].file.path.parent
            expected = f"one of {', '.join(names)}"
            raise InputError(f"no tracking system {label!r:.60}", file=file, expected=expected)
        return tracking[names.index(label)] if tracking else None
    if len(tracking) > 1:
        raise InputError(
            f"{len(tracking)} systems track points in space in {run.name}",
            file=run.systems[0].file.path.parent,
            expected=f"--prefix NAME, one of {', '.join(names)}",
        )
    return tracking[0] if tracking else None


def has_points(runs: Sequence[Run]) -> bool:
    """Return True if a tracking system tracks points in space."""
    return any(_points(system) for run in runs for system in run.systems)


def _points(system: System) -> dict[str, list[int]]:
    """Map of tracked points to their channels x, y, z, for points that have all three."""
    components: dict[str, dict[str, int]] = {}
    for index in system.of_kind("POS"):
        channel = system.channels[index]
        components.setdefault(channel.point or channel.name, {})[channel.component] = index
    return {p: [c[a] for a in _AXES] for p, c in components.items() if set(_AXES) <= set(c)}


def _trials(
    run: Run,
    chosen: int,
    amplifier: int | None,
    muscles: Mapping[str, str],
    axes: Sequence[str] | None,
) -> tuple[list[_Trial], tuple[str, ...]]:
    system = run.systems[chosen]
    points = _points(system)
    rotation, notes = _rotation(system, points, axes)
    flat = [index for channels in points.values() for index in channels]
    clock = clock_of(system)
    values = system.read([*flat, *clock])
    places = _world(values[:, : len(flat)], system, points, rotation)
    parts = clocked(run, chosen, places, values[:, -1] if clock else None)
    emg = None if amplifier is None else _emg_values(run, amplifier, muscles)
    cut = [None if emg is None else _emg_of(run, amplifier, emg, part) for part in parts]
    return [_Trial(tuple(points), *pair) for pair in zip(parts, cut, strict=True)], notes


def _rotation(
    system: System, points: Mapping[str, list[int]], axes: Sequence[str] | None
) -> tuple[FloatArray, tuple[str, ...]]:
    """Rotation from the file's frame to the world's, (3, 3), and a sentence on it."""
    frames = {system.channels[i].frame for channels in points.values() for i in channels}
    file = system.file.path
    if len(frames) > 1:
        shown = ", ".join(sorted(frame or "n/a" for frame in frames))
        expected = "one; or a mapping that takes the points of one"
        raise InputError(
            f"points in several reference frames: {shown}", file=file, expected=expected
        )
    if axes is not None:
        message = f"Read from Motion-BIDS; forward, left and up are the file's {', '.join(axes)}."
        return lab_rotation(axes), (message,)
    directions = system.axes.get(next(iter(frames)), "")
    rotation = np.array([_DIRECTIONS.get(d, (0.0, 0.0, 0.0)) for d in directions[:3]]).T
    if len(directions) != 3 or rotation.shape != (3, 3) or abs(np.linalg.det(rotation)) < 0.5:
        problem = f"SpatialAxes {directions!r:.20}" if directions else "no SpatialAxes"
        expected = "--axes X,Y,Z: the file's axes that point forward, left and up"
        raise InputError(f"{problem} of its reference frame", file=file, expected=expected)
    hand = "" if np.linalg.det(rotation) > 0 else ", a left-handed frame"
    return rotation, (f"Read from Motion-BIDS; its axes x, y, z are {directions}{hand}.",)


def _world(
    values: FloatArray, system: System, points: Mapping[str, list[int]], rotation: FloatArray
) -> FloatArray:
    """Places (N, P, 3) in the world's frame, m; NaN if a coordinate is missing."""
    file = system.file.path
    places = values.reshape(len(values), len(points), 3)
    missing = system.sidecar.get("MissingValues")
    lost = np.isnan(places).any(axis=2)
    if is_number(missing) or (isinstance(missing, str) and _is_zero(missing)):
        lost |= np.all(places == float(str(missing)), axis=2)
    metres = np.empty_like(places)
    for p, channels in enumerate(points.values()):
        for axis, index in enumerate(channels):
            unit = known_unit(system.channels[index].unit or "")
            if unit is None or unit.dimension != "length":
                problem = f"unit of length {system.channels[index].unit!r:.20}"
                name = system.channels[index].name
                raise InputError(problem, file=file, column=name, expected="m, cm or mm")
            metres[:, p, axis] = unit.to_si(places[:, p, axis])
    rotated = np.empty_like(metres)
    for axis in range(3):
        # each axis is one of the file's with a sign, so that nothing is rounded
        from_axis = int(np.argmax(np.abs(rotation[axis])))
        rotated[..., axis] = rotation[axis, from_axis] * metres[..., from_axis]
    rotated[lost] = np.nan
    farthest = np.nanmax(np.abs(rotated), initial=0.0)
    if farthest > LARGEST_PLACE_M:
        expected = "another unit in its _channels.tsv"
        raise InputError(f"a point {farthest:.4g} m away", file=file, expected=expected)
    return rotated


def _is_zero(text: str) -> bool:
    return text.strip() in ("0", "0.0")


def _amplifier(run: Run, muscles: Mapping[str, str]) -> int:
    """Index of the system that has all these EMG channels."""
    emg = [i for i, s in enumerate(run.systems) if s.sort == "emg"]
    for index in emg:
        if set(muscles) <= {channel.name for channel in run.systems[index].channels}:
            return index
    available = [channel.name for i in emg for channel in run.systems[i].channels]
    missing = next((name for name in muscles if name not in available), next(iter(muscles)))
    shown = ", ".join(available[:12]) or "no EMG at all"
    file = run.systems[0].file.path.parent
    raise InputError(f"no EMG channel {missing!r:.60} in {run.name}", file=file, expected=shown)


def _emg_values(run: Run, amplifier: int, muscles: Mapping[str, str]) -> FloatArray:
    """Read the EMG of the muscles (N, m), V."""
    system = run.systems[amplifier]
    names = [channel.name for channel in system.channels]
    chosen = [names.index(name) for name in muscles]
    values = system.read(chosen)
    columns = []
    for i, index in enumerate(chosen):
        channel = system.channels[index]
        unit = known_unit(channel.unit or "")
        if unit is None or unit.dimension != "emg" or unit.symbol in ("normalised", "%MVC"):
            problem = f"is in {channel.unit!r:.20}"
            file = system.file.path
            raise InputError(problem, file=file, column=channel.name, expected="V, mV or uV")
        columns.append(unit.to_si(values[:, i]))
    return np.column_stack(columns)


def _emg_of(run: Run, amplifier: int | None, emg: FloatArray, part: Clocked) -> FloatArray:
    """Cut the EMG of one trial, from its first frame on."""
    assert amplifier is not None  # noqa: S101 - EMG comes from an amplifier
    system = run.systems[amplifier]
    time = times_of(system, run.starts_s[amplifier], len(emg))
    rows = rows_of(part.stretch, time, system.rate_hz)
    first = max(rows.start, int(np.searchsorted(time, part.begin_s - 0.5 / system.rate_hz)))
    if first >= len(time) or time[first] > part.begin_s + 1.0 / system.rate_hz:
        raise InputError(
            f"EMG of {run.name} does not begin with its trial",
            file=system.file.path,
            expected="EMG from the first frame on, or no --emg",
        )
    return emg[first : rows.stop]


def _others(run: Run, chosen: int, amplifier: int | None) -> tuple[str, ...]:
    """Sentences on the channels of a run that are not in the recording."""
    notes: tuple[str, ...] = ()
    for index, system in enumerate(run.systems):
        names = [channel.name for channel in system.channels]
        if index == chosen:
            kept = {
                system.channels[i].name
                for channels_of in _points(system).values()
                for i in channels_of
            }
            names = [n for n in names if n not in kept | {TRIAL_TIME}]
            notes += not_taken(names, f"{system.name}: no points in space")
        elif system.sort == "emg" and index != amplifier:
            notes += not_taken(names, f"{system.name}: no --emg names them")
        elif index != amplifier:
            notes += not_taken(names, f"of {system.name}")
    return notes


def _same_rates(rates: set[float], file: Path) -> None:
    if len(rates) > 1:
        shown = " and ".join(f"{rate:g}" for rate in sorted(rates)[:3])
        expected = "one rate; name one session's folder or one _motion.tsv"
        raise InputError(f"runs of {shown} samples a second", file=file, expected=expected)


def _recording(
    person: Person,
    trials: Sequence[_Trial],
    muscles: tuple[str, ...],
    emg_rates: set[float],
    remarks: tuple[str, ...],
) -> MarkerRecording:
    names = tuple(dict.fromkeys(name for trial in trials for name in trial.names))
    absent = [n for n in names if any(n not in trial.names for trial in trials)]
    if absent:
        remarks += (f"Not in every trial, and lost there: {', '.join(absent)}.",)
    lengths = [len(trial.samples.time_s) for trial in trials]
    facts = person.facts
    mass, height = facts.get("mass_kg"), facts.get("height_m")
    return MarkerRecording(
        sample_rate_hz=trials[0].samples.rate_hz,
        trials=trial_table([trial.samples for trial in trials]),
        offsets=np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64),
        time_s=np.concatenate([trial.samples.time_s for trial in trials]),
        positions=np.concatenate([_as_named(trial, names) for trial in trials]),
        names=names,
        emg=_signals(trials, muscles, emg_rates) if emg_rates else None,
        subject=Subject(
            id=person.label,
            mass_kg=mass if isinstance(mass, float) else None,
            height_m=height if isinstance(height, float) else None,
        ),
        provenance=remarks,
    )


def _as_named(trial: _Trial, names: tuple[str, ...]) -> FloatArray:
    """Places of a trial in the order of all markers; NaN for markers that the trial lacks."""
    if trial.names == names:
        return trial.samples.values
    places = np.full((len(trial.samples.values), len(names), 3), np.nan)
    for i, name in enumerate(trial.names):
        places[:, names.index(name)] = trial.samples.values[:, i]
    return places


def _signals(trials: Sequence[_Trial], muscles: tuple[str, ...], rates: set[float]) -> EmgSignals:
    parts = [np.empty((0, len(muscles))) if t.emg is None else t.emg for t in trials]
    offsets = np.concatenate([[0], np.cumsum([len(p) for p in parts])]).astype(np.int64)
    return EmgSignals(rates.pop(), offsets, np.concatenate(parts), muscles, "V")
