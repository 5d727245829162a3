"""Runs of one person: systems on a common clock, cut into trials with their own clocks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Final

import numpy as np
import pandas as pd

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.findings import not_taken
from armimpedance.recordings.bids.dataset import Person, number_or_text
from armimpedance.recordings.bids.systems import System, emg_systems, motion_system, physio_system
from armimpedance.recordings.bids.tsv import OF_THE_SYSTEM, BidsName, headed_rows, is_missing

#: An event of this type is a trial.
TRIAL: Final = "trial"
#: Entity -> name of the fact for mappings.
_FACTS: Final = {
    "sub": "subject",
    "ses": "session",
    "task": "task",
    "acq": "acquisition",
    "run": "run",
}


@dataclass(frozen=True)
class Stretch:
    """A part of a run, from an onset, for a duration; None: from the start, to the end."""

    onset_s: float | None = None
    duration_s: float | None = None
    facts: Mapping[str, float | str] = field(default_factory=dict)


@dataclass(frozen=True)
class Run:
    """Systems that recorded together.

    `name`: such as "ses-1_task-reach_run-2".
    `systems`: tracking systems first.
    `starts_s`: time of each system's first sample; 0 is that of the first tracking system.
    `stretches`: the trials; the whole run if no event is a trial.
    `facts`: facts from file names and the table of participants.
    """

    name: str
    systems: tuple[System, ...]
    starts_s: tuple[float, ...]
    stretches: tuple[Stretch, ...]
    facts: Mapping[str, float | str]
    notes: tuple[str, ...] = ()


def runs_of(person: Person, *, emg: bool = True) -> tuple[Run, ...]:
    """Read all runs within the requested part of a person's recordings.

    `emg`: whether signals other than motion are needed. If not, a broken file of them is named in
    the notes and does not stop the reading.
    Raises InputError: there are no runs, or a file of a run is wrong.
    """
    motion = person.data("motion", (".tsv",))
    signals = person.data("emg", (".edf", ".bdf"))
    if person.within.is_file():
        signals = [f for m in motion for f in _emg_of(person, m)]
    groups: dict[tuple[tuple[str, str], ...], list[BidsName]] = {}
    for file in (*motion, *signals):
        groups.setdefault(_key(file), []).append(file)
    if not groups:
        expected = "files _motion.tsv in a folder motion, or _emg.edf in a folder emg"
        raise InputError("no motion capture and no EMG", file=person.within, expected=expected)
    return tuple(_run(person, groups[key], emg) for key in sorted(groups, key=_in_order))


def _key(file: BidsName) -> tuple[tuple[str, str], ...]:
    return tuple((k, v) for k, v in file.entities.items() if k not in OF_THE_SYSTEM)


def _in_order(key: tuple[tuple[str, str], ...]) -> list[tuple[str, int, str]]:
    return [(k, int(v) if v.isdecimal() else 0, v) for k, v in key]


def _emg_of(person: Person, motion: BidsName) -> list[BidsName]:
    """EMG files of the run of a motion file."""
    candidates = [f for f in person.files if f.suffix == "emg" and f.ending in (".edf", ".bdf")]
    return [f for f in candidates if _key(f) == _key(motion)]


def _run(person: Person, files: Sequence[BidsName], all_needed: bool) -> Run:
    first = files[0]
    motion = [motion_system(f, person) for f in files if f.suffix == "motion"]
    emg = [f for f in files if f.suffix == "emg"]
    others: list[System] = []
    broken: tuple[str, ...] = ()
    for file in (*emg, *_matching_files(person, first, "physio")):
        try:
            added = emg_systems(file, person) if file in emg else [physio_system(file, person)]
            others += added
        except InputError as error:
            if all_needed or not motion:
                raise
            broken += not_taken([file.path.name], f"it cannot be read: {error.problem}")
    systems = (*motion, *others)
    starts, unknown = _starts(person, systems)
    events = _events(person, first)
    stretches, notes = _trials(events)
    notes += broken
    name = "_".join(f"{k}-{v}" for k, v in _key(first) if k != "sub")
    facts = {_FACTS[k]: v for k, v in first.entities.items() if k in _FACTS}
    if unknown:
        notes += (f"Taken to start with the first system, as no acq_time tells: {unknown}.",)
    notes += tuple(dict.fromkeys(note for system in systems for note in system.notes))
    return Run(name, systems, starts, stretches, {**person.facts, **facts}, notes)


def _matching_files(person: Person, data: BidsName, suffix: str) -> list[BidsName]:
    """Files of one kind that belong to the run of this data file."""
    candidates = [f for f in person.files if f.suffix == suffix and f.ending in (".tsv", ".tsv.gz")]
    of_subject = [
        f for f in candidates if "sub" in f.entities and f.describes(data, but=OF_THE_SYSTEM)
    ]
    return [f for f in of_subject if f.entities.get("task") == data.entities.get("task")]


def _starts(person: Person, systems: Sequence[System]) -> tuple[tuple[float, ...], str]:
    """Start of each system, s after the first, and the names of systems without a time."""
    stamps = [_acquired(person, system.file) for system in systems]
    first = stamps[0]
    starts, unknown = [], []
    for system, stamp in zip(systems, stamps, strict=True):
        known = stamp is not None and first is not None
        offset = (stamp - first).total_seconds() if known else 0.0  # type: ignore[operator]
        starts.append(offset + system.start_s)
        if not known and system is not systems[0] and system.sort != "physio":
            unknown.append(system.name)
    return tuple(starts), ", ".join(unknown)


def _acquired(person: Person, data: BidsName) -> datetime | None:
    """Time of the first sample of a file, from the table of scans; None if unknown."""
    for file in person.files:
        if (file.suffix, file.ending) != ("scans", ".tsv") or not file.describes(data):
            continue
        for number, row in enumerate(headed_rows(file.path, ["filename"]), start=2):
            # a damaged name may hold characters that no path can
            listed = row["filename"].isprintable() and file.path.parent / row["filename"]
            same = listed and listed.resolve() == data.path.resolve()
            text = row.get("acq_time", "n/a")
            if same and not is_missing(text):
                return _stamp(text, file, number)
    return None


def _stamp(text: str, file: BidsName, row: int) -> datetime:
    try:
        stamp = datetime.fromisoformat(text)
        return stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC)
    except (ValueError, OverflowError):
        expected = "YYYY-MM-DDThh:mm:ss"
        location = {"file": file.path, "row": row, "column": "acq_time"}
        raise InputError(f"{text!r:.40}", expected=expected, **location) from None  # type: ignore[arg-type]


def _events(person: Person, data: BidsName) -> list[tuple[BidsName, dict[str, str]]]:
    """Events of a run, preferably from a file in the folder of its data."""
    files = [f for f in _matching_files(person, data, "events") if f.ending == ".tsv"]
    near = [f for f in files if f.path.parent == data.path.parent]
    chosen = (near or files)[:1]
    return [(f, row) for f in chosen for row in headed_rows(f.path, ("onset", "duration"))]


def _trials(
    events: Sequence[tuple[BidsName, dict[str, str]]],
) -> tuple[tuple[Stretch, ...], tuple[str, ...]]:
    """Parts of a run that are trials, and notes on the other events."""
    others: dict[str, int] = {}
    stretches = []
    for number, (file, row) in enumerate(events, start=2):
        kind = row.get("trial_type", "n/a")
        if kind != TRIAL:
            others[kind] = others.get(kind, 0) + 1
            continue
        stretches.append(_stretch(row, file, number))
    counts = [f"{count} events {kind}" for kind, count in list(others.items())[:12]]
    notes = not_taken(counts, "only events of trial_type trial are taken, as trials")
    return tuple(stretches) or (Stretch(),), notes


def _stretch(row: Mapping[str, str], file: BidsName, number: int) -> Stretch:
    times = [number_or_text(row[name]) for name in ("onset", "duration")]
    onset, duration = times
    if isinstance(onset, str) or isinstance(duration, str) or duration <= 0:
        problem = f"a trial at {row['onset']!r:.30} for {row['duration']!r:.30}"
        raise InputError(problem, file=file.path, row=number, expected="numbers, s")
    cells = {k: v for k, v in row.items() if k not in ("onset", "duration", "trial_type")}
    facts = {
        k: v if k == "condition" else number_or_text(v)
        for k, v in cells.items()
        if not is_missing(v)
    }
    return Stretch(onset, duration, facts)


def times_of(system: System, start_s: float, rows: int) -> FloatArray:
    """Time of each sample (N,), s after the first system's first sample.

    Raises InputError: a latency is missing, or times do not increase.
    """
    latency = system.of_kind("LATENCY")
    if not latency:
        return start_s + np.arange(rows) / system.rate_hz
    time = system.read(latency[:1])[:, 0]
    wrong = np.flatnonzero(~(np.diff(time, prepend=-np.inf) > 0))
    if len(wrong):
        column = system.channels[latency[0]].name
        expected = "latencies in s that grow"
        row = int(wrong[0]) + 1
        raise InputError(
            f"latency {time[wrong[0]]:g}",
            file=system.file.path,
            row=row,
            column=column,
            expected=expected,
        )
    return start_s + time if start_s else time


def rows_of(stretch: Stretch, time: FloatArray, rate_hz: float) -> slice:
    """Slice of the samples of a system in one part of a run."""
    if stretch.onset_s is None or stretch.duration_s is None:
        return slice(0, len(time))
    half = 0.5 / rate_hz
    ends = [stretch.onset_s - half, stretch.onset_s + stretch.duration_s - half]
    first, last = np.searchsorted(time, ends)
    return slice(int(first), int(last))


# Trials of a run, each on its own clock, and their table.

#: The channel with each trial's own clock, in files that `armimpedance share` writes.
TRIAL_TIME: Final = "trial_time"
#: Largest deviation of a time step, as a share of the step.
_UNEVEN: Final = 0.5


@dataclass(frozen=True)
class Clocked:
    """The samples of one trial.

    `values` (N, ...).
    `facts`: cells of its event.
    `time_s` (N,): the trial's own clock.
    `begin_s`: time of its first sample in the run.
    """

    condition: str
    facts: Mapping[str, float | str]
    rate_hz: float
    time_s: FloatArray
    values: FloatArray
    stretch: Stretch
    begin_s: float


def clock_of(system: System) -> list[int]:
    """Index of the channel with the trials' own clock, in a list; empty if there is none."""
    named = [(channel.name, channel.kind) for channel in system.channels]
    return [i for i, pair in enumerate(named) if pair == (TRIAL_TIME, "MISC")]


def clocked(run: Run, index: int, values: FloatArray, clock: FloatArray | None) -> list[Clocked]:
    """Cut the samples of a run into trials.

    `values` (N, ...): samples.
    `index`: their system.
    `clock` (N,) or None: the trials' own times; None: each begins at 0.
    Raises InputError: a trial has no sample, or its time steps do not fit the rate.
    """
    system = run.systems[index]
    time = times_of(system, run.starts_s[index], len(values))
    trials = []
    for number, stretch in enumerate(run.stretches, start=1):
        rows = rows_of(stretch, time, system.rate_hz)
        if rows.stop - rows.start < 1:
            raise InputError(
                f"trial {number} of {run.name} has no sample",
                file=system.file.path,
                expected="events inside of the record",
            )
        begin = float(time[rows.start])
        trial_time = time[rows] - begin if clock is None else clock[rows]
        _check_steps(trial_time, system)
        condition = str(stretch.facts.get("condition", run.name))
        rate = system.rate_hz
        trials.append(
            Clocked(condition, stretch.facts, rate, trial_time, values[rows], stretch, begin)
        )
    return trials


def _check_steps(time: FloatArray, system: System) -> None:
    """Refuse a trial whose time steps do not fit the rate."""
    steps = np.diff(time) * system.rate_hz
    if np.isfinite(time).all() and not (np.abs(steps - 1.0) > _UNEVEN).any():
        return
    worst = float(np.nanmax(np.abs(steps - 1.0), initial=0.0))
    raise InputError(
        f"time does not run in equal steps (off by {100 * worst:.0f} % of one)",
        file=system.file.path,
        expected=f"{system.rate_hz:g} samples a second",
    )


def trial_table(trials: Sequence[Clocked]) -> pd.DataFrame:
    """Build the trial table: number, condition, and further cells of the trials' events."""
    numbers = [trial.facts.get("trial") for trial in trials]
    integers = [int(n) for n in numbers if isinstance(n, float) and n.is_integer() and abs(n) < 1e9]
    usable = len(integers) == len(trials) and len(set(integers)) == len(integers)
    table = pd.DataFrame(
        {
            "trial": integers if usable else np.arange(1, len(trials) + 1),
            "condition": [trial.condition for trial in trials],
        }
    )
    further = dict.fromkeys(k for trial in trials for k in trial.facts if k not in table)
    for name in further:
        table[name] = _as_column([trial.facts.get(name) for trial in trials])
    return table


def _as_column(values: Sequence[object]) -> FloatArray | list[str]:
    """Column of numbers with NaN for missing values; of texts if one value is a text."""
    if all(v is None or isinstance(v, float) for v in values):
        return np.array([np.nan if v is None else v for v in values], dtype=np.float64)
    return ["" if v is None else str(v) for v in values]
