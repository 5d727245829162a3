"""Joint predictions as the hand's: against the mapping of estimates, and its covariance."""

import numpy as np
import pytest

from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.core.records import ImpedanceEstimate, Quality
from armimpedance.hand.levels.joint import to_hand, to_joint
from armimpedance.limb.arm.two_link import TwoLinkArm
from armimpedance.muscles.models.packed import matrix, triple
from armimpedance.muscles.models.prediction import JointPrediction, at_hand

ARM = TwoLinkArm(0.30, 0.34, 1.9, 1.5, 0.13, 0.17, 0.018, 0.024)
POSTURES = np.array([[1.04, 1.57], [0.6, 1.1], [1.4, 2.2]])
FORCE = np.array([4.0, -9.0])


def prediction(seed=0):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(2, 3, 3, 3))
    covariance = root @ root.transpose(0, 1, 3, 2)
    K = np.array([[15, 6, 16], [20, 8, 18], [12, 4, 14.0]])
    return JointPrediction(
        joint_angles=POSTURES,
        stiffness=K,
        viscosity=K / 12,
        stiffness_covariance=covariance[0],
        viscosity_covariance=covariance[1] / 144,
        dof=17.0,
        extrapolated=np.zeros(3, dtype=bool),
        reasons=("",) * 3,
    )


def as_estimate(found, p):
    """The same prediction as an estimate of the joints, with its covariance element by element."""
    unfold = np.array([[1, 0, 0], [0, 1, 0], [0, 1, 0], [0, 0, 1.0]])
    covariance = np.zeros((12, 12))
    covariance[4:8, 4:8] = unfold @ found.viscosity_covariance[p] @ unfold.T
    covariance[8:, 8:] = unfold @ found.stiffness_covariance[p] @ unfold.T
    return ImpedanceEstimate(
        level="joint",
        method="test",
        inertia=np.eye(2),
        viscosity=found.viscosity_matrices[p],
        stiffness=found.stiffness_matrices[p],
        covariance=covariance,
        dof=17.0,
        quality=Quality(10, 1, 1, 1, 1, 1, 1, 1),
        force=FORCE,
    )


def test_the_same_as_mapping_an_estimate():
    found = prediction()
    hand = at_hand(found, ARM, FORCE)
    for p, q in enumerate(POSTURES):
        mapped = to_hand(as_estimate(found, p), ARM.posture(q))
        assert hand.stiffness_matrices[p] == pytest.approx(mapped.stiffness, rel=1e-9)
        assert hand.viscosity_matrices[p] == pytest.approx(mapped.viscosity, rel=1e-9)
        for field, i in (("viscosity", 1), ("stiffness", 2)):
            assert matrix(hand.sd(field)[p]) == pytest.approx(mapped.sd[i], rel=1e-9)


def test_the_way_back_gives_the_joints_again():
    found = prediction()
    hand = at_hand(found, ARM, np.broadcast_to(FORCE, (3, 2)))
    for p, q in enumerate(POSTURES):
        J = ARM.jacobian(q)
        derivative = ARM.jacobian_derivative(q)
        back = J.T @ hand.stiffness_matrices[p] @ J - np.einsum("k,kij->ij", FORCE, derivative)
        assert triple(back) == pytest.approx(found.stiffness[p], rel=1e-9)


def test_without_a_force_the_force_term_is_none():
    # at zero force K_e J dq must be the hand force of the joint torque K_j dq
    found = prediction()
    hand = at_hand(found, ARM)
    dq = np.array([0.01, -0.02])
    for p, q in enumerate(POSTURES):
        J = ARM.jacobian(q)
        torque = J.T @ hand.stiffness_matrices[p] @ J @ dq
        assert torque == pytest.approx(found.stiffness_matrices[p] @ dq, rel=1e-9)


def test_a_stretched_arm_and_a_wrong_force_are_refused():
    found = prediction()
    straight = JointPrediction(
        **{**found.__dict__, "joint_angles": np.array([[1.0, 1.0], [0.5, 0.0], [1.0, 1.2]])}
    )
    with pytest.raises(NotIdentifiableError, match="posture 2: the arm is stretched"):
        at_hand(straight, ARM)
    with pytest.raises(InputError, match="hand force of shape"):
        at_hand(found, ARM, np.zeros((2, 2)))


def test_to_joint_and_at_hand_agree_on_the_force_term():
    found = prediction()
    hand = at_hand(found, ARM, FORCE)
    measured = ImpedanceEstimate(
        level="hand",
        method="test",
        inertia=np.eye(2),
        viscosity=hand.viscosity_matrices[0],
        stiffness=hand.stiffness_matrices[0],
        covariance=np.eye(12),
        dof=9.0,
        quality=Quality(10, 1, 1, 1, 1, 1, 1, 1),
        force=FORCE,
    )
    joint = to_joint(measured, ARM.posture(POSTURES[0]))
    assert triple(joint.stiffness) == pytest.approx(found.stiffness[0], rel=1e-9)
