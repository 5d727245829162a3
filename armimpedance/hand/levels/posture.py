"""Posture at which an estimate is mapped, in the plane and in space, and its arm."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from typing import Final, Literal, cast

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.records import ArmPosture, ImpedanceEstimate, Recording, Subject
from armimpedance.hand.still import WRIST, elbow_told, is_wrist_free
from armimpedance.limb.arm import (
    FREE_WRIST,
    IN_SPACE,
    LOCKED_WRIST,
    Arm,
    SpatialArm,
    TwoLinkArm,
    arm_of,
    hand_rod,
    joints_that_move,
)
from armimpedance.recordings import read_subject
from armimpedance.show.verbs.results import PathLike, read_recording

#: Placeholder for an unknown body mass: kinematics do not need it, and M is dropped.
_ANY_MASS_KG = 70.0


def arm_posture_for(
    estimate: ImpedanceEstimate,
    subject: Subject | None = None,
    arm: Arm | None = None,
    *,
    gravity_m_s2: Sequence[float] | None = None,
) -> tuple[ArmPosture, str]:
    """The arm's posture at the onset, and a sentence on its source.

    Measured joint angles if the estimate has them; else inverse kinematics of the two-link arm
    from the hand's position and the shoulder's (the origin if it is not known), elbow >= 0.

    Parameters
    ----------
    estimate : ImpedanceEstimate
        An estimate at the hand.
    subject : Subject, optional
        Source of the lengths of the two-link arm without an `arm`; without a body mass the posture
        has no inertia.
    arm : Arm, optional
        An arm to be used instead of the subject's; it includes its own gravity.
    gravity_m_s2 : (d,), optional
        Gravity along the hand's axes, from the recording; default: a horizontal plane.

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


def kinematic_arm(
    subject: Subject | None, gravity_m_s2: Sequence[float] | None = None
) -> TwoLinkArm:
    """The two-link arm of a subject; the body mass is only needed if gravity acts.

    Parameters
    ----------
    subject : Subject or None
    gravity_m_s2 : (2,), optional
        Gravity along the hand's axes; default: a horizontal plane.

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


# The posture in space at which an estimate is mapped.

_AXES: Final = 3


def is_in_space(estimate: ImpedanceEstimate) -> bool:
    """True if an estimate is of an arm in space.

    The criterion is three axes at the hand, and four or seven angles at the joints.
    """
    if estimate.level == "hand":
        return estimate.k == _AXES
    return estimate.joint_angles is not None and len(estimate.joint_angles) in IN_SPACE


def spatial_posture_for(
    estimate: ImpedanceEstimate,
    subject: Subject | None,
    *,
    elbow: Literal["held", "free"],
    gravity_m_s2: Sequence[float] | None = None,
    swivel_rad: float | None = None,
    wrist: Literal["locked", "free"] | None = None,
) -> tuple[ArmPosture, FloatArray, str]:
    """Posture in space, all angles (n,), and a sentence on their source.

    Measured joint angles if the estimate has them, seven if the wrist is free; else inverse
    kinematics from the hand's place, the shoulder's and the swivel.

    `elbow`: held: the axial rotation of the upper arm is no joint.
    `gravity_m_s2` (3,): along the hand's axes; default: its part of the stiffness is left out.
    `swivel_rad`: required if the angles were not measured.
    `wrist`: for seven measured angles; default: free.
    Returns: `q` (n,).
    `posture`: of three joints (turn, elevation, elbow), of four (the axial one third), or of these
    and the three of a free wrist.
    Raises InputError: neither angles nor place and swivel are known, lengths or a mass under
    gravity are missing, or the hand is out of reach.
    Raises NotIdentifiableError: singular posture.
    """
    measured = estimate.joint_angles
    arm = spatial_arm(subject, gravity_m_s2, LOCKED_WRIST if measured is None else len(measured))
    weightless = subject is None or not subject.mass_kg
    q, source = _angles(estimate, arm, swivel_rad)
    posture = arm.posture(q, joints_that_move(arm.joints, elbow, wrist))
    return (replace(posture, inertia=None) if weightless else posture), q, source


def spatial_arm(
    subject: Subject | None,
    gravity_m_s2: Sequence[float] | None = None,
    joints: int = LOCKED_WRIST,
) -> SpatialArm:
    """The arm in space of a subject; the body mass is only needed if gravity acts.

    `gravity_m_s2` (3,): along the hand's axes; default: the effect of the arm's weight is left out.
    `joints`: 4, or 7 with a free wrist.
    Raises InputError: no subject, one without lengths and height, gravity of other axes or on an
    unknown mass, or another number of joints.
    """
    if joints not in IN_SPACE:
        raise InputError(
            f"{joints} joint angles of an arm in space",
            expected="four with the wrist locked, seven with it free",
        )
    if gravity_m_s2 is not None and len(gravity_m_s2) != _AXES:
        raise InputError(f"gravity of {len(gravity_m_s2)} axes", expected="3, as the arm in space")
    links = kinematic_arm(subject)
    weightless = subject is None or not subject.mass_kg
    if gravity_m_s2 is not None and any(gravity_m_s2) and weightless:
        raise InputError(
            "gravity acts on this arm, and the body mass is not known",
            column="mass_kg",
            expected="the subject's mass: the arm's weight is a part of the hand's stiffness",
        )
    gravity = None if gravity_m_s2 is None else tuple(float(part) for part in gravity_m_s2)
    hand = hand_rod(links) if joints == FREE_WRIST else None
    return SpatialArm(links, gravity, hand)  # type: ignore[arg-type]


def _angles(
    estimate: ImpedanceEstimate, arm: SpatialArm, swivel_rad: float | None
) -> tuple[FloatArray, str]:
    if estimate.joint_angles is not None:
        return np.asarray(estimate.joint_angles), "posture from measured joint angles"
    if estimate.position is None or swivel_rad is None:
        raise InputError(
            "posture unknown",
            expected="four joint angles, or a hand position and the elbow's swivel",
        )
    source = f"posture from the hand's place and a swivel of {np.degrees(swivel_rad):.3g} deg"
    shoulder = estimate.shoulder_m
    if shoulder is None:
        shoulder, source = np.zeros(_AXES), f"{source}, shoulder taken at the origin"
    return arm.joint_angles(estimate.position - shoulder, swivel_rad), source


# The arm of an estimate or a model, and its moving joints.

#: Source of an arm: a recording, its path, or the subject alone.
Whose = Recording | Subject | PathLike
#: Joints of a planar arm: shoulder and elbow.
PLANAR: Final = (0, 1)
#: "held" if the upper arm was kept from turning about its own axis.
Elbow = Literal["held", "free"]
#: "locked" if forearm and hand were kept from turning.
Wrist = Literal["locked", "free"]


def arm_of_whose(whose: Whose, joints: int = 2) -> Arm:
    """The arm of a recording, of the one at a path, or of a subject, with its gravity.

    Parameters
    ----------
    whose : Recording, Subject or path
    joints : int
        Two links in a plane; the four joints of an arm in space, or seven with a free wrist.

    Returns
    -------
    Arm

    Raises
    ------
    InputError
        The recording cannot be read, its subject has neither lengths nor height, gravity acts in
        other axes, or there is no arm model with so many joints.
    """
    source = read_subject(whose) if isinstance(whose, str | os.PathLike) else whose
    subject = source if isinstance(source, Subject) else source.subject
    gravity = None if isinstance(source, Subject) else source.gravity_m_s2
    if joints in IN_SPACE:
        # one posture at a time, and no dynamics except the weight
        return cast(Arm, spatial_arm(subject, gravity, joints))
    if joints != len(PLANAR):
        expected = "2, 4 or 7; in Python an arm of your own"
        raise InputError(f"a model of {joints} joints", expected=expected)
    return kinematic_arm(subject, gravity)


def moving_joints(joints: int, recording: Whose, elbow: Elbow | None) -> tuple[int, ...]:
    """The joints that move: without the upper arm's axial rotation if that is held.

    Parameters
    ----------
    joints : int
    recording : Recording, Subject or path
    elbow : {"held", "free"} or None
        None: as stated in the recording's trials, else free.

    Returns
    -------
    tuple of int

    Raises
    ------
    InputError
        `elbow` is stated for a planar arm.
    """
    if joints not in IN_SPACE:
        if elbow is not None:
            raise InputError(f"the elbow of an arm of {joints} joints", expected="it in space only")
        return tuple(range(joints))
    stated, wrist = elbow_and_wrist_of(recording)
    return joints_that_move(joints, elbow or stated or "free", wrist)


def elbow_and_wrist_of(recording: Whose | None) -> tuple[Elbow | None, Wrist | None]:
    """Stated freedom of elbow and wrist in a recording: held only if held in all trials."""
    if recording is None or isinstance(recording, Subject):
        return None, None
    opened = recording if isinstance(recording, Recording) else read_recording(recording)
    rows = np.arange(len(opened.trials))
    if WRIST not in opened.trials:
        return elbow_told(opened, rows), None
    return elbow_told(opened, rows), "free" if is_wrist_free(opened, rows) else "locked"
