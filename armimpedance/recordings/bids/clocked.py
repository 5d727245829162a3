"""Trials of a run, each on its own clock, and the table of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.recordings.bids.runs import Run, Stretch, rows_of, times_of
from armimpedance.recordings.bids.systems import System

#: The channel with each trial's own clock, in files that `armimpedance share` writes.
TRIAL_TIME: Final = "trial_time"
#: Steps of time may differ from one another by this part of a step.
_UNEVEN: Final = 0.5


@dataclass(frozen=True)
class Clocked:
    """The samples of one trial.

    Attributes
    ----------
    condition : str
    facts : mapping
        What its event says.
    rate_hz : float
    time_s : (N,)
        The trial's own clock.
    values : (N, ...)
    stretch : Stretch
    begin_s : float
        Time of its first sample in the run.
    """

    condition: str
    facts: Mapping[str, float | str]
    rate_hz: float
    time_s: FloatArray
    values: FloatArray
    stretch: Stretch
    begin_s: float


def clock_of(system: System) -> list[int]:
    """The channel with the trials' own clock: its index, or none."""
    named = [(channel.name, channel.kind) for channel in system.channels]
    return [i for i, pair in enumerate(named) if pair == (TRIAL_TIME, "MISC")]


def clocked(run: Run, index: int, values: FloatArray, clock: FloatArray | None) -> list[Clocked]:
    """The trials of a run.

    Parameters
    ----------
    run : Run
    index : int
        The system whose samples these are.
    values : (N, ...)
    clock : (N,) or None
        The trials' own times; None: each begins at 0.

    Raises
    ------
    InputError
        A trial has no sample, or time does not run in steps of the rate.
    """
    system = run.systems[index]
    time = times_of(system, run.starts_s[index], len(values))
    trials = []
    for number, stretch in enumerate(run.stretches, start=1):
        rows = rows_of(stretch, time, system.rate_hz)
        if rows.stop - rows.start < 1:
            raise InputError(
                f"trial {number} of {run.name} has no sample",
                file=system.file.path,
                expected="events inside of the record",
            )
        begin = float(time[rows.start])
        own = time[rows] - begin if clock is None else clock[rows]
        _check_steps(own, system)
        named = str(stretch.facts.get("condition", run.name))
        rate = system.rate_hz
        trials.append(Clocked(named, stretch.facts, rate, own, values[rows], stretch, begin))
    return trials


def _check_steps(time: FloatArray, system: System) -> None:
    """A trial's clock must run in the steps of the rate."""
    steps = np.diff(time) * system.rate_hz
    if np.isfinite(time).all() and not (np.abs(steps - 1.0) > _UNEVEN).any():
        return
    worst = float(np.nanmax(np.abs(steps - 1.0), initial=0.0))
    raise InputError(
        f"time does not run in equal steps (off by {100 * worst:.0f} % of one)",
        file=system.file.path,
        expected=f"{system.rate_hz:g} samples a second",
    )


def trial_table(trials: Sequence[Clocked]) -> pd.DataFrame:
    """The trial table: number, condition, and what the events say of every trial."""
    numbers = [trial.facts.get("trial") for trial in trials]
    whole = [int(n) for n in numbers if isinstance(n, float) and n.is_integer() and abs(n) < 1e9]
    own = len(whole) == len(trials) and len(set(whole)) == len(whole)
    table = pd.DataFrame(
        {
            "trial": whole if own else np.arange(1, len(trials) + 1),
            "condition": [trial.condition for trial in trials],
        }
    )
    further = dict.fromkeys(k for trial in trials for k in trial.facts if k not in table)
    for name in further:
        values = [trial.facts.get(name) for trial in trials]
        if all(v is None or isinstance(v, float) for v in values):
            table[name] = np.array([np.nan if v is None else v for v in values], dtype=np.float64)
        else:
            table[name] = ["" if v is None else str(v) for v in values]
    return table
