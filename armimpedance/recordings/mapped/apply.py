"""A recording from files of any layout and a mapping of their columns."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from armimpedance.core.arrays import LARGEST, FloatArray, IntArray
from armimpedance.core.conventions import (
    command_columns,
    force_columns,
    perturbation_columns,
    position_columns,
)
from armimpedance.core.errors import InputError
from armimpedance.core.findings import not_taken
from armimpedance.core.records import Recording
from armimpedance.recordings.mapped.clocks import OneClock, on_one_clock
from armimpedance.recordings.mapped.cutting import (
    MappedTrial,
    Piece,
    piece_time,
    pieces_of,
    trial_table,
)
from armimpedance.recordings.mapped.ends import without_padding
from armimpedance.recordings.mapped.even_time import with_even_time
from armimpedance.recordings.mapped.mapping import ColumnMapping, ColumnQuantity, known_unit
from armimpedance.recordings.mapped.raw_file import RawRun, ReadFile, trials_beside
from armimpedance.recordings.tables.folder import recording_of_tables
from armimpedance.recordings.tables.number_table import NumberTable
from armimpedance.recordings.tables.sample_table import (
    EMG_PREFIX,
    Samples,
    arm_angle_columns,
    check_axes,
    check_samples,
    sample_columns,
)
from armimpedance.recordings.tables.trial_table import check_onsets
from armimpedance.recordings.where import parse_where

#: Relative distance from a whole number of Hz within which a rate from times is rounded to it.
WHOLE_RATE: Final = 1e-4
#: Largest relative difference between the rates of runs in one recording.
SAME_RATE: Final = 1e-3


@dataclass(frozen=True)
class _RunTable(NumberTable):
    """Samples of a run's trials, with their rows in the file."""

    rows: tuple[int, ...] | np.ndarray = ()

    def row(self, index: int) -> int:
        return int(self.rows[index])


def mapped_recording(
    files: Sequence[ReadFile],
    mapping: ColumnMapping,
    path: Path,
    *,
    strict: bool = False,
    where: str | None = None,
) -> Recording:
    """Read a recording from files with a mapping.

    `path`: the path that the user stated, for messages.
    `strict`: refuse time stamps that scatter about an even clock.
    `where`: condition for the trials to read; samples of others are not checked.
    Returns: a recording; numbers that are in SI already are not changed by a bit.
    Raises InputError: something does not fit the mapping; the message names file, row and column.
    """
    runs = [run for file in files for run in _runs(file, mapping)]
    if not runs:
        raise InputError("holds no runs", file=path, expected="columns with samples")
    stated = mapping.metadata.sample_rate_hz if mapping.rate_stated else None
    cut, notes = [], []
    for run in runs:
        pieces, left_out = pieces_of(run, mapping.trials, stated or run.rate_hz)
        pieces, padding = without_padding(run, pieces, mapping)
        cut.append((run, pieces))
        notes += [*run.notes, *left_out, *padding]
    rate, rate_notes = _rate(cut, stated)
    numbers = None
    if where is not None:
        cut, numbers, sentence = _chosen(cut, mapping, rate, path, where)
        notes.append(sentence)
    if not strict:
        even_runs = [with_even_time(run, pieces, mapping, rate) for run, pieces in cut]
        cut = [(evened.run, pieces) for evened, (_, pieces) in zip(even_runs, cut, strict=True)]
        notes += [note for evened in even_runs for note in evened.notes]
    metadata = replace(
        mapping.metadata, sample_rate_hz=rate, muscles=mapping.metadata.muscles or None
    )
    recording = _recording(cut, replace(mapping, metadata=metadata), rate, path)
    if numbers is not None:
        recording = replace(recording, trials=recording.trials.assign(trial=numbers))
    sentences = dict.fromkeys(
        [*_sources(files, mapping), *rate_notes, *notes, *_left(files, mapping)]
    )
    return replace(recording, provenance=(*recording.provenance, *sentences))


def _chosen(
    cut: Sequence[tuple[OneClock, Sequence[Piece]]],
    mapping: ColumnMapping,
    rate: float,
    path: Path,
    where: str,
) -> tuple[list[tuple[OneClock, list[Piece]]], IntArray, str]:
    """Select the trials for which a condition holds: pieces, numbers, and a sentence.

    Raises InputError: as `Where.choose`, or for a cell of the trial table.
    """
    trials = [MappedTrial(run, piece) for run, pieces in cut for piece in pieces]
    table = trial_table(trials, mapping, rate, path).trials
    rows, sentence = parse_where(where).choose(table, path)
    selected = iter(rows.tolist())
    kept = [(run, [piece for piece in pieces if next(selected)]) for run, pieces in cut]
    numbers = table["trial"].to_numpy()[rows]
    return [(run, pieces) for run, pieces in kept if pieces], numbers, sentence


def _recording(
    cut: Sequence[tuple[OneClock, Sequence[Piece]]],
    mapping: ColumnMapping,
    rate: float,
    path: Path,
) -> Recording:
    """Build the recording of the trials, with the checks of a recording's folder."""
    parts = [_samples(run, pieces, mapping, rate) for run, pieces in cut]
    for part in parts:
        check_axes(part, mapping.metadata, mapping.file)
        check_samples(part, mapping.metadata)
    trials = [MappedTrial(run, piece) for run, pieces in cut for piece in pieces]
    table = trial_table(trials, mapping, rate, path)
    samples = _together(parts, path, table.trials["trial"].to_numpy())
    time = samples.table.columns["time_s"]
    starts, ends = samples.offsets[:-1], samples.offsets[1:]
    check_onsets(table, time[starts], time[ends - 1], 1.0 / rate)
    order = np.arange(len(trials), dtype=np.int64)
    return recording_of_tables(mapping.metadata, table, samples, order)


def _runs(file: ReadFile, mapping: ColumnMapping) -> Iterable[OneClock]:
    for run in file.raw.runs:
        parts: Iterable[RawRun] = (run,)
        if mapping.trials.by == "columns":
            beside = trials_beside(run, mapping, file.path)
            parts = (
                replace(trial.run, facts={**trial.run.facts, "*": trial.key}) for trial in beside
            )
        for part in parts:
            on_clock = on_one_clock(part, mapping, file.path)
            _check_units(on_clock, mapping)
            yield on_clock


def _check_units(run: OneClock, mapping: ColumnMapping) -> None:
    """Refuse a unit in the mapping that contradicts the file's."""
    quantities = list(mapping.quantities.values())
    quantities += [mapping.time] if mapping.time is not None else []
    for quantity in quantities:
        for name in quantity.columns:
            stated = known_unit(run.units.get(name, ""))
            if stated is None or quantity.unit.dimension == "any" or stated == quantity.unit:
                continue
            raise run.error(
                f"the file says {run.units[name]}, the mapping {quantity.unit.symbol}",
                "the same; or `scale` in place of `unit`, where the file is wrong",
                name,
            )


def _rate(
    cut: Sequence[tuple[OneClock, Sequence[Piece]]], stated: float | None
) -> tuple[float, tuple[str, ...]]:
    """Sample rate as stated, else from the file, else from the times; and a note on it."""
    if stated is not None:
        return stated, ()
    run = cut[0][0]
    by_file = {clocked_run.rate_hz for clocked_run, _ in cut}
    if run.rate_hz is not None and by_file == {run.rate_hz}:
        return run.rate_hz, (f"The file states {run.rate_hz:g} Hz.",)
    rates = [(clocked_run, _rate_of(clocked_run, pieces)) for clocked_run, pieces in cut]
    rate = float(np.median([r for _, r in rates]))
    for clocked_run, run_rate in rates:
        if abs(run_rate / rate - 1.0) > SAME_RATE:
            expected = "one rate in all of them; or sample_rate_hz in the mapping"
            raise clocked_run.error(
                f"{run_rate:.6g} Hz where other runs have {rate:.6g} Hz", expected
            )
    integer = round(rate)
    rate = float(integer) if integer and abs(rate / integer - 1.0) < WHOLE_RATE else rate
    return rate, (f"Sample rate from the times: {rate:.9g} Hz.",)


def _rate_of(run: OneClock, pieces: Sequence[Piece]) -> float:
    if run.time_s is None:
        expected = "a column with the time, or sample_rate_hz in the mapping"
        raise run.error("no time and no rate", expected)
    for piece in pieces:
        lost = np.flatnonzero(~(np.abs(run.time_s[piece.start : piece.stop]) < LARGEST))
        if len(lost):
            row = piece.start + int(lost[0])
            raise run.error("time is missing", "a time for each sample", None, row)
    steps = [np.diff(run.time_s[p.start : p.stop]) for p in pieces]
    all_steps = np.concatenate(steps) if steps else np.empty(0)
    if not len(all_steps) or not (usual := float(np.median(all_steps))) > 0:
        raise run.error("time does not run forward", "at least two samples a trial, in time")
    # the mean of all steps except gaps: times are printed with few decimals, or scatter
    usual_steps = all_steps[(all_steps > 0.0) & (all_steps < 2.0 * usual)]
    return 1.0 / float(usual_steps.mean())


def _samples(
    run: OneClock, pieces: Sequence[Piece], mapping: ColumnMapping, rate: float
) -> Samples:
    """Sample table of a run, in SI, with the column names of a recording."""
    rows = np.concatenate([np.arange(p.start, p.stop) for p in pieces])
    lengths = [p.stop - p.start for p in pieces]
    whole = len(rows) == run.rows and np.array_equal(rows, np.arange(run.rows))
    selection = slice(None) if whole else rows
    columns = {
        "trial": np.repeat(np.arange(len(pieces), dtype=np.float64), lengths),
        "time_s": _finite(
            run, np.concatenate([piece_time(run, p, rate) for p in pieces]), rows, "the time"
        ),
    }
    for name, (source, quantity, axis) in _named(mapping).items():
        values = _finite(run, run.numbers(source)[selection], rows, source)
        if quantity is not None:
            values = quantity.unit.to_si(values)
            values = -values if quantity.signs[axis] < 0 else values
        columns[name] = values
    kind = mapping.metadata.kind
    recognised = sample_columns(tuple(columns), kind, mapping.metadata.muscles or None)
    optional = {
        *command_columns(kind, len(recognised.position)),
        *perturbation_columns(len(recognised.position)),
    }
    named = {"trial", "time_s", *_named(mapping)} - set(mapping.keep) - optional
    if clash := sorted(set(recognised.named) ^ named):
        expected = "the name of one that means nothing else; it cannot be kept under this one"
        raise InputError(
            "a column to be kept", file=mapping.file, column=clash[0], expected=expected
        )
    offsets = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
    table = _RunTable(run.file, columns, (), rows + run.first_row)
    return Samples(table, recognised, np.arange(len(pieces), dtype=np.int64), offsets)


def _named(mapping: ColumnMapping) -> dict[str, tuple[str, ColumnQuantity | None, int]]:
    """Map of the recording's columns to the file's column, its quantity and its axis."""
    kind, axes = mapping.metadata.kind, len(mapping.position.columns)
    if len(mapping.force.columns) != axes:
        problem = f"{len(mapping.force.columns)} columns of force beside {axes} of position"
        raise InputError(problem, file=mapping.file, column="force.columns", expected="as many")
    limit = (2, 3) if kind == "hand" else (1, 50)
    if not limit[0] <= axes <= limit[1]:
        expected = "x and y, or x, y and z" if kind == "hand" else "1 to 50 joints"
        raise InputError(
            f"{axes} columns", file=mapping.file, column="position.columns", expected=expected
        )
    sources: dict[str, tuple[str, ColumnQuantity | None, int]] = {}
    for quantity, names in _own_names(mapping, axes):
        if len(names) != len(quantity.columns):
            problem = f"{len(quantity.columns)} columns for {', '.join(names)}"
            raise InputError(problem, file=mapping.file, expected=f"{len(names)} columns")
        pairs = zip(names, quantity.columns, strict=True)
        sources |= {name: (c, quantity, i) for i, (name, c) in enumerate(pairs)}
    return sources | {name: (name, None, 0) for name in mapping.keep if name not in sources}


def _own_names(mapping: ColumnMapping, axes: int) -> list[tuple[ColumnQuantity, tuple[str, ...]]]:
    """Quantities of the mapping, each with the names of its columns in a recording."""
    kind = mapping.metadata.kind
    names = [
        (mapping.position, position_columns(kind, axes)),
        (mapping.force, force_columns(kind, axes)),
    ]
    if (angles := mapping.joint_angles) is not None:
        names.append((angles, arm_angle_columns(kind, len(angles.columns))))
    if mapping.emg is not None:
        muscles = mapping.metadata.muscles or ()
        names.append((mapping.emg, tuple(EMG_PREFIX + m for m in muscles)))
    if mapping.commanded is not None:
        names.append((mapping.commanded, command_columns(kind, axes)))
    if mapping.added_torque is not None:
        names.append((mapping.added_torque, perturbation_columns(axes)))
    return names


def _finite(run: OneClock, values: FloatArray, rows: np.ndarray, column: str) -> FloatArray:
    """Return the values; refuse a missing value."""
    with np.errstate(over="ignore", invalid="ignore"):
        fine = np.isfinite(values.sum()) or np.isfinite(values).all()
    if not fine:
        at = int(np.flatnonzero(~np.isfinite(values))[0])
        problem = "missing value" if np.isnan(values[at]) else f"not finite: {values[at]}"
        raise run.error(problem, "a number in every sample of a trial", column, int(rows[at]))
    return values


def _together(parts: Sequence[Samples], path: Path, numbers: np.ndarray) -> Samples:
    """Join the samples of all runs, with trials numbered as in the trial table."""
    names = parts[0].table.columns
    lengths = np.concatenate([np.diff(part.offsets) for part in parts])
    columns = {
        name: np.concatenate([part.table.columns[name] for part in parts])
        if len(parts) > 1
        else parts[0].table.columns[name]
        for name in names
        if name != "trial"
    }
    columns = {"trial": np.repeat(numbers.astype(np.float64), lengths), **columns}
    offsets = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
    return Samples(NumberTable(path, columns), parts[0].columns, numbers, offsets)


def _sources(files: Sequence[ReadFile], mapping: ColumnMapping) -> list[str]:
    names = [file.path.name for file in files]
    files_shown = names[0] if len(names) == 1 else f"{len(names)} files, {names[0]} to {names[-1]}"
    changed = [
        f"{name.replace('_', ' ')}: from {quantity.unit.symbol}"
        for name, quantity in mapping.quantities.items()
        if not quantity.unit.is_si
    ]
    reversed_names = [
        c
        for q in mapping.quantities.values()
        for c, s in zip(q.columns, q.signs, strict=True)
        if s < 0
    ]
    sentences = [f"Read from {files_shown} by the mapping {mapping.file.name}."]
    sentences += [f"Brought to SI: {', '.join(changed)}."] if changed else []
    return sentences + ([f"Sign turned: {', '.join(reversed_names)}."] if reversed_names else [])


def _left(files: Sequence[ReadFile], mapping: ColumnMapping) -> list[str]:
    """Sentences on the contents of the files that the mapping does not name."""
    unnamed: dict[str, None] = {}
    for file in files:
        for run in file.raw.runs:
            names = [n for table in run.tables for n in table.columns] + list(run.facts)
            unnamed |= dict.fromkeys(n for n in names if not mapping.wants(n))
    sentences = [sentence for file in files for sentence in file.raw.not_taken]
    return [*not_taken(tuple(unnamed), "the mapping gives them no meaning"), *sentences]
