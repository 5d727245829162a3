"""The clock of a sample table: time runs forward, in steps of 1 / rate."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, IntArray
from armimpedance.core.errors import InputError
from armimpedance.recordings.tables.number_table import NumberTable

#: A step between two samples may differ from 1 / rate by this part of it (jitter of the clock)...
STEP_TOLERANCE: Final = 0.1
#: ... and the time since the trial's start by half a sample and the inaccuracy of a quartz clock.
DRIFT_TOLERANCE_SAMPLES: Final = 0.5
CLOCK_TOLERANCE: Final = 1e-4
#: Samples that are looked at together: few enough that a long recording needs little more room.
TOGETHER: Final = 1 << 18


def check_time(table: NumberTable, offsets: IntArray, rate_hz: float) -> None:
    """Time must run forward in steps of 1 / rate.

    Times are printed with so many decimals: where the step is no multiple of the last decimal,
    rounding may shift each time by one unit of it, and the tolerances grow by that much. Where
    that unit is longer than a step, several samples may print the same time.

    Raises
    ------
    InputError
    """
    time, dt = table.columns["time_s"], 1.0 / rate_hz
    _check_finite(table, time)
    rounding = _rounding(time[:2000], dt)
    # of each thing that may be wrong the first sample, in the order in which they are told
    wrong: dict[int, tuple[int, str]] = {}
    for piece in _pieces(time, offsets, dt):
        for rule, (where, problem) in enumerate(_rules(piece, dt, rounding)):
            if rule not in wrong and where.any():
                at = int(np.argmax(where))
                told = problem.format(step=piece.step[at], elapsed=piece.elapsed[at])
                wrong[rule] = (piece.first + at, told)
    if wrong:
        sample, told = wrong[min(wrong)]
        expected = f"steps of {dt:.6g} s at {rate_hz:g} Hz"
        row = table.row(sample)
        raise InputError(told, file=table.file, row=row, column="time_s", expected=expected)


def _check_finite(table: NumberTable, time: FloatArray) -> None:
    """Differences of infinite times are no numbers, and would pass every rule."""
    if time.size == 0 or np.isfinite([time.min(), time.max()]).all():
        return
    sample = int(np.argmin(np.isfinite(time)))
    problem, row = f"{time[sample]:g} is no time", table.row(sample)
    raise InputError(problem, file=table.file, row=row, column="time_s", expected="seconds")


@dataclass(frozen=True)
class _Piece:
    """Samples from `first` on: steps to each, time and number of samples since its trial began."""

    first: int
    step: FloatArray
    elapsed: FloatArray
    index: IntArray


def _pieces(time: FloatArray, offsets: IntArray, dt: float) -> Iterator[_Piece]:
    for first in range(0, len(time), TOGETHER):
        last = min(first + TOGETHER, len(time))
        step = np.diff(time[first:last], prepend=time[first - 1] if first else time[0] - dt)
        # the trials that have samples here, and how many of them
        low = int(np.searchsorted(offsets, first, side="right")) - 1
        high = int(np.searchsorted(offsets, last, side="left"))
        starts: IntArray = offsets[low:high]
        lengths = np.asarray(np.diff(offsets[low : high + 1].clip(first, last)), dtype=np.int64)
        step[starts[starts >= first] - first] = dt
        elapsed = time[first:last] - np.repeat(time[starts], lengths)
        yield _Piece(first, step, elapsed, np.arange(first, last) - np.repeat(starts, lengths))


def _rules(piece: _Piece, dt: float, rounding: float) -> Iterator[tuple[BoolArray, str]]:
    """Where (S,) the clock is wrong, and what is said of it."""
    step, elapsed = piece.step, piece.elapsed
    yield (step < 0) | ((step == 0) & (rounding < dt)), "time does not run forward"
    apart = np.abs(step - dt) > STEP_TOLERANCE * dt + rounding
    yield apart, "a step of {step:.6g} s: a gap, or another rate"
    slack = DRIFT_TOLERANCE_SAMPLES * dt + rounding + CLOCK_TOLERANCE * elapsed
    drifts = np.abs(elapsed - piece.index * dt) > slack
    yield drifts, "{elapsed:.6g} s after the trial's start, which disagrees with the rate"


def _rounding(time: FloatArray, dt: float) -> float:
    """By how much printing may have moved a time: the last decimal's unit, 0 if steps are exact."""
    for decimals in range(10):
        with np.errstate(over="ignore", invalid="ignore"):
            scaled = time * 10.0**decimals
            off = np.abs(scaled - np.round(scaled)).max()
        if off < 1e-6:
            steps = dt * 10.0**decimals
            exact = round(steps) > 0 and abs(steps - round(steps)) < 1e-9 * steps
            return 0.0 if exact else 10.0**-decimals
    return 0.0
