"""A recording from files of any layout and the mapping that says what is in them."""

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

#: A rate from times that is this close to a whole number of Hz is that number.
WHOLE_RATE: Final = 1e-4
#: Rates of runs that differ by more than this are not those of one recording.
SAME_RATE: Final = 1e-3


@dataclass(frozen=True)
class _RunTable(NumberTable):
    """Samples of a run's trials, which knows where each stands in the file."""

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
    """The recording in these files.

    `path`: what the user named, for messages.
    `strict`: refuse stamps that scatter about an even clock.
    `where`: trials for which this holds only; of the others no sample is looked at.
    Returns: doubles that are in SI already stay as they are, to the bit.
    Raises InputError: what in which file, row and column does not fit the mapping.
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
    rate, told = _rate(cut, stated)
    numbers = None
    if where is not None:
        cut, numbers, sentence = _chosen(cut, mapping, rate, path, where)
        notes.append(sentence)
    if not strict:
        even = [with_even_time(run, pieces, mapping, rate) for run, pieces in cut]
        cut = [(one.run, pieces) for one, (_, pieces) in zip(even, cut, strict=True)]
        notes += [note for one in even for note in one.notes]
    metadata = replace(
        mapping.metadata, sample_rate_hz=rate, muscles=mapping.metadata.muscles or None
    )
    recording = _recording(cut, replace(mapping, metadata=metadata), rate, path)
    if numbers is not None:
        recording = replace(recording, trials=recording.trials.assign(trial=numbers))
    said = dict.fromkeys([*_sources(files, mapping), *told, *notes, *_left(files, mapping)])
    return replace(recording, provenance=(*recording.provenance, *said))


def _chosen(
    cut: Sequence[tuple[OneClock, Sequence[Piece]]],
    mapping: ColumnMapping,
    rate: float,
    path: Path,
    where: str,
) -> tuple[list[tuple[OneClock, list[Piece]]], IntArray, str]:
    """The pieces of the trials for which something holds, their numbers, and a sentence on them.

    Raises InputError: as `Where.choose`, or of a cell of the trial table.
    """
    trials = [MappedTrial(run, piece) for run, pieces in cut for piece in pieces]
    table = trial_table(trials, mapping, rate, path).trials
    rows, sentence = parse_where(where).choose(table, path)
    left = iter(rows.tolist())
    kept = [(run, [piece for piece in pieces if next(left)]) for run, pieces in cut]
    numbers = table["trial"].to_numpy()[rows]
    return [(run, pieces) for run, pieces in kept if pieces], numbers, sentence


def _recording(
    cut: Sequence[tuple[OneClock, Sequence[Piece]]],
    mapping: ColumnMapping,
    rate: float,
    path: Path,
) -> Recording:
    """The recording of trials, with the checks of a recording's folder."""
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
            parts = (replace(each.run, facts={**each.run.facts, "*": each.key}) for each in beside)
        for part in parts:
            on_clock = on_one_clock(part, mapping, file.path)
            _check_units(on_clock, mapping)
            yield on_clock


def _check_units(run: OneClock, mapping: ColumnMapping) -> None:
    """Refuse a unit of the mapping that contradicts the file's."""
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
    """The sample rate: as stated, as the file says, or from the times."""
    if stated is not None:
        return stated, ()
    run = cut[0][0]
    by_file = {each.rate_hz for each, _ in cut}
    if run.rate_hz is not None and by_file == {run.rate_hz}:
        return run.rate_hz, (f"The file states {run.rate_hz:g} Hz.",)
    rates = [(each, _rate_of(each, pieces)) for each, pieces in cut]
    rate = float(np.median([r for _, r in rates]))
    for each, own in rates:
        if abs(own / rate - 1.0) > SAME_RATE:
            expected = "one rate in all of them; or sample_rate_hz in the mapping"
            raise each.error(f"{own:.6g} Hz where other runs have {rate:.6g} Hz", expected)
    whole = round(rate)
    rate = float(whole) if whole and abs(rate / whole - 1.0) < WHOLE_RATE else rate
    return rate, (f"Sample rate from the times: {rate:.9g} Hz.",)


def _rate_of(run: OneClock, pieces: Sequence[Piece]) -> float:
    if run.time_s is None:
        expected = "a column with the time, or sample_rate_hz in the mapping"
        raise run.error("no time and no rate", expected)
    for piece in pieces:
        lost = np.flatnonzero(~(np.abs(run.time_s[piece.start : piece.stop]) < LARGEST))
        if len(lost):
            at = piece.start + int(lost[0])
            raise run.error("time is missing", "a time for each sample", None, at)
    steps = [np.diff(run.time_s[p.start : p.stop]) for p in pieces]
    every = np.concatenate(steps) if steps else np.empty(0)
    if not len(every) or not (usual := float(np.median(every))) > 0:
        raise run.error("time does not run forward", "at least two samples a trial, in time")
    # The mean of all steps that are no gaps: times are printed with few decimals, or scatter.
    usual_steps = every[(every > 0.0) & (every < 2.0 * usual)]
    return 1.0 / float(usual_steps.mean())


def _samples(
    run: OneClock, pieces: Sequence[Piece], mapping: ColumnMapping, rate: float
) -> Samples:
    """The sample table of a run, in SI, with the names of a recording's columns."""
    rows = np.concatenate([np.arange(p.start, p.stop) for p in pieces])
    lengths = [p.stop - p.start for p in pieces]
    whole = len(rows) == run.rows and np.array_equal(rows, np.arange(run.rows))
    where = slice(None) if whole else rows
    columns = {
        "trial": np.repeat(np.arange(len(pieces), dtype=np.float64), lengths),
        "time_s": _finite(
            run, np.concatenate([piece_time(run, p, rate) for p in pieces]), rows, "the time"
        ),
    }
    for name, (source, quantity, axis) in _named(mapping).items():
        values = _finite(run, run.numbers(source)[where], rows, source)
        if quantity is not None:
            values = quantity.unit.to_si(values)
            values = -values if quantity.signs[axis] < 0 else values
        columns[name] = values
    kind = mapping.metadata.kind
    meant = sample_columns(tuple(columns), kind, mapping.metadata.muscles or None)
    told = {*command_columns(kind, len(meant.position)), *perturbation_columns(len(meant.position))}
    named = {"trial", "time_s", *_named(mapping)} - set(mapping.keep) - told
    if clash := sorted(set(meant.named) ^ named):
        expected = "the name of one that means nothing else; it cannot be kept under this one"
        raise InputError(
            "a column to be kept", file=mapping.file, column=clash[0], expected=expected
        )
    offsets = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
    table = _RunTable(run.file, columns, (), rows + run.first_row)
    return Samples(table, meant, np.arange(len(pieces), dtype=np.int64), offsets)


def _named(mapping: ColumnMapping) -> dict[str, tuple[str, ColumnQuantity | None, int]]:
    """The recording's column -> the file's, with its quantity and which of its axes it is."""
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
    found: dict[str, tuple[str, ColumnQuantity | None, int]] = {}
    for quantity, own in _own_names(mapping, axes):
        if len(own) != len(quantity.columns):
            problem = f"{len(quantity.columns)} columns for {', '.join(own)}"
            raise InputError(problem, file=mapping.file, expected=f"{len(own)} columns")
        pairs = zip(own, quantity.columns, strict=True)
        found |= {name: (c, quantity, i) for i, (name, c) in enumerate(pairs)}
    return found | {name: (name, None, 0) for name in mapping.keep if name not in found}


def _own_names(mapping: ColumnMapping, axes: int) -> list[tuple[ColumnQuantity, tuple[str, ...]]]:
    """Each quantity of the mapping with the names that its columns have in a recording."""
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
    """The values, refused where one is missing."""
    with np.errstate(over="ignore", invalid="ignore"):
        fine = np.isfinite(values.sum()) or np.isfinite(values).all()
    if not fine:
        at = int(np.flatnonzero(~np.isfinite(values))[0])
        problem = "missing value" if np.isnan(values[at]) else f"not finite: {values[at]}"
        raise run.error(problem, "a number in every sample of a trial", column, int(rows[at]))
    return values


def _together(parts: Sequence[Samples], path: Path, numbers: np.ndarray) -> Samples:
    """The samples of all runs, their trials numbered as in the trial table."""
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
    what = names[0] if len(names) == 1 else f"{len(names)} files, {names[0]} to {names[-1]}"
    changed = [
        f"{name.replace('_', ' ')}: from {quantity.unit.symbol}"
        for name, quantity in mapping.quantities.items()
        if not quantity.unit.is_si
    ]
    turned = [
        c
        for q in mapping.quantities.values()
        for c, s in zip(q.columns, q.signs, strict=True)
        if s < 0
    ]
    said = [f"Read from {what} by the mapping {mapping.file.name}."]
    said += [f"Brought to SI: {', '.join(changed)}."] if changed else []
    return said + ([f"Sign turned: {', '.join(turned)}."] if turned else [])


def _left(files: Sequence[ReadFile], mapping: ColumnMapping) -> list[str]:
    """What the files hold and the mapping does not name."""
    left: dict[str, None] = {}
    for file in files:
        for run in file.raw.runs:
            there = [n for table in run.tables for n in table.columns] + list(run.facts)
            left |= dict.fromkeys(n for n in there if not mapping.wants(n))
    told = [sentence for file in files for sentence in file.raw.not_taken]
    return [*not_taken(tuple(left), "the mapping gives them no meaning"), *told]
