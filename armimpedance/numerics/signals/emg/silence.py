"""Check that muscles were silent in a passive test, by their EMG (Venture elbow, section IV-C)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
import pandas as pd

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import InputError, check_number
from armimpedance.core.motion import EmgSignals
from armimpedance.core.records import Recording
from armimpedance.numerics.signals.emg.activation import envelope, mvc_column


@dataclass(frozen=True)
class EmgLevel(FrozenRecord):
    """Activity of the muscles; T trials, m muscles. Its text is one sentence.

    Attributes
    ----------
    muscles : tuple of m str
    mean_percent : (T, m)
        Mean over the trial in % of the maximum.
    highest_percent : (T, m)
        The highest mean over a second, in % of the maximum.
    limit_percent : float
        Largest mean over a second that counts as silent, % of the maximum.
    envelope_hz : float
        Low-pass of the rectified EMG, the source's: second-order Butterworth forward and backward.
    window_s : float
        Length of the mean that must stay below the limit, s.
    """

    muscles: Annotated[tuple[str, ...], "m"]
    mean_percent: Annotated[FloatArray, "T m"]
    highest_percent: Annotated[FloatArray, "T m"]
    limit_percent: float
    envelope_hz: ClassVar[float] = 6.0
    window_s: ClassVar[float] = 1.0

    def to_dict(self) -> dict[str, Any]:
        """Return plain texts and numbers for FIT.json."""
        return {
            "muscles": list(self.muscles),
            "mean_percent": self.mean_percent.tolist(),
            "highest_percent": self.highest_percent.tolist(),
            "limit_percent": self.limit_percent,
        }

    def __str__(self) -> str:
        shown = ", ".join(
            f"{muscle} {mean:.1f} %"
            for muscle, mean in zip(self.muscles, self.mean_percent.mean(axis=0), strict=True)
        )
        return f"EMG: {shown} of the maximum, below the gate of {self.limit_percent:g} %"


def emg_gate(emg: EmgSignals, trials: pd.DataFrame, *, limit_percent: float = 3.0) -> EmgLevel:
    """Refuse a test in which a muscle was active over any one second.

    In the source, passive muscles are at about 2 % of the maximum, noise of the electrodes
    included, and the envelopes vary by about half of that. A limit of 3 % accepts such a test. It
    refuses a muscle that adds 2 % to an electrode's noise of 2 % (squares add: 2.8 %) for longer
    than by chance.

    Parameters
    ----------
    emg : EmgSignals
    trials : DataFrame (T rows)
        Table with the column ``trial``, and with ``mvc_<muscle>_V`` if the EMG is in V.
    limit_percent : float
        The limit in % of the maximum.

    Returns
    -------
    EmgLevel

    Raises
    ------
    InputError
        A muscle is above the limit (the message names muscle, trial, time and level); EMG in V has
        no maximum; a trial is too short for the envelope; or the numbers of trials differ.
    """
    check_number(limit_percent, f"gate at {limit_percent} %", above=0)
    if len(emg.offsets) != len(trials) + 1:
        raise InputError(f"EMG of {len(emg.offsets) - 1} trials", expected=f"{len(trials)}")
    maxima = _maxima(emg, trials)
    mean, highest = np.zeros((2, len(trials), len(emg.muscles)))
    for t, number in enumerate(trials["trial"]):
        raw = emg.signals[emg.offsets[t] : emg.offsets[t + 1]]
        level = 100 * _envelope(raw, emg.sample_rate_hz, number) / maxima[t]
        means = _window_means(level, emg.sample_rate_hz)
        mean[t], highest[t] = level.mean(axis=0), means.max(axis=0)
        worst = int(highest[t].argmax())
        if highest[t, worst] > limit_percent:
            seconds = float(means[:, worst].argmax()) / emg.sample_rate_hz
            raise InputError(
                f"trial {number}: {emg.muscles[worst]} at {highest[t, worst]:.1f} % of its "
                f"maximum from {seconds:.2f} s on for {EmgLevel.window_s:g} s",
                expected=f"a relaxed muscle, below {limit_percent:g} %",
            )
    return EmgLevel(emg.muscles, mean, highest, limit_percent)


def recorded_emg(recording: Recording) -> EmgSignals | None:
    """Return the EMG of a recording of angle and torque; None if there is none.

    Parameters
    ----------
    recording : Recording

    Returns
    -------
    EmgSignals or None
        At the recording's rate and in its unit.
    """
    if recording.emg is None:
        return None
    return EmgSignals(
        recording.sample_rate_hz,
        recording.offsets,
        recording.emg,
        recording.muscles,
        recording.emg_unit,
    )


def _maxima(emg: EmgSignals, trials: pd.DataFrame) -> FloatArray:
    """Rectified EMG in the maximum contraction, (T, m), in the unit of the signals."""
    if emg.unit == "normalised":
        return np.ones((len(trials), len(emg.muscles)))
    columns = [mvc_column(muscle) for muscle in emg.muscles]
    for column in columns:
        if column not in trials:
            raise InputError(
                "EMG in V without its maximum", column=column, expected="in the trial table"
            )
    maxima = trials[columns].to_numpy(dtype=np.float64)
    if not (np.isfinite(maxima).all() and (maxima > 0).all()):
        bad = columns[int(np.argwhere(~(maxima > 0))[0, 1])]
        raise InputError("a maximum that is not positive", column=bad, expected="V")
    return maxima


def _envelope(raw: FloatArray, rate_hz: float, trial: object) -> FloatArray:
    """Rectified and smoothed EMG (S, m)."""
    try:
        return envelope(raw, rate_hz, cutoff_hz=EmgLevel.envelope_hz)
    except InputError as error:
        raise InputError(f"trial {trial}: {error}") from error


def _window_means(level: FloatArray, rate_hz: float) -> FloatArray:
    """Means over `EmgLevel.window_s` from every sample on (., m); of a shorter trial, its mean."""
    width = min(max(round(EmgLevel.window_s * rate_hz), 1), len(level))
    running = np.cumsum(np.vstack([np.zeros(level.shape[1]), level]), axis=0)
    return np.asarray((running[width:] - running[:-width]) / width)
