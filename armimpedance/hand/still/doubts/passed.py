"""Delay or low-pass that one channel passed and the other did not."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.records import Recording, Window
from armimpedance.numerics.signals import delayed

Channel = Literal["force", "position"]
Way = Literal["late", "low-pass", "zero-phase"]
CHANNELS: Final[tuple[Channel, ...]] = ("force", "position")
#: Position signals filtered more than this cannot be corrected (s, Hz), because the motion that
#: identifies the filter is lost. Measured: a filter of 15 Hz without phase is corrected, one of 12
#: Hz is not; a low-pass with phase of 50 Hz is corrected, one of 20 Hz looks like a delay of 9 ms.
LOST: Final = {"late": 6e-3, "low-pass": 40.0, "zero-phase": 14.0}


@dataclass(frozen=True)
class Passed:
    """Delay or low-pass that one channel passed and the other did not.

    `value`: the delay (s) of "late", else the corner (Hz). `order`: of the low-pass; 0 for a delay.
    """

    channel: Channel
    way: Way
    order: int
    value: float

    def of(self, signal: FloatArray, rate_hz: float) -> FloatArray:
        """Filter a signal (..., S, d) that begins at rest."""
        return np.moveaxis(self.of_rows(np.moveaxis(signal, -1, -2), rate_hz), -1, -2)

    def of_rows(self, signal: FloatArray, rate_hz: float) -> FloatArray:
        """Filter a signal (..., S) whose last axis is time."""
        if self.is_nothing:
            return signal
        if self.way == "late":
            return delayed(signal, self.value * rate_hz)
        from scipy.signal import sosfilt, sosfiltfilt

        sos, at_rest = _low_pass(self.order, self.value, rate_hz)
        if self.way == "zero-phase":
            return np.asarray(sosfiltfilt(sos, signal))
        state = at_rest.reshape(len(sos), *(1,) * (signal.ndim - 1), 2)
        return np.asarray(sosfilt(sos, signal, zi=state * signal[..., :1])[0])

    def through(self, window: Window) -> Window:
        """Filter the other channel of a window."""
        values = self.of(getattr(window, self.other), window.sample_rate_hz)
        if self.other == "position":
            return replace(window, position=values)
        return replace(window, force=values)

    def alike(self, recording: Recording) -> Recording:
        """Filter the other channel of a recording, trial by trial."""
        values = np.array(getattr(recording, self.other))
        for row in range(recording.n_trials):
            at = recording.samples_of(row)
            values[at] = self.of(values[at], recording.sample_rate_hz)
        changed = {self.other: values, "force_lowpass_hz": None}
        return replace(recording, **changed)  # type: ignore[arg-type]

    @property
    def other(self) -> Channel:
        """The channel that is not filtered."""
        return "position" if self.channel == "force" else "force"

    @property
    def is_lost(self) -> bool:
        """True if too little of the motion remains to correct the filter."""
        beyond = LOST[self.way] < self.value if self.way == "late" else self.value < LOST[self.way]
        return self.channel == "position" and beyond

    @property
    def is_nothing(self) -> bool:
        """True if it leaves a signal unchanged."""
        return self.way == "late" and self.value == 0

    @property
    def words(self) -> str:
        """Description for messages."""
        if self.way == "late":
            return f"{1e3 * self.value:.3g} ms late"
        phase = " without phase" if self.way == "zero-phase" else ""
        return f"through a low-pass{phase} of order {self.order} at {self.value:.3g} Hz"


@lru_cache(maxsize=256)
def _low_pass(order: int, corner_hz: float, rate_hz: float) -> tuple[FloatArray, FloatArray]:
    """Second-order sections of a Butterworth filter, and their state after a long constant 1."""
    from scipy.signal import butter, sosfilt_zi

    sections = np.asarray(butter(order, corner_hz, fs=rate_hz, output="sos"))
    return sections, np.asarray(sosfilt_zi(sections))
