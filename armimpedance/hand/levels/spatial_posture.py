"""The posture in space at which an estimate is to be mapped."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.records import ArmPosture, ImpedanceEstimate, Subject
from armimpedance.hand.levels.posture import kinematic_arm
from armimpedance.limb.arm import (
    FREE_WRIST,
    IN_SPACE,
    LOCKED_WRIST,
    SpatialArm,
    hand_rod,
    joints_that_move,
)

_AXES: Final = 3


def is_in_space(estimate: ImpedanceEstimate) -> bool:
    """Whether an estimate is of an arm in space.

    Parameters
    ----------
    estimate : ImpedanceEstimate

    Returns
    -------
    bool
        Of the hand by its three axes, of the joints by its four angles, or seven.
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
    """The posture, all angles (n,), and one sentence that says where they come from.

    Measured joint angles if the estimate has them, seven where the wrist is free; else inverse
    kinematics from the hand's place, the shoulder's and the swivel.

    Parameters
    ----------
    estimate : ImpedanceEstimate
    subject : Subject or None
    elbow : {"held", "free"}
        Held: the upper arm's axial turning is no joint.
    gravity_m_s2 : (3,), optional
        Along the hand's axes; without, its part of the stiffness is left out.
    swivel_rad : float, optional
        Needed where the angles were not measured.
    wrist : {"locked", "free"}, optional
        Of seven measured angles; default: free.

    Returns
    -------
    posture : ArmPosture
        Of three joints (turn, elevation, elbow), of four (the axial one third), or of these and
        the three of a free wrist.
    q : (n,)
    source : str

    Raises
    ------
    InputError
        Neither angles nor place and swivel are known, lengths or a mass under gravity are missing,
        or the hand is out of reach.
    NotIdentifiableError
        Singular posture.
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
    """The arm in space of a subject, whose body mass need not be known where no gravity acts.

    Parameters
    ----------
    subject : Subject or None
    gravity_m_s2 : (3,), optional
        Along the hand's axes; without, what the arm's weight adds is left out.
    joints : int
        4, or 7 with a free wrist.

    Returns
    -------
    SpatialArm

    Raises
    ------
    InputError
        No subject, one without lengths and height, gravity of other axes or on an unknown mass, or
        another number of joints.
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
