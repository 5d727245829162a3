"""Movements of an arm in a small therapy robot, by inverse dynamics of the rooms' own models."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
from scipy.signal import lfilter

from armimpedance.core.records import Recording, Subject
from armimpedance.core.skeleton import Hinge, Segment, Skeleton
from armimpedance.joint.therapy.arm.passive_arm import PassiveArm, arm_bodies, winter_segments
from armimpedance.joint.therapy.robot.therapy_robot import (
    Loads,
    TherapyRobot,
    load_torque,
    parameter_count,
    robot_bodies,
)

RATE = 250.0
AXES = ("elevation", "horizontal")
UPPER_ARM_M = 0.32
SEGMENTS = winter_segments(70.0, UPPER_ARM_M, 0.25, 0.18)
#: Axis, from and to in degrees, seconds.
MOVEMENTS = {
    "elevation": (0, 45.0, 110.0, 3.25),
    "horizontal": (1, 0.0, 90.0, 4.5),
    "lowering": (0, 110.0, 45.0, 3.25),
}
#: k_s and q_0 of the two axes.
STIFFNESS = (5.0, 1.2)
REST_RAD = (1.1, 0.2)


def bench(relative_sd: float = 0.0, **changes) -> TherapyRobot:
    """Vertical axis, elevation and a fixed elbow's worth of links; Table 3's first two axes."""
    ball, down, zero = 0.02 * np.eye(3), np.array([0.0, 0.0, -0.12]), np.zeros(3)
    up, flexion = np.array([0.0, 0.0, 1.0]), np.array([0.0, -1.0, 0.0])
    elbow = np.array([0.0, 0.0, -0.3])
    parts = (
        Segment("base", None, zero),
        Segment("column", "base", zero, (Hinge("horizontal", up),), 5.0, zero, ball),
        Segment("upper_arm", "column", zero, (Hinge("elevation", flexion),), 4.0, down, ball),
        Segment("forearm", "upper_arm", elbow, (Hinge("elbow", flexion),), 2.0, down, ball),
    )
    theta = np.zeros(parameter_count(3))
    theta[:8] = (8.22, 7.56, 0.0, 0.0, 1.17, 1.55, 0.92, -0.66)
    theta[-3:] = (-1.0, -9.0, 3.0)
    loads = Loads(theta, np.diag((relative_sd * theta) ** 2), np.full(3, 0.005))
    given = {
        "name": "bench",
        "axes": (*AXES, "elbow"),
        "skeleton": Skeleton(parts, floating=False),
        "limits_rad": np.tile([-1.0, 2.6], (3, 1)),
        "torque_limit_Nm": np.full(3, 59.5),
        "motor_inertia_kgm2": np.full(3, 0.1),
        "loads": loads,
    }
    return TherapyRobot(**{**given, **changes})


def heavier(segments, factor: float):
    """The same segments of another density."""
    return tuple(
        replace(s, mass_kg=factor * s.mass_kg, inertia_kgm2=factor * s.inertia_kgm2)
        for s in segments
    )


def motion(movement: str, rest_s: float = 0.4):
    """Minimum jerk between rests: t (S,), q, qd, qdd (S, 3)."""
    axis, start, end, seconds = MOVEMENTS[movement]
    t = np.arange(round((seconds + 2 * rest_s) * RATE) + 1) / RATE
    s = np.clip((t - rest_s) / seconds, 0, 1)
    q, qd, qdd = np.zeros((3, len(t), 3))
    if axis == 1:
        q[:, 0] = np.deg2rad(60)
    start, far = np.deg2rad(start), np.deg2rad(end - start)
    q[:, axis] = start + far * (10 * s**3 - 15 * s**4 + 6 * s**5)
    qd[:, axis] = far * (30 * s**2 - 60 * s**3 + 30 * s**4) / seconds
    qdd[:, axis] = far * (60 * s - 180 * s**2 + 120 * s**3) / seconds**2
    return t, q, qd, qdd


def wandering(rng, samples: int, sd: float, time_s: float = 0.8):
    """A torque (S,) of correlation ``sd^2 exp(-|t| / time_s)``."""
    phi = np.exp(-1 / (RATE * time_s))
    steps = rng.standard_normal(samples) * sd * np.sqrt(1 - phi**2)
    steps[0] = rng.standard_normal() * sd
    return lfilter([1.0], [1.0, -phi], steps)


class Session:
    """A person's trials, one after another."""

    def __init__(self, robot=None, segments=SEGMENTS, seed=0, wander=(0.0, 0.0), noise=0.0):
        self.robot = (robot or bench()).adjusted_to(UPPER_ARM_M)
        self.rng, self.wander, self.noise = np.random.default_rng(seed), wander, noise
        arm = PassiveArm("S", self.robot.name, UPPER_ARM_M, tuple(segments))
        self.bodies = robot_bodies(self.robot), arm_bodies(self.robot, arm)
        self.rows, self.q, self.motor, self.time = [], [], [], []

    def add(self, movement="elevation", k=STIFFNESS, rest=REST_RAD, extra=None, **columns):
        """One trial; `extra(t, q, qd)` (S,) is what the moving axis needs beside."""
        axis, _, _, seconds = MOVEMENTS[movement]
        t, q, qd, qdd = motion(movement)
        torque = sum(body.torque(q, qd, qdd) for body in self.bodies)
        torque += load_torque(self.robot, q, qd)
        for i in range(2):
            torque[:, i] += k[i] * (q[:, i] - rest[i])
            torque[:, i] += wandering(self.rng, len(t), self.wander[i])
        if extra is not None:
            torque[:, axis] += extra(t, q, qd)
        torque += self.noise * self.rng.standard_normal(torque.shape)
        row = {"condition": "passive", "movement": movement, "axis": axis + 1, "onset_s": 0.4}
        self.rows.append({**row, "end_s": 0.4 + seconds, **columns})
        for kept, value in zip((self.time, self.q, self.motor), (t, q, torque), strict=True):
            kept.append(value)
        return self

    def recording(self, **changes) -> Recording:
        table = pd.DataFrame(self.rows)
        table.insert(0, "trial", np.arange(1, len(table) + 1))
        given = {
            "kind": "joint",
            "sample_rate_hz": RATE,
            "trials": table,
            "offsets": np.cumsum([0, *map(len, self.time)]),
            "time_s": np.concatenate(self.time),
            "position": np.concatenate(self.q),
            "force": -np.concatenate(self.motor),
            "torque": "commanded",
            "subject": Subject("S", mass_kg=70.0, upper_arm_m=UPPER_ARM_M),
        }
        return Recording(**{**given, **changes})


def repeated(session: Session, movements=("elevation", "horizontal"), times=3, **given):
    """The session with so many alike repetitions of every movement."""
    for _ in range(times):
        for movement in movements:
            session.add(movement, **given)
    return session
