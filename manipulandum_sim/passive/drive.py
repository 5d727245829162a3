"""The examiner's part in the two tests: the prescribed motion of trunk and shoulder.

``p5``: the standing patient's shoulders are pushed round now and then; the trunk swings back
about the vertical axis, sways a little all the time, and the arms follow freely. ``release``: the
upper arm is held level to the back, the forearm hangs down, is lifted and let go.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.skeleton import Skeleton
from manipulandum_sim.passive.chain import base_motion

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

Test = Literal["p5", "release"]

#: Height of the hips' centre above the floor, fraction of the body's height (Winter, Fig. 4.1).
HIP_HEIGHT: Final = 0.530
#: Distance of the splines' knots, s.
KNOT_S: Final = 0.01
DEGREE: Final = 5


@dataclass(frozen=True)
class Push:
    """The examiner's pushes; ranges of uniform draws.

    Attributes
    ----------
    every_s : (float, float)
        From one push to the next.
    yaw_rad : (float, float)
        Amplitude of the trunk's swing about the vertical axis.
    swing_hz, damping : float
        Frequency and damping of that swing.
    rise_s : float
        Time in which a push builds up.
    sway_m, sway_rad : float
        Sd of the small sway of place and turns.
    """

    every_s: tuple[float, float] = (2.0, 3.5)
    yaw_rad: tuple[float, float] = (0.11, 0.22)
    swing_hz: float = 1.3
    damping: float = 0.25
    rise_s: float = 0.10
    sway_m: float = 0.004
    sway_rad: float = 0.006


@dataclass(frozen=True)
class Drive:
    """Prescribed coordinates of T trials as a spline in time; the base is the last such segment."""

    skeleton: Skeleton
    base: str
    spline: BSpline

    def at(self, times: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Coordinates and two derivatives (N, T, P) at times (N,)."""
        return self.spline(times), self.spline(times, nu=1), self.spline(times, nu=2)

    def base_motion(self, times: FloatArray) -> FloatArray:
        """The same as `passive_chain.base_motion`, (N, T, 3, 12)."""
        q, qd, qdd = self.at(times)
        flat = [part.reshape(-1, part.shape[2]) for part in (q, qd, qdd)]
        return base_motion(self.skeleton, self.base, *flat).reshape(*q.shape[:2], 3, 12)


def shaken(
    skeleton: Skeleton,
    height_m: float,
    keys: list[np.random.SeedSequence],
    span_s: tuple[float, float],
    push: Push,
) -> Drive:
    """The trunk of each trial in test ``p5``."""
    times = _knots(span_s)
    motion = np.zeros((len(times), len(keys), 6))
    for trial, key in enumerate(keys):
        rng = np.random.default_rng(key)
        yaw = _pushes(rng, times, push)
        sway = _sway(rng, times, 6)
        motion[:, trial] = sway * np.repeat([push.sway_m, push.sway_rad], 3)
        motion[:, trial, 3] += yaw
        # the pushed trunk leans and shifts a little with its turn
        motion[:, trial, :3] += yaw[:, None] * rng.normal(0, [0.02, 0.05, 0.0])
        motion[:, trial, 4:] += yaw[:, None] * rng.normal(0, 0.06, 2)
    motion[..., 2] += HIP_HEIGHT * height_m
    return _drive(skeleton, "trunk", times, motion)


def held(skeleton: Skeleton, height_m: float, trials: int, span_s: tuple[float, float]) -> Drive:
    """The upper arm of test ``release``: level to the back, at rest."""
    times = _knots(span_s)
    motion = np.zeros((len(times), trials, 9))
    motion[..., 2] = HIP_HEIGHT * height_m
    motion[..., 6] = -np.pi / 2
    return _drive(skeleton, "right_upper_arm", times, motion)


def _knots(span_s: tuple[float, float]) -> FloatArray:
    start, end = span_s
    count = int(np.ceil((end - start) / KNOT_S)) + 2 * DEGREE
    return np.asarray(start + KNOT_S * (np.arange(count) - DEGREE), dtype=np.float64)


def _drive(skeleton: Skeleton, base: str, times: FloatArray, motion: FloatArray) -> Drive:
    from scipy.interpolate import make_interp_spline

    return Drive(skeleton, base, make_interp_spline(times, motion, k=DEGREE))


def _pushes(rng: np.random.Generator, times: FloatArray, push: Push) -> FloatArray:
    """The trunk's yaw (N,): a damped swing after every push."""
    omega = 2 * np.pi * push.swing_hz
    yaw: FloatArray = np.zeros(len(times))
    moment, side = times[0] + rng.uniform(0.2, 0.8), rng.choice([-1.0, 1.0])
    while moment < times[-1]:
        t = np.maximum(times - moment, 0.0)
        rise = 1 - np.exp(-((t / push.rise_s) ** 4))
        swing = np.sin(np.sqrt(1 - push.damping**2) * omega * t)
        yaw += side * rng.uniform(*push.yaw_rad) * rise * np.exp(-push.damping * omega * t) * swing
        moment, side = moment + rng.uniform(*push.every_s), -side
    return yaw


def _sway(rng: np.random.Generator, times: FloatArray, count: int) -> FloatArray:
    """Quasi-periodic motion (N, count) of unit sd: six sines from 0.2 to 1.6 Hz each."""
    hertz = rng.uniform(0.2, 1.6, (6, count))
    phase = rng.uniform(0, 2 * np.pi, (6, count))
    waves = np.sin(2 * np.pi * hertz * times[:, None, None] + phase)
    return np.asarray(waves.sum(axis=1) / np.sqrt(3), dtype=np.float64)
