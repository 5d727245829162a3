"""Laws of the closed forms that need no other implementation."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from armimpedance.core.errors import InputError
from armimpedance.limb.arm.two_link import TwoLinkArm

ARM = TwoLinkArm(0.30, 0.34, 1.9, 1.5, 0.13, 0.17, 0.018, 0.024)
angles = st.tuples(st.floats(-3, 3), st.floats(0.05, 3.0))
STEP = 1e-6


def central_difference(function, q, i, step=STEP):
    shift = np.zeros(len(q))
    shift[i] = step
    return (function(np.asarray(q) + shift) - function(np.asarray(q) - shift)) / (2 * step)


@given(angles)
def test_jacobian_is_the_derivative_of_the_position(q):
    expected = np.stack([central_difference(ARM.hand_position, q, i) for i in range(2)], axis=-1)
    np.testing.assert_allclose(ARM.jacobian(q), expected, atol=1e-9)


@given(angles)
def test_jacobian_derivative_is_the_derivative_of_the_jacobian(q):
    expected = np.stack([central_difference(ARM.jacobian, q, i) for i in range(2)], axis=-1)
    derivative = ARM.jacobian_derivative(q)
    np.testing.assert_allclose(derivative, expected, atol=1e-9)
    np.testing.assert_array_equal(derivative, np.swapaxes(derivative, -1, -2))


@given(angles, st.tuples(st.floats(-5, 5), st.floats(-5, 5)))
def test_jacobian_rate_follows_a_moving_arm(q, qd):
    q, qd = np.array(q), np.array(qd)
    ahead, behind = ARM.jacobian(q + STEP * qd), ARM.jacobian(q - STEP * qd)
    np.testing.assert_allclose(ARM.jacobian_rate(q, qd), (ahead - behind) / (2 * STEP), atol=1e-8)


def test_source_matrix_at_the_nominal_posture():
    # Tsuji (1997), eq. (32), with l1 the upper arm and l2 the forearm
    s, e = 1.04, 1.57
    l1, l2 = 0.30, 0.34
    expected = [
        [-l1 * np.sin(s) - l2 * np.sin(s + e), -l2 * np.sin(s + e)],
        [l1 * np.cos(s) + l2 * np.cos(s + e), l2 * np.cos(s + e)],
    ]
    np.testing.assert_allclose(ARM.jacobian([s, e]), expected, rtol=1e-15)


def test_straight_arm_lies_on_the_x_axis():
    np.testing.assert_allclose(ARM.hand_position([0, 0]), [0.64, 0], atol=1e-16)
    np.testing.assert_allclose(ARM.hand_position([np.pi / 2, np.pi / 2]), [-0.34, 0.30], atol=1e-15)


@given(angles)
def test_inverse_kinematics_undoes_the_forward_ones(q):
    back = ARM.joint_angles(ARM.hand_position(q))
    np.testing.assert_allclose(ARM.hand_position(back), ARM.hand_position(q), atol=1e-12)
    np.testing.assert_allclose(back, q, atol=1e-7)


def test_inverse_kinematics_on_the_edge_and_beyond():
    np.testing.assert_allclose(ARM.joint_angles([[0, 0.64]]), [[np.pi / 2, 0]], atol=1e-6)
    with pytest.raises(InputError, match=r"0\.700 m from the shoulder.*0\.040 to 0\.640 m"):
        ARM.joint_angles([[0.2, 0.2], [0.0, 0.7]])
    with pytest.raises(InputError, match="out of reach"):
        ARM.joint_angles([0.0, 0.01])


@given(angles)
def test_inertia_is_symmetric_positive_and_blind_to_the_shoulder(q):
    M = ARM.inertia(q)
    np.testing.assert_array_equal(M, M.T)
    assert np.linalg.eigvalsh(M)[0] > 0
    np.testing.assert_array_equal(M, ARM.inertia([q[0] + 1, q[1]]))


def test_inertia_is_the_kinetic_energy_of_the_two_bodies():
    rng = np.random.default_rng(3)
    q, qd = rng.uniform(-2, 2, 2), rng.uniform(-3, 3, 2)

    def centres(q):
        upper = ARM.upper_arm_com_m / ARM.upper_arm_m * ARM.elbow_position(q)
        along = (ARM.hand_position(q) - ARM.elbow_position(q)) / ARM.forearm_hand_m
        return np.stack([upper, ARM.elbow_position(q) + ARM.forearm_hand_com_m * along])

    speeds = (centres(q + STEP * qd) - centres(q - STEP * qd)) / (2 * STEP)
    masses = np.array([ARM.upper_arm_kg, ARM.forearm_hand_kg])
    spins = ARM.upper_arm_inertia_kgm2 * qd[0] ** 2 + ARM.forearm_hand_inertia_kgm2 * qd.sum() ** 2
    energy = (masses @ (speeds**2).sum(axis=1) + spins) / 2
    np.testing.assert_allclose(qd @ ARM.inertia(q) @ qd / 2, energy, rtol=1e-8)


@given(angles, st.tuples(st.floats(-5, 5), st.floats(-5, 5)))
def test_coriolis_torque_does_no_net_work(q, qd):
    # d/dt (qd^T M qd / 2) = qd^T tau: with tau = M qdd + h this asks qd^T (Mdot qd - 2 h) = 0
    q, qd = np.array(q), np.array(qd)
    Mdot = (ARM.inertia(q + STEP * qd) - ARM.inertia(q - STEP * qd)) / (2 * STEP)
    np.testing.assert_allclose(qd @ Mdot @ qd, 2 * qd @ ARM.bias(q, qd), atol=1e-6)


def test_free_arm_keeps_its_energy_and_its_angular_momentum():
    def rate(state):
        q, qd = state
        return np.stack([qd, np.linalg.solve(ARM.inertia(q), -ARM.bias(q, qd))])

    state, dt = np.array([[0.3, 1.2], [2.0, -4.0]]), 1e-3
    start = [ARM.inertia(state[0]) @ state[1]]
    for _ in range(500):
        k1 = rate(state)
        k2 = rate(state + dt / 2 * k1)
        k3 = rate(state + dt / 2 * k2)
        state = state + dt / 6 * (k1 + 2 * k2 + 2 * k3 + rate(state + dt * k3))
    end = ARM.inertia(state[0]) @ state[1]
    assert abs(state[0, 1] - 1.2) > 0.5
    np.testing.assert_allclose(end[0], start[0][0], rtol=1e-8)
    np.testing.assert_allclose(end @ state[1], start[0] @ [2.0, -4.0], rtol=1e-8)


@given(angles)
def test_gravity_is_the_slope_of_the_potential(q):
    arm = TwoLinkArm(0.30, 0.34, 1.9, 1.5, 0.13, 0.17, 0.018, 0.024, gravity_m_s2=(1.0, -9.81))

    def potential(q):
        upper = arm.upper_arm_com_m / arm.upper_arm_m * arm.elbow_position(q)
        along = (arm.hand_position(q) - arm.elbow_position(q)) / arm.forearm_hand_m
        lower = arm.elbow_position(q) + arm.forearm_hand_com_m * along
        return -(arm.upper_arm_kg * upper + arm.forearm_hand_kg * lower) @ [1.0, -9.81]

    expected = [central_difference(potential, q, i) for i in range(2)]
    np.testing.assert_allclose(arm.gravity(q), expected, atol=1e-7)
    np.testing.assert_array_equal(ARM.gravity(q), [0, 0])


def test_batches_equal_single_states():
    rng = np.random.default_rng(0)
    q, qd = rng.uniform(-2, 2, (3, 4, 2)), rng.uniform(-2, 2, (3, 4, 2))
    for name in ("hand_position", "elbow_position", "jacobian", "jacobian_derivative", "inertia"):
        method = getattr(ARM, name)
        np.testing.assert_array_equal(method(q)[2, 1], method(q[2, 1]))
    for name in ("jacobian_rate", "bias"):
        method = getattr(ARM, name)
        np.testing.assert_array_equal(method(q, qd)[2, 1], method(q[2, 1], qd[2, 1]))
    np.testing.assert_allclose(ARM.gravity(q), np.zeros((3, 4, 2)))


def test_posture_holds_what_the_arm_says():
    posture = ARM.posture([1.04, 1.57])
    np.testing.assert_array_equal(posture.jacobian, ARM.jacobian([1.04, 1.57]))
    np.testing.assert_array_equal(posture.inertia, ARM.inertia([1.04, 1.57]))
    assert (ARM.joints, ARM.axes) == (2, 2)


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf])
def test_an_arm_needs_positive_numbers(bad):
    with pytest.raises(InputError, match="forearm_hand_kg"):
        TwoLinkArm(0.3, 0.34, 1.9, bad, 0.13, 0.17, 0.018, 0.024)


@pytest.mark.parametrize("bad", [[1.0], 1.0, [1, 2, 3], [np.nan, 1]])
def test_states_of_the_wrong_kind(bad):
    with pytest.raises(InputError, match="two-link arm"):
        ARM.jacobian(bad)
