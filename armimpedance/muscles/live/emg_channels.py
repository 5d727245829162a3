"""From EMG, one sample at a time, to activation; channels that cannot be believed are lost."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.signal import butter

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.core.errors import InputError
from armimpedance.muscles.live.activity import UNKNOWN, Activity, HeldActivity
from armimpedance.muscles.live.clock import Tick
from armimpedance.muscles.live.emg_faults import WINDOW_S, EmgFaults
from armimpedance.muscles.live.emg_levels import CUTOFF_HZ, ORDER, EmgLevels
from armimpedance.muscles.live.form import StiffnessForm
from armimpedance.numerics.signals import lowpass_delay_s

#: Offsets of electrodes are taken off below this, Hz.
OFFSET_HZ: Final = 10.0
#: A gap longer than this lets the filters begin anew (s).
LONGEST_GAP_S: Final = 0.1
#: Slower samples hold too little of a raw EMG.
LEAST_RATE_HZ: Final = 500.0


class Biquad:
    """A filter of second order, forward only, over m channels."""

    def __init__(self, b: FloatArray, a: FloatArray, channels: int) -> None:
        self._b, self._a = b, a
        self._state = np.zeros((2, channels))

    def step(self, x: FloatArray) -> FloatArray:
        """The filtered sample (m,)."""
        b, a, state = self._b, self._a, self._state
        y = b[0] * x + state[0]
        state[0] = b[1] * x - a[1] * y + state[1]
        state[1] = b[2] * x - a[2] * y
        return np.asarray(y)

    def settle(self, level: FloatArray, where: BoolArray) -> None:
        """Make these channels what they are after a constant input long enough, at 0 Hz."""
        gain = self._b.sum() / self._a.sum()
        second = (self._b[2] - self._a[2] * gain) * level
        first = (self._b[1] - self._a[1] * gain) * level + second
        self._state = np.where(where, np.stack([first, second]), self._state)


class EmgChannels:
    """Samples that hold raw EMG or its envelope, in V.

    Offset off (high-pass of order 2 at 10 Hz), rectified, Butterworth low-pass of order 2 at 3.5 Hz
    forward only; an envelope is taken as it is. Noise at rest is taken off in squares.

    Parameters
    ----------
    form : StiffnessForm
    levels : EmgLevels
    rate_hz : float
    raw : bool
        False: an envelope, whose own delay nobody knows here.

    Raises
    ------
    InputError
        Levels of another number of muscles, or raw EMG that is too slow.
    """

    def __init__(
        self,
        form: StiffnessForm,
        levels: EmgLevels,
        rate_hz: float,
        *,
        raw: bool,
    ) -> None:
        if len(levels.maximum_V) != len(form.muscles):
            raise InputError(f"{len(levels.maximum_V)} levels", expected=f"{len(form.muscles)}")
        if raw and rate_hz < LEAST_RATE_HZ:
            raise InputError(f"raw EMG at {rate_hz:g} Hz", expected=f"{LEAST_RATE_HZ:g} or more")
        self._muscles, self._highest, self._levels = form.muscles, form.highest, levels
        self._rate, self._raw = rate_hz, raw
        self.signal = "emg_V" if raw else "envelope_V"
        self.delay_s = lowpass_delay_s(CUTOFF_HZ, rate_hz, ORDER) if raw else 0.0
        self._high = butter(2, OFFSET_HZ, "highpass", fs=rate_hz) if raw else None
        self._low = butter(ORDER, CUTOFF_HZ, fs=rate_hz) if raw else None
        # until then the envelope is the mean of what there is
        self._warm = round(rate_hz / (2 * CUTOFF_HZ)) if raw else 0
        self.reset()

    def reset(self) -> None:
        """Forget all samples."""
        m = len(self._muscles)
        self._held = HeldActivity(self._highest)
        self._faults = EmgFaults(self._levels, self._rate, raw=self._raw)
        if self._high is not None and self._low is not None:
            self._highpass, self._lowpass = Biquad(*self._high, m), Biquad(*self._low, m)
        self._count, self._sum = 0, np.zeros(m)
        self._faulty, self._last = np.zeros(m, dtype=bool), np.zeros(m)
        # envelopes of the last tenth of a second, every hundredth: what was there before a fault
        # was seen
        self._every = max(round(self._rate / 100), 1)
        self._before = np.zeros((round(100 * WINDOW_S) + 2, m))

    def take(self, values: FloatArray, sd: FloatArray, tick: Tick) -> Activity:
        """The activations at a sample; `sd` (m,) is added to what the carrier's noise is."""
        if tick.step_s > LONGEST_GAP_S and self._count:
            self.reset()
        missing = np.isnan(values)
        values = self._last = np.where(missing, self._last, values)
        amplitude, band = self._amplitude(values, missing)
        why = self._faults.look(values, band)
        self._put_back(why != 0)
        lost = missing | self._faulty
        self._remember(amplitude, lost)
        alpha, noise = self._levels.activation(np.maximum(amplitude, 0.0))
        # of an envelope nobody knows here how it was made
        sd = np.hypot(sd, noise) if self._raw else sd
        settling = self._count <= self._warm
        if settling:
            sd = np.hypot(sd, UNKNOWN * self._highest * (1 - self._count / self._warm))
        alpha, sd = self._held.take(alpha, sd, lost, tick.step_s)
        flags = [
            f"{self._faults.name(int(why[i])) if why[i] else 'lost'}: {self._muscles[i]}"
            for i in np.flatnonzero(lost)
        ]
        return Activity(alpha, sd, flags + ["settling"] * settling)

    def _amplitude(self, values: FloatArray, missing: BoolArray) -> tuple[FloatArray, FloatArray]:
        """Envelope (m,) and the EMG without its offset (m,)."""
        self._count += 1
        if not self._raw:
            return values, values
        if self._count == 1:
            self._highpass_offset(values)
        band = self._highpass.step(values)
        rectified = np.abs(band)
        if self._count <= self._warm:
            self._sum += rectified
            mean = self._sum / self._count
            if self._count == self._warm:
                self._lowpass.settle(mean, np.ones(len(mean), dtype=bool))
            return mean, band
        # a channel that is lost feeds its own envelope: it stays where it is
        fed = np.where(self._faulty | missing, self._before[0], rectified)
        return np.maximum(self._lowpass.step(fed), 0.0), band

    def _highpass_offset(self, first: FloatArray) -> None:
        """Begin as if the first sample were the electrodes' offset."""
        self._highpass.settle(first, np.ones(len(first), dtype=bool))

    def _put_back(self, faulty: BoolArray) -> None:
        """Set channels that are faulty from now on back to before the fault began."""
        new = faulty & ~self._faulty
        self._faulty = faulty
        if not new.any() or self._count <= self._warm:
            return
        if self._raw:
            self._lowpass.settle(self._before[-1], new)
        self._held.put_back(self._levels.activation(self._before[-1])[0], new)
        self._before[:, new] = self._before[-1, new]

    def _remember(self, amplitude: FloatArray, lost: BoolArray) -> None:
        if self._count == 1:
            self._before[:] = amplitude
        if self._count % self._every == 0:
            kept = np.where(lost, self._before[0], amplitude)
            self._before = np.vstack([kept, self._before[:-1]])
