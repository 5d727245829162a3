"""The reflex's signal: the velocity of a while ago, linear or rectified, behind a low-pass."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.elbow.cascade.rows import CascadeRows

Side = Literal["both", "positive", "negative"]
SIDES: Final[tuple[Side, ...]] = ("both", "positive", "negative")
ORDERS: Final = (1, 2)
#: A velocity of so long ago at most is looked at, s.
PAD_S: Final = 1.0
#: Time constants of the low-pass after which less than a two-hundredth is left.
FORGOTTEN: Final = 8.0


@dataclass(frozen=True)
class Pathway:
    """A reflex but for its gain.

    Attributes
    ----------
    delay_s : float
    cutoff_hz : float
        Of the low-pass, whose poles are all alike.
    order : int
    side : {"both", "positive", "negative"}
        Which velocities it answers.
    """

    delay_s: float
    cutoff_hz: float
    order: int = 2
    side: Side = "both"

    @property
    def lead_s(self) -> float:
        """Time after which what was before the record is forgotten, s."""
        return min(self.delay_s + FORGOTTEN / (2 * np.pi * self.cutoff_hz), PAD_S)

    def signal(self, rows: CascadeRows) -> FloatArray:
        """Its answer to the motion at gain one, (N,) rad/s."""
        out = np.empty(len(rows.torque))
        for row in range(len(rows.offsets) - 1):
            inside = rows.trial(row)
            out[inside] = self.of_rate(rows.motion[inside, 1], rows.rate_hz)
        return out

    def of_rate(self, rate: FloatArray, rate_hz: float) -> FloatArray:
        """Its answer to an angular velocity (S,) that was nothing before, (S,) rad/s."""
        if self.side == "positive":
            rate = np.maximum(rate, 0)
        elif self.side == "negative":
            rate = np.minimum(rate, 0)
        count = _fast(len(rate) + round(PAD_S * rate_hz))
        s = 2j * np.pi * np.fft.rfftfreq(count, 1 / rate_hz)
        lag = (1 + s / (2 * np.pi * self.cutoff_hz)) ** -float(self.order)
        late = np.fft.rfft(rate, count) * lag * np.exp(-s * self.delay_s)
        return np.asarray(np.fft.irfft(late, count)[: len(rate)])


def _fast(count: int) -> int:
    from scipy.fft import next_fast_len

    return int(next_fast_len(count, real=True))
