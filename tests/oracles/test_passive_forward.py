"""The simulated passive arm against Pinocchio's dynamics and an adaptive integrator."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp

from armimpedance.limb.arm.skeleton_model import skeleton_model
from manipulandum_sim.passive.drive import Push, held, shaken
from manipulandum_sim.passive.segments import ELBOW
from manipulandum_sim.passive.subject import PASSIVE_SUBJECTS, hinge_values
from manipulandum_sim.passive.swing import simulate_passive
from manipulandum_sim.passive.truth import PassiveTruth


class Oracle:
    """qdd of the free hinges, one instant at a time."""

    def __init__(self, subject, drive, signs=None):
        self.model = skeleton_model(subject.skeleton)
        self.data, self.drive = self.model.createData(), drive
        n = drive.spline.c.shape[2]
        self.free = slice(n, self.model.nv)
        names = subject.skeleton.coordinates[n:]
        self.k, self.h, self.f, self.q_r, self.K = (
            hinge_values(subject, names, what) for what in ("k", "h", "f", "q_r", "K")
        )
        self.signs = np.zeros(len(names)) if signs is None else signs

    def __call__(self, time, state):
        K = len(self.k)
        q, qd = state[:K], state[K:]
        told = [part[0] for part in self.drive.at(np.array([time]))]
        whole = [
            np.concatenate([part[0], own])
            for part, own in zip(told, (q, qd, np.zeros(K)), strict=True)
        ]
        bias = pin.rnea(self.model, self.data, *whole)[self.free].copy()
        upper = np.triu(pin.crba(self.model, self.data, whole[0]))
        M = (upper + np.triu(upper, 1).T)[self.free, self.free]
        e = q - self.q_r
        tau = -(self.k * e + self.K * e**2 + self.h * qd + self.f * self.signs)
        return np.concatenate([qd, np.linalg.solve(M, tau - bias)])


def integrate(oracle, times, state, **options):
    return solve_ivp(
        oracle, (times[0], times[-1]), state, "DOP853", rtol=1e-10, atol=1e-12, **options
    )


def first_state(truth: PassiveTruth):
    return np.concatenate([truth.q[0, truth.columns], truth.qd[0, truth.columns]])


def without_friction(subject):
    return replace(subject, joints={n: replace(j, f=0.0) for n, j in subject.joints.items()})


@pytest.mark.parametrize("name", ["1", "whole-arm"])
def test_the_shaken_arm_moves_as_pinocchio_s(name):
    subject = without_friction(PASSIVE_SUBJECTS[name]).with_joint(ELBOW, K=0.4)
    recording, truth = simulate_passive("p5", subject=subject, duration_s=1.0, seed=3)
    key = [np.random.SeedSequence(3, spawn_key=(1,))]
    drive = shaken(subject.skeleton, subject.height_m, key, (-2.0, 1.0), Push())
    oracle = Oracle(subject, drive)
    times = recording.time_s
    expected = integrate(oracle, times, first_state(truth), t_eval=times).y.T
    free = truth.columns
    np.testing.assert_allclose(truth.q[:, free], expected[:, : len(free)], atol=2e-8)
    np.testing.assert_allclose(truth.qd[:, free], expected[:, len(free) :], atol=2e-7)
    accelerations = [oracle(t, s)[len(free) :] for t, s in zip(times, expected, strict=True)]
    np.testing.assert_allclose(truth.qdd[:, free], accelerations, atol=2e-6)


@pytest.mark.first_cases(1)
@pytest.mark.parametrize("f", [0.015, 0.6, -0.05])
def test_dry_friction_is_that_of_an_integrator_that_stops_at_every_reversal(f):
    subject = PASSIVE_SUBJECTS["1"].with_joint(ELBOW, f=f)
    recording, truth = simulate_passive(
        "release", subject=subject, trials=1, duration_s=2.0, rate_hz=60.0
    )
    drive = held(subject.skeleton, subject.height_m, 1, (0.0, 2.0))
    times, c = recording.time_s, truth.columns[0]
    state, here = first_state(truth), 0.0
    expected, sign = {}, np.sign(truth.qd[0, c])
    while here < times[-1]:
        oracle = Oracle(subject, drive, np.array([sign]))

        def stops(_, s):
            return s[1]

        stops.terminal, stops.direction = True, -sign
        ahead = times[times >= here]
        done = integrate(oracle, [here, times[-1]], state, events=stops, t_eval=ahead)
        expected.update(zip(done.t, done.y[0], strict=True))
        if done.status == 0:
            break
        here, state, sign = done.t_events[0][0], done.y_events[0][0], -sign
        state[1] = 0.0
        stuck = np.sign(Oracle(subject, drive, np.array([sign]))(here, state)[1]) != sign
        if f > 0 and stuck:
            expected |= {t: state[0] for t in times if t > here}
            break
    assert len(expected) == len(times)
    course = np.array([expected[t] for t in times])
    np.testing.assert_allclose(truth.q[:, c], course, atol=1e-7)
    assert (truth.held.any()) == (f == 0.6)
