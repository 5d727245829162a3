"""Both mappings between hand and joints in space, against the plant's own derivatives."""

from __future__ import annotations

import numpy as np
import pytest

from armimpedance.core.errors import NotIdentifiableError
from armimpedance.core.records import ArmPosture, ImpedanceEstimate
from armimpedance.hand.levels import feasible_joint_stiffness, force_term, to_hand, to_joint
from manipulandum_sim.hand import find_subject
from manipulandum_sim.space import SpaceArm, SpaceCondition, find_space_truth

FORCE = np.array([0.0, -5.0, 3.0])
STEP = 1e-4


def truth_and_posture(elbow):
    """The rig's truth, and its posture with derivatives of the place (no truth's formulas)."""
    from manipulandum_sim.space import SpaceRig

    subject = find_subject("A")
    plant = SpaceCondition().plant(subject, SpaceRig(elbow=elbow))
    truth = find_space_truth([plant], FORCE[None], ["one"], 0.0, elbow)
    r, arm, q = list(plant.moving), SpaceArm.of(subject), truth.posture
    units = np.eye(4)[r]
    ahead, behind = (
        [arm.dynamics(q + s * STEP * u, np.zeros((1, 4))).J[0][:, r] for u in units]
        for s in (1, -1)
    )
    bends = np.stack([(a - b) / (2 * STEP) for a, b in zip(ahead, behind, strict=True)], axis=-1)
    posture = ArmPosture(
        joint_angles=q[0][r],
        hand_position=truth.hand[0],
        jacobian=truth.jacobian[0][:, r],
        jacobian_derivative=bends,
        gravity_gradient=truth.gravity_gradient[0][np.ix_(r, r)],
    )
    return truth, posture, np.ix_([0], r, r)


def estimate_of(level, M, B, K):
    return ImpedanceEstimate(
        level=level,
        method="truth",
        inertia=M,
        inertia_with_handle=M,
        viscosity=B,
        stiffness=K,
        covariance=np.zeros((3 * K.size, 3 * K.size)),
        dof=np.inf,
        force=FORCE,
        quality=None,
        keys={},
    )


def relative(found, true):
    return np.linalg.norm(found - true) / np.linalg.norm(true)


@pytest.mark.parametrize("elbow", ["held", "free"])
def test_from_the_joints_to_the_hand(elbow):
    truth, posture, block = truth_and_posture(elbow)
    joint = estimate_of("joint", truth.M_j[block][0], truth.B_j[block][0], truth.K_j[block][0])
    hand = to_hand(joint, posture)
    assert relative(hand.stiffness, truth.K_e[0]) < 1e-6
    assert relative(hand.inertia, truth.M_e[0]) < 1e-9
    weightless = ArmPosture(
        posture.joint_angles,
        posture.hand_position,
        posture.jacobian,
        posture.jacobian_derivative,
        gravity_gradient=np.zeros_like(posture.gravity_gradient),
    )
    assert relative(to_hand(joint, weightless).stiffness, truth.K_e[0]) > 0.02


def test_a_free_arms_joints_are_no_softer_than_the_hand_says():
    truth, posture, block = truth_and_posture("free")
    J, K = posture.jacobian, truth.K_e[0]
    least = J.T @ K @ J - force_term(posture, FORCE) - posture.gravity_gradient
    # of rank 4 - 3: one eigenvalue is the swivel's, three are zero
    values = np.linalg.eigvalsh(truth.K_j[block][0] - least)
    assert np.abs(values[:3]).max() < 1e-5 * values[3]


def test_from_the_hand_to_the_joints_where_the_elbow_is_held():
    truth, posture, block = truth_and_posture("held")
    hand = estimate_of("hand", truth.M_e[0], truth.B_e[0], truth.K_e[0])
    joint = to_joint(hand, posture)
    assert relative(joint.stiffness, truth.K_j[block][0]) < 1e-6
    assert relative(joint.viscosity, truth.B_j[block][0]) < 1e-6
    assert relative(joint.inertia, truth.M_j[block][0]) < 1e-9


def test_four_joints_are_not_told_by_the_hand_and_theirs_is_among_those_that_fit():
    truth, posture, block = truth_and_posture("free")
    hand = estimate_of("hand", truth.M_e[0], truth.B_e[0], truth.K_e[0])
    with pytest.raises(NotIdentifiableError):
        to_joint(hand, posture)
    added = force_term(posture, FORCE) + posture.gravity_gradient
    K_e = (truth.K_e[0] + truth.K_e[0].T) / 2
    fits = feasible_joint_stiffness(K_e, posture.jacobian, force_term=(added + added.T) / 2)
    assert fits.dimension == 4
    assert fits.contains(truth.K_j[block][0], rtol=1e-5)
