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

#: The groups that hold signals; cells' activity and devices' descriptions are in others.
_PLACES: Final = ("acquisition", "processing", "stimulus/presentation", "analysis")
_DEEPEST: Final = 8
_MOST_GROUPS: Final = 5000
#: The most columns of a series from a limb and a robot.
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
        """The usual time between samples; 0 if unknown."""
        if self.rate_hz is not None:
            return 1.0 / self.rate_hz
        return float(np.median(np.diff(self.time_s))) if len(self.time_s) > 1 else 0.0

    @cached_property
    def runs_forward(self) -> bool:
        """True if times never decrease."""
        return bool((np.diff(self.time_s) >= 0).all())

    def between(self, first_s: float, last_s: float) -> slice | NDArray[np.intp]:
        """The rows between these times, both included."""
        if self.runs_forward:
            return slice(
                int(np.searchsorted(self.time_s, first_s, side="left")),
                int(np.searchsorted(self.time_s, last_s, side="right")),
            )
        return np.flatnonzero((self.time_s >= first_s) & (self.time_s <= last_s))

    def is_of(self, other: Clock) -> bool:
        """True if two series have exactly the same times."""
        return self.rate_hz == other.rate_hz and np.array_equal(self.time_s, other.time_s)


@dataclass
class NwbSeries:
    """The series that share one clock.

    `columns`: name -> column.
    """

    clock: Clock
    columns: dict[str, RawColumn] = field(default_factory=dict)


@dataclass
class FileSeries:
    """The series read from a file.

    `left`: reason -> names of data that were not taken.
    `numbers`: number of numbers that were read.
    """

    series: list[NwbSeries] = field(default_factory=list)
    left: dict[str, list[str]] = field(default_factory=dict)
    numbers: int = 0

    def leave(self, name: str, why: str) -> None:
        """Note that something is not taken."""
        self.left.setdefault(why, []).append(name)

    def add(self, clock: Clock, columns: dict[str, RawColumn]) -> None:
        """Add columns to those of the same clock."""
        for series in self.series:
            if series.clock.is_of(clock):
                series.columns |= columns
                return
        self.series.append(NwbSeries(clock, dict(columns)))


def series_of(file: Any, wanted: Wanted) -> FileSeries:
    """Read all series of a file with wanted columns.

    `wanted`: whether a column, such as "acquisition/force.x", is wanted.
    """
    found = FileSeries()
    seen: set[object] = set()
    for name, group in _groups(file, found, seen):
        try:
            _take(found, name, group, wanted)
        except Hdf5Error as error:
            found.leave(name, str(error))
    return found


def _groups(file: Any, found: FileSeries, seen: set[object]) -> Iterator[tuple[str, Any]]:
    """Each group that holds data, once, with its path."""
    places = [(path, member(file, path)) for path in _PLACES]
    pending = [(p, g, 0) for p, g in places if g is not None and not is_dataset(g)]
    while pending:
        path, group, depth = pending.pop(0)
        if group.id in seen or depth > _DEEPEST or len(seen) > _MOST_GROUPS:
            continue
        seen.add(group.id)
        members = dict(inner(group))
        if "data" in members:
            yield path, group
            continue
        if any(content is not None and is_dataset(content) for content in members.values()):
            found.leave(path, _kind(group))
            continue
        for name, content in members.items():
            if content is None:
                found.leave(
                    f"{path}/{name}",
                    "it lies in another file, or nowhere, or its name cannot be shown",
                )
            else:
                pending.append((f"{path}/{name}", content, depth + 1))


def _kind(group: Any) -> str:
    return f"{attribute_text(group, 'neurodata_type')[:40] or 'a table'} and no time series"


def _take(found: FileSeries, name: str, group: Any, wanted: Wanted) -> None:
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
    """A column in its unit; a factor of one changes no bit."""
    column = column if factor == 1.0 else column * factor
    return column + offset if offset else column


def _labels(name: str, data: Any, kind: str) -> list[str]:
    """Names of columns: positions have axes, other series have numbers."""
    if len(data.shape) == 1:
        return [name]
    if kind == "SpatialSeries" and data.shape[1] <= len(_AXES):
        return [f"{name}.{_AXES[i]}" for i in range(data.shape[1])]
    return [f"{name}[{i}]" for i in range(data.shape[1])]


def _factors(group: Any, data: Any, width: int) -> FloatArray:
    """Factors from stored numbers to the unit, one for each column."""
    factor = np.full(width, attribute_number(data, "conversion", 1.0))
    per_channel = member(group, "channel_conversion")
    if per_channel is None or not is_dataset(per_channel):
        return factor
    channel_factors = numbers(per_channel)
    if channel_factors.shape != (width,):
        raise Hdf5Error("not one channel_conversion a channel")
    return factor * channel_factors


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
    # Rates below 0.1 nHz or above 1 THz are refused.
    if not 1e-10 < rate < 1e12:
        raise Hdf5Error("no rate")
    first = float(np.asarray(start[()], dtype=np.float64).reshape(-1)[0])
    return Clock(first + np.arange(rows) / rate, rate)


# The trials of an NWB file: a table with start, end and further columns.

TRIALS: Final = "intervals/trials"
_MOST_TRIALS: Final = 100_000
#: The rounding error of times, relative to a step.
_SLACK: Final = 1e-3


@dataclass(frozen=True)
class Trial:
    """One row of the table of trials.

    `stop_is_next`: True if the next trial begins where this one ends; that sample then belongs to
    the next trial.
    `facts`: all columns of the table.
    """

    start_s: float
    stop_s: float
    stop_is_next: bool
    facts: Mapping[str, float | str]


def _trial_columns(table: Any, left: dict[str, list[str]]) -> dict[str, Sequence[float | str]]:
    columns: dict[str, Sequence[float | str]] = {}
    for name, content in inner(table):
        if content is None or not is_dataset(content):
            continue
        try:
            columns[name] = _column(content)
        except Hdf5Error as error:
            left.setdefault(str(error), []).append(f"{TRIALS}/{name}")
    return columns


def trials_of(file: Any, left: dict[str, list[str]]) -> list[Trial]:
    """The trials in order of time; none if the file has no such table.

    `left`: reason -> names of data that were not taken; entries are added.
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
    wrong_length = [name for name, values in columns.items() if len(values) != len(starts)]
    for name in wrong_length:
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
    values: list[float] = numbers(dataset).tolist()
    return values


def _are_times(starts: Sequence[float | str], stops: Sequence[float | str]) -> bool:
    for first, last in zip(starts, stops, strict=True):
        if isinstance(first, str) or isinstance(last, str):
            return False
        if not (np.isfinite(first) and np.isfinite(last) and last > first):
            return False
    return True


def cut(series: NwbSeries, trial: Trial) -> RawTable:
    """The rows of a trial, with time counted from its start."""
    clock = series.clock
    slack = _SLACK * abs(clock.step_s)
    end = trial.stop_s - slack if trial.stop_is_next else trial.stop_s + slack
    rows = clock.between(trial.start_s - slack, end)
    columns = {n: RawColumn(c.values[rows], c.unit) for n, c in series.columns.items()}
    time = _since(clock.time_s[rows], clock.rate_hz, trial.start_s, slack)
    return RawTable(columns, time, clock.rate_hz)


def _since(time: FloatArray, rate: float | None, start: float, slack: float) -> FloatArray:
    """The time since a trial's start, counted in steps where they are even."""
    if not rate or not len(time):
        return time - start
    before = float(time[0] - start)
    first = 0.0 if abs(before) <= slack else before
    return first + np.arange(len(time)) / rate
