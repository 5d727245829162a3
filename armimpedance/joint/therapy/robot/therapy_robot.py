"""Model of the therapy robot: rigid bodies from its drawings, and identified loads.

``tau_r = M(q) qdd + C(q, qd) qd + G(q) + friction + cables + spring`` (13). The source leaves out
Coriolis torques; they are included here.

Friction ``sign(v) tau_c (1 - exp(-|v| / v_s)) + k_v v`` is odd in the velocity. The printed (10) is
not: taken literally it grows without bound for v < 0. The cables are springs (11), the
counterbalance spring of one axis is a polynomial of second order (12).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Any, Final

import numpy as np
import pinocchio as pin

from armimpedance.core.arrays import LEAST_DOF, FloatArray, FrozenRecord
from armimpedance.core.errors import InputError, RecordError, check_number
from armimpedance.core.skeleton import Skeleton
from armimpedance.limb.arm import skeleton_model

#: Linear parameters of every axis, in this order: Coulomb and viscous friction, cable stiffness k_c
#: and the cable's torque at the angle zero, ``-k_c q_c``.
AXIS_TERMS: Final = ("coulomb", "viscous", "cable_stiffness", "cable_offset")
AXIS_UNITS: Final = ("N m", "N m s/rad", "N m/rad", "N m")
#: Then the parameters of the counterbalance spring: c_0, c_1, c_2.
SPRING_TERMS: Final = ("spring_0", "spring_1", "spring_2")
SPRING_UNITS: Final = ("N m", "N m/rad", "N m/rad^2")

#: Segments of the skeleton that carry the person's upper arm, and forearm with hand. The arm hangs
#: from the segment's origin along -z.
UPPER_ARM: Final = "upper_arm"
FOREARM: Final = "forearm"


@dataclass(frozen=True)
class Loads(FrozenRecord):
    """Identified loads of a robot with n axes: friction, cables and spring.

    `theta` (4 n + 3,): `AXIS_TERMS` of axis 1, of axis 2, ..., then `SPRING_TERMS`; 0 for terms
    that an axis does not have.
    `covariance` (4 n + 3, 4 n + 3): zero rows and columns for terms that an axis does not have.
    `rise_rad_s` (n,): speed v_s over which the Coulomb friction builds up.
    `dof`: degrees of freedom of the t distribution for intervals; inf = normal.
    """

    theta: Annotated[FloatArray, "p"]
    covariance: Annotated[FloatArray, "p p covariance"]
    rise_rad_s: Annotated[FloatArray, "n"]
    dof: float = float("inf")

    def __post_init__(self) -> None:
        super().__post_init__()
        p = parameter_count(len(self.rise_rad_s))
        if len(self.theta) != p:
            raise RecordError(f"{len(self.theta)} theta", expected=f"{p}")
        if not (self.rise_rad_s > 0).all():
            raise RecordError("rise_rad_s is not positive", expected="more than 0")
        if not self.dof >= LEAST_DOF:
            raise RecordError(f"{self.dof:g} degrees of freedom", expected=f"{LEAST_DOF:g} or more")

    def term(self, name: str) -> FloatArray:
        """One of `AXIS_TERMS` of all axes, (n,)."""
        return self.theta[: -len(SPRING_TERMS)].reshape(-1, len(AXIS_TERMS))[
            :, AXIS_TERMS.index(name)
        ]

    @property
    def spring(self) -> FloatArray:
        """Spring parameters c_0, c_1, c_2."""
        return self.theta[-len(SPRING_TERMS) :]

    @property
    def cable_rest_rad(self) -> FloatArray:
        """Angle q_c (n,) at which a cable exerts no torque; NaN without a cable."""
        k, b = self.term("cable_stiffness"), self.term("cable_offset")
        return np.where(k != 0, -b / np.where(k != 0, k, 1.0), np.nan)


@dataclass(frozen=True)
class TherapyRobot(FrozenRecord):
    """Model of a robot with n axes.

    Attributes
    ----------
    name : str
        Name, which is stored with an arm that was measured in the robot.
    axes : tuple of n str
        Hinges of the skeleton in the order of a recording's columns (axis 1 first), which may
        differ from that of the chain.
    skeleton : Skeleton
        Bodies of the robot alone, with a fixed root and one hinge per segment. Segments `UPPER_ARM`
        and `FOREARM` carry the person's arm, which at zero angles hangs along -z. The forearm's
        origin is at the elbow, ``(0, 0, -length)`` in the upper arm's frame, and moves when the
        robot is adjusted.
    limits_rad : (n, 2)
        Range of motion.
    torque_limit_Nm : (n,)
        Largest torques of the motors, at the joint.
    motor_inertia_kgm2 : (n,)
        Inertia of the rotors, referred to the joint.
    spring_axis : int
        Axis of the counterbalance spring, counted from 0.
    loads : Loads or None
        None before the identification.

    Examples
    --------
    >>> from armimpedance.lab.simulated.therapy import drawings_of
    >>> from manipulandum_sim.therapy import therapy_device
    >>> drawings_of(therapy_device()).axes
    ('elevation', 'horizontal', 'rotation', 'elbow', 'pronation')
    """

    name: str
    axes: Annotated[tuple[str, ...], "n"]
    skeleton: Skeleton
    limits_rad: Annotated[FloatArray, "n 2"]
    torque_limit_Nm: Annotated[FloatArray, "n"]
    motor_inertia_kgm2: Annotated[FloatArray, "n"]
    spring_axis: int = 0
    loads: Loads | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        n = len(self.axes)
        if self.skeleton.floating or sorted(self.skeleton.coordinates) != sorted(self.axes):
            raise RecordError(
                f"a skeleton with the hinges {', '.join(self.skeleton.coordinates)}",
                expected=f"a fixed root and {', '.join(self.axes)}",
            )
        self.skeleton.index(UPPER_ARM)
        if self.skeleton.segments[self.skeleton.index(FOREARM)].parent != UPPER_ARM:
            raise RecordError(f"{FOREARM} is not carried by {UPPER_ARM}")
        if not (self.limits_rad[:, 0] < self.limits_rad[:, 1]).all():
            raise RecordError("limits_rad is empty on an axis", expected="lowest, then highest")
        if not ((self.torque_limit_Nm > 0).all() and (self.motor_inertia_kgm2 >= 0).all()):
            raise RecordError("a torque limit or a motor's inertia is negative")
        if not 0 <= self.spring_axis < n:
            raise RecordError(f"spring_axis {self.spring_axis}", expected=f"0 to {n - 1}")
        if self.loads is not None and len(self.loads.rise_rad_s) != n:
            raise RecordError(f"loads of {len(self.loads.rise_rad_s)} axes", expected=f"{n}")

    @property
    def n_axes(self) -> int:
        """Number of axes n."""
        return len(self.axes)

    @property
    def chain(self) -> tuple[int, ...]:
        """Axis (column of a recording) of each coordinate of the skeleton."""
        return tuple(self.axes.index(name) for name in self.skeleton.coordinates)

    @property
    def upper_arm_m(self) -> float:
        """Length of the upper arm to which the robot is adjusted, m."""
        forearm = self.skeleton.segments[self.skeleton.index(FOREARM)]
        return float(-forearm.origin_m[2])

    @property
    def identified(self) -> Loads:
        """The identified loads.

        Raises
        ------
        InputError
            They have not been identified.
        """
        if self.loads is None:
            raise InputError(
                f"robot {self.name}: friction, cables and spring are not known",
                expected="a file that `armimpedance therapy robot` wrote",
            )
        return self.loads

    def adjusted_to(self, upper_arm_m: float) -> TherapyRobot:
        """Return the robot with its upper-arm link set to a person's length.

        Raises
        ------
        InputError
            An impossible length.
        """
        check_number(upper_arm_m, f"an upper arm of {upper_arm_m} m", low=0.15, high=0.5, unit="m")
        moved = tuple(
            replace(s, origin_m=np.array([*s.origin_m[:2], -upper_arm_m]))
            if s.name == FOREARM
            else s
            for s in self.skeleton.segments
        )
        return replace(self, skeleton=replace(self.skeleton, segments=moved))


def parameter_count(n_axes: int) -> int:
    """Length of `Loads.theta`."""
    return len(AXIS_TERMS) * n_axes + len(SPRING_TERMS)


def parameter_names(n_axes: int) -> tuple[str, ...]:
    """Names ``coulomb_1, viscous_1, ...``, axes counted from 1, then the spring's."""
    axes = tuple(f"{term}_{i + 1}" for i in range(n_axes) for term in AXIS_TERMS)
    return (*axes, *SPRING_TERMS)


def parameter_units(n_axes: int) -> tuple[str, ...]:
    """Units of `parameter_names`."""
    return AXIS_UNITS * n_axes + SPRING_UNITS


def friction_sign(velocity: FloatArray, rise_rad_s: FloatArray | float) -> FloatArray:
    """Smoothed sign ``sign(v) (1 - exp(-|v| / v_s))`` of a velocity, with its shape."""
    return np.asarray(-np.sign(velocity) * np.expm1(-np.abs(velocity) / rise_rad_s))


def load_rows(
    axis: int, q: FloatArray, qd: FloatArray, rise_rad_s: float, *, spring: bool
) -> FloatArray:
    """Columns of one axis' loads, (..., 4), or (..., 7) with the spring's.

    `axis`: counted from 0. `q`, `qd` (..., n): of all axes.
    """
    angle, velocity = q[..., axis], qd[..., axis]
    ones = np.ones_like(angle)
    columns = [friction_sign(velocity, rise_rad_s), velocity, angle, ones]
    if spring:
        columns += [ones, angle, angle**2]
    return np.stack(columns, axis=-1)


def load_torque(robot: TherapyRobot, q: FloatArray, qd: FloatArray) -> FloatArray:
    """Torque of friction, cables and spring (..., n) at angles and velocities (..., n).

    Raises InputError: the robot's loads are not known.
    """
    loads, k = robot.identified, len(AXIS_TERMS)
    torque = np.empty_like(q)
    for axis in range(robot.n_axes):
        spring = axis == robot.spring_axis
        rows = load_rows(axis, q, qd, float(loads.rise_rad_s[axis]), spring=spring)
        theta = loads.theta[k * axis : k * (axis + 1)]
        # tau (...,) = rows (..., 4 or 7) theta (4 or 7,)
        torque[..., axis] = rows @ (np.concatenate([theta, loads.spring]) if spring else theta)
    return torque


def load_gradient(robot: TherapyRobot, axis: int, q: FloatArray, qd: FloatArray) -> FloatArray:
    """Derivative ``d tau_axis / d theta`` (..., 4 n + 3); load torques are linear in theta."""
    loads, k = robot.identified, len(AXIS_TERMS)
    spring = axis == robot.spring_axis
    rows = load_rows(axis, q, qd, float(loads.rise_rad_s[axis]), spring=spring)
    whole = np.zeros((*q.shape[:-1], len(loads.theta)))
    whole[..., k * axis : k * (axis + 1)] = rows[..., :k]
    if spring:
        whole[..., -len(SPRING_TERMS) :] = rows[..., k:]
    return whole


# Torques of rigid bodies on the robot's axes.
#
# Import this module only if they are computed: it loads Pinocchio.


@dataclass(frozen=True, eq=False)
class RigidBodies:
    """Inverse dynamics of bodies on the robot's axes; columns in the order of a recording.

    `model`, `data`: of Pinocchio; `data` is scratch space, so one object serves one thread only.
    `chain` (n,) int: axis of each of the model's coordinates.
    """

    model: Any
    data: Any
    chain: Any

    def torque(self, q: FloatArray, qd: FloatArray, qdd: FloatArray) -> FloatArray:
        """Torque ``M qdd + C qd + G`` of one sample (n,) or of several (S, n).

        `q`, `qd`, `qdd` (n,) or (S, n): rad, rad/s, rad/s^2.
        """
        chain = self.chain
        torque = np.empty_like(q)
        if q.ndim == 1:
            torque[chain] = pin.rnea(self.model, self.data, q[chain], qd[chain], qdd[chain])
            return torque
        rows = (np.ascontiguousarray(part[:, chain]) for part in (q, qd, qdd))
        for i, (a, b, c) in enumerate(zip(*rows, strict=True)):
            torque[i, chain] = pin.rnea(self.model, self.data, a, b, c)
        return torque

    def inertia_torque(self, q: FloatArray, qdd: FloatArray) -> FloatArray:
        """Torque ``M qdd`` only, of one sample (n,) or of several (S, n)."""
        still = np.zeros_like(q)
        return self.torque(q, still, qdd) - self.torque(q, still, still)

    def potential_J(self, q: FloatArray) -> FloatArray:
        """Potential energy of the weight (S,) at angles (S, n), up to a constant."""
        rows = np.ascontiguousarray(q[:, self.chain])
        return np.array([pin.computePotentialEnergy(self.model, self.data, a) for a in rows])


def robot_bodies(robot: TherapyRobot) -> RigidBodies:
    """Rigid bodies of the empty robot: links and rotors.

    Parameters
    ----------
    robot : TherapyRobot
        With or without identified loads, which are not used.

    Returns
    -------
    RigidBodies
    """
    model = skeleton_model(robot.skeleton)
    model.armature = robot.motor_inertia_kgm2[list(robot.chain)].copy()
    return RigidBodies(model, model.createData(), np.array(robot.chain))
