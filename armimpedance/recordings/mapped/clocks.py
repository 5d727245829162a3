"""Columns of a run on one clock, that of the position; other clocks are converted with a note."""

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

#: Range of rates, relative to the position's, that are interpolated: a slower clock misses parts
#: of a push, a faster one would cause aliasing.
RATES: Final = {"force": (0.5, 4.0), "emg": (0.5, 4.0), "added_torque": (0.5, 4.0)}
#: Longest gap between samples that is interpolated, in usual steps.
LONGEST_STEP: Final = 3.0
#: Numbers at which counters of 16, 24 and 32 bits overflow to 0.
COUNTERS: Final = (2.0**16, 2.0**24, 2.0**32)
_SHOWN: Final = 12


@dataclass(frozen=True)
class OneClock:
    """A run with all columns of a mapping on the clock of the position.

    `time_s` (N,) or None: None if only a rate is known.
    `rate_hz`: the rate, if the file states it.
    `columns`: name -> (N,) float64 or text.
    `once`: name -> values of columns of another length without a clock, possibly one per trial.
    `units`: name -> unit as stated in the file.
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
        """Return an error for this run; `row` counts its samples from 0."""
        line = None if row is None else row + self.first_row
        in_run = "" if self.name == str(self.file) or not self.name else f" in {self.name}"
        return InputError(
            problem + in_run, file=self.file, row=line, column=column, expected=expected
        )

    def numbers(self, column: str) -> FloatArray:
        """Return a column of numbers (N,); NaN for missing numbers.

        Raises InputError: there is no such column on this clock, or it holds a text.
        """
        if column not in self.columns:
            raise self.error("no such column", _some(self.columns), column)
        values = self.columns[column]
        if values.dtype.kind != "U":
            return np.asarray(values, dtype=np.float64)
        parsed = np.full(len(values), np.nan)
        for row, text in enumerate(values.tolist()):
            value = number_of(text) if text.strip() else np.nan
            if value is None:
                raise self.error(f"not a number: {text[:40]!r}", "a number", column, row)
            parsed[row] = value
        return parsed


def on_one_clock(run: RawRun, mapping: ColumnMapping, file: Path) -> OneClock:
    """Convert all columns of a mapping to the clock of the position.

    Returns: the run, cut to the time that all clocks cover; `notes` state what was done.
    Raises InputError: a column is missing, has no time, or a clock does not fit the position's.
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
        clock = _time_of(table, mapping.time, quantity, homes, file)
        same = clock is None or time is None or np.array_equal(clock, time)
        if table.rows == base.rows and same:
            columns[name] = table.columns[name].values
            continue
        if clock is None or time is None:
            if kind == "value":
                continue
            problem = f"{table.rows} rows beside the position's {base.rows}, without a time"
            raise InputError(problem, file=file, column=name, expected="a column with its time")
        values, covered = _brought(table.columns[name], clock, time, kind, (file, name))
        columns[name], inside = values, inside & covered
        notes.append(_clock_remark(kind, clock, time))
    return _cut_to(inside, run, (base, time, columns, homes), file, tuple(dict.fromkeys(notes)))


def _refuse_missing(
    run: RawRun, mapping: ColumnMapping, homes: Mapping[str, RawTable], file: Path
) -> None:
    for needed in mapping.quantities.values():
        for name in needed.columns:
            if name not in homes:
                available = f"one of {_some(homes)}" if homes else "columns"
                in_run = f" in {run.name}" if run.name not in ("", str(file)) else ""
                raise InputError(
                    "no such column" + in_run, file=file, column=name, expected=available
                )


def _cut_to(
    inside: BoolArray, run: RawRun, parts: tuple[Any, ...], file: Path, notes: tuple[str, ...]
) -> OneClock:
    """Cut a run to the samples that all clocks cover."""
    base, time, columns, homes = parts
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
    """Columns of the mapping outside the position's table, with their kind and quantity."""
    uses: dict[str, tuple[str, ColumnQuantity | None]] = {}
    for kind, quantity in mapping.quantities.items():
        uses |= dict.fromkeys(quantity.columns, (kind, quantity))
    uses |= dict.fromkeys(mapping.keep, ("keep", None))
    marks = [mapping.trials.column, mapping.trials.disturbance]
    uses |= {name: ("held", None) for name in marks if name is not None}
    values = [v.column for v in mapping.values.values() if v.column is not None]
    uses |= {name: ("value", None) for name in values if name not in uses}
    return {n: v for n, v in uses.items() if n in homes and homes[n] is not base}


def _time_of(
    table: RawTable,
    stated: ColumnQuantity | None,
    quantity: ColumnQuantity | None,
    homes: Mapping[str, RawTable],
    file: Path,
) -> FloatArray | None:
    """Time of a table's rows, s, from a column of the mapping, else from the file; or None."""
    own_column = None if quantity is None else quantity.time
    name = own_column if own_column is not None else None if stated is None else stated.columns[0]
    if name is not None and name not in homes:
        raise InputError(
            "no such column", file=file, column=name, expected=f"one of {_some(homes)}"
        )
    if name is not None and homes[name].rows == table.rows and (own_column or homes[name] is table):
        column = homes[name].columns[name]
        if column.is_text:
            problem = f"not a number: {str(column.values[0])[:40]!r}"
            raise InputError(problem, file=file, column=name, expected="the time as a number")
        unit = stated.unit if stated is not None else None
        numbers = run_on(np.asarray(column.values, dtype=np.float64))
        return numbers if unit is None else unit.to_si(numbers)
    if own_column is not None:
        problem = f"{homes[own_column].rows} rows beside the {table.rows} whose time it is"
        raise InputError(problem, file=file, column=own_column, expected="as many")
    return table.time_s


def run_on(ticks: FloatArray) -> FloatArray:
    """Continue a counter over the overflows of its bits.

    `ticks` (N,): integers; other numbers are returned unchanged. A counter that is reset at each
    trial goes back by another number than that of its bits, and is not changed.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        steps = np.diff(ticks)
        back = steps < 0
    if not back.any() or (ticks != np.floor(ticks)).any():
        return ticks
    usual = float(np.median(steps[~back])) if not back.all() else 0.0
    for full in COUNTERS:
        continued = steps + full
        overflows = back & (continued > 0) & (continued <= LONGEST_STEP * usual)
        if overflows.any() and ticks.max() < full:
            return ticks + full * np.concatenate([[0], np.cumsum(overflows)])
    return ticks


def _brought(
    column: RawColumn, own_time: FloatArray, time: FloatArray, kind: str, location: tuple[Path, str]
) -> tuple[NDArray[Any], BoolArray]:
    """Interpolate values to other times, NaN within gaps; and True for times that are covered."""
    file, name = location
    if len(own_time) < 2 or len(time) < 2:
        raise InputError("a clock of a single sample", file=file, column=name, expected="more")
    steps = np.diff(own_time)
    if not np.isfinite(own_time).all() or (steps <= 0).any():
        row = int(np.argmax(~(steps > 0))) + 2
        raise InputError(
            "time does not run forward", file=file, row=row, column=name, expected="rising times"
        )
    step, usual = float(np.median(steps)), float(np.median(np.diff(time)))
    low, high = RATES.get(kind, (0.0, np.inf))
    if not low <= usual / step <= high:
        problem = f"{1 / step:.4g} Hz beside the position's {1 / usual:.4g} Hz"
        expected = f"{low:g} to {high:g} times its rate; resample it before"
        raise InputError(problem, file=file, column=name, expected=expected)
    covered = (time >= own_time[0]) & (time <= own_time[-1])
    before = np.clip(np.searchsorted(own_time, time, side="right") - 1, 0, len(own_time) - 2)
    if column.is_text or kind in ("held", "value"):
        last = np.clip(np.searchsorted(own_time, time, side="right") - 1, 0, len(own_time) - 1)
        return column.values[last], covered
    values = np.interp(time, own_time, np.asarray(column.values, dtype=np.float64))
    # a dropout becomes a missing value, which is refused with its place, not a straight line
    values[(steps[before] > LONGEST_STEP * step) & ~np.isin(time, own_time)] = np.nan
    return values, covered


def _clock_remark(kind: str, own_time: FloatArray, time: FloatArray) -> str:
    rates = [1.0 / float(np.median(np.diff(t))) for t in (own_time, time)]
    how = "held" if kind in ("held", "value") else "interpolated"
    names = {"held": "trial marks", "value": "trial values", "keep": "further columns"}
    name = names.get(kind, kind.replace("_", " "))
    return (
        f"{name}: {how} from a clock of {rates[0]:.6g} Hz to the position's of {rates[1]:.6g} Hz."
    )


def _some(names: Mapping[str, object]) -> str:
    shown = list(names)[:_SHOWN]
    return ", ".join(shown) + (", …" if len(names) > _SHOWN else "")
