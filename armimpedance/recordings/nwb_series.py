"""The time series and the trials of an NWB file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.arrays import FloatArray
from armimpedance.recordings.hdf5 import (
    MOST_NUMBERS,
    Hdf5Error,
    attribute_number,
    attribute_text,
    check_numbers,
    inner,
    is_dataset,
    member,
    numbers,
    texts,
)
from armimpedance.recordings.mapped.raw_file import RawColumn, RawTable, Wanted

#: Where signals lie; what cells did and the devices' descriptions lie elsewhere.
_PLACES: Final = ("acquisition", "processing", "stimulus/presentation", "analysis")
_DEEPEST: Final = 8
_MOST_GROUPS: Final = 5000
#: More columns than this are no signals of a limb and a robot.
_WIDEST: Final = 64
_AXES: Final = "xyz"


@dataclass(frozen=True)
class Clock:
    """The times of a series.

    `time_s` (N,).
    `rate_hz`: where the file states it.
    """

    time_s: FloatArray
    rate_hz: float | None = None

    @cached_property
    def step_s(self) -> float:
        """The usual time between samples; 0 where there is none."""
        if self.rate_hz is not None:
            return 1.0 / self.rate_hz
        return float(np.median(np.diff(self.time_s))) if len(self.time_s) > 1 else 0.0

    @cached_property
    def runs_forward(self) -> bool:
        """Whether no time lies before the one above it."""
        return bool((np.diff(self.time_s) >= 0).all())

    def between(self, first_s: float, last_s: float) -> slice | NDArray[np.intp]:
        """The rows of these times, both included."""
        if self.runs_forward:
            return slice(
                int(np.searchsorted(self.time_s, first_s, side="left")),
                int(np.searchsorted(self.time_s, last_s, side="right")),
            )
        return np.flatnonzero((self.time_s >= first_s) & (self.time_s <= last_s))

    def is_of(self, other: Clock) -> bool:
        """Whether two series have the same times, to the last bit."""
        return self.rate_hz == other.rate_hz and np.array_equal(self.time_s, other.time_s)


@dataclass
class NwbSeries:
    """The series of one clock.

    `columns`: name -> column.
    """

    clock: Clock
    columns: dict[str, RawColumn] = field(default_factory=dict)


@dataclass
class Found:
    """What a file holds.

    `left`: why something was not taken -> names.
    `numbers`: how many were read.
    """

    series: list[NwbSeries] = field(default_factory=list)
    left: dict[str, list[str]] = field(default_factory=dict)
    numbers: int = 0

    def leave(self, name: str, why: str) -> None:
        """Something is not taken."""
        self.left.setdefault(why, []).append(name)

    def add(self, clock: Clock, columns: dict[str, RawColumn]) -> None:
        """Columns, beside those of the same clock."""
        for series in self.series:
            if series.clock.is_of(clock):
                series.columns |= columns
                return
        self.series.append(NwbSeries(clock, dict(columns)))


def series_of(file: Any, wanted: Wanted) -> Found:
    """All series of a file whose columns are wanted.

    `wanted`: whether a column, such as "acquisition/force.x", is wanted.
    """
    found = Found()
    seen: set[object] = set()
    for name, group in _groups(file, found, seen):
        try:
            _take(found, name, group, wanted)
        except Hdf5Error as error:
            found.leave(name, str(error))
    return found


def _groups(file: Any, found: Found, seen: set[object]) -> Iterator[tuple[str, Any]]:
    """Each group that holds data, once, and where it lies."""
    places = [(path, member(file, path)) for path in _PLACES]
    ends = [(p, g, 0) for p, g in places if g is not None and not is_dataset(g)]
    while ends:
        path, group, depth = ends.pop(0)
        if group.id in seen or depth > _DEEPEST or len(seen) > _MOST_GROUPS:
            continue
        seen.add(group.id)
        members = dict(inner(group))
        if "data" in members:
            yield path, group
            continue
        if any(thing is not None and is_dataset(thing) for thing in members.values()):
            found.leave(path, _kind(group))
            continue
        for name, thing in members.items():
            if thing is None:
                found.leave(
                    f"{path}/{name}",
                    "it lies in another file, or nowhere, or its name cannot be shown",
                )
            else:
                ends.append((f"{path}/{name}", thing, depth + 1))


def _kind(group: Any) -> str:
    return f"{attribute_text(group, 'neurodata_type')[:40] or 'a table'} and no time series"


def _take(found: Found, name: str, group: Any, wanted: Wanted) -> None:
    """Read one series, if any of its columns is wanted."""
    data = member(group, "data")
    if data is None or not is_dataset(data) or not 1 <= len(data.shape) <= 2:
        raise Hdf5Error("no table of numbers")
    width = data.shape[1] if len(data.shape) == 2 else 1
    if width > _WIDEST:
        raise Hdf5Error(f"more than {_WIDEST} channels")
    labels = _labels(name, data, attribute_text(group, "neurodata_type"))
    for label in labels:
        if not wanted(label):
            found.leave(label, "the mapping gives them no meaning")
    if not any(wanted(label) for label in labels):
        return
    check_numbers(data)
    found.numbers += data.shape[0] * width
    if found.numbers > MOST_NUMBERS:
        raise Hdf5Error(f"more than {MOST_NUMBERS} numbers in all")
    clock = _clock(group, data.shape[0])
    values = numbers(data).reshape(data.shape[0], width)
    factors, offset = _factors(group, data, width), attribute_number(data, "offset", 0.0)
    unit = attribute_text(data, "unit") or None
    columns = {}
    for i, label in enumerate(labels):
        if wanted(label):
            columns[label] = RawColumn(_scaled(values[:, i], factors[i], offset), unit)
    found.add(clock, columns)


def _scaled(column: FloatArray, factor: float, offset: float) -> FloatArray:
    """A column in its unit; a factor of one leaves each bit as it is."""
    column = column if factor == 1.0 else column * factor
    return column + offset if offset else column


def _labels(name: str, data: Any, kind: str) -> list[str]:
    """Names of columns: a place has axes, other series have numbers."""
    if len(data.shape) == 1:
        return [name]
    if kind == "SpatialSeries" and data.shape[1] <= len(_AXES):
        return [f"{name}.{_AXES[i]}" for i in range(data.shape[1])]
    return [f"{name}[{i}]" for i in range(data.shape[1])]


def _factors(group: Any, data: Any, width: int) -> FloatArray:
    """What brings stored numbers to the unit, one for each column."""
    factor = np.full(width, attribute_number(data, "conversion", 1.0))
    own = member(group, "channel_conversion")
    if own is None or not is_dataset(own):
        return factor
    each = numbers(own)
    if each.shape != (width,):
        raise Hdf5Error("not one channel_conversion a channel")
    return factor * each


def _clock(group: Any, rows: int) -> Clock:
    times = member(group, "timestamps")
    if times is not None and is_dataset(times):
        time_s = numbers(times)
        if time_s.shape != (rows,):
            raise Hdf5Error(f"{time_s.shape[:1]} times for {rows} rows")
        return Clock(time_s)
    start = member(group, "starting_time")
    if start is None or not is_dataset(start) or start.shape not in ((), (1,)):
        raise Hdf5Error("no times")
    rate = attribute_number(start, "rate", 0.0)
    # A rate of 0.1 nHz and one of 1 THz are no rates.
    if not 1e-10 < rate < 1e12:
        raise Hdf5Error("no rate")
    first = float(np.asarray(start[()], dtype=np.float64).reshape(-1)[0])
    return Clock(first + np.arange(rows) / rate, rate)


# The trials of an NWB file: a table with start, end and what else was noted.

TRIALS: Final = "intervals/trials"
_MOST_TRIALS: Final = 100_000
#: A time may miss its sample by this part of a step, by rounding.
_SLACK: Final = 1e-3


@dataclass(frozen=True)
class Trial:
    """One row of the table of trials.

    `stop_is_next`: whether the next trial begins where this one ends: that sample is the next
    one's.
    `facts`: all columns of the table.
    """

    start_s: float
    stop_s: float
    stop_is_next: bool
    facts: Mapping[str, float | str]


def _trial_columns(table: Any, left: dict[str, list[str]]) -> dict[str, Sequence[float | str]]:
    columns: dict[str, Sequence[float | str]] = {}
    for name, thing in inner(table):
        if thing is None or not is_dataset(thing):
            continue
        try:
            columns[name] = _column(thing)
        except Hdf5Error as error:
            left.setdefault(str(error), []).append(f"{TRIALS}/{name}")
    return columns


def trials_of(file: Any, left: dict[str, list[str]]) -> list[Trial]:
    """The trials in order of time; none where the file has no such table.

    `left`: why something was not taken -> names; added to.
    Raises Hdf5Error: the table has no start and end for each trial.
    """
    table = member(file, TRIALS)
    if table is None or is_dataset(table):
        return []
    columns = _trial_columns(table, left)
    starts, stops = columns.pop("start_time", None), columns.pop("stop_time", None)
    if starts is None or stops is None or len(starts) != len(stops):
        raise Hdf5Error(f"{TRIALS} has no start_time and stop_time")
    if len(starts) > _MOST_TRIALS or not _are_times(starts, stops):
        raise Hdf5Error(f"{TRIALS} has times that are none")
    odd = [name for name, values in columns.items() if len(values) != len(starts)]
    for name in odd:
        del columns[name]
        left.setdefault("not one value a trial", []).append(f"{TRIALS}/{name}")
    order = np.argsort(np.array(starts, np.float64), kind="stable")
    firsts = [*(float(starts[i]) for i in order[1:]), np.inf]
    return [
        Trial(
            start_s=float(starts[i]),
            stop_s=float(stops[i]),
            stop_is_next=following <= float(stops[i]),
            facts={name: values[i] for name, values in columns.items()},
        )
        for i, following in zip(order, firsts, strict=True)
    ]


def _column(dataset: Any) -> Sequence[float | str]:
    if len(dataset.shape) != 1:
        raise Hdf5Error("not one value a trial")
    if dataset.dtype.kind in "OS":
        return texts(dataset)
    found: list[float] = numbers(dataset).tolist()
    return found


def _are_times(starts: Sequence[float | str], stops: Sequence[float | str]) -> bool:
    for first, last in zip(starts, stops, strict=True):
        if isinstance(first, str) or isinstance(last, str):
            return False
        if not (np.isfinite(first) and np.isfinite(last) and last > first):
            return False
    return True


def cut(series: NwbSeries, trial: Trial) -> RawTable:
    """The rows of a trial; their time counts from its start."""
    clock = series.clock
    slack = _SLACK * abs(clock.step_s)
    end = trial.stop_s - slack if trial.stop_is_next else trial.stop_s + slack
    rows = clock.between(trial.start_s - slack, end)
    columns = {n: RawColumn(c.values[rows], c.unit) for n, c in series.columns.items()}
    time = _since(clock.time_s[rows], clock.rate_hz, trial.start_s, slack)
    return RawTable(columns, time, clock.rate_hz)


def _since(time: FloatArray, rate: float | None, start: float, slack: float) -> FloatArray:
    """The time since the start of a trial: counted in steps where they are even."""
    if not rate or not len(time):
        return time - start
    before = float(time[0] - start)
    first = 0.0 if abs(before) <= slack else before
    return first + np.arange(len(time)) / rate
