"""Times of a table in text: rising, each once, in equal steps."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.recordings.motion.tabbed_text import NumberRows


def times(rows: NumberRows, column: int, file: Path) -> tuple[FloatArray, NumberRows, int]:
    """The times of rows, those rows, and how many were left out because they stand there twice.

    Parameters
    ----------
    rows : NumberRows
    column : int
        Where the time stands.
    file : Path
        For messages.

    Raises
    ------
    InputError
        A row has no time, time goes back, or it stands still though the rows differ.
    """
    time = rows.values[:, column]
    if not np.isfinite(time).all():
        at = int(rows.numbers[np.flatnonzero(~np.isfinite(time))[0]])
        raise InputError("a row without a time", file=file, row=at, expected="a number")
    # the columns before the time number the frames, and count on where a row is repeated
    now, before = rows.values[1:, column:], rows.values[:-1, column:]
    same = (now == before) | (np.isnan(now) & np.isnan(before))
    twice = np.concatenate([[False], same.all(axis=1)])
    step = np.diff(time[~twice])
    if (step <= 0).any():
        i = int(np.flatnonzero(step <= 0)[0]) + 1
        at = int(rows.numbers[~twice][i])
        how = "stands still at" if step[i - 1] == 0 else "goes back to"
        problem = f"time does not rise: it {how} {time[~twice][i]:.9g} s"
        raise InputError(problem, file=file, row=at, expected="each time once, rising")
    kept = NumberRows(rows.values[~twice], rows.numbers[~twice], rows.further)
    return kept.values[:, column], kept, int(twice.sum())


def sample_rate(time_s: FloatArray, file: Path, stated_hz: float | None = None) -> float:
    """The rate of equally spaced times.

    Raises
    ------
    InputError
        Times do not rise in equal steps, or not with the stated rate.
    """
    if len(time_s) < 2:
        raise InputError(f"{len(time_s)} samples", file=file, expected="two or more")
    step = float(time_s[-1] - time_s[0]) / (len(time_s) - 1)
    rate = stated_hz or (1.0 / step if step > 0 else math.nan)
    # times are often printed with few decimals
    wrong = np.flatnonzero(~(np.abs(np.diff(time_s) * rate - 1.0) < 0.5))
    if stated_hz and abs(step * rate - 1.0) > 0.01 and len(wrong) in (0, len(time_s) - 1):
        problem = f"time does not rise in steps of {1.0 / rate:.6g} s (1 / DataRate) but {step:.6g}"
        expected = "a rate and times that agree"
        raise InputError(problem, file=file, column="time", expected=expected)
    if len(wrong) or abs(step * rate - 1.0) > 0.01:
        at = float(time_s[wrong[0]]) if len(wrong) else float(time_s[0])
        problem = f"time does not rise in steps of {1.0 / rate:.6g} s after {at:.6g} s"
        expected = "equal steps; resample it first"
        raise InputError(problem, file=file, column="time", expected=expected)
    # a rate that was meant to be whole
    return float(round(rate)) if abs(rate - round(rate)) < 1e-3 * rate / len(time_s) else rate
