"""Friction, cables and spring of a therapy robot: a known truth comes back, the rest is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from armimpedance.contribution.calibrate import identify_robot
from armimpedance.contribution.checks import check_recording
from armimpedance.contribution.rigid import robot_bodies
from armimpedance.contribution.robot import (
    SPRING_TERMS,
    Loads,
    TherapyRobot,
    load_torque,
    parameter_count,
)
from armimpedance.contribution.robot_validation import validate_robot
from armimpedance.errors import InputError
from armimpedance.records import Recording, Subject
from armimpedance.skeleton import Hinge, Segment, Skeleton

RATE = 1000.0
AXES = ("elevation", "horizontal", "elbow")
DEG = np.pi / 180
#: Guidali (2013), Table 3, axes 1, 2 and 4: tau_c, k_v, k_c, q_c; axis 1 has no cables.
TABLE_3 = ((8.22, 0.132, 0.0, 0.0), (1.17, 0.027, 0.016, 41.0), (1.07, 0.013, 0.014, 10.0))
SPRING = (-3.0, -12.0, 4.0)
SPEEDS_DEG_S = (0.3, 1.0, 4.0, 10.0, 25.0, 60.0)


def bench(loads: Loads | None = None) -> TherapyRobot:
    """Three axes: elevation, the vertical one below it, the elbow."""
    ball, down = 0.02 * np.eye(3), np.array([0.0, 0.0, -0.12])
    up, flexion = np.array([0.0, 0.0, 1.0]), np.array([0.0, -1.0, 0.0])
    elbow = np.array([0.0, 0.0, -0.3])
    zero = np.zeros(3)
    parts = (
        Segment("base", None, zero),
        Segment("column", "base", zero, (Hinge("horizontal", up),), 5.0, zero, ball),
        Segment("upper_arm", "column", zero, (Hinge("elevation", flexion),), 4.0, down, ball),
        Segment("forearm", "upper_arm", elbow, (Hinge("elbow", flexion),), 2.0, down, ball),
    )
    return TherapyRobot(
        name="bench",
        axes=AXES,
        skeleton=Skeleton(parts, floating=False),
        limits_rad=np.array([[0.0, 2.2], [-0.8, 2.2], [0.0, 2.2]]),
        torque_limit_Nm=np.array([59.5, 59.5, 30.0]),
        motor_inertia_kgm2=np.full(3, 0.05),
        loads=loads,
    )


def truth(rise_rad_s: float = 1e-4) -> TherapyRobot:
    """The bench with the loads of Table 3; Coulomb friction from the least velocity on."""
    theta = np.zeros(parameter_count(3))
    for i, (coulomb, viscous, k, rest) in enumerate(TABLE_3):
        theta[4 * i : 4 * i + 4] = coulomb, viscous / DEG, k / DEG, -k * rest
    theta[-3:] = SPRING
    return bench(Loads(theta, np.zeros((15, 15)), np.full(3, rise_rad_s)))


def stribeck(qd, robot, static):
    """What friction is larger by at low speed: gone within some deg/s."""
    coulomb = robot.identified.term("coulomb")
    return np.sign(qd) * coulomb * static * np.exp(-np.abs(qd) / (0.5 * DEG))


class Session:
    """Trials of the empty bench, one after another."""

    def __init__(self, robot, *, noise=0.3, seed=0, static=0.3):
        self.robot, self.noise, self.static = robot, noise, static
        self.rng, self.bodies = np.random.default_rng(seed), robot_bodies(robot)
        self.rows, self.q, self.motor = [], [], []

    def add(self, row, q, qd, qdd, extra=0.0):
        motor = self.bodies.torque(q, qd, qdd) + load_torque(self.robot, q, qd)
        motor += stribeck(qd, self.robot, self.static) + extra
        motor += self.noise * self.rng.standard_normal(motor.shape)
        self.rows.append({"trial": len(self.rows) + 1, **row})
        self.q.append(q + 1e-6 * self.rng.standard_normal(q.shape) * (self.noise > 0))
        self.motor.append(motor)

    def sweep(self, axis, velocity_deg_s, seconds=2.0, even=0.0):
        v, middle = velocity_deg_s * DEG, self.robot.limits_rad[axis].mean()
        seconds = min(seconds, 1.8 / abs(v))
        t = np.arange(round(seconds * RATE)) / RATE
        q = np.tile([0.6, 0.2, 0.8], (len(t), 1))
        q[:, axis] = middle + v * (t - seconds / 2)
        qd = np.zeros_like(q)
        qd[:, axis] = v
        extra = np.zeros_like(q)
        extra[:, axis] = even * abs(v)
        times = {"onset_s": 0.05, "end_s": seconds - 0.05}
        row = {"condition": "sweep", "axis": axis + 1, "velocity_deg_s": velocity_deg_s, **times}
        self.add(row, q, qd, 0 * q, extra)

    def hold(self, angle, approach, sticks):
        q = np.tile([angle, 0.2, 0.8], (500, 1))
        extra = np.zeros_like(q)
        extra[:, 0] = approach * sticks
        row = {"condition": "hold", "axis": 1, "approach": approach, "onset_s": 0.0, "end_s": 0.5}
        self.add(row, q, 0 * q, 0 * q, extra)

    def reach(self, start, end, seconds=3.0):
        t = np.arange(round(seconds * RATE)) / RATE / seconds
        s = 10 * t**3 - 15 * t**4 + 6 * t**5
        ds = (30 * t**2 - 60 * t**3 + 30 * t**4) / seconds
        dds = (60 * t - 180 * t**2 + 120 * t**3) / seconds**2
        way = np.subtract(end, start)
        row = {"condition": "validation", "axis": 1, "onset_s": 0.0, "end_s": seconds}
        self.add(row, start + np.outer(s, way), np.outer(ds, way), np.outer(dds, way))

    def recording(self, **changes):
        given = {
            "kind": "joint",
            "sample_rate_hz": RATE,
            "trials": pd.DataFrame(self.rows),
            "offsets": np.cumsum([0, *(len(q) for q in self.q)]),
            "time_s": np.concatenate([np.arange(len(q)) / RATE for q in self.q]),
            "position": np.concatenate(self.q),
            "force": -np.concatenate(self.motor),
            "torque": "commanded",
            "subject": Subject("empty", upper_arm_m=0.30),
        }
        return Recording(**{**given, **changes})


def calibration(  # noqa: PLR0913
    robot=None, *, noise=0.3, seed=0, static=0.3, speeds=SPEEDS_DEG_S, even=0.0, scatter=0.2
):
    """Sweeps of all axes in both directions, then holds of the first."""
    session = Session(robot or truth(), noise=noise, seed=seed, static=static)
    for axis in range(3):
        for speed in speeds:
            session.sweep(axis, speed, even=even)
            session.sweep(axis, -speed, even=even)
    for angle in np.linspace(0.1, 2.0, 9):
        for approach in (1, -1):
            stuck = 8.0 * (1 - scatter * session.rng.random() * (noise > 0))
            session.hold(angle, approach, stuck)
    return session.recording()


@pytest.fixture(scope="module")
def nominal():
    return identify_robot(calibration(), bench())


@pytest.fixture(scope="module")
def exact():
    return identify_robot(calibration(noise=0.0, static=0.0), bench())


def test_without_noise_the_truth_comes_back(exact):
    assert np.allclose(exact.robot.identified.theta, truth().identified.theta, rtol=1e-3, atol=1e-3)
