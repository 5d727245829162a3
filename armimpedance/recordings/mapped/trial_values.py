"""The trial table of a mapped recording: from columns, facts, names of files, or one for all."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from armimpedance.recordings.mapped.clocks import OneClock
from armimpedance.recordings.mapped.columns_toml import UNITS_OF_ENDINGS
from armimpedance.recordings.mapped.cutting import Piece, piece_time
from armimpedance.recordings.mapped.mapping import ColumnMapping, TrialValue
from armimpedance.recordings.tables.trial_table import TrialTable, trials_of_cells

#: The condition where neither file nor mapping tells one.
NO_CONDITION: Final = "all"
#: The file's own numbers of trials, where they cannot stay: they are no numbers, or stand twice.
NAME_IN_FILE: Final = "trial_in_file"


@dataclass(frozen=True)
class MappedTrial:
    """A trial and the run that it is part of."""

    run: OneClock
    piece: Piece


def trial_table(
    trials: Sequence[MappedTrial], mapping: ColumnMapping, rate_hz: float, path: Path
) -> TrialTable:
    """The trial table, with the checks of `trials.csv`.

    Raises
    ------
    InputError
        A value is missing, changes within a trial, or is not what its column holds.
    """
    cells = [_cells(trial, trials, mapping, rate_hz) for trial in trials]
    _number(cells, trials)
    for given in cells:
        given.setdefault("condition", NO_CONDITION)
    first = ["trial", "condition"]
    names = first + [n for n in dict.fromkeys(n for c in cells for n in c) if n not in first]
    lines = tuple(trial.run.first_row + trial.piece.start for trial in trials)
    rows = [[given.get(name, "") for name in names] for given in cells]
    return trials_of_cells(path, names, lines, rows)


def _cells(
    trial: MappedTrial, trials: Sequence[MappedTrial], mapping: ColumnMapping, rate_hz: float
) -> dict[str, str]:
    """What the mapping says of a trial, as the cells of a table."""
    found = _of_name(trial.run, mapping.trials.pattern)
    time = piece_time(trial.run, trial.piece, rate_hz)
    for name, sample in (("onset_s", trial.piece.onset), ("end_s", trial.piece.end)):
        if sample is not None:
            found[name] = repr(float(time[sample - trial.piece.start]))
    for name, value in mapping.values.items():
        found[name] = _cell(name, _value(trial, trials, value), value, time, trial)
    return found


def _of_name(run: OneClock, pattern: str | None) -> dict[str, str]:
    """What the name of the file says."""
    if pattern is None:
        return {}
    names = re.findall(r"\{(\w+)\}", pattern)
    parts = re.split(r"\{\w+\}", pattern)
    expression = "".join(
        re.escape(part) + (f"(?P<v{i}>.+)" if i < len(names) else "")
        for i, part in enumerate(parts)
    )
    match = re.fullmatch(expression, run.file.name) or re.fullmatch(expression, run.file.stem)
    if not match:
        raise run.error(f"a name that is not like {pattern}", "one that is, or another pattern")
    return {name: match.group(f"v{i}") for i, name in enumerate(names)}


def _value(trial: MappedTrial, trials: Sequence[MappedTrial], value: TrialValue) -> float | str:
    """The value of a trial, as the file has it."""
    run, piece, column = trial.run, trial.piece, value.column
    if column is None:
        return "" if value.value is None else value.value
    if column in run.columns:
        return _constant(run, run.columns[column], piece, column)
    if column in run.facts:
        return run.facts[column]
    if column in run.once:
        siblings = [each for each in trials if each.run is run]
        each_trial = run.once[column]
        at = next(i for i, each in enumerate(siblings) if each.piece is piece)
        if len(each_trial) == len(siblings):
            return _plain(each_trial[at])
        problem = f"{len(each_trial)} values for {len(siblings)} trials"
        raise run.error(problem, "one a sample, or one a trial", column)
    there = [*run.columns, *run.facts, *run.once]
    raise run.error("no such column", f"one of {', '.join(there[:12])}", column)


def _constant(run: OneClock, values: NDArray[Any], piece: Piece, column: str) -> float | str:
    inside = values[piece.start : piece.stop]
    changes = inside != inside[0]
    if inside.dtype.kind == "f":
        changes &= ~(np.isnan(inside) & np.isnan(inside[0]))
    if changes.any():
        row = piece.start + int(np.argmax(changes))
        problem = f"changes within a trial, from {_plain(inside[0])} to {_plain(values[row])}"
        raise run.error(problem, "one value a trial", column, row)
    return _plain(inside[0])


def _plain(value: Any) -> float | str:
    return str(value) if isinstance(value, str) else float(value)


def _cell(
    name: str, found: float | str, value: TrialValue, time: NDArray[Any], trial: MappedTrial
) -> str:
    """The text of a cell, in the unit that the name of its column says."""
    if isinstance(found, str) and value.unit is None and not value.is_sample:
        return found
    try:
        number = float(found)
    except ValueError:
        problem = f"not a number: {str(found)[:40]!r}"
        raise trial.run.error(problem, "a number", value.column) from None
    if np.isnan(number):
        return ""
    if value.is_sample:
        if not (number.is_integer() and 1 <= number <= len(time)):
            expected = f"the number of a sample, 1 to {len(time)}"
            raise trial.run.error(f"sample {number:g}", expected, value.column)
        return repr(float(time[int(number) - 1]))
    own = next((unit for end, unit in UNITS_OF_ENDINGS.items() if name.endswith(end)), None)
    if value.unit is not None and own is not None and value.unit != own:
        number = float(value.unit.to_si(np.array([number]))[0]) * own.divide / own.multiply
    if own is None and number.is_integer() and abs(number) < 2.0**53:
        return str(int(number))
    return repr(number)


def _number(cells: list[dict[str, str]], trials: Sequence[MappedTrial]) -> None:
    """Give each trial its number: the file's own where they are whole and different."""
    for given, trial in zip(cells, trials, strict=True):
        own = trial.run.facts.get("*", trial.piece.name)
        if own is not None and "trial" not in given:
            text = _cell("trial", own, TrialValue(), np.empty(0), trial)
            given["trial"] = text
    numbers = [given.get("trial") for given in cells]
    whole = all(n is not None and re.fullmatch(r"[+-]?\d{1,15}", n) for n in numbers)
    if whole and len({int(n) for n in numbers if n is not None}) == len(numbers):
        return
    for number, given in enumerate(cells, start=1):
        own = given.get("trial")
        given["trial"] = str(number)
        if own is not None:
            given.setdefault(NAME_IN_FILE, own)
