"""BIDS folders (Motion-BIDS, EMG-BIDS): each recording system is a table with one clock."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.findings import not_taken
from armimpedance.recordings.bids.dataset import is_bids, person_at
from armimpedance.recordings.bids.runs import Run, Stretch, rows_of, runs_of, times_of
from armimpedance.recordings.bids.systems import System
from armimpedance.recordings.mapped.raw_file import (
    RawColumn,
    RawFile,
    RawRun,
    RawTable,
    Source,
    Wanted,
)


def _read(path: Path, wanted: Wanted) -> RawFile:
    runs = runs_of(person_at(path))
    skipped: dict[str, None] = {}
    parts = [part for run in runs for part in _parts(run, wanted, skipped)]
    notes = dict.fromkeys(note for run in runs for note in run.notes)
    reason = "the mapping gives them no meaning"
    return RawFile(tuple(parts), (*notes, *not_taken(list(skipped), reason)))


def _parts(run: Run, wanted: Wanted, skipped: dict[str, None]) -> list[RawRun]:
    """The trials of a run."""
    tables = []
    for system, start, names in zip(run.systems, run.starts_s, _names(run.systems), strict=True):
        chosen = [i for i, name in enumerate(names) if wanted(name)]
        skipped |= dict.fromkeys(name for name in names if not wanted(name))
        if chosen:
            values = system.read(chosen)
            time = times_of(system, start, len(values))
            tables.append((system, [names[i] for i in chosen], chosen, values, time))
    parts = []
    for number, stretch in enumerate(run.stretches, start=1):
        name = run.name if len(run.stretches) == 1 else f"{run.name}, trial {number}"
        cut = [_table(*table, stretch) for table in tables]
        if tables and not any(table.rows for table in cut):
            problem = f"{name}: no sample at its time ({stretch.onset_s} s)"
            file = run.systems[0].file.path
            raise InputError(problem, file=file, expected="events inside of the record")
        parts.append(RawRun(name, tuple(cut), {**run.facts, **_event_facts(run, stretch)}))
    return parts


def _event_facts(run: Run, stretch: Stretch) -> dict[str, float | str]:
    """The facts of a trial's event; ``event/name`` where a channel has the name."""
    channels = {channel.name for system in run.systems for channel in system.channels}
    return {f"event/{k}" if k in channels else k: v for k, v in stretch.facts.items()}


def _table(
    system: System,
    names: list[str],
    chosen: list[int],
    values: FloatArray,
    time: FloatArray,
    stretch: Stretch,
) -> RawTable:
    rows = rows_of(stretch, time, system.rate_hz)
    columns = {
        name: RawColumn(np.ascontiguousarray(values[rows, i]), system.channels[index].unit)
        for i, (name, index) in enumerate(zip(names, chosen, strict=True))
    }
    return RawTable(columns, time_s=time[rows], rate_hz=system.rate_hz, first_row=rows.start + 1)


def _names(systems: tuple[System, ...]) -> list[list[str]]:
    """Unique names over all systems of a run: ``system/channel`` where a name is not unique."""
    count = Counter(channel.name for system in systems for channel in system.channels)
    names = [
        [c.name if count[c.name] == 1 else f"{system.name}/{c.name}" for c in system.channels]
        for system in systems
    ]
    flat = Counter(name for system_names in names for name in system_names)
    twice = [name for name, occurrences in flat.items() if occurrences > 1]
    if twice:
        file = systems[0].file.path.parent
        expected = "different labels (tracksys-, recording-)"
        raise InputError(f"two systems of one name have {twice[0]}", file=file, expected=expected)
    return names


SOURCE = Source(
    name="a folder of BIDS (motion, emg)",
    recognises=is_bids,
    read=_read,
)
