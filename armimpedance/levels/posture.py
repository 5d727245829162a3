"""The posture at which an estimate is to be mapped."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from armimpedance.arm import Arm, TwoLinkArm, arm_of
from armimpedance.errors import InputError
from armimpedance.records import ArmPosture, ImpedanceEstimate, Subject

#: A stand-in where the body mass is unknown: kinematics do not need it, and M is dropped.
_ANY_MASS_KG = 70.0


def arm_posture_for(
    estimate: ImpedanceEstimate, subject: Subject | None = None, arm: Arm | None = None
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
        An arm that takes the place of the subject's.

    Returns
    -------
    posture : ArmPosture
    source : str
        Origin of the posture, in words.

    Raises
    ------
    InputError
        Neither angles nor position are known, the hand is out of reach, lengths are missing, or
        an arm without inverse kinematics needs them.
    """
    mass_known = arm is not None or (subject is not None and subject.mass_kg is not None)
    arm = arm if arm is not None else kinematic_arm(subject)
    posture, source = _posture(estimate, arm)
    if not mass_known:
        return replace(posture, inertia=None), f"{source}; body mass unknown"
    return posture, source


def kinematic_arm(subject: Subject | None) -> TwoLinkArm:
    """The two-link arm of a subject whose body mass need not be known: lengths, no inertia.

    Parameters
    ----------
    subject : Subject or None

    Returns
    -------
    TwoLinkArm

    Raises
    ------
    InputError
        No subject, or one without lengths and height.
    """
    if subject is None:
        raise InputError("the arm is not known", expected="a recording or a subject")
    return arm_of(subject if subject.mass_kg else replace(subject, mass_kg=_ANY_MASS_KG))


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
