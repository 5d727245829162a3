"""Small random forces throughout a reach, each trial with a course of its own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.arrays import FloatArray
from manipulandum_sim.movement.pushes import Push

#: Frequencies of a course (Hz), of equal size.
FREQUENCIES_HZ: Final = tuple(np.arange(1.0, 17.0, 1.5).tolist())
#: Draws from 0 to 1 of one trial: a phase for each axis and frequency.
N_PHASES: Final = 2 * len(FREQUENCIES_HZ)


@dataclass(frozen=True)
class Commands:
    """Courses of T trials.

    Attributes
    ----------
    push : Push
        Of kind "random": rms force on each axis, and how long it lasts.
    phase : (2, F, T)
        rad.
    """

    push: Push
    phase: FloatArray

    @classmethod
    def drawn(cls, push: Push, draws: FloatArray) -> Commands:
        """From uniform draws (`N_PHASES`, T)."""
        return cls(push, 2 * np.pi * draws.reshape(2, -1, draws.shape[-1]))

    def force(self, lag_s: FloatArray) -> FloatArray:
        """Force (2, T) of the robot on the hand at times (T,) from the onset; NaN is before."""
        omega = 2 * np.pi * np.array(FREQUENCIES_HZ)[:, None]
        lag = np.nan_to_num(lag_s)
        course = np.cos(omega * lag + self.phase).sum(axis=1)
        size = self.push.size * np.sqrt(2 / len(FREQUENCIES_HZ))
        return np.asarray(self.push.hold(lag_s) * size * course)
