"""Hand -> joint -> hand: laws, the force term, covariance."""

from dataclasses import replace

import numpy as np
import pytest
from oracles.pinocchio_arm import planar_chain, seven_joint_arm

from armimpedance.core.conventions import NOMINAL_POSTURE_RAD
from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.core.records import ImpedanceEstimate, Quality
from armimpedance.hand.levels.joint import force_term, to_hand, to_joint
from armimpedance.limb.arm.anthropometry import two_link_arm
from armimpedance.limb.arm.two_link import TwoLinkArm, hand_inertia

ARM = TwoLinkArm(0.30, 0.34, 1.9, 1.5, 0.13, 0.17, 0.018, 0.024)
POSTURE = ARM.posture(NOMINAL_POSTURE_RAD)
THREE = planar_chain([0.30, 0.25, 0.09], [1.9, 1.1, 0.4], [0.13, 0.11, 0.05], [0.018, 0.007, 0.001])
M = np.array([[1.73, -0.66], [-0.66, 1.00]])
B = np.array([[8.63, -6.40], [-5.80, 13.86]])
K = np.array([[104.8, -74.4], [-60.0, 179.3]])
FORCE = np.array([3.0, -8.0])


def some_covariance(k, seed=0, relative=0.05):
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((3 * k * k, 3 * k * k))
    sizes = np.repeat([0.02, 0.3, 4.0], k * k) * relative / 0.05
    return np.outer(sizes, sizes) * (root @ root.T) / (3 * k * k)


def estimate(level="hand", matrices=(M, B, K), **given):
    k = len(matrices[0])
    fields = {
        "level": level,
        "method": "test",
        "inertia": matrices[0],
        "viscosity": matrices[1],
        "stiffness": matrices[2],
        "covariance": some_covariance(k),
        "dof": 39,
        "quality": Quality(40, 1000, 0.98, 0.96, 10.0, 3.0, 12, 0.1),
        "force": FORCE,
        "position": POSTURE.hand_position,
    }
    return ImpedanceEstimate(**(fields | given))


@pytest.mark.parametrize("direction", range(8))
def test_force_term_against_torque_differences_at_three_kilograms(direction):
    # a non-linear force field F(X) of 29.4 N, its slope K_e known: tau(q) = J^T F is differenced
    angle = direction * np.pi / 4
    F0, K_e = 29.4 * np.array([np.cos(angle), np.sin(angle)]), K
    X0 = POSTURE.hand_position

    def torque(q):
        dX = ARM.hand_position(q) - X0
        force = F0 - K_e @ dX - 900.0 * dX**2 + 2e4 * dX @ dX * dX
        return ARM.jacobian(q).T @ force

    step, q = 1e-5, np.array(NOMINAL_POSTURE_RAD)
    shifts = step * np.eye(2)
    slope = np.stack([(torque(q + s) - torque(q - s)) / (2 * step) for s in shifts], axis=-1)
    mapped = to_joint(estimate(force=F0), POSTURE, symmetric=False).stiffness
    assert np.linalg.norm(mapped + slope) < 1e-6 * np.linalg.norm(slope)
    Gamma = POSTURE.jacobian.T @ K_e @ POSTURE.jacobian + slope
    np.testing.assert_allclose(force_term(POSTURE, F0), Gamma, atol=1e-3 * np.abs(Gamma).max())
    # what the source's equation (10) leaves out is far from negligible
    without = to_joint(estimate(force=F0), POSTURE, symmetric=False, force_dependent=False)
    assert np.linalg.norm(without.stiffness + slope) > 0.05 * np.linalg.norm(slope)


def test_force_term_in_closed_form():
    X, u2 = POSTURE.hand_position, POSTURE.hand_position - ARM.elbow_position(NOMINAL_POSTURE_RAD)
    expected = -np.array([[FORCE @ X, FORCE @ u2], [FORCE @ u2, FORCE @ u2]])
    np.testing.assert_allclose(force_term(POSTURE, FORCE), expected, rtol=1e-14)
    with pytest.raises(InputError, match="hand force"):
        force_term(POSTURE, [1.0, 2.0, 3.0])


def test_a_spring_pulling_at_the_shoulder_does_nothing_there():
    # a central force field about the shoulder: no torque at the shoulder whatever the posture
    X = POSTURE.hand_position
    tension, slope = 12.0, 300.0
    line = X / np.linalg.norm(X)
    K_e = slope * np.outer(line, line) + tension / np.linalg.norm(X) * (
        np.eye(2) - np.outer(line, line)
    )
    mapped = to_joint(estimate(matrices=(M, B, K_e), force=-tension * line), POSTURE)
    np.testing.assert_allclose(mapped.stiffness[0], 0, atol=1e-12)
    assert mapped.stiffness[1, 1] > 1


def test_energy_of_a_small_movement_is_the_same_at_both_levels():
    joint = to_joint(estimate(), POSTURE, force_dependent=False)
    dq = np.array([0.01, -0.02])
    dX = POSTURE.jacobian @ dq
    for name in ("inertia", "viscosity", "stiffness"):
        hand_energy = dX @ getattr(estimate(), name) @ dX
        assert dq @ getattr(joint, name) @ dq == pytest.approx(hand_energy)


def test_inertia_of_the_arm_comes_back():
    posture = two_link_arm(70, 1.75).posture(NOMINAL_POSTURE_RAD)
    Lambda = hand_inertia(posture.jacobian, posture.inertia)
    joint = to_joint(estimate(matrices=(Lambda, B, K)), posture)
    np.testing.assert_allclose(joint.inertia, posture.inertia, rtol=1e-10)


@pytest.mark.parametrize("force_dependent", [True, False])
def test_round_trip(force_dependent):
    hand = estimate(inertia_with_handle=M + 0.164 * np.eye(2))
    keep = {"force_dependent": force_dependent}
    back = to_hand(to_joint(hand, POSTURE, symmetric=False, **keep), POSTURE, **keep)
    for name in ("inertia", "inertia_with_handle", "viscosity", "stiffness", "covariance"):
        np.testing.assert_allclose(getattr(back, name), getattr(hand, name), rtol=1e-8, atol=1e-9)
    assert back.level == "hand"
    assert len(back.provenance) == 2
    np.testing.assert_array_equal(back.force, hand.force)


def test_symmetric_part_is_what_is_mapped_by_default():
    joint = to_joint(estimate(), POSTURE)
    np.testing.assert_allclose(joint.stiffness, joint.stiffness.T, rtol=1e-13)
    as_is = to_joint(estimate(), POSTURE, symmetric=False)
    np.testing.assert_allclose(joint.stiffness, (as_is.stiffness + as_is.stiffness.T) / 2)
    # a 2x2 antisymmetric part maps by the determinant
    skew = (K[0, 1] - K[1, 0]) * np.linalg.det(POSTURE.jacobian)
    assert as_is.stiffness[0, 1] - as_is.stiffness[1, 0] == pytest.approx(skew)


def drawn_covariance(source, target, draws=20_000):
    """Covariance of a mapped estimate by brute force, and its standard errors."""
    rng = np.random.default_rng(11)
    k = source.k
    root = np.linalg.cholesky(source.covariance)
    samples = source.parameters + rng.standard_normal((draws, 3 * k * k)) @ root.T
    mapped = np.array([target(s.reshape(3, k, k)) for s in samples])
    covariance = np.cov(mapped.T)
    variances = np.diag(covariance)
    return covariance, np.sqrt((np.outer(variances, variances) + covariance**2) / draws)


def test_covariance_to_the_joints_against_draws():
    hand = estimate()
    J = POSTURE.jacobian
    gamma = force_term(POSTURE, FORCE)

    def target(matrices):
        out = [J.T @ (A + A.T) / 2 @ J for A in matrices]
        out[2] = out[2] - gamma
        return np.ravel(out)

    drawn, error = drawn_covariance(hand, target)
    # 144 entries (78 distinct): the largest of so many stays below 4.5 standard errors
    assert (np.abs(to_joint(hand, POSTURE).covariance - drawn) / error).max() < 4.5


def test_covariance_of_a_redundant_arm_against_draws():
    posture = THREE.posture([0.9, 0.8, 0.5])
    rng = np.random.default_rng(2)
    roots = rng.standard_normal((3, 3, 3))
    # not symmetric, so that left and right of each matrix cannot be confused
    matrices = [s * (4 * np.eye(3) + r) for s, r in zip([0.05, 0.3, 4], roots, strict=True)]
    joint = estimate("joint", matrices)
    # small errors: the map is not linear, and the tolerance is the drawing's own
    joint = replace(joint, covariance=1e-6 * some_covariance(3))
    gamma, J = force_term(posture, FORCE), posture.jacobian

    def target(matrices):
        M, B, K = matrices
        return np.ravel([np.linalg.inv(J @ np.linalg.inv(A) @ J.T) for A in (M, B, K + gamma)])

    drawn, error = drawn_covariance(joint, target, draws=5_000)
    assert (np.abs(to_hand(joint, posture).covariance - drawn) / error).max() < 4.5


def test_compliances_of_redundant_joints_add():
    posture = THREE.posture([0.9, 0.8, 0.5])
    rigid = np.diag([1e9, 1e9, 1e9])
    J = posture.jacobian
    stiffnesses = np.array([30.0, 20.0, 5.0])
    compliance = sum(np.outer(J[:, i], J[:, i]) / stiffnesses[i] for i in range(3))
    joint = estimate("joint", (rigid, rigid, np.diag(stiffnesses)), force=np.zeros(2))
    hand = to_hand(joint, posture)
    np.testing.assert_allclose(hand.stiffness @ compliance, np.eye(2), atol=1e-12)


def test_inertia_of_a_redundant_arm_is_the_operational_one():
    arm = seven_joint_arm(70, 1.75)
    posture = arm.posture([0.4, -0.3, 0.2, 1.1, 0.3, 0.2, -0.1])
    joint = estimate("joint", (posture.inertia, np.eye(7), np.eye(7)), force=None)
    hand = to_hand(joint, posture)
    expected = hand_inertia(posture.jacobian, posture.inertia)
    np.testing.assert_allclose(hand.inertia, expected, rtol=1e-9)


def test_a_redundant_arm_is_refused_the_other_way():
    with pytest.raises(NotIdentifiableError, match="3 joints, 2 hand axes.*feasible_joint") as info:
        to_joint(estimate(), THREE.posture([0.9, 0.8, 0.5]))
    assert info.value.parameters == ("M", "B", "K")


def test_unknown_force_and_posture_near_the_edge_are_told():
    quiet = to_joint(estimate(shoulder_m=np.zeros(2)), POSTURE)
    assert quiet.warnings == ()
    blind = to_joint(estimate(force=None), POSTURE)
    assert any("Gamma was left out" in text for text in blind.warnings)
    zero = to_joint(estimate(force=np.zeros(2)), POSTURE)
    np.testing.assert_array_equal(blind.stiffness, zero.stiffness)
    told = estimate(force=None, shoulder_m=np.zeros(2))
    assert to_joint(told, POSTURE, force_dependent=False).warnings == ()
    straight = to_joint(estimate(), ARM.posture([1.0, 0.02]))
    assert any("nearly singular" in text for text in straight.warnings)
    for mapping, level in ((to_joint, "hand"), (to_hand, "joint")):
        with pytest.raises(NotIdentifiableError, match="singular posture"):
            mapping(estimate(level), ARM.posture([1.0, 0.0]))


def test_a_singular_matrix_of_a_redundant_arm_is_refused():
    joint = estimate("joint", (np.eye(3), np.zeros((3, 3)), np.eye(3)))
    with pytest.raises(NotIdentifiableError, match="viscosity is singular"):
        to_hand(joint, THREE.posture([0.9, 0.8, 0.5]))


def test_a_square_arm_maps_without_viscosity():
    joint = estimate("joint", (np.eye(2), np.zeros((2, 2)), np.eye(2)))
    np.testing.assert_array_equal(to_hand(joint, POSTURE).viscosity, np.zeros((2, 2)))


def test_wrong_level_or_axes():
    with pytest.raises(InputError, match="joint level"):
        to_joint(estimate("joint"), POSTURE)
    with pytest.raises(InputError, match="hand level"):
        to_hand(estimate("hand"), POSTURE)
    posture = seven_joint_arm(70, 1.75).posture(np.full(7, 0.3))
    with pytest.raises(InputError, match="2 hand axes"):
        to_joint(estimate(), posture)


def test_one_joint_that_moves_the_hand_in_a_plane():
    posture = planar_chain([0.3], [1.0], [0.15], [0.01]).posture([0.7])
    J = posture.jacobian
    joint = to_joint(estimate(), posture, force_dependent=False)
    np.testing.assert_allclose(joint.stiffness, J.T @ K @ J)
    assert joint.covariance.shape == (3, 3)


def test_the_torque_that_the_muscles_bear_is_that_of_the_hand_force():
    # virtual work: F . dX = tau . dq for any small dq
    mapped = to_joint(estimate(), POSTURE)
    dq = np.array([3e-6, -2e-6])
    dX = ARM.hand_position(POSTURE.joint_angles + dq) - POSTURE.hand_position
    assert mapped.torque @ dq == pytest.approx(FORCE @ dX, rel=1e-4)
    assert to_joint(estimate(force=None), POSTURE).torque is None


@pytest.mark.parametrize("symmetric", [True, False])
def test_what_rows_share_is_mapped_as_the_matrices_are(symmetric):
    error = np.random.default_rng(4).normal(size=12)
    M_e, B_e, K_e = error.reshape(3, 2, 2)
    bare = to_joint(estimate(), POSTURE, symmetric=symmetric)
    moved = to_joint(estimate(matrices=(M + M_e, B + B_e, K + K_e)), POSTURE, symmetric=symmetric)
    shared = to_joint(
        estimate(shared_errors={"reflex": error}), POSTURE, symmetric=symmetric
    ).shared_errors
    np.testing.assert_allclose(shared["reflex"], moved.parameters - bare.parameters, rtol=1e-9)


def test_what_joints_share_reaches_the_hand_by_its_derivative():
    # three joints, two axes: not linear, so that small errors are asked
    rng = np.random.default_rng(6)
    posture = THREE.posture(np.array([0.5, 1.1, 0.4]))
    roots = rng.normal(size=(3, 3, 3))
    whole = [root @ root.T + 3 * np.eye(3) for root in roots]
    error = rng.normal(size=(3, 3, 3))
    given = {"level": "joint", "matrices": whole, "force": None, "covariance": some_covariance(3)}
    step = 1e-6
    up, down = (
        to_hand(
            estimate(
                **(given | {"matrices": [w + s * e for w, e in zip(whole, error, strict=True)]})
            ),
            posture,
        ).parameters
        for s in (step, -step)
    )
    said = to_hand(estimate(**given, shared_errors={"gain x": error.ravel()}), posture)
    np.testing.assert_allclose(said.shared_errors["gain x"], (up - down) / (2 * step), rtol=1e-5)
