"""Samples of several trials, one after another, with a table of the trials."""

from __future__ import annotations

import re
from collections.abc import Sequence
from html import escape
from typing import Annotated, Any, Final

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from armimpedance.core.arrays import LARGEST, FloatArray, FrozenRecord, IntArray
from armimpedance.core.errors import RecordError

#: Most conditions that a short text names.
MOST_SHOWN: Final = 12
#: Columns of the trial table that must hold numbers or be empty.
_NUMBERS: Final = re.compile(r"(mvc|rest)_.+_V|onset_s|end_s|direction_deg|elevation_deg")


def trial_slices(offsets: IntArray) -> list[slice]:
    """Slices of the samples of each trial.

    `offsets` (T + 1,) int: trial t is ``offsets[t]:offsets[t + 1]``.
    """
    return [slice(int(a), int(b)) for a, b in zip(offsets[:-1], offsets[1:], strict=True)]


class InTrials(FrozenRecord):
    """Base of recordings of samples in trials: trial table and first sample of each trial.

    Raises RecordError: the rate is not positive, there are no trials, the table lacks a column or
    holds a trial twice, or it disagrees with the samples.
    """

    sample_rate_hz: float
    trials: pd.DataFrame
    offsets: Annotated[IntArray, "T+1"]
    time_s: Annotated[FloatArray, "N"]

    def __post_init__(self) -> None:
        super().__post_init__()
        check_rate(self.sample_rate_hz)
        trials = self.trials.reset_index(drop=True).copy()
        object.__setattr__(self, "trials", trials)
        for column in ("trial", "condition"):
            if column not in trials:
                raise RecordError("no such column in the trial table", column=column)
        if len(trials) == 0:
            raise RecordError("no trials", expected="one row per trial")
        if trials["trial"].duplicated().any():
            twice = trials["trial"][trials["trial"].duplicated()].iloc[0]
            raise RecordError(f"trial {twice} appears twice in the trial table")
        _check_numbers(trials)
        expect_shape("offsets", self.offsets, (len(trials) + 1,))
        if self.offsets[0] != 0 or (np.diff(self.offsets) <= 0).any():
            raise RecordError("a trial has no samples", expected="rising offsets from 0")
        expect_shape("time_s", self.time_s, (int(self.offsets[-1]),))

    @property
    def n_trials(self) -> int:
        """Number of trials T."""
        return len(self.trials)

    def __repr__(self) -> str:
        seconds = len(self.time_s) / self.sample_rate_hz
        conditions = list(dict.fromkeys(map(str, self.trials["condition"])))
        shown = ", ".join(conditions[:MOST_SHOWN])
        hidden = len(conditions) - MOST_SHOWN
        trials = "1 trial" if self.n_trials == 1 else f"{self.n_trials} trials"
        return (
            f"{type(self).__name__} of {trials}, {seconds:.1f} s at "
            f"{self.sample_rate_hz:g} Hz\nconditions: {shown}"
            + (f", ... and {hidden} more" if hidden > 0 else "")
        )

    def _repr_html_(self) -> str:
        return "".join(f"<p>{escape(line)}</p>" for line in repr(self).splitlines())

    def samples_of(self, row: int) -> slice:
        """The samples of the trial in row `row` (from 0) of the trial table."""
        return slice(int(self.offsets[row]), int(self.offsets[row + 1]))

    def _chosen(self, rows: Sequence[int] | ArrayLike) -> tuple[IntArray, dict[str, Any]]:
        """Sample numbers of some trials (row numbers from 0, or a mask), and the changed fields."""
        chosen = np.arange(self.n_trials)[np.asarray(rows)]
        parts = trial_slices(self.offsets)
        samples = [np.arange(parts[r].start, parts[r].stop) for r in chosen]
        index = np.concatenate(samples or [np.arange(0)])
        offsets = np.concatenate([[0], np.cumsum(np.diff(self.offsets)[chosen])])
        trials = self.trials.iloc[chosen]
        return index, {"trials": trials, "offsets": offsets, "time_s": self.time_s[index]}


def _check_numbers(trials: pd.DataFrame) -> None:
    """Refuse a text, an infinity or an absurd number in a column of numbers."""
    for column in trials.columns:
        if not _NUMBERS.fullmatch(str(column)):
            continue
        numbers = pd.to_numeric(trials[column], errors="coerce").to_numpy(dtype=float)
        wrong = (np.isnan(numbers) & trials[column].notna()) | (np.abs(numbers) >= LARGEST)
        if wrong.any():
            row = int(np.flatnonzero(wrong)[0])
            trial, value = trials["trial"].iloc[row], trials[column].iloc[row]
            what = f"trial {trial}: {str(value)!r}"
            raise RecordError(what, column=str(column), expected="a number, or nothing")


def check_rate(rate_hz: float) -> None:
    """Refuse a sample rate outside the possible range."""
    if not 1e-6 <= rate_hz <= 1e9:
        raise RecordError(f"sample rate {rate_hz:g} Hz", expected="0.000001 to 1e9 Hz")


def expect_shape(name: str, array: np.ndarray, shape: tuple[int, ...]) -> None:
    """Refuse an array whose shape does not agree with other fields of its record."""
    if array.shape != shape:
        raise RecordError(f"{name} has shape {array.shape}", expected=f"shape {shape}")
