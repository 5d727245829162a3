"""From EMG, one sample at a time, to activation; channels that cannot be believed are lost."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.signal import butter

from armimpedance.core.arrays import BoolArray, FloatArray, IntArray
from armimpedance.core.errors import InputError
from armimpedance.muscles.live.activity import UNKNOWN, Activity, HeldActivity, Tick
from armimpedance.muscles.live.hand_stiffness import StiffnessForm
from armimpedance.muscles.live.inputs import CUTOFF_HZ, ORDER, EmgLevels
from armimpedance.numerics.signals import LastRows, lowpass_delay_s

# Signs that an EMG is none: an electrode that was pulled, an amplifier at its end.
#
# Every few milliseconds the last 80 ms of each channel are looked at, so that a fault is seen
# within 100 ms of its beginning.

WINDOW_S: Final = 0.08
#: Between looks.
EVERY_S: Final = 0.005
#: A level that does not change for so long comes from no muscle (s).
STUCK_S: Final = 0.04
#: Mean level over the maximum that no muscle reaches.
TOO_LARGE: Final = 1.5
#: Level over that of a silent muscle below which the electrode is not on the skin.
BELOW_REST: Final = 0.5
#: Correlation with what was there one and two periods of the mains ago; and the level over the
#: maximum from which hum matters.
HUM: Final = 0.7
HUMMING: Final = 0.1
MAINS_HZ: Final = (50.0, 60.0)
#: Samples at an extreme beyond the maximum that are no chance.
AT_EXTREME: Final = 5
#: rms of what is below 10 Hz, over the larger of a tenth of the maximum and the EMG itself.
MOVING: Final = 1.0

_NAMES: Final = (
    "",
    "stuck",
    "saturated",
    "too large",
    "below rest: off the skin?",
    "hum: off the skin?",
    "electrode moves",
)


class EmgFaults:
    """Looks at the last samples of m channels.

    `raw`: False: envelopes, of which less can be seen.
    """

    def __init__(self, levels: EmgLevels, rate_hz: float, *, raw: bool) -> None:
        self._levels, self._raw, m = levels, raw, len(levels.maximum_V)
        self._length = max(round(WINDOW_S * rate_hz), 4)
        self._still = max(round(STUCK_S * rate_hz), 3)
        self._every = max(round(EVERY_S * rate_hz), 1)
        self._rows = LastRows(self._length, 2 * m)
        periods = [round(rate_hz / hz) for hz in MAINS_HZ]
        self._periods = [p for p in periods if 2 * p < self._length]
        self._offset = np.zeros(m)
        self._slow = min(1 / rate_hz, 1.0)
        self._seen = 0
        self._why = np.zeros(m, dtype=np.int64)

    @staticmethod
    def name(number: int) -> str:
        """The meaning of a number that `look` returns."""
        return _NAMES[number]

    def look(self, values: FloatArray, band: FloatArray) -> IntArray:
        """Take a sample; the number of each channel's fault (m,), 0 where there is none.

        `values`, `band` (m,): as they came (the last one where a channel dropped out), and without
        their offset.
        """
        m = len(values)
        self._seen += 1
        self._rows.push(np.concatenate([values, band]))
        # a mean at first, then one that forgets within a second
        self._offset += max(self._slow, 1 / self._seen) * (values - self._offset)
        if self._seen % self._every == 0 and self._seen >= self._length:
            rows = self._rows.last(self._length)
            self._why = self._judged(rows[:, :m], rows[:, m:])
        return self._why

    def _judged(self, raw: FloatArray, band: FloatArray) -> IntArray:
        """Number of each channel's fault (m,) from windows (S, m)."""
        maximum, rest = self._levels.maximum_V, self._levels.rest_V
        level, last = np.abs(band).mean(axis=0), raw[-self._still :]
        # of the last ones alone: a filter still rings with what was there before
        quiet = np.abs(last - last.mean(axis=0) if self._raw else last).mean(axis=0)
        faults = [
            np.ptp(last, axis=0) == 0,
            self._saturated(raw),
            level > TOO_LARGE * maximum,
            quiet < BELOW_REST * rest,
        ]
        if self._raw:
            faults += [self._hums(band) & (level > HUMMING * maximum), self._moves(raw, band)]
        # the first that holds
        every = np.array(faults)
        return np.where(every.any(axis=0), every.argmax(axis=0) + 1, 0)

    def _saturated(self, raw: FloatArray) -> BoolArray:
        rail = self._levels.rail_V
        if rail is not None:
            return np.asarray((np.abs(raw) >= rail).sum(axis=0) >= AT_EXTREME)
        # an amplifier whose end is not known: samples heap at the extremes
        far = self._levels.maximum_V
        heaps = []
        for extreme in (raw.max(axis=0), raw.min(axis=0)):
            heaps.append(((raw == extreme).sum(axis=0) >= AT_EXTREME) & (np.abs(extreme) > far))
        return np.asarray(heaps[0] | heaps[1])

    def _hums(self, band: FloatArray) -> BoolArray:
        """True for each channel (m,) that repeats itself with a period of the mains."""
        humming = np.zeros(band.shape[1], dtype=bool)
        for period in self._periods:
            now = band[2 * period :]
            power = (now**2).sum(axis=0)
            alike = np.ones(band.shape[1], dtype=bool)
            for lag in (period, 2 * period):
                then = band[2 * period - lag : len(band) - lag]
                size = np.sqrt(power * (then**2).sum(axis=0))
                alike &= (now * then).sum(axis=0) > HUM * np.maximum(size, 1e-300)
            humming |= alike
        return humming

    def _moves(self, raw: FloatArray, band: FloatArray) -> BoolArray:
        """True for channels whose signal below the band exceeds the EMG: the electrode moves."""
        slow = raw - band - self._offset
        least = np.maximum(np.sqrt((band**2).mean(axis=0)), 0.1 * self._levels.maximum_V)
        return np.asarray(np.sqrt((slow**2).mean(axis=0)) > MOVING * least)


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

    `raw`: False: an envelope, whose own delay nobody knows here.
    Raises InputError: levels of another number of muscles, or raw EMG that is too slow.
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
