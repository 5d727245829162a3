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

from armimpedance.arrays import FloatArray
from armimpedance.errors import InputError
from armimpedance.records import Subject
from armimpedance.skeleton import Hinge, MarkerSite, Segment, Skeleton
from manipulandum_sim.hand import (
    FOREARM_HAND_COM,
    FOREARM_HAND_GYRATION,
    FOREARM_HAND_MASS,
    FOREARM_LENGTH,
    UPPER_ARM_COM,
    UPPER_ARM_GYRATION,
    UPPER_ARM_MASS,
)

# Winter, Table 4.1 and Fig. 4.1 (see `subjects`); trunk from the hips to the shoulders.
UPPER_ARM_LENGTH: Final = 0.186
TRUNK_MASS: Final = 0.497
TRUNK_COM: Final = 0.50
TRUNK_LENGTH: Final = 0.818 - 0.530
SHOULDER_HALF_BREADTH: Final = 0.129
HIP_HALF_BREADTH: Final = 0.0955
HAND_LENGTH: Final = 0.108
#: (mass, centre, radius of gyration) of forearm and hand apart.
FOREARM: Final = (0.016, 0.430, 0.303)
HAND: Final = (0.006, 0.506, 0.297)
# Winter gives no radius about the long axis; de Leva (1996), Table 4, men.
UPPER_ARM_LONG: Final = 0.158
FOREARM_LONG: Final = 0.121

SHOULDER: Final = (
    "right_shoulder_flexion",
    "right_shoulder_abduction",
    "right_shoulder_rotation",
)
ELBOW: Final = "right_elbow_flexion"
WRIST: Final = "right_wrist_flexion"


@dataclass(frozen=True)
class PassiveJoint:
    """``tau = -(k (q - q_r) + K (q - q_r)^2 + h qd + f sign(qd))`` of one hinge.

    Attributes
    ----------
    k, h, f : float
        Stiffness (Nm/rad), viscosity (Nms/rad), Coulomb friction (Nm); f < 0 drives the joint.
    q_r : float
        Rest angle, rad.
    K : float
        Nm/rad^2.
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
        """What a recording says of the subject."""
        upper = UPPER_ARM_LENGTH * self.height_m
        reach = (FOREARM_LENGTH + HAND_LENGTH / 2) * self.height_m
        return Subject(self.name, self.mass_kg, self.height_m, upper, reach)


def rod(mass: float, length: float, centre: float, gyration: float, long: float) -> dict:
    """Mass, centre and inertia of a limb along -z, radii as fractions of its length."""
    square = mass * length**2 * np.array([gyration, gyration, long]) ** 2
    return {
        "mass_kg": mass,
        "com_m": np.array([0.0, 0.0, -centre * length]),
        "inertia_kgm2": np.diag(square),
    }


def _trunk(mass_kg: float, height_m: float) -> Segment:
    """A cylinder of the hips' breadth; its motion is prescribed, its inertia plays no part."""
    length, radius = TRUNK_LENGTH * height_m, HIP_HALF_BREADTH * height_m
    mass = TRUNK_MASS * mass_kg
    across = mass * (3 * radius**2 + length**2) / 12
    return Segment(
        "trunk",
        None,
        np.zeros(3),
        (),
        mass,
        np.array([0.0, 0.0, TRUNK_COM * length]),
        np.diag([across, across, mass * radius**2 / 2]),
    )


def _upper_arm(mass_kg: float, height_m: float) -> Segment:
    axes = ([0, -1, 0], [-1, 0, 0], [0, 0, 1])
    hinges = tuple(Hinge(n, np.array(a, float)) for n, a in zip(SHOULDER, axes, strict=True))
    place = np.array([0.0, -SHOULDER_HALF_BREADTH, TRUNK_LENGTH]) * height_m
    length, mass = UPPER_ARM_LENGTH * height_m, UPPER_ARM_MASS * mass_kg
    body = rod(mass, length, UPPER_ARM_COM, UPPER_ARM_GYRATION, UPPER_ARM_LONG)
    return Segment("right_upper_arm", "trunk", place, hinges, **body)


def _forearms(mass_kg: float, height_m: float, wrist: bool) -> tuple[Segment, ...]:
    """Forearm and hand as one body, or as two."""
    length = FOREARM_LENGTH * height_m
    elbow = np.array([0.0, 0.0, -UPPER_ARM_LENGTH * height_m])
    bend = np.array([0.0, -1.0, 0.0])
    hinge, upper = (Hinge(ELBOW, bend),), "right_upper_arm"
    if not wrist:
        mass = FOREARM_HAND_MASS * mass_kg
        body = rod(mass, length, FOREARM_HAND_COM, FOREARM_HAND_GYRATION, FOREARM_LONG)
        return (Segment("right_forearm", upper, elbow, hinge, **body),)
    share, centre, gyration = FOREARM
    alone = rod(share * mass_kg, length, centre, gyration, FOREARM_LONG)
    share, centre, gyration = HAND
    hand = rod(share * mass_kg, HAND_LENGTH * height_m, centre, gyration, FOREARM_LONG)
    end = np.array([0.0, 0.0, -length])
    return (
        Segment("right_forearm", upper, elbow, hinge, **alone),
        Segment("right_hand", "right_forearm", end, (Hinge(WRIST, bend),), **hand),
    )


def _markers(height_m: float, wrist: bool) -> tuple[MarkerSite, ...]:
    """The eight of the source's Fig. 3, on the skin some centimetres off the bones' axes."""
    upper, fore = UPPER_ARM_LENGTH * height_m, FOREARM_LENGTH * height_m
    top, side = TRUNK_LENGTH * height_m, SHOULDER_HALF_BREADTH * height_m
    knuckle = HAND_LENGTH / 2 * height_m
    hand = ("right_hand", -knuckle) if wrist else ("right_forearm", -fore - knuckle)
    sites: dict[str, tuple[str, list[float]]] = {
        "acromion_right": ("trunk", [0.0, -side, top + 0.03]),
        "acromion_left": ("trunk", [0.0, side, top + 0.03]),
        "upper_arm": ("right_upper_arm", [0.01, -0.045, -2 / 3 * upper]),
        "epicondyle": ("right_upper_arm", [0.0, -0.04, -upper]),
        "forearm": ("right_forearm", [-0.01, -0.035, -2 / 3 * fore]),
        "hand": (hand[0], [-0.02, 0.0, hand[1]]),
        "iliac_right": ("trunk", [0.05, -HIP_HALF_BREADTH * height_m, 0.08]),
        "iliac_left": ("trunk", [0.05, HIP_HALF_BREADTH * height_m, 0.08]),
    }
    return tuple(MarkerSite(n, segment, np.array(p)) for n, (segment, p) in sites.items())


def arm_skeleton(mass_kg: float, height_m: float, *, wrist: bool = False) -> Skeleton:
    """Trunk (floating), right upper arm, right forearm with hand, and the markers.

    Parameters
    ----------
    mass_kg, height_m : float
    wrist : bool
        Hand and forearm are two bodies.

    Raises
    ------
    InputError
        A number that no body has.
    """
    for name, value, most in (("mass in kg", mass_kg, 400.0), ("height in m", height_m, 3.0)):
        if not (np.isfinite(value) and 0 < value <= most):
            raise InputError(f"{name} is {value}", expected=f"more than 0 and at most {most:g}")
    segments = (
        _trunk(mass_kg, height_m),
        _upper_arm(mass_kg, height_m),
        *_forearms(mass_kg, height_m, wrist),
    )
    return Skeleton(segments, _markers(height_m, wrist))


#: Relaxed shoulder and wrist; the elbow-only subjects' shoulder has no friction.
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
