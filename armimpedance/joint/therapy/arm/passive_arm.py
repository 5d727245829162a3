"""The passive human arm: ``tau_h = M_h qdd + C_h qd + G_h + K_s (q - q_0)`` (14)-(15).

Masses are those of Winter's table (by default with the same table's radii of gyration; the source
has point masses) or of a mock-up whose pipes were weighed. K_s and q_0 come from passive movements
of the person in the robot.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import LEAST_DOF, FloatArray, FrozenRecord
from armimpedance.core.errors import InputError, RecordError, check_number
from armimpedance.core.records import Subject
from armimpedance.core.skeleton import Skeleton
from armimpedance.joint.therapy.robot.therapy_robot import (
    FOREARM,
    UPPER_ARM,
    RigidBodies,
    TherapyRobot,
)
from armimpedance.limb.arm import WINTER, SegmentRatios, skeleton_model

#: Relative sd of the person's segment masses about the table's; one factor for all of them.
MASS_SD: Final = 0.03


@dataclass(frozen=True)
class ArmSegment:
    """A part of the arm on one of the robot's links.

    Attributes
    ----------
    name : str
    link : {"upper_arm", "forearm"}
        The link of the robot that carries it.
    mass_kg : float
    com_m : float
        Distance of the centre of mass from the link's origin (shoulder or elbow), m.
    inertia_kgm2 : float
        About the centre of mass, transverse; 0 for a point mass.
    inertia_long_kgm2 : float
        About the limb's long axis.
    """

    name: str
    link: str
    mass_kg: float
    com_m: float
    inertia_kgm2: float = 0.0
    inertia_long_kgm2: float = 0.0

    def __post_init__(self) -> None:
        values = (self.mass_kg, self.com_m, self.inertia_kgm2, self.inertia_long_kgm2)
        if self.link not in (UPPER_ARM, FOREARM):
            raise RecordError(f"{self.name} on the link {self.link!r}", expected="an arm's link")
        if not (np.isfinite(values).all() and min(values) >= 0):
            raise RecordError(f"{self.name}: a negative or infinite mass, length or inertia")


@dataclass(frozen=True)
class Elastic(FrozenRecord):
    """Passive stiffness of one axis, (15): ``k_s (q - q_0) = k_s q + offset``.

    `axis`: its name in the robot.
    `stiffness`, `offset`: k_s, N m/rad, and ``-k_s q_0``, N m.
    `covariance` (2, 2): covariance of the two.
    `dof`: degrees of freedom of the t distribution for intervals.
    `range_rad` (2,): angles over which it was measured.
    `between` (2, 2): covariance of the two between repetitions, the variation of the arm from
    movement to movement. The slow torque of the person is not included.
    `noise_density`: density of the residual at low frequencies, N m^2 s: its integral over T
    seconds has the variance ``noise_density T``.
    `mass_gradient` (2,): derivative of stiffness and offset by the mass factor. They were fitted to
    the torque without that of the masses, so they partly compensate a wrong mass.
    `robot_gradient` (2, p): derivative by `Loads.theta`.
    `stiffness_identified`, `rest_identified`: True if k_s and q_0 are known well enough to be
    quoted.
    `verdict`: the reason, in one line.
    `repeatable`: True if the repetitions agree. If not, neither number is identified, and no
    contribution should be reported for this axis. A number that is only too uncertain to be quoted
    does not prevent that: its covariance is taken into account.
    `one_way`: 1 if the angle of the axis only grew in the measurement, -1 if it only fell, 0 for
    both. With one direction only, `offset` includes the arm's resistance to that movement.
    """

    axis: str
    stiffness: float
    offset: float
    covariance: Annotated[FloatArray, "2 2 covariance"]
    dof: float
    range_rad: Annotated[FloatArray, "2"]
    between: Annotated[FloatArray, "2 2"]
    noise_density: float
    mass_gradient: Annotated[FloatArray, "2"]
    robot_gradient: Annotated[FloatArray, "2 p"]
    stiffness_identified: bool = True
    rest_identified: bool = True
    verdict: str = ""
    repeatable: bool = True
    one_way: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        noise = f"{self.axis}: noise_density {self.noise_density}"
        check_number(self.noise_density, noise, low=0, error=RecordError)
        if not np.isfinite([self.stiffness, self.offset]).all():
            raise RecordError(f"{self.axis}: no finite stiffness", expected="finite numbers")
        if not self.dof >= LEAST_DOF:
            problem = f"{self.axis}: {self.dof:g} degrees of freedom"
            raise RecordError(problem, expected=f"{LEAST_DOF:g} or more")

    @property
    def rest_rad(self) -> float:
        """Rest angle q_0; NaN without stiffness."""
        return -self.offset / self.stiffness if self.stiffness else float("nan")


@dataclass(frozen=True)
class Reference(FrozenRecord):
    """Support in the passive repetitions of one movement: the denominator of (19).

    `movement`: its name in the trial table.
    `support_Nm` (R,): mean support torque of every repetition, motor less robot.
    `from_rad`, `to_rad`: angles at which the movement starts and ends.
    """

    movement: str
    axis: str
    support_Nm: Annotated[FloatArray, "R"]
    from_rad: float
    to_rad: float

    def __post_init__(self) -> None:
        super().__post_init__()
        if not len(self.support_Nm):
            problem = f"{self.movement}: a reference without a repetition"
            raise RecordError(problem, expected="one or more")


@dataclass(frozen=True)
class PassiveArm(FrozenRecord):
    """A person's relaxed arm in the robot.

    Attributes
    ----------
    subject : str
        Name of the person.
    robot : str
        Name of the robot in which it was measured.
    upper_arm_m : float
        Length to which the robot was adjusted, m.
    segments : tuple of ArmSegment
        Masses on the robot's links.
    elastic : tuple of Elastic
        One for each measured axis.
    references : tuple of Reference
        The support of each passive movement, for (19).
    mass_sd : float
        Sd of the factor between true and stated masses; 0 for a mock-up that was weighed.

    Examples
    --------
    A mock-up of one weighed pipe, whose stiffness was not measured:

    >>> from armimpedance import PassiveArm
    >>> from armimpedance.joint.therapy import ArmSegment
    >>> pipe = ArmSegment("pipe", "upper_arm", mass_kg=1.2, com_m=0.15)
    >>> PassiveArm("mock-up", "ARMin", 0.30, (pipe,), mass_sd=0.0).elastic_of("elevation")
    Traceback (most recent call last):
    armimpedance.core.errors.InputError: subject mock-up: no passive calibration of axis ele...
    """

    subject: str
    robot: str
    upper_arm_m: float
    segments: tuple[ArmSegment, ...]
    elastic: tuple[Elastic, ...] = ()
    references: tuple[Reference, ...] = ()
    mass_sd: float = MASS_SD

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 <= self.mass_sd < 0.5:
            raise RecordError(f"mass_sd {self.mass_sd}", expected="0 to 0.5, a fraction")
        axes = [e.axis for e in self.elastic]
        if len(set(axes)) != len(axes):
            raise RecordError("an axis' stiffness appears twice in a passive arm")

    def elastic_of(self, axis: str) -> Elastic:
        """Stiffness of this axis.

        Raises
        ------
        InputError
            It was not measured.
        """
        for elastic in self.elastic:
            if elastic.axis == axis:
                return elastic
        raise InputError(
            f"subject {self.subject}: no passive calibration of axis {axis}",
            expected="passive movements about it in the recording for `armimpedance therapy arm`",
        )

    def reference_of(self, movement: str, axis: str) -> Reference | None:
        """Reference (19) of this movement; None if it was not measured."""
        for reference in self.references:
            if (reference.movement, reference.axis) == (movement, axis):
                return reference
        return None


def winter_segments(
    mass_kg: float,
    upper_arm_m: float,
    forearm_m: float,
    hand_m: float,
    *,
    point_masses: bool = False,
) -> tuple[ArmSegment, ...]:
    """Upper arm, forearm and hand from body mass and segment lengths, after Winter.

    `mass_kg`: mass of the whole body.
    `upper_arm_m`, `forearm_m`, `hand_m`: shoulder to elbow, elbow to wrist, wrist to finger tip.
    `point_masses`: True to leave out the segments' own inertias, as in the source.
    Raises InputError: an impossible mass or length.
    """
    for name, value, most in (
        ("body mass in kg", mass_kg, 400.0),
        ("upper_arm_m", upper_arm_m, 0.5),
        ("forearm_m", forearm_m, 0.5),
        ("hand_m", hand_m, 0.3),
    ):
        if not (np.isfinite(value) and 0 < value <= most):
            raise InputError(f"{name} is {value}", expected=f"more than 0 and at most {most:g}")

    def segment(
        name: str, ratios: SegmentRatios, link: str, start: float, length: float
    ) -> ArmSegment:
        mass = mass_kg * ratios.mass
        inertia = 0.0 if point_masses else mass * (ratios.gyration * length) ** 2
        return ArmSegment(name, link, mass, start + ratios.com * length, inertia)

    return (
        segment("upper_arm", WINTER.upper_arm, UPPER_ARM, 0.0, upper_arm_m),
        segment("forearm", WINTER.forearm, FOREARM, 0.0, forearm_m),
        segment("hand", WINTER.hand, FOREARM, forearm_m, hand_m),
    )


# The rigid bodies of a person's arm, moved by the robot's axes.
#
# Import this module only if torques are computed: it loads Pinocchio.


def arm_bodies(robot: TherapyRobot, arm: PassiveArm) -> RigidBodies:
    """Rigid bodies of the person's arm only, moved by the robot's axes; without passive
    stiffness."""
    model = skeleton_model(arm_skeleton(robot.skeleton, arm.segments))
    return RigidBodies(model, model.createData(), np.array(robot.chain))


def arm_skeleton(frame: Skeleton, segments: tuple[ArmSegment, ...]) -> Skeleton:
    """The robot's joints with the masses of an arm instead of its own.

    Segments of the arm that share a link become one body.
    """
    bodies = []
    for segment in frame.segments:
        carried = [s for s in segments if s.link == segment.name]
        mass = sum(s.mass_kg for s in carried)
        com = sum(s.mass_kg * s.com_m for s in carried) / mass if mass > 0 else 0.0
        # parallel axis: I = sum I_i + m_i (c_i - c)^2, about both transverse axes
        own = sum(s.inertia_kgm2 + s.mass_kg * (s.com_m - com) ** 2 for s in carried)
        bodies.append(
            replace(
                segment,
                mass_kg=float(mass),
                com_m=np.array([0.0, 0.0, -com]),
                inertia_kgm2=np.diag([own, own, sum(s.inertia_long_kgm2 for s in carried)]),
            )
        )
    return replace(frame, segments=tuple(bodies), markers=())


# The segments of a recording's subject: lengths and masses from the known data of the person.


def segments_of(
    subject: Subject,
    *,
    mass_kg: float | None = None,
    upper_arm_m: float | None = None,
    forearm_m: float | None = None,
    hand_m: float | None = None,
    point_masses: bool = False,
) -> tuple[ArmSegment, ...]:
    """Upper arm, forearm and hand of a person; arguments take precedence over the recording.

    An unknown length of forearm or hand is Winter's share of the measured length from elbow to
    grip, or else of the height.

    Parameters
    ----------
    subject : Subject
        The recorded person, with the known data of the body.
    mass_kg : float, optional
        Mass of the whole body, kg.
    upper_arm_m, forearm_m, hand_m : float, optional
        Shoulder to elbow, elbow to wrist, wrist to finger tip, m.
    point_masses : bool
        True for segments without inertia of their own, as in the source.

    Returns
    -------
    tuple of ArmSegment

    Raises
    ------
    InputError
        The body mass or a length is unknown or impossible.
    """
    mass_kg = mass_kg if mass_kg is not None else subject.mass_kg
    if mass_kg is None:
        raise _unknown(subject, "the body mass", "subject.mass_kg", "mass-kg")
    return winter_segments(
        mass_kg,
        upper_arm_length(subject, upper_arm_m),
        forearm_m if forearm_m is not None else _beyond_elbow(subject, "forearm"),
        hand_m if hand_m is not None else _beyond_elbow(subject, "hand"),
        point_masses=point_masses,
    )


def upper_arm_length(subject: Subject, stated: float | None = None) -> float:
    """Length of the upper arm, to which the robot is adjusted too.

    Raises InputError: neither it nor the height is known.
    """
    if stated is not None:
        return stated
    if subject.upper_arm_m is not None:
        return subject.upper_arm_m
    if subject.height_m is None:
        where = "subject.upper_arm_m or height_m"
        raise _unknown(subject, "the upper arm's length", where, "upper-arm-m")
    return WINTER.upper_arm.length * subject.height_m


def _beyond_elbow(subject: Subject, part: str) -> float:
    """Length of the forearm or of the hand, m."""
    ratio = getattr(WINTER, part).length
    if subject.forearm_hand_m is not None:
        return float(ratio * subject.forearm_hand_m / WINTER.forearm_hand_length)
    if subject.height_m is None:
        where = "subject.forearm_hand_m or height_m"
        raise _unknown(subject, f"the {part}'s length", where, f"{part}-m")
    return float(ratio * subject.height_m)


def _unknown(subject: Subject, what: str, where: str, option: str) -> InputError:
    return InputError(
        f"subject {subject.id}: {what} is not known",
        expected=f"{where} in recording.json, or --{option}",
    )
