"""Twelve motions on two plates: natural, in balance, and consistent with their own derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from armimpedance.core.errors import InputError
from manipulandum_sim.body import performance
from manipulandum_sim.body.draft import Draft, bump, step
from manipulandum_sim.body.motions import MOTIONS
from manipulandum_sim.body.performance import body_motion
from manipulandum_sim.body.plan import centre_of_pressure
from manipulandum_sim.body.subject import find_body_subject
from manipulandum_sim.body.table import (
    ANKLE_HEIGHT,
    BALL_BEFORE_ANKLE,
    HEEL_BEHIND_ANKLE,
)
from manipulandum_sim.force_plates import foot_wrenches, support_torques
from manipulandum_sim.tree_dynamics import contact_wrench, inverse_dynamics, move

#: Half the width of a sole, fraction of the height (Winter, Fig. 4.1, rounded).
FOOT_HALF_WIDTH = 0.025
#: Where the toe lies before the ankle, likewise.
TOE_BEFORE_ANKLE = 0.114
SUBJECT = find_body_subject("A")
SKELETON = SUBJECT.skeleton
HEIGHT = SUBJECT.height_m
WEIGHT_N = SUBJECT.mass_kg * 9.80665
#: A foot that carries less than this may have its centre of pressure anywhere, N.
LOADED_N = 30.0
SOLE = {
    "heel": np.array([-HEEL_BEHIND_ANKLE, 0, -ANKLE_HEIGHT]) * HEIGHT,
    "ball": np.array([BALL_BEFORE_ANKLE, 0, -ANKLE_HEIGHT]) * HEIGHT,
    "toe": np.array([TOE_BEFORE_ANKLE, 0, -ANKLE_HEIGHT]) * HEIGHT,
}


#: What differs most comes first; `make study` looks at the motions beyond the sixth.
FIRST = ("all_joints", "walk", "leg_swings", "front_squat", "arm_circles", "trunk_twist")
ORDER = [*FIRST, *(name for name in MOTIONS if name not in FIRST)]


@pytest.fixture(scope="module", params=ORDER)
def performed(request):
    motion = body_motion(request.param, SUBJECT, np.random.default_rng(5))
    whole = contact_wrench(SKELETON, motion.q, motion.qd, motion.qdd)
    return motion, whole, move(SKELETON, motion.q, motion.qd, motion.qdd)


def sole_points(moved, side):
    i = SKELETON.index(f"{side}_foot")
    return {name: moved.origin[i] + moved.rotation[i] @ point for name, point in SOLE.items()}


def carries(motion, side):
    return motion.left_share > 0 if side == "left" else motion.left_share < 1


@pytest.mark.first_cases(6)
def test_derivatives_are_those_of_the_spline_through_the_samples(performed):
    motion, _, _ = performed
    spline = make_interp_spline(motion.time_s, motion.q, k=5)
    for order, given in ((1, motion.qd), (2, motion.qdd)):
        found = spline(motion.time_s, nu=order)
        assert np.abs(found - given).max() <= 1e-9 * np.abs(given).max()


@pytest.mark.first_cases(6)
def test_feet_stand_on_the_floor_and_stay_above_it(performed):
    motion, _, moved = performed
    for side in ("right", "left"):
        points, loaded = sole_points(moved, side), carries(motion, side)
        # Toes give way under a raised heel.
        assert min(points[name][:, 2].min() for name in ("heel", "ball")) > -1e-6
        np.testing.assert_allclose(points["ball"][loaded, 2], 0, atol=1e-9)


@pytest.mark.parametrize("name", ["leg_swings", "all_joints"])
def test_a_swinging_leg_does_not_scrape_the_floor(name):
    motion = body_motion(name, SUBJECT, np.random.default_rng(106))
    moved = move(SKELETON, motion.q)
    for side in ("right", "left"):
        assert min(place[:, 2].min() for place in sole_points(moved, side).values()) > -1e-6


@pytest.mark.first_cases(6)
def test_a_standing_foot_does_not_slip_between_the_samples(performed):
    motion, _, _ = performed
    fine = np.arange(5 * (len(motion.q) - 1) + 1) / 500.0
    moved = move(SKELETON, make_interp_spline(motion.time_s, motion.q, k=5)(fine))
    for side in ("right", "left"):
        ball = sole_points(moved, side)["ball"]
        stands = carries(motion, side)
        for k in range(5):
            here, both = ball[k::5][: len(stands) - 1], stands[:-1] & stands[1:]
            assert np.abs(here - ball[::5][:-1])[both].max() < 1e-6


@pytest.mark.first_cases(6)
def test_the_pressure_is_under_the_feet(performed):
    """Both feet's centres of pressure are in their soles, so a person can do this."""
    motion, whole, moved = performed
    wrenches, pressure = foot_wrenches(whole, motion.left_share, motion.supports)
    for k, side in enumerate(("right", "left")):
        loaded = wrenches[:, k, 2] > LOADED_N
        R = moved.rotation[SKELETON.index(f"{side}_foot")][loaded]
        forward = R[:, :2, 0] / np.linalg.norm(R[:, :2, 0], axis=1, keepdims=True)
        from_ball = pressure[loaded, k] - sole_points(moved, side)["ball"][loaded, :2]
        along = (from_ball * forward).sum(axis=1)
        across = from_ball[:, 1] * forward[:, 0] - from_ball[:, 0] * forward[:, 1]
        assert along.min() > -(HEEL_BEHIND_ANKLE + BALL_BEFORE_ANKLE) * HEIGHT
        assert along.max() < (TOE_BEFORE_ANKLE - BALL_BEFORE_ANKLE) * HEIGHT
        assert np.abs(across).max() < FOOT_HALF_WIDTH * HEIGHT


@pytest.mark.first_cases(6)
def test_the_floor_pushes_and_the_shoes_hold(performed):
    motion, whole, _ = performed
    assert whole[:, 2].min() > 0.3 * WEIGHT_N
    assert whole[:, 2].max() < 2.0 * WEIGHT_N
    # The mean of a motion that ends where it began carries the weight.
    assert whole[:, 2].mean() == pytest.approx(WEIGHT_N, rel=0.01)
    assert (np.hypot(whole[:, 0], whole[:, 1]) / whole[:, 2]).max() < 0.5
    assert np.abs(motion.q[:, 3:6]).max() < 0.8
    assert np.abs(motion.q[:, SKELETON.coordinate("left_shoulder_abduction")]).max() < 1.45


@pytest.mark.first_cases(6)
def test_no_motor_holds_the_pelvis(performed):
    """The feet's wrenches, each at its own foot, explain all six forces at the root."""
    motion, whole, moved = performed
    wrenches, _ = foot_wrenches(whole, motion.left_share, motion.supports)
    held = support_torques(SKELETON, moved, wrenches)
    tau = inverse_dynamics(SKELETON, motion.q, motion.qd, motion.qdd)
    np.testing.assert_allclose(held[:, :6], tau[:, :6], atol=1e-8)


@pytest.mark.first_cases(6)
def test_it_begins_and_ends_in_quiet_standing(performed):
    """Upright and unaccelerated; a body that is about to step already drifts by centimetres/s."""
    motion, whole, _ = performed
    for i in (0, -1):
        assert np.abs(motion.qd[i]).max() < 0.05
        np.testing.assert_allclose(whole[i, :3], [0, 0, WEIGHT_N], atol=0.01 * WEIGHT_N)


def test_support_torques_are_the_power_of_the_contacts():
    """``qd . J^T w = w . v`` for the feet's own velocities, by differences."""
    motion = body_motion("squat", SUBJECT, np.random.default_rng(1))
    q, qd = motion.q[400:420], motion.qd[400:420]
    rng, h = np.random.default_rng(2), 1e-6
    force, moment = rng.normal(size=(2, len(q), 2, 3))
    power = np.zeros(len(q))
    here, ahead, behind = (move(SKELETON, q + s * h * qd) for s in (0, 1, -1))
    wrenches = np.concatenate([force, moment], axis=2)
    for k, side in enumerate(("right", "left")):
        i = SKELETON.index(f"{side}_foot")
        v = (ahead.origin[i] - behind.origin[i]) / (2 * h)
        spin = (
            (ahead.rotation[i] - behind.rotation[i]) / (2 * h) @ np.swapaxes(here.rotation[i], 1, 2)
        )
        rate = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
        at_ankle = moment[:, k] - np.cross(here.origin[i], force[:, k])
        power += (force[:, k] * v).sum(axis=1) + (at_ankle * rate).sum(axis=1)
    found = (support_torques(SKELETON, here, wrenches) * qd).sum(axis=1)
    np.testing.assert_allclose(found, power, atol=1e-6)


def test_centre_of_pressure_of_a_weight():
    place, weight = np.array([0.3, -0.2, 0.0]), np.array([5.0, -3.0, 700.0])
    wrench = np.concatenate([weight, np.cross(place, weight)])[None]
    np.testing.assert_allclose(centre_of_pressure(wrench), place[None, :2], atol=1e-12)


def test_steps_are_exact_at_their_ends_and_smooth_between():
    t = np.linspace(0, 3, 3001)
    rise = step(t, 1.0, 2.0)
    assert (rise[t <= 1] == 0).all()
    assert (rise[t >= 2] == 1).all()
    assert (np.diff(rise) >= -1e-15).all()
    # The fourth derivative has no jump: its differences shrink with the step.
    fourth = np.diff(step(np.linspace(0.95, 1.05, 2001), 1.0, 2.0), 4) / 5e-5**4
    assert np.abs(np.diff(fourth)).max() < 0.1 * np.abs(fourth).max()
    assert (bump(t, 0.5, 1.0, 1.0, 1.5)[(t < 0.5) | (t > 1.5)] == 0).all()


def test_a_lifted_foot_carries_exactly_nothing():
    d = Draft(SUBJECT, 6.0, 100.0, np.random.default_rng(0))
    d.carry([(1.0, 2.0, 0.0), (3.0, 4.0, 1.0), (4.5, 5.5, 0.5)])
    share = d.left_share
    assert (share[(d.t >= 2) & (d.t <= 3)] == 0).all()
    assert (share[(d.t >= 4) & (d.t <= 4.5)] == 1).all()
    assert share[-1] == 0.5
    assert share.min() == 0
    assert share.max() == 1


def test_another_seed_is_another_performance():
    once, again, other = (
        body_motion("squat", SUBJECT, np.random.default_rng(seed)) for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(once.q, again.q)
    count = min(len(once.q), len(other.q))
    assert 0.01 < np.abs(once.q[:count] - other.q[:count]).max() < 0.6


def test_an_unknown_motion_is_refused():
    with pytest.raises(InputError, match="no motion 'hop'"):
        body_motion("hop", SUBJECT, np.random.default_rng(0))


@pytest.mark.parametrize(("falls", "succeeds"), [(1, True), (100, False)])
def test_who_would_fall_begins_again(falls, succeeds, monkeypatch):
    stood = performance.realise
    left = iter(range(falls))

    def realise(plan, subject):
        if next(left, None) is not None:
            raise InputError("right foot out of reach")
        return stood(plan, subject)

    monkeypatch.setattr(performance, "realise", realise)
    rng = np.random.default_rng(1)
    if succeeds:
        first = body_motion("squat", SUBJECT, np.random.default_rng(1))
        monkeypatch.undo()
        at_once = body_motion("squat", SUBJECT, rng)
        assert not np.array_equal(first.q[:100], at_once.q[:100])
    else:
        with pytest.raises(InputError, match="out of reach"):
            body_motion("squat", SUBJECT, rng)
