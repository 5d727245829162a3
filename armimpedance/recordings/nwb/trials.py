"""The trials of an NWB file: a table with start, end and what else was noted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.recordings.hdf5 import Hdf5Error, inner, is_dataset, member, numbers, texts
from armimpedance.recordings.mapped.raw_file import RawColumn, RawTable
from armimpedance.recordings.nwb.series import Series

TRIALS: Final = "intervals/trials"
_MOST_TRIALS: Final = 100_000
#: A time may miss its sample by this part of a step, by rounding.
_SLACK: Final = 1e-3


@dataclass(frozen=True)
class Trial:
    """One row of the table of trials.

    Attributes
    ----------
    start_s, stop_s : float
    stop_is_next : bool
        Whether the next trial begins where this one ends: that sample is the next one's.
    facts : mapping
        All columns of the table.
    """

    start_s: float
    stop_s: float
    stop_is_next: bool
    facts: Mapping[str, float | str]


def trials_of(file: Any, left: dict[str, list[str]]) -> list[Trial]:
    """The trials in order of time; none where the file has no such table.

    Parameters
    ----------
    file : h5py.File
    left : dict
        Why something was not taken -> names; added to.

    Raises
    ------
    Hdf5Error
        The table has no start and end for each trial.
    """
    table = member(file, TRIALS)
    if table is None or is_dataset(table):
        return []
    columns: dict[str, Sequence[float | str]] = {}
    for name, thing in inner(table):
        if thing is None or not is_dataset(thing):
            continue
        try:
            columns[name] = _column(thing)
        except Hdf5Error as error:
            left.setdefault(str(error), []).append(f"{TRIALS}/{name}")
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


def cut(series: Series, trial: Trial) -> RawTable:
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
