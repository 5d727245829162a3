"""Legs between pelvis and floor."""

from __future__ import annotations

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from manipulandum_sim.body.legs import (
    LEG_ANGLES,
    FootPath,
    foot_of_angles,
    foot_pose,
    leg_angles,
    leg_of,
    pelvis_ceiling,
)
from manipulandum_sim.body.subject import find_body_subject
from manipulandum_sim.tree_dynamics import move, turn_about

SKELETON = find_body_subject("A").skeleton
LOW = np.array([-0.5, -0.6, -0.8, 0.05, -0.7, -0.5])
HIGH = np.array([1.4, 0.8, 0.8, 2.2, 0.7, 0.5])


@pytest.fixture(params=["right", "left"])
def leg(request):
    return leg_of(SKELETON, request.param, 0.068, 0.13)


def random_states(leg, count=50):
    """Coordinates (N, 36) with a tilted pelvis and random angles of one leg."""
    rng = np.random.default_rng(6)
    q = np.zeros((count, 36))
    q[:, :6] = rng.uniform(-0.6, 0.6, (count, 6))
    columns = [SKELETON.coordinate(f"{leg.side}_{name}") for name in LEG_ANGLES]
    q[:, columns] = rng.uniform(LOW, HIGH, (count, 6))
    motion = move(SKELETON, q)
    return q[:, columns], motion, SKELETON.index(f"{leg.side}_foot")


def test_angles_are_found_again_from_the_poses(leg):
    angles, motion, foot = random_states(leg)
    pelvis = motion.rotation[0], motion.origin[0]
    found = leg_angles(leg, *pelvis, motion.rotation[foot], motion.origin[foot])
    np.testing.assert_allclose(found, angles, atol=1e-9)


def test_the_foot_of_the_angles_is_the_skeleton_s(leg):
    angles, motion, foot = random_states(leg)
    R, ankle = foot_of_angles(leg, motion.rotation[0], motion.origin[0], angles)
    np.testing.assert_allclose(R, motion.rotation[foot], atol=1e-12)
    np.testing.assert_allclose(ankle, motion.origin[foot], atol=1e-12)


def test_the_ball_stays_where_it_is_while_the_heel_rises(leg):
    heel = np.linspace(0, 0.9, 7)
    none = np.zeros_like(heel)
    foot = FootPath(np.tile([0.3, -0.1], (7, 1)), none, none + 0.4, heel)
    R, ankle = foot_pose(leg, foot)
    ball = ankle + R @ np.array([leg.ball_m, 0, -leg.ankle_m])
    np.testing.assert_allclose(ball, ball[:1].repeat(7, axis=0), atol=1e-12)
    assert ball[0, 2] == pytest.approx(0, abs=1e-12)
    assert (np.diff(ankle[:, 2]) > 0).all()


def test_a_foot_too_far_is_refused(leg):
    upright, none = np.eye(3)[None], np.zeros((1, 3))
    with pytest.raises(InputError, match=f"{leg.side} foot out of reach"):
        leg_angles(leg, upright, none, upright, np.array([[0.0, 0.0, -1.2]]))
    with pytest.raises(InputError, match="at every height"):
        pelvis_ceiling(leg, upright, np.zeros((1, 2)), np.array([[3.0, 0.0, 0.1]]), 0.99)


def test_at_the_ceiling_the_leg_is_as_long_as_it_may_be(leg):
    tilt = turn_about(np.array([1.0, 0, 0]), np.array([0.2]))
    place, ankle = np.array([[0.1, 0.05]]), np.array([[0.3, 0.1, 0.07]])
    top = pelvis_ceiling(leg, tilt, place, ankle, 0.97)
    hip = np.column_stack([place, top]) + tilt @ leg.hip
    assert np.linalg.norm(hip - ankle) == pytest.approx(0.97 * leg.length_m, rel=1e-12)
