"""Cut a run into trials, and build their trial table."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.arrays import BoolArray, FloatArray, IntArray
from armimpedance.recordings.mapped.clocks import OneClock
from armimpedance.recordings.mapped.columns_toml import UNITS_OF_ENDINGS
from armimpedance.recordings.mapped.mapping import ColumnMapping, TrialCut, TrialValue
from armimpedance.recordings.mapped.raw_file import names_in
from armimpedance.recordings.tables.trial_table import TrialTable, trials_of_cells

#: Default of the gap that begins a trial, in usual steps.
USUAL_GAP: Final = 10.0


@dataclass(frozen=True)
class Piece:
    """One trial of a run.

    `start`, `stop`: its samples.
    `name`: its number or name in the file.
    `onset`, `end`: the last sample before the disturbance and the first after it, if a column
    marks them.
    """

    start: int
    stop: int
    name: float | str | None = None
    onset: int | None = None
    end: int | None = None


def pieces_of(run: OneClock, cut: TrialCut, rate_hz: float | None) -> tuple[list[Piece], list[str]]:
    """Cut a run into trials; return them and sentences on what was left out.

    Raises InputError: a column is missing or holds a wrong value, or there is no trial.
    """
    left_out: list[str] = []
    if cut.by == "column":
        pieces, left_out = _by_column(run, cut)
    elif cut.by == "gap":
        pieces = _by_gap(run, cut)
    elif cut.by == "edge":
        pieces, left_out = _by_edge(run, cut, rate_hz)
    else:
        pieces = [Piece(0, run.rows)] if run.rows else []
    if not pieces:
        raise run.error("holds no trial", "samples of at least one", cut.column)
    if cut.disturbance is not None:
        pieces = [_with_disturbance(run, piece, cut) for piece in pieces]
    return pieces, left_out


def _by_column(run: OneClock, cut: TrialCut) -> tuple[list[Piece], list[str]]:
    values = _marks(run, str(cut.column))
    blank = _blank(run, values)
    outside = np.isin(values, _as(values, cut.between)) | _missing(values) | blank
    changes = np.flatnonzero((values[1:] != values[:-1]) | (outside[1:] != outside[:-1])) + 1
    edges = [0, *changes.tolist(), run.rows] if run.rows else []
    pieces, seen = [], set()
    for start, stop in zip(edges[:-1], edges[1:], strict=True):
        if outside[start]:
            continue
        name = values[start].item()
        if name in seen:
            expected = "each trial in one piece, or what stands between trials as `between`"
            problem = f"trial {_plain(name)} goes on after others"
            raise run.error(problem, expected, cut.column, start)
        seen.add(name)
        pieces.append(Piece(start, stop, name))
    note = f"Padding: {blank.sum()} rows of zeros in all columns left out."
    return pieces, [note] if blank.any() else []


def _by_gap(run: OneClock, cut: TrialCut) -> list[Piece]:
    if run.time_s is None:
        raise run.error("trials by gap without a time", "a column with the time")
    with np.errstate(invalid="ignore", over="ignore"):
        step = np.diff(run.time_s)
    forward = step[step > 0]
    usual = float(np.median(forward)) if len(forward) else 0.0
    longest = USUAL_GAP * usual if cut.gap_s is None else cut.gap_s
    # a missing time belongs to no step; the check of missing values reports it
    starts = np.flatnonzero((step < 0) | (step > longest)) + 1
    edges = [0, *starts.tolist(), run.rows] if run.rows else []
    return [Piece(a, b) for a, b in zip(edges[:-1], edges[1:], strict=True)]


def _by_edge(run: OneClock, cut: TrialCut, rate_hz: float | None) -> tuple[list[Piece], list[str]]:
    onsets = _rises(run, str(cut.column), cut.threshold)
    if run.time_s is None and rate_hz is None:
        raise run.error(
            "trials by edge without a time", "a column with the time, or sample_rate_hz"
        )
    time = np.arange(run.rows) / rate_hz if run.time_s is None else run.time_s  # type: ignore[operator]
    pieces: list[Piece] = []
    cut_off = []
    for number, onset in enumerate(onsets.tolist(), start=1):
        inside = (time >= time[onset] - cut.before_s * (1 + 1e-9) - 1e-9) & (
            time <= time[onset] + cut.after_s * (1 + 1e-9) + 1e-9
        )
        rows = np.flatnonzero(inside)
        if (
            time[onset] - cut.before_s < time[0] - 1e-9
            or time[onset] + cut.after_s > time[-1] + 1e-9
        ):
            cut_off.append(str(number))
            continue
        piece = Piece(int(rows[0]), int(rows[-1]) + 1, float(number), onset)
        if pieces and piece.start < pieces[-1].stop:
            expected = "shorter before_s and after_s: trials must not overlap"
            raise run.error("edges too close to one another", expected, cut.column, onset)
        pieces.append(piece)
    which = f"Trial{'s' * (len(cut_off) > 1)} {', '.join(cut_off)}"
    note = f"{which} of {run.name} reach beyond the record and were left out."
    return pieces, [note] if cut_off else []


def _with_disturbance(run: OneClock, piece: Piece, cut: TrialCut) -> Piece:
    column, threshold = str(cut.disturbance), cut.disturbance_threshold
    over = run.numbers(column)[piece.start : piece.stop] > threshold
    rises = np.flatnonzero(over[1:] & ~over[:-1])
    if over[:1].any() or len(rises) != 1:
        count = "begins within it" if over[:1].any() else f"rises {len(rises)} times"
        problem = f"the disturbance of the trial {count}"
        raise run.error(problem, "one onset a trial", column, piece.start)
    onset = int(rises[0])
    falls = np.flatnonzero(~over[onset + 1 :])
    end = piece.start + onset + 1 + int(falls[0]) if len(falls) else None
    return replace(piece, onset=piece.start + onset, end=end)


def _rises(run: OneClock, column: str, threshold: float) -> IntArray:
    """Samples just before a column rises through a threshold."""
    over = run.numbers(column) > threshold
    return np.flatnonzero(over[1:] & ~over[:-1])


def _marks(run: OneClock, column: str) -> NDArray[Any]:
    """Return a column of trial numbers or names."""
    if column in run.columns:
        return run.columns[column]
    raise run.error(
        "no such column on the position's clock", ", ".join(list(run.columns)[:12]), column
    )


def _missing(values: NDArray[Any]) -> BoolArray:
    if values.dtype.kind == "U":
        return np.char.strip(values) == ""
    return np.isnan(values)


def _blank(run: OneClock, marks: NDArray[Any]) -> BoolArray:
    """True for rows of zeros in all columns, trial number included, as padding by some programs."""
    rows = np.flatnonzero(marks == 0.0) if marks.dtype.kind == "f" else np.empty(0, dtype=np.int64)
    numbers = [v[rows] for v in run.columns.values() if v.dtype.kind == "f"]
    blank = np.zeros(len(marks), dtype=bool)
    blank[rows] = np.logical_and.reduce([(v == 0.0) | np.isnan(v) for v in numbers] or [[]])
    return blank


def _as(values: NDArray[Any], between: tuple[float | str, ...]) -> NDArray[Any]:
    """Convert the values that mark rows between trials to the type of the column."""
    if values.dtype.kind == "U":
        return np.array([_plain(v) for v in between], dtype=np.str_)
    numbers = [float(v) for v in between if not isinstance(v, str)]
    return np.array(numbers, dtype=np.float64)


def _plain(value: object) -> str:
    is_integer = isinstance(value, float) and value.is_integer()
    return str(int(value)) if is_integer and isinstance(value, float) else str(value)


def piece_time(run: OneClock, piece: Piece, rate_hz: float | None) -> FloatArray:
    """Time of a trial's samples, s: from the file, or from 0 in steps of the rate."""
    if run.time_s is not None:
        return run.time_s[piece.start : piece.stop]
    if rate_hz is None:
        expected = "a column with the time, or sample_rate_hz in the mapping"
        raise run.error("no time and no rate", expected)
    return np.arange(piece.stop - piece.start) / rate_hz


# The trial table of a mapped recording: from columns, facts, file names, or one value for all.

#: Condition if neither file nor mapping states one.
NO_CONDITION: Final = "all"
#: Column for the file's own trial numbers if they cannot be used: not numbers, or not unique.
NAME_IN_FILE: Final = "trial_in_file"


@dataclass(frozen=True)
class MappedTrial:
    """A trial and its run."""

    run: OneClock
    piece: Piece


def trial_table(
    trials: Sequence[MappedTrial], mapping: ColumnMapping, rate_hz: float, path: Path
) -> TrialTable:
    """Build the trial table, with the checks of `trials.csv`.

    Raises InputError: a value is missing, changes within a trial, or does not fit its column.
    """
    cells = [_cells(trial, trials, mapping, rate_hz) for trial in trials]
    _number(cells, trials)
    for row in cells:
        row.setdefault("condition", NO_CONDITION)
    first = ["trial", "condition"]
    names = first + [n for n in dict.fromkeys(n for c in cells for n in c) if n not in first]
    lines = tuple(trial.run.first_row + trial.piece.start for trial in trials)
    rows = [[row.get(name, "") for name in names] for row in cells]
    return trials_of_cells(path, names, lines, rows)


def _cells(
    trial: MappedTrial, trials: Sequence[MappedTrial], mapping: ColumnMapping, rate_hz: float
) -> dict[str, str]:
    """Cells of a trial's row, from the mapping."""
    cells = _of_name(trial.run, mapping.trials.pattern)
    time = piece_time(trial.run, trial.piece, rate_hz)
    for name, sample in (("onset_s", trial.piece.onset), ("end_s", trial.piece.end)):
        if sample is not None:
            cells[name] = repr(float(time[sample - trial.piece.start]))
    for name, value in mapping.values.items():
        cells[name] = _cell(name, _value(trial, trials, value), value, time, trial)
    return cells


def _of_name(run: OneClock, pattern: str | None) -> dict[str, str]:
    """Cells from the name of the file; empty without a pattern."""
    if pattern is None:
        return {}
    cells = names_in(pattern, run.file)
    if cells is None:
        raise run.error(f"a name that is not like {pattern}", "one that is, or another pattern")
    return cells


def _value(trial: MappedTrial, trials: Sequence[MappedTrial], value: TrialValue) -> float | str:
    """Return the value of a trial, as in the file."""
    run, piece, column = trial.run, trial.piece, value.column
    if column is None:
        return "" if value.value is None else value.value
    if column in run.columns:
        return _constant(run, run.columns[column], piece, column)
    if column in run.facts:
        return run.facts[column]
    if column in run.once:
        siblings = [other_trial for other_trial in trials if other_trial.run is run]
        each_trial = run.once[column]
        position = next(i for i, other_trial in enumerate(siblings) if other_trial.piece is piece)
        if len(each_trial) == len(siblings):
            return _plain_value(each_trial[position])
        problem = f"{len(each_trial)} values for {len(siblings)} trials"
        raise run.error(problem, "one a sample, or one a trial", column)
    available = [*run.columns, *run.facts, *run.once]
    raise run.error("no such column", f"one of {', '.join(available[:12])}", column)


def _constant(run: OneClock, values: NDArray[Any], piece: Piece, column: str) -> float | str:
    inside = values[piece.start : piece.stop]
    changes = inside != inside[0]
    if inside.dtype.kind == "f":
        changes &= ~(np.isnan(inside) & np.isnan(inside[0]))
    if changes.any():
        row = piece.start + int(np.argmax(changes))
        problem = (
            f"changes within a trial, from {_plain_value(inside[0])} to {_plain_value(values[row])}"
        )
        raise run.error(problem, "one value a trial", column, row)
    return _plain_value(inside[0])


def _plain_value(value: Any) -> float | str:
    return str(value) if isinstance(value, str) else float(value)


def _time_of_sample(
    number: float, value: TrialValue, time: NDArray[Any], trial: MappedTrial
) -> float:
    if not (number.is_integer() and 1 <= number <= len(time)):
        expected = f"the number of a sample, 1 to {len(time)}"
        raise trial.run.error(f"sample {number:g}", expected, value.column)
    return float(time[int(number) - 1])


def _cell(
    name: str, raw: float | str, value: TrialValue, time: NDArray[Any], trial: MappedTrial
) -> str:
    """Text of a cell, in the unit that the name of its column implies."""
    if isinstance(raw, str) and value.unit is None and not value.is_sample:
        return raw
    try:
        number = float(raw)
    except ValueError:
        problem = f"not a number: {str(raw)[:40]!r}"
        raise trial.run.error(problem, "a number", value.column) from None
    if np.isnan(number):
        return ""
    if value.is_sample:
        return repr(_time_of_sample(number, value, time, trial))
    column_unit = next((unit for end, unit in UNITS_OF_ENDINGS.items() if name.endswith(end)), None)
    if value.unit is not None and column_unit is not None and value.unit != column_unit:
        number = (
            float(value.unit.to_si(np.array([number]))[0])
            * column_unit.divide
            / column_unit.multiply
        )
    if column_unit is None and number.is_integer() and abs(number) < 2.0**53:
        return str(int(number))
    return repr(number)


def _number(cells: list[dict[str, str]], trials: Sequence[MappedTrial]) -> None:
    """Number the trials: by the file's own numbers if they are integers and unique."""
    for row, trial in zip(cells, trials, strict=True):
        file_number = trial.run.facts.get("*", trial.piece.name)
        if file_number is not None and "trial" not in row:
            text = _cell("trial", file_number, TrialValue(), np.empty(0), trial)
            row["trial"] = text
    numbers = [row.get("trial") for row in cells]
    are_integers = all(n is not None and re.fullmatch(r"[+-]?\d{1,15}", n) for n in numbers)
    if are_integers and len({int(n) for n in numbers if n is not None}) == len(numbers):
        return
    for number, row in enumerate(cells, start=1):
        file_number = row.get("trial")
        row["trial"] = str(number)
        if file_number is not None:
            row.setdefault(NAME_IN_FILE, file_number)
