"""The set of joint stiffnesses behind one hand stiffness."""

import numpy as np
import pytest
from oracles.pinocchio_arm import planar_chain, seven_joint_arm

from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.hand.levels.joint import force_term
from armimpedance.hand.levels.redundant import feasible_joint_stiffness
from armimpedance.limb.arm.two_link import TwoLinkArm

THREE = planar_chain([0.30, 0.25, 0.09], [1.9, 1.1, 0.4], [0.13, 0.11, 0.05], [0.018, 0.007, 0.001])
POSTURE = THREE.posture([0.9, 0.8, 0.5])
SEVEN = seven_joint_arm(70, 1.75).posture([0.4, -0.3, 0.2, 1.1, 0.3, 0.2, -0.1])
K_J = np.array([[30.0, 8.0, 1.0], [8.0, 22.0, 3.0], [1.0, 3.0, 6.0]])


def hand_of(K_j, J, gamma=0.0):
    return np.linalg.inv(J @ np.linalg.inv(K_j + gamma) @ J.T)


@pytest.mark.parametrize(("posture", "free"), [(POSTURE, 3), (SEVEN, 22)])
def test_dimension_and_membership(posture, free):
    d, n = posture.jacobian.shape
    rng = np.random.default_rng(1)
    root = rng.standard_normal((n, n))
    K_j = 5 * np.eye(n) + root @ root.T
    K_e = hand_of(K_j, posture.jacobian)
    feasible = feasible_joint_stiffness((K_e + K_e.T) / 2, posture.jacobian)
    assert feasible.dimension == free == n * (n + 1) // 2 - d * (d + 1) // 2
    assert feasible.contains(K_j)
    assert not feasible.contains(1.01 * K_j)
    # the directions and the condition are complementary: K_j is a member for its own coefficients
    offset = np.linalg.inv(K_j) - feasible.compliance
    coefficients = np.tensordot(feasible.directions, offset, axes=2)
    np.testing.assert_allclose(feasible.member(coefficients), K_j, rtol=1e-6)


def test_every_member_gives_the_hand_stiffness_and_respects_the_bound():
    feasible = feasible_joint_stiffness(hand_of(K_J, POSTURE.jacobian), POSTURE.jacobian)
    rng = np.random.default_rng(5)
    scale = np.linalg.norm(feasible.compliance)
    members = []
    while len(members) < 50:
        try:
            members.append(feasible.member(0.3 * scale * rng.standard_normal(3)))
        except InputError:
            continue
    for K_j in members:
        assert feasible.contains(K_j)
        excess = np.linalg.eigvalsh(K_j - feasible.lower_bound)
        # rank n - d = 1
        np.testing.assert_allclose(excess[:2], 0, atol=1e-8 * np.abs(K_j).max())
        assert excess[2] > 0
        assert all(K_j[i, i] >= feasible.element_bounds(i, i)[0] - 1e-9 for i in range(3))


def test_bounds_are_sharp_and_nothing_is_bounded_above():
    feasible = feasible_joint_stiffness(hand_of(K_J, POSTURE.jacobian), POSTURE.jacobian)
    null = np.linalg.svd(POSTURE.jacobian)[2][-1]
    for size in (1e-6, 1e6):
        assert feasible.contains(feasible.lower_bound + size * np.outer(null, null), rtol=1e-4)
    assert feasible.element_bounds(0, 1) == (-np.inf, np.inf)
    assert feasible.element_bounds(1, 1)[1] == np.inf


def test_hand_force_shifts_the_set():
    gamma = force_term(POSTURE, [4.0, -9.0])
    K_e = hand_of(K_J, POSTURE.jacobian, gamma)
    feasible = feasible_joint_stiffness((K_e + K_e.T) / 2, POSTURE.jacobian, force_term=gamma)
    assert feasible.contains(K_J)
    assert feasible.contains(feasible.member([0, 0, 0]))
    without = feasible_joint_stiffness((K_e + K_e.T) / 2, POSTURE.jacobian)
    assert not without.contains(K_J)


def test_a_square_arm_leaves_nothing_free():
    J = TwoLinkArm(0.30, 0.34, 1.9, 1.5, 0.13, 0.17, 0.018, 0.024).jacobian([1.04, 1.57])
    K_e = np.array([[104.8, -74.4], [-74.4, 179.3]])
    feasible = feasible_joint_stiffness(K_e, J)
    assert feasible.dimension == 0
    np.testing.assert_allclose(feasible.member([]), J.T @ K_e @ J, rtol=1e-10)


def test_refusals():
    J = POSTURE.jacobian
    with pytest.raises(InputError, match="symmetric and positive"):
        feasible_joint_stiffness([[1.0, 2.0], [2.0, 1.0]], J)
    with pytest.raises(InputError, match="symmetric and positive"):
        feasible_joint_stiffness([[2.0, 0.5], [0.4, 1.0]], J)
    with pytest.raises(NotIdentifiableError, match="singular posture"):
        feasible_joint_stiffness(np.eye(2), THREE.jacobian([0.9, 0.0, 0.0]))
    feasible = feasible_joint_stiffness(np.eye(2), J)
    with pytest.raises(InputError, match="coefficients"):
        feasible.member([1.0])
    with pytest.raises(InputError, match="not positive"):
        feasible.member([0.0, 0.0, -1e6])
    assert not feasible.contains(-K_J)
    assert not feasible.contains(K_J + [[0, 1, 0], [0, 0, 0], [0, 0, 0]])
