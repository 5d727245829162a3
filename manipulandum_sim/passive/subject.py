"""Subjects with relaxed arms: body, passive joints, the eight markers of the elbow's examination.

k, h, f of the two built-in elbows are what G. Venture et al. (in-vivo estimation of the human
elbow joint dynamics during passive movements, Tables II and III, test P5) print, with f turned
positive: a joint whose friction drives it is no passive joint.

The rest angle is not printed. From the printed standard deviations the elbow of subject 1 must
hang some 0.63 rad, of subject 2 some 0.72 rad, from its rest (``sd_k = s / rms(q - q_r)``,
``sd_f = s / sqrt(1 - r^2)``, r from the printed condition number). With gravity against k that
is a rest angle of 1.45 +- 0.1 rad, near the right angle at which the second test swings; both
subjects have 1.5.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.records import Subject
from armimpedance.core.skeleton import Skeleton
from manipulandum_sim.passive.segments import ELBOW, SHOULDER, WRIST, arm_lengths, arm_skeleton


@dataclass(frozen=True)
class PassiveJoint:
    """``tau = -(k (q - q_r) + K (q - q_r)^2 + h qd + f sign(qd))`` of one hinge.

    Attributes
    ----------
    k, h, f : float
        Stiffness (N m/rad), viscosity (N m s/rad), Coulomb friction (N m); f < 0 drives the joint.
    q_r : float
        Rest angle, rad.
    K : float
        N m/rad^2.
    """

    k: float = 0.0
    h: float = 0.0
    f: float = 0.0
    q_r: float = 0.0
    K: float = 0.0

    def __post_init__(self) -> None:
        values = (self.k, self.h, self.f, self.q_r, self.K)
        if not np.isfinite(values).all() or self.k < 0 or self.h < 0:
            raise InputError(f"passive joint {values}", expected="finite numbers, k and h >= 0")


@dataclass(frozen=True)
class PassiveSubject:
    """A person whose arm is relaxed.

    Attributes
    ----------
    name : str
    skeleton : Skeleton
        With the eight markers.
    joints : mapping str -> PassiveJoint
        One for every hinge of the arm.
    mass_kg, height_m : float
    """

    name: str
    skeleton: Skeleton
    joints: Mapping[str, PassiveJoint]
    mass_kg: float
    height_m: float

    def __post_init__(self) -> None:
        hinges = {h.name for s in self.skeleton.segments for h in s.hinges}
        if hinges != set(self.joints):
            odd = ", ".join(sorted(hinges ^ set(self.joints)))
            raise InputError(f"subject {self.name}: {odd}", expected="one passive joint per hinge")

    def with_joint(self, name: str, **values: float) -> PassiveSubject:
        """The subject with other numbers of one joint (``k, h, f, q_r, K``).

        Raises
        ------
        InputError
            No such joint, or a number it cannot have.
        """
        if name not in self.joints:
            raise InputError(f"no joint {name!r}", expected=" or ".join(self.joints))
        joints = {**self.joints, name: replace(self.joints[name], **values)}
        return replace(self, joints=joints)

    @property
    def record(self) -> Subject:
        """The subject as a recording holds it."""
        upper, reach = arm_lengths(self.height_m)
        return Subject(self.name, self.mass_kg, self.height_m, upper, reach)


_SHOULDER_JOINTS: Final = {
    "right_shoulder_flexion": PassiveJoint(k=4.0, h=0.30),
    "right_shoulder_abduction": PassiveJoint(k=6.0, h=0.30, q_r=0.10),
    "right_shoulder_rotation": PassiveJoint(k=2.5, h=0.10),
}
_FRICTION: Final = dict(zip(SHOULDER, (0.04, 0.04, 0.02), strict=True))
_WRIST_JOINT: Final = PassiveJoint(k=0.6, h=0.010, f=0.005)


def passive_subject(
    name: str, mass_kg: float, height_m: float, elbow: PassiveJoint, *, whole_arm: bool = False
) -> PassiveSubject:
    """A relaxed subject of any size and elbow.

    Parameters
    ----------
    name : str
    mass_kg, height_m : float
    elbow : PassiveJoint
    whole_arm : bool
        A wrist too, and friction in every joint.

    Returns
    -------
    PassiveSubject

    Raises
    ------
    InputError
        A number that no body has.
    """
    joints = {**_SHOULDER_JOINTS, ELBOW: elbow}
    if whole_arm:
        joints = {n: replace(j, f=_FRICTION.get(n, j.f)) for n, j in joints.items()}
        joints[WRIST] = _WRIST_JOINT
    skeleton = arm_skeleton(mass_kg, height_m, wrist=whole_arm)
    return PassiveSubject(name, skeleton, joints, mass_kg, height_m)


_ELBOW_1: Final = PassiveJoint(k=2.95, h=0.031, f=0.015, q_r=1.5)
_ELBOW_2: Final = PassiveJoint(k=2.04, h=0.025, f=0.010, q_r=1.5)

PASSIVE_SUBJECTS: Final = {
    subject.name: subject
    for subject in (
        passive_subject("1", 70.0, 1.74, _ELBOW_1),
        passive_subject("2", 62.0, 1.70, _ELBOW_2),
        passive_subject("whole-arm", 70.0, 1.74, _ELBOW_1, whole_arm=True),
    )
}


def find_passive_subject(subject: str | PassiveSubject) -> PassiveSubject:
    """A subject by its name.

    Parameters
    ----------
    subject : {"1", "2", "whole-arm"} or PassiveSubject

    Returns
    -------
    PassiveSubject

    Raises
    ------
    InputError
        If there is no such subject.
    """
    if isinstance(subject, PassiveSubject):
        return subject
    if subject not in PASSIVE_SUBJECTS:
        known = " or ".join(PASSIVE_SUBJECTS)
        raise InputError(f"no passive subject {subject!r}", expected=known)
    return PASSIVE_SUBJECTS[subject]


def hinge_values(subject: PassiveSubject, hinges: tuple[str, ...], what: str) -> FloatArray:
    """One number of each of these hinges, (K,)."""
    return np.array([getattr(subject.joints[h], what) for h in hinges])
