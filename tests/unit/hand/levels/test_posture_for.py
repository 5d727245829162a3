"""Which posture an estimate is mapped at, and that it is said."""

import numpy as np
import pytest
from oracles.pinocchio_arm import planar_chain

from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate, Quality, Subject
from armimpedance.hand.levels.posture import arm_posture_for
from armimpedance.limb.arm.anthropometry import two_link_arm

SUBJECT = Subject("A", 65, 1.70, 0.30, 0.34)
ARM = two_link_arm(65, 1.70, upper_arm_m=0.30, forearm_hand_m=0.34)
Q = np.array([1.04, 1.57])
CHAIN = planar_chain([0.3, 0.25, 0.09], [1.9, 1.1, 0.4], [0.1, 0.1, 0.05], [0.02, 0.01, 0.001])


def estimate(**given):
    quality = Quality(40, 1000, 0.98, 0.96, 10.0, 3.0, 12, 0.1)
    eye = np.eye(2)
    return ImpedanceEstimate("hand", "test", eye, eye, eye, np.eye(12), 39, quality, **given)


def test_measured_angles_come_first():
    posture, source = arm_posture_for(estimate(joint_angles=Q, position=[0.1, 0.1]), SUBJECT)
    np.testing.assert_array_equal(posture.joint_angles, Q)
    np.testing.assert_array_equal(posture.inertia, ARM.inertia(Q))
    assert "measured" in source


def test_inverse_kinematics_from_the_shoulder():
    shoulder = np.array([-0.2, 0.05])
    hand = ARM.hand_position(Q)
    posture, source = arm_posture_for(
        estimate(position=hand + shoulder, shoulder_m=shoulder), SUBJECT
    )
    np.testing.assert_allclose(posture.joint_angles, Q, atol=1e-12)
    assert "inverse kinematics" in source
    assert "origin" not in source
    posture, source = arm_posture_for(estimate(position=hand), arm=ARM)
    np.testing.assert_allclose(posture.joint_angles, Q, atol=1e-12)
    assert "origin" in source


def test_a_subject_without_mass_has_a_posture_without_inertia():
    weightless = Subject("B", None, None, 0.30, 0.34)
    posture, source = arm_posture_for(estimate(joint_angles=Q), weightless)
    assert posture.inertia is None
    assert "mass unknown" in source
    np.testing.assert_array_equal(posture.jacobian, ARM.jacobian(Q))


def test_what_is_missing_is_named():
    with pytest.raises(InputError, match="the arm is not known"):
        arm_posture_for(estimate(joint_angles=Q))
    with pytest.raises(InputError, match="upper_arm_m"):
        arm_posture_for(estimate(joint_angles=Q), Subject("C"))
    with pytest.raises(InputError, match="posture unknown"):
        arm_posture_for(estimate(), SUBJECT)
    with pytest.raises(InputError, match="out of reach"):
        arm_posture_for(estimate(position=[2.0, 0.0]), SUBJECT)
    with pytest.raises(InputError, match="2 measured joint angles"):
        arm_posture_for(estimate(joint_angles=Q), arm=CHAIN)
    with pytest.raises(InputError, match="no inverse"):
        arm_posture_for(estimate(position=[0.1, 0.3]), arm=CHAIN)
    with pytest.raises(InputError, match="shoulder with 3"):
        arm_posture_for(estimate(position=[0.1, 0.3], shoulder_m=[0, 0, 0]), SUBJECT)
