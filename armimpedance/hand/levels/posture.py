"""The posture at which an estimate is to be mapped."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.core.records import ArmPosture, ImpedanceEstimate, Subject
from armimpedance.limb.arm import Arm, TwoLinkArm, arm_of

#: A stand-in where the body mass is unknown: kinematics do not need it, and M is dropped.
_ANY_MASS_KG = 70.0


def arm_posture_for(
    estimate: ImpedanceEstimate,
    subject: Subject | None = None,
    arm: Arm | None = None,
    *,
    gravity_m_s2: Sequence[float] | None = None,
) -> tuple[ArmPosture, str]:
    """The arm's posture at the onset, and one sentence that says where it comes from.

    Measured joint angles if the estimate has them; else inverse kinematics of the two-link arm
    from the hand's position and the shoulder's (the origin where it is not known), elbow >= 0.

    Parameters
    ----------
    estimate : ImpedanceEstimate
        An estimate at the hand.
    subject : Subject, optional
        Gives the lengths of the two-link arm where no `arm` is given; without a body mass the
        posture has no inertia.
    arm : Arm, optional
        An arm that takes the place of the subject's; it knows its own gravity.
    gravity_m_s2 : (d,), optional
        Gravity along the hand's axes, as the recording says; without, the plane is taken as
        horizontal.

    Returns
    -------
    posture : ArmPosture
    source : str
        Origin of the posture, in words.

    Raises
    ------
    InputError
        Neither angles nor position are known, the hand is out of reach, lengths are missing, an
        arm without inverse kinematics needs them, or gravity acts on an arm of unknown mass.
    """
    mass_known = arm is not None or (subject is not None and subject.mass_kg is not None)
    arm = arm if arm is not None else kinematic_arm(subject, gravity_m_s2)
    posture, source = _posture(estimate, arm)
    if mass_known:
        return posture, source
    return replace(posture, inertia=None), f"{source}; body mass unknown"


def _in_gravity(arm: TwoLinkArm, gravity_m_s2: Sequence[float] | None) -> TwoLinkArm:
    if gravity_m_s2 is None:
        return arm
    if len(gravity_m_s2) != arm.axes:
        raise InputError(
            f"gravity of {len(gravity_m_s2)} axes", expected=f"{arm.axes}, as the two-link arm"
        )
    return replace(arm, gravity_m_s2=(float(gravity_m_s2[0]), float(gravity_m_s2[1])))


def kinematic_arm(
    subject: Subject | None, gravity_m_s2: Sequence[float] | None = None
) -> TwoLinkArm:
    """The two-link arm of a subject whose body mass need not be known where no gravity acts.

    Parameters
    ----------
    subject : Subject or None
    gravity_m_s2 : (2,), optional
        Gravity along the hand's axes; without, the plane is taken as horizontal.

    Returns
    -------
    TwoLinkArm

    Raises
    ------
    InputError
        No subject, one without lengths and height, or gravity on an arm of unknown mass.
    """
    if subject is None:
        raise InputError("the arm is not known", expected="a recording or a subject")
    arm = arm_of(subject if subject.mass_kg else replace(subject, mass_kg=_ANY_MASS_KG))
    if gravity_m_s2 is None or not any(gravity_m_s2):
        return arm
    if len(gravity_m_s2) != arm.axes:
        raise InputError(
            f"gravity of {len(gravity_m_s2)} axes", expected=f"{arm.axes}, as the two-link arm"
        )
    if not subject.mass_kg:
        raise InputError(
            "gravity acts in this plane, and the body mass is not known",
            column="mass_kg",
            expected="the subject's mass: the arm's weight is a part of the hand's stiffness",
        )
    return replace(arm, gravity_m_s2=(float(gravity_m_s2[0]), float(gravity_m_s2[1])))


def _posture(estimate: ImpedanceEstimate, arm: Arm) -> tuple[ArmPosture, str]:
    if estimate.joint_angles is not None:
        if len(estimate.joint_angles) != arm.joints:
            raise InputError(
                f"{len(estimate.joint_angles)} measured joint angles",
                expected=f"{arm.joints}, as the arm has",
            )
        return arm.posture(estimate.joint_angles), "posture from measured joint angles"
    if estimate.position is None:
        raise InputError("posture unknown", expected="joint angles or a hand position")
    if not isinstance(arm, TwoLinkArm):
        raise InputError("posture unknown", expected="joint angles: this arm has no inverse")
    hand = estimate.position
    shoulder, source = estimate.shoulder_m, "posture from inverse kinematics of the two-link arm"
    if shoulder is None:
        shoulder, source = np.zeros_like(hand), f"{source}, shoulder taken at the origin"
    if shoulder.shape != hand.shape:
        wanted = f"{len(hand)} values, as the hand's position"
        raise InputError(f"shoulder with {len(shoulder)} values", expected=wanted)
    return arm.posture(arm.joint_angles(hand - shoulder)), source
