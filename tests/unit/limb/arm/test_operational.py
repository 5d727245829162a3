"""Laws of the dynamics at the hand, eqs. (14)-(20) of Tsuji (1997)."""

import numpy as np
import pinocchio as pin
import pytest
from oracles.pinocchio_arm import planar_chain, seven_joint_arm

from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.limb.arm.anthropometry import two_link_arm
from armimpedance.limb.arm.two_link import dynamic_inverse, hand_bias, hand_gravity, hand_inertia

TWO = two_link_arm(70, 1.75)
THREE = planar_chain(
    [0.30, 0.25, 0.09], [1.9, 1.1, 0.4], [0.13, 0.11, 0.05], [0.018, 0.007, 0.001],
    gravity_m_s2=(0.0, -9.81, 0.0),
)  # fmt: skip
SEVEN = seven_joint_arm(70, 1.75)


def states(arm, count=12, seed=5):
    rng = np.random.default_rng(seed)
    return rng.uniform(0.3, 1.3, (count, arm.joints)), rng.uniform(-5, 5, (count, arm.joints))


@pytest.mark.parametrize("arm", [TWO, THREE, SEVEN], ids=["two", "three", "seven"])
def test_dynamic_inverse_is_a_right_inverse(arm):
    q, _ = states(arm)
    J, M = arm.jacobian(q), arm.inertia(q)
    identity = np.broadcast_to(np.eye(arm.axes), (12, arm.axes, arm.axes))
    np.testing.assert_allclose(J @ dynamic_inverse(J, M), identity, atol=1e-11)
    Lambda = hand_inertia(J, M)
    np.testing.assert_allclose(Lambda, np.swapaxes(Lambda, -1, -2), rtol=1e-9, atol=1e-12)
    assert np.linalg.eigvalsh(Lambda).min() > 0


def test_square_arm_needs_no_generalised_inverse():
    q, _ = states(TWO)
    J, M = TWO.jacobian(q), TWO.inertia(q)
    inverse = np.linalg.inv(J)
    np.testing.assert_allclose(dynamic_inverse(J, M), inverse, rtol=1e-9)
    expected = np.swapaxes(inverse, -1, -2) @ M @ inverse
    np.testing.assert_allclose(hand_inertia(J, M), expected, rtol=1e-9)


@pytest.mark.parametrize("arm", [THREE, SEVEN], ids=["three", "seven"])
def test_hand_accelerates_as_forward_dynamics_say(arm):
    q, qd = states(arm)
    tau = np.random.default_rng(9).uniform(-10, 10, q.shape)
    data = arm.model.createData()
    state = zip(q, qd, tau, strict=True)
    qdd = np.array([pin.aba(arm.model, data, *row).copy() for row in state])
    J, M = arm.jacobian(q), arm.inertia(q)
    Jdot_qd = np.einsum("tij,tj->ti", arm.jacobian_rate(q, qd), qd)
    acceleration = np.einsum("tij,tj->ti", J, qdd) + Jdot_qd
    h_e = hand_bias(J, Jdot_qd, M, arm.bias(q, qd))
    g_e = hand_gravity(J, M, arm.gravity(q))
    # Lambda_e Xdd + h_e + g_e = Jbar^T tau
    left = np.einsum("tij,tj->ti", hand_inertia(J, M), acceleration) + h_e + g_e
    right = np.einsum("tji,tj->ti", dynamic_inverse(J, M), tau)
    np.testing.assert_allclose(left, right, rtol=1e-9, atol=1e-9)


def test_a_locked_joint_can_only_make_the_hand_heavier():
    q, _ = states(THREE)
    J, M = THREE.jacobian(q), THREE.inertia(q)
    gain = hand_inertia(J[..., :2], M[..., :2, :2]) - hand_inertia(J, M)
    assert np.linalg.eigvalsh(gain).min() > -1e-9


def test_singular_posture_and_too_few_joints_are_refused():
    with pytest.raises(NotIdentifiableError, match="singular posture"):
        hand_inertia(TWO.jacobian([1.0, 0.0]), TWO.inertia([1.0, 0.0]))
    with pytest.raises(NotIdentifiableError, match="1 joints"):
        hand_inertia(np.ones((2, 1)), np.eye(1))
    with pytest.raises(InputError, match="shape"):
        hand_inertia(np.eye(2), np.eye(3))
