"""The arm in space: its derivatives, its dynamics against the simulator's, its swivel; mapping."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import armimpedance as ai
from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.limb.arm import HELD, SpatialArm, TwoLinkArm, hand_rod
from armimpedance.limb.arm.anthropometry import DE_LEVA
from manipulandum_sim.hand import find_subject, simulate_condition
from manipulandum_sim.hand.robot import IDEAL
from manipulandum_sim.space import SpaceArm

GRAVITY = (0.0, 0.0, -9.80665)
OTHER = SpaceArm.of(find_subject("A"))
ARM = SpatialArm(
    TwoLinkArm(
        *(float(x) for x in OTHER.lengths),
        *(float(x) for x in OTHER.masses),
        *(float(x) for x in OTHER.centres),
        *(float(x) for x in OTHER.across),
    ),
    GRAVITY,
)
ANGLES = np.random.default_rng(3).uniform([-1.5, 0.3, -1.5, 0.3], [1.5, 2.5, 1.5, 2.4], (6, 4))


FREE_WRIST = SpatialArm(ARM.links, GRAVITY, hand_rod(ARM.links))
#: Both arms at six postures each.
CASES = [
    *((ARM, q) for q in ANGLES),
    *(
        (FREE_WRIST, np.append(q, [0.8, -0.3, 0.5] * np.sin(i + q[:3])))
        for i, q in enumerate(ANGLES)
    ),
]


@pytest.mark.parametrize(("arm", "q"), CASES)
def test_place_weight_and_inertia_are_those_of_the_simulated_arm(arm, q):
    # length, kg, centre, across and along of every rod
    simulated = SpaceArm(*np.array(arm.rods).T)
    posture, other = arm.posture(q), simulated.dynamics(q[None], np.zeros((1, len(q))))
    np.testing.assert_allclose(posture.hand_position, other.place[0], atol=1e-14)
    np.testing.assert_allclose(posture.jacobian, other.J[0], atol=1e-14)
    np.testing.assert_allclose(posture.gravity_torque, other.h[0], atol=1e-12)
    np.testing.assert_allclose(posture.inertia, other.M[0], atol=1e-13)


def test_links_are_as_round_as_the_simulated_ones():
    thin = np.array([DE_LEVA["male"].upper_arm.gyration_long, 0.121]) * OTHER.lengths
    np.testing.assert_allclose(OTHER.along, OTHER.masses * thin**2, rtol=1e-12)
    np.testing.assert_allclose([rod.along_kgm2 for rod in ARM.rods], OTHER.along, rtol=1e-12)


@pytest.mark.parametrize(("arm", "q"), CASES)
def test_second_derivatives_are_differences_of_the_first(arm, q):
    h, posture = 1e-5, arm.posture(q)
    for j, step in enumerate(h * np.eye(len(q))):
        ahead, behind = arm.posture(q + step), arm.posture(q - step)
        bend = (ahead.jacobian - behind.jacobian) / (2 * h)
        np.testing.assert_allclose(posture.jacobian_derivative[:, :, j], bend, atol=1e-9)
        weight = (ahead.gravity_torque - behind.gravity_torque) / (2 * h)
        np.testing.assert_allclose(posture.gravity_gradient[:, j], weight, atol=1e-8)


@pytest.mark.parametrize("swivel", [-0.8, 0.0, 0.6, 1.4])
def test_a_hand_and_a_swivel_tell_the_angles(swivel):
    hand = np.array([0.1, 0.45, -0.1])
    q = ARM.joint_angles(hand, swivel)
    np.testing.assert_allclose(ARM.hand_position(q), hand, atol=1e-14)
    assert 0 < q[3] < np.pi
    # the elbow from the line between shoulder and hand, seen from the shoulder
    elbow = SpaceArm.of(find_subject("A")).hand(np.array([[*q[:3], 0.0]]))[0] * (
        OTHER.lengths[0] / OTHER.lengths.sum()
    )
    n = hand / np.linalg.norm(hand)
    off = elbow - (elbow @ n) * n
    down = np.array([0, 0, -1.0]) + n[2] * n
    right = np.cross(down, n)
    assert np.arctan2(off @ right, off @ down) == pytest.approx(swivel, abs=1e-12)
    assert right[0] > 0


@pytest.mark.parametrize("hand", [[0.0, 0.9, 0.0], [0.0, 0.0, -0.4], [0.1, 0.4], [0.0, 0.01, 0.0]])
def test_what_has_no_swivel_is_refused(hand):
    with pytest.raises(InputError):
        ARM.joint_angles(hand, 0.3)


def test_a_held_arms_joints_hold_the_truth_and_lead_back(hands):
    hand, recording, truth = hands
    (joint,) = ai.to_joint(hand, recording=recording)
    low, high = joint.interval()
    r = np.ix_(HELD, HELD)
    true = np.stack([truth.M_j[0][r], truth.B_j[0][r], truth.K_j[0][r]])
    # nine elements each, of which seldom more than two lie outside of their own 95 %
    assert (((low <= true) & (true <= high)).mean(axis=(1, 2)) > 0.7).all()
    assert (np.abs(joint.parameters.reshape(3, 3, 3) - true) < 4 * joint.sd).all()
    (back,) = ai.to_hand([joint], recording=recording)
    K = hand[0].stiffness
    np.testing.assert_allclose(back.stiffness, (K + K.T) / 2, atol=1e-9)


def test_a_free_arm_is_refused_with_what_is_known(hands):
    hand, recording, _ = hands
    with pytest.raises(NotIdentifiableError, match="at least"):
        ai.to_joint(hand, recording=recording, elbow="free")
    with pytest.raises(NotIdentifiableError):
        ai.to_joint(hand, recording=recording.subject)


def test_a_swivel_stands_for_angles_that_were_not_measured(hands):
    (hand,), recording, truth = hands
    unknown = replace(hand, joint_angles=None)
    with pytest.raises(InputError, match="swivel"):
        ai.to_joint([unknown], recording=recording)
    n = truth.hand[0] / np.linalg.norm(truth.hand[0])
    q = truth.posture[0]
    off = OTHER.hand(np.array([[*q[:3], 0.0]]))[0]
    down = np.array([0, 0, -1.0]) + n[2] * n
    swivel = np.degrees(np.arctan2(off @ np.cross(down, n), off @ down))
    (told,) = ai.to_joint([unknown], recording=recording, swivel_deg=swivel)
    (measured,) = ai.to_joint([hand], recording=recording)
    np.testing.assert_allclose(told.joint_angles, measured.joint_angles, atol=1e-3)
    np.testing.assert_allclose(told.stiffness, measured.stiffness, rtol=0.02, atol=0.3)


def test_a_planar_arm_has_no_swivel(hands):
    planar, _ = simulate_condition(seed=1, sets=1, emg=False, servo=IDEAL)
    with pytest.raises(InputError, match="three axes"):
        ai.to_joint(ai.estimate(planar), recording=planar, swivel_deg=10.0)
    hand, recording, _ = hands
    with pytest.raises(InputError, match="in space"):
        ai.to_muscle(hand, arm="planar6", recording=recording)
