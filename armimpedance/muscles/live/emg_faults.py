"""Signs that an EMG is none: an electrode that was pulled, an amplifier at its end.

Every few milliseconds the last 80 ms of each channel are looked at, so that a fault is seen within
100 ms of its beginning.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, IntArray
from armimpedance.muscles.live.emg_levels import EmgLevels
from armimpedance.numerics.signals import LastRows

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

    Parameters
    ----------
    levels : EmgLevels
    rate_hz : float
    raw : bool
        False: envelopes, of which less can be seen.
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
        """What a number that `look` gives means."""
        return _NAMES[number]

    def look(self, values: FloatArray, band: FloatArray) -> IntArray:
        """Take a sample; the number of each channel's fault (m,), 0 where there is none.

        Parameters
        ----------
        values, band : (m,)
            As they came (the last one where a channel dropped out), and without their offset.
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
        """Whether each channel (m,) repeats itself with a period of the mains."""
        found = np.zeros(band.shape[1], dtype=bool)
        for period in self._periods:
            now = band[2 * period :]
            power = (now**2).sum(axis=0)
            alike = np.ones(band.shape[1], dtype=bool)
            for lag in (period, 2 * period):
                then = band[2 * period - lag : len(band) - lag]
                size = np.sqrt(power * (then**2).sum(axis=0))
                alike &= (now * then).sum(axis=0) > HUM * np.maximum(size, 1e-300)
            found |= alike
        return found

    def _moves(self, raw: FloatArray, band: FloatArray) -> BoolArray:
        """Whether what is below the band is larger than the EMG: an electrode is moved."""
        slow = raw - band - self._offset
        least = np.maximum(np.sqrt((band**2).mean(axis=0)), 0.1 * self._levels.maximum_V)
        return np.asarray(np.sqrt((slow**2).mean(axis=0)) > MOVING * least)
