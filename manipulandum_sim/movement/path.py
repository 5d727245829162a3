"""Where the reaching hand means to be: a minimum-jerk course that differs from trial to trial."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError

#: Numbers that make one trial differ from the others: onset, duration, amplitude, three bows.
N_DRAWS: Final = 6


@dataclass(frozen=True)
class Variability:
    """Variability between trials of one person, as standard deviations.

    Attributes
    ----------
    onset_s : float
        Onset of the movement after the go signal.
    duration, amplitude : float
        As fractions.
    aside_m : triple of float
        Across the line of the reach: at its end, and two bows on the way.
    force_n, force_time_s : float
        Slow force of the hand's own (Ornstein-Uhlenbeck) and its time constant.
    """

    onset_s: float = 0.015
    duration: float = 0.04
    amplitude: float = 0.02
    aside_m: tuple[float, float, float] = (0.004, 0.005, 0.002)
    force_n: float = 0.3
    force_time_s: float = 0.15

    def times(self, factor: float) -> Variability:
        """All of it this many times as large, the onset apart."""
        aside = (factor * self.aside_m[0], factor * self.aside_m[1], factor * self.aside_m[2])
        return Variability(
            self.onset_s,
            factor * self.duration,
            factor * self.amplitude,
            aside,
            factor * self.force_n,
            self.force_time_s,
        )


class Motion2(NamedTuple):
    """Position, velocity and acceleration of the hand, each (2, T)."""

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


@dataclass(frozen=True)
class ReachLine:
    """The line of a reach.

    Attributes
    ----------
    start_m, end_m : pair of float
        From the shoulder.
    duration_s : float
    """

    start_m: tuple[float, float] = (-0.05, 0.27)
    end_m: tuple[float, float] = (-0.05, 0.52)
    duration_s: float = 0.7

    def __post_init__(self) -> None:
        if not (self.duration_s > 0 and self.length_m > 0):
            raise InputError(
                f"a reach of {self.length_m:g} m in {self.duration_s:g} s", expected="more than 0"
            )

    @property
    def length_m(self) -> float:
        """From start to end."""
        return float(np.hypot(*(np.subtract(self.end_m, self.start_m))))

    @property
    def along(self) -> FloatArray:
        """Unit vector (2,) of the reach."""
        return np.asarray(np.subtract(self.end_m, self.start_m) / self.length_m)

    @property
    def aside(self) -> FloatArray:
        """Unit vector (2,) a quarter turn to the left of the reach."""
        x, y = self.along
        return np.array([-y, x])


@dataclass(frozen=True)
class Courses:
    """The intended courses of T trials.

    Attributes
    ----------
    line : ReachLine
    onset_s : (T,)
        On the trials' clock.
    duration_s, amplitude : (T,)
        `amplitude` as a fraction of the line's length.
    aside_m : (3, T)
    """

    line: ReachLine
    onset_s: FloatArray
    duration_s: FloatArray
    amplitude: FloatArray
    aside_m: FloatArray

    @classmethod
    def drawn(
        cls, line: ReachLine, go_s: float, variability: Variability, draws: FloatArray
    ) -> Courses:
        """Courses of trials with standard normal numbers (N_DRAWS, T)."""
        v = variability
        return cls(
            line,
            go_s + v.onset_s * draws[0],
            line.duration_s * (1 + v.duration * draws[1]),
            1 + v.amplitude * draws[2],
            np.array(v.aside_m)[:, None] * draws[3:6],
        )

    @classmethod
    def nominal(cls, line: ReachLine, go_s: float, trials: int = 1) -> Courses:
        """The course that all trials would take without any variability."""
        return cls.drawn(line, go_s, Variability(), np.zeros((N_DRAWS, trials)))

    def at(self, time_s: FloatArray | float) -> Motion2:
        """Motion (2, T) at times (T,) of the trials' clocks, or at one time of all."""
        u = np.clip((time_s - self.onset_s) / self.duration_s, 0.0, 1.0)
        s, ds, dds = minimum_jerk(u)
        ds, dds = ds / self.duration_s, dds / self.duration_s**2
        f, df, ddf = self._bows(s)
        position = np.array(self.line.start_m)[:, None] + f
        return Motion2(position, df * ds, ddf * ds**2 + df * dds)

    def _bows(self, s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Place from the start over the travelled share s, its slope and curvature, (2, T)."""
        along = self.line.along[:, None] * self.line.length_m * self.amplitude
        side, turn = self.line.aside[:, None], np.pi * np.arange(1, 3)[:, None]
        end, bows = self.aside_m[0], self.aside_m[1:]
        sine, cosine = np.sin(turn * s), np.cos(turn * s)
        f = along * s + side * (end * s + (bows * sine).sum(axis=0))
        df = along + side * (end + (bows * turn * cosine).sum(axis=0))
        ddf = -side * (bows * turn**2 * sine).sum(axis=0)
        return f, df, ddf


def minimum_jerk(u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Travelled share over the share of the duration u, with two derivatives by u.

    Flash and Hogan 1985: ``10 u^3 - 15 u^4 + 6 u^5``.
    """
    s = u**3 * (10 - 15 * u + 6 * u**2)
    ds = 30 * u**2 * (1 - u) ** 2
    dds = 60 * u * (1 - u) * (1 - 2 * u)
    return s, ds, dds
