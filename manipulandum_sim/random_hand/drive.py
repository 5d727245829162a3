"""Limb, handle and robot move as one, for as long as a command lasts.

    (A + J^T m J) qdd = pull + J^T (F_robot + F_own - m Jdot qd)

with m the mass of robot and handle along each axis. The sensor sits between robot and handle. Of a
joint the same holds about its axes: rad, N m and kg m^2 in the place of m, N and kg.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from armimpedance.core.arrays import FloatArray
from manipulandum_sim.random_hand.limbs import Held, Limb
from manipulandum_sim.random_hand.rig import RATE_HZ, Driver


class RandomTrack(NamedTuple):
    """Course of the trials: place and force at the sensor, (S, T, d)."""

    place: FloatArray
    sensor: FloatArray


@dataclass(frozen=True)
class RandomDrive:
    """T trials of one limb.

    Attributes
    ----------
    rig : Driver
    limb : Limb
    hand, hold : (d,)
        Place at rest (m), and force of the robot that balances the hand there (N).
    command : (3, 2 S - 1, T, d)
        At every half sample, with two derivatives.
    own : (S, T, d)
        Force of the person's own at the samples, linear between them.
    """

    rig: Driver
    limb: Limb
    hand: FloatArray
    hold: FloatArray
    command: FloatArray
    own: FloatArray

    def integrate(self) -> RandomTrack:
        """Runge and Kutta's fourth order, one step a sample."""
        samples, trials, d = self.own.shape
        h, delay = 1 / RATE_HZ, self._delay
        place, sensor = np.empty((2, samples, trials, d))
        q = np.repeat(self.limb.start[None], trials, axis=0)
        qd = np.zeros_like(q)
        past: list[FloatArray] = []
        for n in range(samples):
            heard = self._heard(past, n, delay)
            qdd1, now, push = self._rate(q, qd, 2 * n, heard[0])
            if delay:
                past.append(now.stretch)
            place[n] = now.place
            a = (now.J @ qdd1[..., None])[..., 0] + now.drift
            sensor[n] = self.rig.beyond * a - push
            if n + 1 == samples:
                break
            v2 = qd + h / 2 * qdd1
            qdd2 = self._rate(q + h / 2 * qd, v2, 2 * n + 1, heard[1])[0]
            v3 = qd + h / 2 * qdd2
            qdd3 = self._rate(q + h / 2 * v2, v3, 2 * n + 1, heard[1])[0]
            v4 = qd + h * qdd3
            qdd4 = self._rate(q + h * v3, v4, 2 * n + 2, heard[2])[0]
            q = q + h / 6 * (qd + 2 * (v2 + v3) + v4)
            qd = qd + h / 6 * (qdd1 + 2 * (qdd2 + qdd3) + qdd4)
        return RandomTrack(place, sensor)

    @property
    def _delay(self) -> int:
        """Delay of the reflex in samples; 0 without a reflex."""
        return round(self.rig.reflex.delay_s * RATE_HZ) if self.rig.reflex else 0

    def _heard(
        self, past: list[FloatArray], n: int, delay: int
    ) -> tuple[FloatArray | None, FloatArray | None, FloatArray | None]:
        """Delayed stretch (T, m) at the start, the middle and the end of a step."""
        if not delay or n < delay:
            return None, None, None
        here = past[n - delay]
        # with a delay of one sample the next one is not known yet
        there = past[n - delay + 1] if delay > 1 else here
        return here, (here + there) / 2, there

    def _rate(
        self, q: FloatArray, qd: FloatArray, half: int, heard: FloatArray | None
    ) -> tuple[FloatArray, Held, FloatArray]:
        """Accelerations (T, r), the limb, and the motors' force (T, d), at a half sample."""
        rig, now = self.rig, self.limb.at(q, qd, heard)
        m = rig.carried
        K, B = rig.spring
        p, v, a = self.command[:, half]
        away = now.place - self.hand
        if rig.imposed != "position":
            push = self.hold + p - K * away - B * now.velocity
        else:
            push = self.hold + K * (p - away) + B * (v - now.velocity) + m * a
        own = (self.own[half // 2] + self.own[(half + 1) // 2]) / 2
        JT = np.swapaxes(now.J, 1, 2)
        right = now.pull + (JT @ (push + own - m * now.drift)[..., None])[..., 0]
        whole = now.A + JT @ (m[:, None] * now.J)
        return np.linalg.solve(whole, right[..., None])[..., 0], now, push
