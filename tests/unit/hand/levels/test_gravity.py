"""Gravity's gradient in the mapping, against statics that are solved point by point."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import root

from armimpedance.core.errors import InputError
from armimpedance.core.records import ArmPosture, ImpedanceEstimate, Quality, Subject
from armimpedance.hand.levels import joint as levels
from armimpedance.hand.levels.show import to_hand, to_joint, to_muscle
from armimpedance.hand.show import Estimates
from armimpedance.limb.arm.two_link import TwoLinkArm
from armimpedance.muscles.models import JointPrediction, at_hand

QUALITY = Quality(1, 1, 1.0, 1.0, 1.0, 1.0, 12, 0.0)
STEP = 1e-4


def slope(function, q):
    """d function / dq by central differences, the new axis last."""
    shifts = STEP * np.eye(len(q))
    return np.stack([(function(q + s) - function(q - s)) / (2 * STEP) for s in shifts], axis=-1)


def estimate(level, K, force, **given):
    k = len(K)
    fields = {"position": None, "joint_angles": None, "force": np.asarray(force)}
    return ImpedanceEstimate(
        level, "truth", np.eye(k), K, K, np.eye(3 * k * k), np.inf, QUALITY, **(fields | given)
    )


class Rotating:
    """A four-joint arm in space from rotation matrices alone: shoulder about three axes, elbow."""

    AXES = np.array([[0.0, 0, 1], [1.0, 0, 0], [0, 1.0, 0], [1.0, 0, 0]])
    MASSES = np.array([1.9, 1.5])
    GRAVITY = np.array([0.0, 0.0, -9.81])

    @staticmethod
    def turn(axis, angle):
        x, y, z = axis
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross

    def places(self, q):
        """Centres of mass of both links, and the hand."""
        upper = np.linalg.multi_dot(
            [self.turn(a, x) for a, x in zip(self.AXES[:3], q, strict=False)]
        )
        lower = upper @ self.turn(self.AXES[3], q[3])
        elbow = upper @ [0.02, 0.30, 0.0]
        return (
            upper @ [0.01, 0.13, 0.0],
            elbow + lower @ [0.0, 0.17, 0.01],
            elbow + lower @ [0.0, 0.34, 0.0],
        )

    def hand(self, q):
        return self.places(q)[2]

    def energy(self, q):
        return -sum(m * self.GRAVITY @ p for m, p in zip(self.MASSES, self.places(q), strict=False))


ARM = Rotating()
REST = np.array([0.3, 0.5, -0.4, 1.3])
K_J = np.array(
    [[30.0, 4.0, 2.0, 3.0], [4.0, 26.0, 1.0, 6.0], [2.0, 1.0, 12.0, 2.0], [3.0, 6.0, 2.0, 18.0]]
)


def settled_force(X, offset, start):
    """Force at a hand that is held at X: springs, weight and force in balance, nothing else."""

    def residual(unknown):
        q, force = unknown[:4], unknown[4:]
        springs = offset - K_J @ (q - REST) - 10.0 * (q - REST) ** 3
        balance = springs - slope(ARM.hand, q).T @ force - slope(ARM.energy, q)
        return np.concatenate([balance, 100 * (ARM.hand(q) - X)])

    solution = root(residual, start, tol=1e-12)
    assert np.abs(residual(solution.x)).max() < 1e-7
    return solution.x[4:]


def test_hand_stiffness_of_an_arm_in_space_under_its_weight():
    force, J = np.array([0.0, -5.0, 3.0]), slope(ARM.hand, REST)
    weight, gradient = slope(ARM.energy, REST), slope(lambda q: slope(ARM.energy, q), REST)
    offset = J.T @ force + weight
    start = np.concatenate([REST, force])
    measured = -slope(lambda X: settled_force(X, offset, start), ARM.hand(REST))
    bent = slope(lambda q: slope(ARM.hand, q), REST)
    posture = ArmPosture(
        REST, ARM.hand(REST), J, bent, gravity_torque=weight, gravity_gradient=gradient
    )
    joint = estimate("joint", K_J, force)
    mapped = levels.to_hand(joint, posture)
    assert np.linalg.norm(mapped.stiffness - measured) < 1e-4 * np.linalg.norm(measured)
    assert not mapped.warnings
    # what the muscles bear carries the weight too
    np.testing.assert_allclose(posture.torque_under(force), offset)
    # left out, it is wrong by more than the force term, and the result says so
    without = levels.to_hand(joint, replace(posture, gravity_torque=None, gravity_gradient=None))
    assert np.linalg.norm(without.stiffness - measured) > 0.04 * np.linalg.norm(measured)
    assert without.warnings[0].startswith("gravity: ")


PLANAR = TwoLinkArm(0.30, 0.34, 1.9, 1.5, 0.13, 0.17, 0.018, 0.024, gravity_m_s2=(1.3, -9.7))


def test_planar_gradient_is_the_slope_of_the_torque():
    angles = np.array([[0.7, 1.4], [-1.2, 0.3], [2.0, 2.4]])
    for q, gradient in zip(angles, PLANAR.gravity_gradient(angles), strict=True):
        np.testing.assert_allclose(gradient, slope(PLANAR.gravity, q), atol=1e-6)
    still = replace(PLANAR, gravity_m_s2=(0.0, 0.0))
    assert not still.gravity_gradient(angles).any()


def test_an_arm_in_a_vertical_plane_comes_back_from_its_hand():
    # a known K_j; the hand's stiffness by statics: F(X) = J^-T (tau - g) at the angles that reach X
    q0, K, force = np.array([0.6, 1.5]), np.array([[25.0, 7.0], [7.0, 19.0]]), np.array([4.0, -6.0])
    offset = PLANAR.jacobian(q0).T @ force + PLANAR.gravity(q0)

    def held(X):
        q = PLANAR.joint_angles(X)
        torque = offset - K @ (q - q0)
        return np.linalg.solve(PLANAR.jacobian(q).T, torque - PLANAR.gravity(q))

    posture = PLANAR.posture(q0)
    K_e = -slope(held, posture.hand_position)
    hand = estimate("hand", K_e, force)
    joint = levels.to_joint(hand, posture, symmetric=False)
    np.testing.assert_allclose(joint.stiffness, K, atol=1e-4)
    np.testing.assert_allclose(joint.torque, offset)
    back = levels.to_hand(joint, posture)
    np.testing.assert_allclose(back.stiffness, hand.stiffness, rtol=1e-12)
    flat = levels.to_joint(hand, replace(PLANAR, gravity_m_s2=(0.0, 0.0)).posture(q0))
    assert np.linalg.norm(flat.stiffness - K) > 0.05 * np.linalg.norm(K)


def test_what_a_recording_says_of_gravity_goes_into_the_mapping():
    who = Subject("A", mass_kg=70.0, height_m=1.75)
    hand = estimate("hand", np.diag([200.0, 350.0]), [0.0, 0.0], joint_angles=np.array([0.6, 1.5]))
    flat = to_joint(Estimates((hand,), who))
    told = to_joint(Estimates((hand,), who, (0.0, 0.0)))
    upright = to_joint(Estimates((hand,), who, (0.0, -9.81)))
    np.testing.assert_array_equal(flat[0].stiffness, told[0].stiffness)
    assert "taken as horizontal" in flat[0].provenance[-1]
    assert np.abs(upright[0].stiffness - flat[0].stiffness).max() > 3
    np.testing.assert_allclose(to_hand(upright)[0].stiffness, hand.stiffness, atol=1e-9)
    with pytest.raises(InputError, match="body mass is not known"):
        to_joint(Estimates((hand,), replace(who, mass_kg=None), (0.0, -9.81)))
    with pytest.raises(InputError, match="gravity of 3 axes"):
        to_joint(Estimates((hand,), who, (0.0, 0.0, -9.81)))


def test_muscles_bear_the_weight_and_a_sagittal_arm_asks_for_gravity():
    who = Subject("A", mass_kg=70.0, height_m=1.75)
    hand = estimate("hand", np.diag([200.0, 350.0]), [0.0, 0.0], joint_angles=np.array([0.6, 1.5]))
    silent = to_muscle(Estimates((hand,), who), arm="arm26")[0]
    assert any(w.startswith("gravity: arm26") for w in silent.warnings)
    told = to_muscle(Estimates((hand,), who, (0.0, 0.0)), arm="arm26")[0]
    assert not any(w.startswith("gravity") for w in told.warnings)
    # without a hand force, muscles are tense only where there is a weight to carry
    flat, upright = (
        to_muscle(Estimates((hand,), who, gravity), arm="planar6")[0]
        for gravity in (None, (0.0, -9.81))
    )
    assert flat.tension.max() < 1e-6
    assert upright.tension.max() > 10


def test_what_a_model_predicts_at_the_hand_has_the_weight_in_it():
    q = np.array([[0.6, 1.5]])
    K = np.array([[25.0, 7.0], [7.0, 19.0]])
    known = np.zeros((1, 3, 3))
    predicted = JointPrediction(q, K[[0, 0, 1], [0, 1, 1]][None], [[2.0, 0.5, 2.0]], known, known,
                                10.0, [False], [""])  # fmt: skip
    hand = at_hand(predicted, PLANAR, [4.0, -6.0])
    mapped = levels.to_hand(estimate("joint", K, [4.0, -6.0]), PLANAR.posture(q[0])).stiffness
    np.testing.assert_allclose(hand.stiffness[0], mapped[[0, 0, 1], [0, 1, 1]], rtol=1e-9)
