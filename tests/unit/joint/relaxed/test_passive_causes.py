"""What makes a passive joint move unlike the model is told apart, with its size."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pytest

from armimpedance.core.records import Recording
from armimpedance.joint.relaxed.doubts.evidence import RowEvidence, WhiteningNoise
from armimpedance.joint.relaxed.doubts.rivals import cause_findings
from armimpedance.joint.relaxed.equations import Terms
from armimpedance.joint.relaxed.joint_spline import solve_joint_spline
from armimpedance.joint.relaxed.linear import from_joint_recording
from armimpedance.joint.relaxed.samples import from_motion

FREE = Terms("free")
K, H, F, Q_R = 3.0, 0.2, 0.15, 1.4


class Moved(NamedTuple):
    """Angle, velocity, acceleration, and random numbers of one trial."""

    q: Any
    v: Any
    a: Any
    rng: Any


def moved(seed, rate=100.0, seconds=10.0, late=0.0):
    """Angle, its rate and acceleration now, those `late` s ago, and random numbers; two sines."""
    rng = np.random.default_rng(seed)
    slow, quick = rng.uniform(0.15, 0.25), rng.uniform(0.5, 0.7)
    phases = rng.uniform(0, 2 * np.pi, 2)

    def at(t):
        waves = [(0.5, 2 * np.pi * slow, phases[0]), (0.12, 2 * np.pi * quick, phases[1])]
        q = 1.5 + sum(a * np.sin(w * t + c) for a, w, c in waves)
        v = sum(a * w * np.cos(w * t + c) for a, w, c in waves)
        return q, v, sum(-a * w * w * np.sin(w * t + c) for a, w, c in waves)

    t = np.arange(int(rate * seconds)) / rate
    return at(t)[0], at(t - late), rng


def machine(seed, left=None, late=0.0):
    """Three trials of a motor that swings a joint and measures its torque, `left` in it."""
    position, torque = [], []
    for trial in range(3):
        angle, (q, v, a), rng = moved(100 * seed + trial, late=late)
        tau = K * (q - Q_R) + H * v + F * np.sign(v)
        tau = tau + (left(Moved(q, v, a, rng)) if left else 0.0)
        position.append(angle + 2e-4 * rng.standard_normal(len(angle)))
        torque.append(tau + 0.03 * rng.standard_normal(len(angle)))
    n = len(position[0])
    return Recording(
        kind="joint",
        sample_rate_hz=100.0,
        trials=pd.DataFrame({"trial": [1, 2, 3], "condition": "swing"}),
        offsets=n * np.arange(4),
        time_s=np.tile(np.arange(n) / 100.0, 3),
        position=np.concatenate(position)[:, None],
        force=np.concatenate(torque)[:, None],
    )


def bump(m):
    """A torque of half a second, .2 N m."""
    t = np.arange(len(m.q)) / 100.0
    return 0.2 * np.sin(np.pi * np.clip((t - m.rng.uniform(1, 8)) / 0.5, 0, 1)) ** 2


def bristle(m):
    """Friction that begins as a spring and yields after .06 rad, in place of the sign."""
    bent = np.full(len(m.v), 0.06 * np.sign(m.v[0]))
    for i, v in enumerate(m.v[:-1]):
        bent[i + 1] = bent[i] + 0.01 * (v - np.abs(v) * bent[i] / 0.06)
    return F * (bent / 0.06 - np.sign(m.v))


#: What is wrong with the record, what is named for it; its size if it is told, after these words.
MACHINE = {
    "clean": ({}, set()),
    "weight": ({"left": lambda m: 2 * np.sin(m.q)}, {"weight"}),
    "inertia": ({"left": lambda m: 0.03 * m.a}, {"inertia"}, 0.03, ", "),
    "late": ({"late": 0.02}, {"skew"}, 20, "is "),
    "early": ({"late": -0.02}, {"skew"}, -20, "is "),
    "curve": ({"left": lambda m: 0.8 * (m.q - Q_R) ** 2}, {"amplitude"}),
    "help": ({"left": bump}, {"voluntary"}),
    "drag": ({"left": lambda m: 0.15 * np.abs(m.v) * m.v}, {"damping"}),
    "sticks": ({"left": lambda m: F * np.sign(m.v) * np.exp(-np.abs(m.v) / 0.1)}, {"friction"}),
}

#: A stiffness of second order and a weight make nearly the same torque over one radian.
ALIKE = {"weight", "amplitude"}


def warned(findings):
    return {one.name for one in findings if one.verdict == "warning"}


@pytest.mark.parametrize("which", MACHINE)
def test_what_is_left_in_a_measured_torque_is_named_with_its_size(which):
    how, expected, *told = MACHINE[which]
    found = cause_findings(from_joint_recording(machine(5, **how)), FREE)
    assert expected <= warned(found) <= expected | (ALIKE if expected & ALIKE else set())
    if told:
        size, before = told
        (message,) = [one.message for one in found if one.name in expected]
        value = float(message.split(before)[1].split(" +-")[0])
        assert abs(value - size) < 4 * float(message.split("+- ")[1].split()[0])


def test_causes_that_the_data_cannot_tell_apart_are_both_named_and_say_so():
    record = machine(5, left=lambda m: 0.5 * np.sin(m.q))
    found = {one.name: one for one in cause_findings(from_joint_recording(record), FREE)}
    assert warned(found.values()) == ALIKE
    assert "the same of amplitude" in found["weight"].message
    assert "the same of weight" in found["amplitude"].message


def test_friction_that_begins_as_a_spring_is_named():
    found = {
        one.name: one for one in cause_findings(from_joint_recording(machine(5, bristle)), FREE)
    }
    # how far it was bent when a trial begins is not known, and looks like a slow torque
    assert {"friction"} <= warned(found.values()) <= {"friction", "voluntary"}
    told = found["friction"].message
    assert "as a spring" in told
    assert 0.03 < float(told.split("after ")[1].split()[0]) < 0.12


def test_friction_that_the_model_was_told_not_to_have_is_named_with_its_size():
    terms = Terms("free", friction=False)
    found = {one.name: one for one in cause_findings(from_joint_recording(machine(8)), terms)}
    assert warned(found.values()) == {"friction"}
    size, error = found["friction"].message.split(", ")[2].removesuffix(" N m: f is").split(" +- ")
    assert abs(float(size) - F) < 4 * float(error.split()[0])


def filmed(forearm, samples=150, **more):
    noise = {"angle_noise": 2e-3, "place_noise": 3e-4}
    motion, _ = forearm.swings(samples=samples, shake_m=0.0, start=0.8, substeps=8, **noise, **more)
    return motion


@pytest.mark.study
@pytest.mark.first_cases(1)
@pytest.mark.parametrize("factor", [1.2, 0.85])
def test_the_clock_of_a_film_is_told_from_a_stiffness_by_gravity(forearm, factor):
    motion = filmed(forearm)
    wrong = replace(
        motion,
        sample_rate_hz=factor * motion.sample_rate_hz,
        time_s=np.asarray(motion.time_s) / factor,
    )
    samples = from_motion(wrong, [forearm.elbow])
    found = {one.name: one for one in cause_findings(samples, FREE)}
    assert found["time"].verdict == "warning"
    off = float(found["time"].message.split("rate is ")[1].split(" %")[0])
    # within 4 of the standard errors that it gives for gravity, half as large for the rate
    spread = 100 * float(found["time"].message.split("+- ")[1].split()[0]) / 2
    assert abs(off - 100 * (factor - 1)) < 4 * spread


@pytest.mark.first_cases(1)
@pytest.mark.parametrize(("factor", "named"), [(1.25, {"time"}), (1.05, {"time", "inertia"})])
def test_tables_of_limbs_speak_for_the_clock_only_where_it_is_far_off(forearm, factor, named):
    motion = filmed(forearm)
    wrong = replace(
        motion,
        sample_rate_hz=factor * motion.sample_rate_hz,
        time_s=np.asarray(motion.time_s) / factor,
    )
    found = warned(cause_findings(from_motion(wrong, [forearm.elbow]), FREE))
    assert found - {"amplitude"} == named


@pytest.mark.study
def test_damping_by_the_square_of_the_velocity_is_named_with_its_size(forearm):
    samples = from_motion(filmed(forearm, drag=0.02), [forearm.elbow])
    found = {one.name: one for one in cause_findings(samples, FREE)}
    assert warned(found.values()) == {"damping"}
    size, error = found["damping"].message.split("velocity, ")[1].split(" N m")[0].split(" +- ")
    assert abs(float(size) - 0.02) < 4 * float(error)


@pytest.mark.study
@pytest.mark.first_cases(1)
@pytest.mark.parametrize("up", ["x", "-x", "-z"])
def test_a_swing_tells_which_way_is_up(forearm, up):
    motion = filmed(forearm)
    # the same film, its skeleton and all, turned so that another axis points up; the hinge's own
    # is y, along which gravity would not pull at all
    turn = {"x": np.pi / 2, "-x": -np.pi / 2, "-z": np.pi}[up]
    coordinates = motion.coordinates.copy()
    x, z = motion.coordinates[:, 0], motion.coordinates[:, 2]
    coordinates[:, 0] = np.cos(turn) * x + np.sin(turn) * z
    coordinates[:, 2] = -np.sin(turn) * x + np.cos(turn) * z
    coordinates[:, motion.skeleton.coordinates.index("trunk_ry")] += turn
    samples = from_motion(replace(motion, coordinates=coordinates), [forearm.elbow])
    found = {one.name: one for one in cause_findings(samples, FREE)}
    # the weight's sine along another axis and a stiffness of third order are nearly the same
    assert {"up axis"} <= warned(found.values()) <= {"up axis", "amplitude"}
    said = found["up axis"].message
    assert f"as if {up} pointed up" in said
    k = float(said.split("k is then ")[1].split()[0])
    assert k == pytest.approx(forearm.truth.k, rel=0.05)


@pytest.mark.study
def test_a_clean_clock_is_not_doubted_and_tells_what_it_would_have_seen(forearm):
    samples = from_motion(filmed(forearm), [forearm.elbow])
    found = {one.name: one for one in cause_findings(samples, FREE)}
    assert warned(found.values()) == set()
    assert "a rate" in found["time"].smallest
    assert "N m" in found["voluntary"].smallest


@pytest.mark.study
def test_a_rest_angle_that_is_stated_wrong_is_none_of_the_causes(forearm):
    samples = from_motion(filmed(forearm), [forearm.elbow])
    assert warned(cause_findings(samples, Terms(forearm.truth.q_r + 0.1))) == set()
    assert warned(cause_findings(from_joint_recording(machine(7)), Terms(Q_R + 0.1))) == set()


def test_the_sign_near_a_reversal_takes_nothing_off_friction():
    # with signs as the spline shows them f was one standard error too small and h too large
    off = []
    for seed in range(12):
        fit = solve_joint_spline(from_joint_recording(machine(seed)), FREE).robust
        off.append(fit.parameters[1:3] - [H, F])
    spread = np.std(off, axis=0, ddof=1) / np.sqrt(len(off))
    assert (np.abs(np.mean(off, axis=0)) < 3 * spread).all()


def test_evidence_is_least_squares():
    rng = np.random.default_rng(1)
    X, y = rng.standard_normal((50, 3)), rng.standard_normal(50)
    rows = np.column_stack([X, y])
    evidence = RowEvidence(("a", "b", "c"), (WhiteningNoise(rows, 0.0, 0.0, 1.0),), 50)
    fit = evidence.fit(("a", "c"))
    theta, left, *_ = np.linalg.lstsq(X[:, [0, 2]], y, rcond=None)
    np.testing.assert_allclose(fit.values, theta, atol=1e-12)
    assert fit.deviance == pytest.approx(50 * np.log(left[0]))
    C = left[0] / 48 * np.linalg.inv(X[:, [0, 2]].T @ X[:, [0, 2]])
    np.testing.assert_allclose(fit.covariance, C, atol=1e-12)
