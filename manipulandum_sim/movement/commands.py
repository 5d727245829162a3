"""Small random forces or displacements throughout a reach, each trial with a course of its own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from manipulandum_sim.movement.pushes import Push

#: Frequencies of a course (Hz), of equal size.
FREQUENCIES_HZ: Final = tuple(np.arange(1.0, 17.0, 1.5).tolist())
#: Draws from 0 to 1 of one trial: a phase for each axis and frequency.
N_PHASES: Final = 2 * len(FREQUENCIES_HZ)

_OMEGA: Final = 2 * np.pi * np.array(FREQUENCIES_HZ)[:, None]


@dataclass(frozen=True)
class Commands:
    """Courses of T trials.

    Attributes
    ----------
    push : Push
        Of kind "random" or "random servo": rms on each axis, and how long it lasts.
    phase : (2, F, T)
        rad.
    """

    push: Push
    phase: FloatArray

    @classmethod
    def drawn(cls, push: Push, draws: FloatArray) -> Commands:
        """From uniform draws (`N_PHASES`, T)."""
        return cls(push, 2 * np.pi * draws.reshape(2, -1, draws.shape[-1]))

    def value(self, lag_s: FloatArray) -> FloatArray:
        """Force (N) or displacement (m), (2, T), at times (T,) from the onset; NaN is before."""
        course = np.cos(self._angle(lag_s)).sum(axis=1)
        return np.asarray(self.push.hold(lag_s) * self._size * course)

    def rate(self, lag_s: FloatArray) -> FloatArray:
        """Its rate of change (2, T), the beginning and the end left out."""
        course = -(_OMEGA * np.sin(self._angle(lag_s))).sum(axis=1)
        return np.asarray(self.push.hold(lag_s) * self._size * course)

    def _angle(self, lag_s: FloatArray) -> FloatArray:
        return np.asarray(_OMEGA * np.nan_to_num(lag_s) + self.phase)

    @property
    def _size(self) -> float:
        return float(self.push.size * np.sqrt(2 / len(FREQUENCIES_HZ)))
