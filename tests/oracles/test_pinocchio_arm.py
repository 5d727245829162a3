"""Closed form against Pinocchio, and the general arms."""

import numpy as np
import pinocchio as pin
import pytest
from pinocchio_arm import PinocchioArm, planar_chain, seven_joint_arm

from armimpedance.core.errors import InputError
from armimpedance.limb.arm.anthropometry import two_link_arm
from armimpedance.limb.arm.two_link import TwoLinkArm

GRAVITY = (0.7, -9.81)
ARM = TwoLinkArm(0.30, 0.34, 1.9, 1.5, 0.13, 0.17, 0.018, 0.024, gravity_m_s2=GRAVITY)
ORACLE = planar_chain(
    [0.30, 0.34], [1.9, 1.5], [0.13, 0.17], [0.018, 0.024], gravity_m_s2=(*GRAVITY, 0.0)
)
THREE = planar_chain([0.30, 0.25, 0.09], [1.9, 1.1, 0.4], [0.13, 0.11, 0.05], [0.018, 0.007, 0.001])


def states(n, batch=(40,), seed=1):
    rng = np.random.default_rng(seed)
    return rng.uniform(-np.pi, np.pi, (*batch, n)), rng.uniform(-8, 8, (*batch, n))


@pytest.mark.parametrize(
    "name", ["hand_position", "jacobian", "jacobian_derivative", "inertia", "gravity"]
)
def test_closed_form_equals_pinocchio(name):
    q, _ = states(2)
    np.testing.assert_allclose(getattr(ARM, name)(q), getattr(ORACLE, name)(q), rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ["jacobian_rate", "bias"])
def test_closed_form_equals_pinocchio_in_motion(name):
    q, qd = states(2)
    got, expected = getattr(ARM, name)(q, qd), getattr(ORACLE, name)(q, qd)
    np.testing.assert_allclose(got, expected, rtol=1e-12, atol=1e-12)


def test_closed_form_equals_pinocchio_inverse_dynamics():
    q, qd = states(2)
    qdd = states(2, seed=2)[1]
    model, data = ORACLE.model, ORACLE.model.createData()
    expected = [pin.rnea(model, data, *state).copy() for state in zip(q, qd, qdd, strict=True)]
    tau = np.einsum("tij,tj->ti", ARM.inertia(q), qdd) + ARM.bias(q, qd) + ARM.gravity(q)
    np.testing.assert_allclose(tau, expected, rtol=1e-12, atol=1e-12)


def test_a_planar_chain_has_no_gravity_unless_asked():
    q, _ = states(3)
    np.testing.assert_array_equal(THREE.gravity(q), np.zeros((40, 3)))
    assert np.abs(ORACLE.gravity([0.3, 0.4])).min() > 1


@pytest.mark.parametrize("arm", [THREE, seven_joint_arm(70, 1.75)], ids=["three", "seven"])
def test_derivatives_of_general_arms_by_finite_differences(arm):
    q, qd = states(arm.joints, batch=(4,))
    step = 1e-6
    shifts = step * np.eye(arm.joints)

    def slope(method):
        parts = [(method(q + s) - method(q - s)) / (2 * step) for s in shifts]
        return np.stack(parts, axis=-1)

    np.testing.assert_allclose(arm.jacobian(q), slope(arm.hand_position), atol=1e-8)
    derivative = arm.jacobian_derivative(q)
    np.testing.assert_allclose(derivative, slope(arm.jacobian), atol=1e-8)
    np.testing.assert_allclose(derivative, np.swapaxes(derivative, -1, -2), atol=1e-12)
    rate = np.einsum("...kij,...j->...ki", derivative, qd)
    np.testing.assert_allclose(arm.jacobian_rate(q, qd), rate, atol=1e-10)


def test_seven_joint_arm_contains_the_two_link_arm():
    seven = seven_joint_arm(70, 1.75, sex="female", gravity_m_s2=(0, 0, 0))
    two = two_link_arm(70, 1.75, table="de_leva", sex="female")
    q2, qd2 = states(2)
    q, qd = np.zeros((40, 7)), np.zeros((40, 7))
    q[:, [0, 3]], qd[:, [0, 3]] = q2, qd2
    hand = seven.hand_position(q)
    np.testing.assert_allclose(hand[:, :2], two.hand_position(q2), atol=1e-14)
    np.testing.assert_allclose(hand[:, 2], 0, atol=1e-15)
    both = np.ix_(range(40), [0, 3], [0, 3])
    np.testing.assert_allclose(seven.inertia(q)[both], two.inertia(q2), atol=1e-14)
    np.testing.assert_allclose(seven.bias(q, qd)[:, [0, 3]], two.bias(q2, qd2), atol=1e-12)


def test_seven_joint_arm_hangs_with_its_weight():
    arm = seven_joint_arm(70, 1.75)
    hanging = [0, np.pi / 2, 0, 0, 0, 0, 0]
    np.testing.assert_allclose(arm.gravity(hanging), np.zeros(7), atol=1e-13)
    reaching = arm.gravity(np.zeros(7))
    # held out level, the shoulder carries the mass moment of all three segments (about +y: down)
    two = two_link_arm(70, 1.75, table="de_leva")
    lower = two.upper_arm_m + two.forearm_hand_com_m
    moment = two.upper_arm_kg * two.upper_arm_com_m + two.forearm_hand_kg * lower
    np.testing.assert_allclose(reaching[1], -9.81 * moment, rtol=1e-12)


def test_a_single_joint_is_a_pendulum():
    arm = planar_chain([0.3], [1.2], [0.15], [0.01], gravity_m_s2=(0.0, -9.81, 0.0))
    q, qd = states(1)
    turned = np.stack([-np.sin(q), np.cos(q)], axis=1)
    np.testing.assert_allclose(arm.jacobian(q), 0.3 * turned, atol=1e-15)
    np.testing.assert_allclose(arm.inertia(q), np.full((40, 1, 1), 0.01 + 1.2 * 0.15**2))
    np.testing.assert_allclose(arm.bias(q, qd), 0, atol=1e-12)
    np.testing.assert_allclose(arm.gravity(q), 1.2 * 9.81 * 0.15 * np.cos(q), atol=1e-12)


def test_results_do_not_change_with_the_next_call():
    first = THREE.jacobian([0.1, 0.2, 0.3])
    kept = first.copy()
    THREE.jacobian([1.0, 1.0, 1.0])
    np.testing.assert_array_equal(first, kept)


def test_hostile_models_and_states():
    with pytest.raises(InputError, match="no frame"):
        PinocchioArm(THREE.model, "foot")
    with pytest.raises(InputError, match="hand axes"):
        PinocchioArm(THREE.model, "hand", hand_axes=(0, 3))
    with pytest.raises(InputError, match="3 values"):
        THREE.jacobian([0.1, 0.2])
    with pytest.raises(InputError, match="not finite"):
        THREE.jacobian([0.1, 0.2, np.nan])
    with pytest.raises(InputError, match="different lengths"):
        planar_chain([0.3, 0.3], [1.0], [0.1], [0.01])
    with pytest.raises(InputError, match="not positive"):
        planar_chain([0.3], [-1.0], [0.1], [0.01])
    with pytest.raises(InputError, match="height"):
        seven_joint_arm(70, 0)
    ball = pin.Model()
    joint = ball.addJoint(0, pin.JointModelSpherical(), pin.SE3.Identity(), "ball")
    ball.addFrame(pin.Frame("hand", joint, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    with pytest.raises(InputError, match="one coordinate"):
        PinocchioArm(ball, "hand")
