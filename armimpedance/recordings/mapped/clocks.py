"""The columns of a run on one clock, that of the position; several clocks are told, never mixed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.core.delimited import number_of
from armimpedance.core.errors import InputError
from armimpedance.recordings.mapped.mapping import ColumnMapping, ColumnQuantity
from armimpedance.recordings.mapped.raw_file import RawColumn, RawRun, RawTable

#: A clock of these many times the position's rate can be brought to it: a slower one says too
#: little of a push, a faster one would fold its higher frequencies into lower ones.
RATES: Final = {"force": (0.5, 4.0), "emg": (0.5, 4.0), "added_torque": (0.5, 4.0)}
#: Between two samples further apart than this many usual steps nothing is interpolated.
LONGEST_STEP: Final = 3.0
#: Numbers at which counters of 16, 24 and 32 bits begin anew.
COUNTERS: Final = (2.0**16, 2.0**24, 2.0**32)
_SHOWN: Final = 12


@dataclass(frozen=True)
class OneClock:
    """A run with all that a mapping asks for on the clock of the position.

    `time_s` (N,) or None: None where nothing tells it but a rate.
    `rate_hz`: where the file states it.
    `columns`: name -> (N,) float64 or text.
    `once`: name -> values of columns of another length, without a clock: one a trial, perhaps.
    `units`: name -> unit as the file states it.
    """

    file: Path
    name: str
    rows: int
    time_s: FloatArray | None
    rate_hz: float | None
    columns: Mapping[str, NDArray[Any]]
    once: Mapping[str, NDArray[Any]]
    facts: Mapping[str, float | str]
    units: Mapping[str, str]
    first_row: int = 1
    notes: tuple[str, ...] = ()

    def error(
        self, problem: str, expected: str, column: str | None = None, row: int | None = None
    ) -> InputError:
        """What is wrong in this run; `row` counts its samples from 0."""
        line = None if row is None else row + self.first_row
        where = "" if self.name == str(self.file) or not self.name else f" in {self.name}"
        return InputError(
            problem + where, file=self.file, row=line, column=column, expected=expected
        )

    def numbers(self, column: str) -> FloatArray:
        """A column that must hold numbers, (N,); NaN where one is missing.

        Raises InputError: there is no such column on this clock, or it holds a text.
        """
        if column not in self.columns:
            raise self.error("no such column", _some(self.columns), column)
        values = self.columns[column]
        if values.dtype.kind != "U":
            return np.asarray(values, dtype=np.float64)
        read = np.full(len(values), np.nan)
        for row, text in enumerate(values.tolist()):
            value = number_of(text) if text.strip() else np.nan
            if value is None:
                raise self.error(f"not a number: {text[:40]!r}", "a number", column, row)
            read[row] = value
        return read


def on_one_clock(run: RawRun, mapping: ColumnMapping, file: Path) -> OneClock:
    """Bring what a mapping names to the clock of the position.

    Returns: cut to the time that all clocks cover; `notes` say what was done.
    Raises InputError: a column is not there, has no time, or a clock does not fit the position's.
    """
    homes = {name: table for table in run.tables for name in table.columns}
    _refuse_missing(run, mapping, homes, file)
    base = homes[mapping.position.columns[0]]
    time = _time_of(base, mapping.time, mapping.position, homes, file)
    columns: dict[str, NDArray[Any]] = {n: c.values for n, c in base.columns.items()}
    inside = np.ones(base.rows, dtype=bool)
    notes: list[str] = []
    for name, (kind, quantity) in _of_other_clocks(mapping, homes, base).items():
        table = homes[name]
        other = _time_of(table, mapping.time, quantity, homes, file)
        same = other is None or time is None or np.array_equal(other, time)
        if table.rows == base.rows and same:
            columns[name] = table.columns[name].values
            continue
        if other is None or time is None:
            if kind == "value":
                continue
            problem = f"{table.rows} rows beside the position's {base.rows}, without a time"
            raise InputError(problem, file=file, column=name, expected="a column with its time")
        values, covered = _brought(table.columns[name], other, time, kind, (file, name))
        columns[name], inside = values, inside & covered
        notes.append(_told(kind, other, time))
    return _cut_to(inside, run, (base, time, columns, homes), file, tuple(dict.fromkeys(notes)))


def _refuse_missing(
    run: RawRun, mapping: ColumnMapping, homes: Mapping[str, RawTable], file: Path
) -> None:
    for needed in mapping.quantities.values():
        for name in needed.columns:
            if name not in homes:
                there = f"one of {_some(homes)}" if homes else "columns"
                where = f" in {run.name}" if run.name not in ("", str(file)) else ""
                raise InputError("no such column" + where, file=file, column=name, expected=there)


def _cut_to(
    inside: BoolArray, run: RawRun, found: tuple[Any, ...], file: Path, notes: tuple[str, ...]
) -> OneClock:
    """The run where all clocks have samples."""
    base, time, columns, homes = found
    rows = np.flatnonzero(inside)
    if base.rows and not len(rows):
        raise InputError(
            f"the clocks of {run.name} have no time in common", file=file, expected="one time base"
        )
    first, last = (int(rows[0]), int(rows[-1]) + 1) if len(rows) else (0, 0)
    if base.rows - (last - first):
        lost = base.rows - (last - first)
        notes = (*notes, f"{lost} samples that not all clocks cover were left out.")
    return OneClock(
        file=file,
        name=run.name,
        rows=last - first,
        time_s=None if time is None else time[first:last],
        rate_hz=base.rate_hz,
        columns={name: values[first:last] for name, values in columns.items()},
        once={n: t.columns[n].values for n, t in homes.items() if n not in columns},
        facts=run.facts,
        units={n: u for n, t in homes.items() if (u := t.columns[n].unit) is not None},
        first_row=base.first_row + first,
        notes=notes,
    )


def _of_other_clocks(
    mapping: ColumnMapping, homes: Mapping[str, RawTable], base: RawTable
) -> dict[str, tuple[str, ColumnQuantity | None]]:
    """What the mapping names outside of the position's table: name -> what it is for."""
    found: dict[str, tuple[str, ColumnQuantity | None]] = {}
    for kind, quantity in mapping.quantities.items():
        found |= dict.fromkeys(quantity.columns, (kind, quantity))
    found |= dict.fromkeys(mapping.keep, ("keep", None))
    held = [mapping.trials.column, mapping.trials.disturbance]
    found |= {name: ("held", None) for name in held if name is not None}
    values = [v.column for v in mapping.values.values() if v.column is not None]
    found |= {name: ("value", None) for name in values if name not in found}
    return {n: v for n, v in found.items() if n in homes and homes[n] is not base}


def _time_of(
    table: RawTable,
    stated: ColumnQuantity | None,
    quantity: ColumnQuantity | None,
    homes: Mapping[str, RawTable],
    file: Path,
) -> FloatArray | None:
    """The time of a table's rows in s, from a column of the mapping or as the file knows it."""
    own = None if quantity is None else quantity.time
    name = own if own is not None else None if stated is None else stated.columns[0]
    if name is not None and name not in homes:
        raise InputError(
            "no such column", file=file, column=name, expected=f"one of {_some(homes)}"
        )
    if name is not None and homes[name].rows == table.rows and (own or homes[name] is table):
        column = homes[name].columns[name]
        if column.is_text:
            problem = f"not a number: {str(column.values[0])[:40]!r}"
            raise InputError(problem, file=file, column=name, expected="the time as a number")
        unit = stated.unit if stated is not None else None
        numbers = run_on(np.asarray(column.values, dtype=np.float64))
        return numbers if unit is None else unit.to_si(numbers)
    if own is not None:
        problem = f"{homes[own].rows} rows beside the {table.rows} whose time it is"
        raise InputError(problem, file=file, column=own, expected="as many")
    return table.time_s


def run_on(ticks: FloatArray) -> FloatArray:
    """A counter that begins anew when its bits are full, as if it had more of them.

    `ticks` (N,): whole numbers; anything else comes back as it is. A counter that begins anew with
    each trial goes back by another number than that of its bits.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        steps = np.diff(ticks)
        back = steps < 0
    if not back.any() or (ticks != np.floor(ticks)).any():
        return ticks
    usual = float(np.median(steps[~back])) if not back.all() else 0.0
    for full in COUNTERS:
        on = steps + full
        over = back & (on > 0) & (on <= LONGEST_STEP * usual)
        if over.any() and ticks.max() < full:
            return ticks + full * np.concatenate([[0], np.cumsum(over)])
    return ticks


def _brought(
    column: RawColumn, own: FloatArray, time: FloatArray, kind: str, where: tuple[Path, str]
) -> tuple[NDArray[Any], BoolArray]:
    """Values at other times, and where they lie inside of the record; NaN inside of gaps."""
    file, name = where
    if len(own) < 2 or len(time) < 2:
        raise InputError("a clock of a single sample", file=file, column=name, expected="more")
    steps = np.diff(own)
    if not np.isfinite(own).all() or (steps <= 0).any():
        at = int(np.argmax(~(steps > 0))) + 2
        raise InputError(
            "time does not run forward", file=file, row=at, column=name, expected="rising times"
        )
    step, usual = float(np.median(steps)), float(np.median(np.diff(time)))
    low, high = RATES.get(kind, (0.0, np.inf))
    if not low <= usual / step <= high:
        problem = f"{1 / step:.4g} Hz beside the position's {1 / usual:.4g} Hz"
        expected = f"{low:g} to {high:g} times its rate; resample it before"
        raise InputError(problem, file=file, column=name, expected=expected)
    covered = (time >= own[0]) & (time <= own[-1])
    before = np.clip(np.searchsorted(own, time, side="right") - 1, 0, len(own) - 2)
    if column.is_text or kind in ("held", "value"):
        last = np.clip(np.searchsorted(own, time, side="right") - 1, 0, len(own) - 1)
        return column.values[last], covered
    values = np.interp(time, own, np.asarray(column.values, dtype=np.float64))
    # A dropout is a missing value, which is refused by its place, not a straight line.
    values[(steps[before] > LONGEST_STEP * step) & ~np.isin(time, own)] = np.nan
    return values, covered


def _told(kind: str, own: FloatArray, time: FloatArray) -> str:
    rates = [1.0 / float(np.median(np.diff(t))) for t in (own, time)]
    how = "held" if kind in ("held", "value") else "interpolated"
    what = {"held": "trial marks", "value": "trial values", "keep": "further columns"}
    name = what.get(kind, kind.replace("_", " "))
    return (
        f"{name}: {how} from a clock of {rates[0]:.6g} Hz to the position's of {rates[1]:.6g} Hz."
    )


def _some(names: Mapping[str, object]) -> str:
    shown = list(names)[:_SHOWN]
    return ", ".join(shown) + (", …" if len(names) > _SHOWN else "")
