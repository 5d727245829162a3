"""Arm, handle and robot move as one: equations of motion and their integration.

The grip holds the hand's place, so the joints that move are the state:

    (M + J^T m J) qdd = tau - h + J^T (F_robot + F_own - m Jdot qd)

with m the mass of robot and handle. The sensor sits between robot and handle: it reads
``m_robot a - F_robot``, by limb and handle on the robot.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from manipulandum_sim.hand import RATE_HZ
from manipulandum_sim.space.plant import Plant
from manipulandum_sim.space.rig import SOFT_N_M, SOFT_NS_M, SpaceRig


@dataclass(frozen=True)
class Drive:
    """T trials of one condition.

    Attributes
    ----------
    plant : Plant
    rig : SpaceRig
    hand, hold : (3,)
        Place at the start (m), and force of the robot that balances the hand there (N).
    unit : (T, 3)
        Direction of each disturbance.
    onset : (T,) int
        Sample.
    """

    plant: Plant
    rig: SpaceRig
    hand: FloatArray
    hold: FloatArray
    unit: FloatArray
    onset: IntArray

    def profile(self, lag_s: FloatArray) -> FloatArray:
        """Commanded displacement (m) or force (N), first and second derivative (3, ...)."""
        rig = self.rig
        return rig.shape.profile(lag_s, rig.duration_s, rig.peak)

    @property
    def damping(self) -> float:
        """Damping of the servo, N s/m."""
        mass = float(np.mean(self.rig.robot_kg)) + self.rig.handle_mass_kg
        return float(2 * self.rig.damping_ratio * np.sqrt(self.rig.stiffness * mass))

    def robot_force(self, lag_s: FloatArray, place: FloatArray, velocity: FloatArray) -> FloatArray:
        """Force (T, 3) of the motors at the hand."""
        rig = self.rig
        away = place - self.hand
        p, v, a = (self.unit * part[:, None] for part in self.profile(lag_s))
        if rig.control == "force":
            return np.asarray(self.hold + p - SOFT_N_M * away - SOFT_NS_M * velocity)
        mass = np.array(rig.robot_kg) + rig.handle_mass_kg
        push = rig.stiffness * (p - away) + self.damping * (v - velocity) + mass * a
        return np.asarray(self.hold + push)

    def rate(
        self, state: tuple[FloatArray, FloatArray], lag_s: FloatArray, own: FloatArray | float
    ) -> _Rate:
        """Equations of motion at angles and rates (T, r) of the moving joints."""
        q, qd = state
        r = list(self.plant.moving)
        full, rates = self.plant.full(q), np.zeros((len(q), len(self.plant.posture)))
        rates[:, r] = qd
        now = self.plant.arm.dynamics(full, rates)
        J, JT = now.J[:, :, r], np.swapaxes(now.J[:, :, r], 1, 2)
        robot = np.array(self.rig.robot_kg)
        moved = robot + self.rig.handle_mass_kg
        push = self.robot_force(lag_s, now.place, now.velocity)
        torque = (self.plant.torque(full, rates) - now.h)[:, r]
        torque += (JT @ (push + own - moved * now.drift)[..., None])[..., 0]
        whole = now.M[:, r][:, :, r] + JT @ (moved[:, None] * J)
        qdd = np.asarray(np.linalg.solve(whole, torque[..., None])[..., 0], dtype=np.float64)
        a = (J @ qdd[..., None])[..., 0] + now.drift
        return _Rate(qdd, now.place, robot * a - push, full)


class _Rate(NamedTuple):
    """Joint accelerations (T, r), hand place and sensor force (T, 3), all angles (T, n)."""

    qdd: FloatArray
    place: FloatArray
    sensor: FloatArray
    angles: FloatArray


@dataclass(frozen=True)
class SpaceTrack:
    """Course of the trials: hand place and sensor force (T, S, 3), angles (T, S, n)."""

    place: FloatArray
    sensor: FloatArray
    angles: FloatArray


def integrate_space(drive: Drive, own: FloatArray | None) -> SpaceTrack:
    """Fourth-order Runge-Kutta with a fixed step over trials of one condition.

    Parameters
    ----------
    drive : Drive
    own : (S, 3, T) or None
        Force of the hand's own (N) at the samples, linear between them.

    Returns
    -------
    SpaceTrack
    """
    rig, trials = drive.rig, len(drive.onset)
    h, samples = 1 / (RATE_HZ * rig.substeps), rig.samples
    place, sensor = np.empty((2, trials, samples, 3))
    angles = np.empty((trials, samples, len(drive.plant.posture)))
    q = np.repeat(drive.plant.posture[None][:, list(drive.plant.moving)], trials, axis=0)
    qd = np.zeros_like(q)
    for n in range((samples - 1) * rig.substeps + 1):
        at, part = divmod(n, rig.substeps)
        lag = n * h - drive.onset / RATE_HZ
        first, middle, last = _own_over_substep(own, at, part, rig.substeps)
        k1 = drive.rate((q, qd), lag, first)
        if part == 0:
            place[:, at], sensor[:, at], angles[:, at] = k1.place, k1.sensor, k1.angles
        v2 = qd + h / 2 * k1.qdd
        k2 = drive.rate((q + h / 2 * qd, v2), lag + h / 2, middle)
        v3 = qd + h / 2 * k2.qdd
        k3 = drive.rate((q + h / 2 * v2, v3), lag + h / 2, middle)
        v4 = qd + h * k3.qdd
        k4 = drive.rate((q + h * v3, v4), lag + h, last)
        q = q + h / 6 * (qd + 2 * (v2 + v3) + v4)
        qd = qd + h / 6 * (k1.qdd + 2 * (k2.qdd + k3.qdd) + k4.qdd)
    return SpaceTrack(place, sensor, angles)


def _own_over_substep(
    own: FloatArray | None, at: int, part: int, substeps: int
) -> tuple[FloatArray | float, FloatArray | float, FloatArray | float]:
    """The hand's own force (T, 3) at the start, the middle and the end of a substep."""
    if own is None:
        return 0.0, 0.0, 0.0
    here, there = own[at].T, own[min(at + 1, len(own) - 1)].T
    first, middle, last = (
        here + (part + extra) / substeps * (there - here) for extra in (0.0, 0.5, 1.0)
    )
    return first, middle, last
