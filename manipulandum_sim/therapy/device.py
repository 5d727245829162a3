"""An exoskeleton for arm therapy of five modelled axes, like ARMin III, with all that loads it.

From M. Guidali et al. (2013): Table 3's friction and cables, the motors' 59.5 N m on the two axes
of the shoulder, a spring on a rope that carries the upper-arm link on axis 1, a torque sensor on
axis 2, the two distal axes' masses on the last body. The source gives no masses, lengths, rotors,
static friction or Stribeck velocities: those here are assumed, of the size of such parts. All
loads are torques that the motors must add.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray, frozen_array
from armimpedance.core.errors import InputError
from armimpedance.core.skeleton import Hinge, Segment, Skeleton
from manipulandum_sim.therapy.dynamics import (
    FOREARM,
    Moments,
    Payload,
    SerialChain,
    inverse_dynamics,
)
from manipulandum_sim.therapy.friction import Friction

#: Rate of control and record, 1/s.
RATE_HZ: Final = 1000.0
#: Axes 1 to 5, the columns of a recording.
AXES: Final = ("elevation", "horizontal", "rotation", "elbow", "pronation")
#: Length of the upper-arm link when nobody is in the robot, m.
UPPER_ARM_M: Final = 0.30

#: Guidali (2013), Table 3: cables, N m/deg and deg; Coulomb and viscous friction, N m and
#: N m s/deg.
_CABLE_NM_DEG: Final = (0.0, 0.016, 0.015, 0.014, 0.0078)
_CABLE_REST_DEG: Final = (0.0, 41.0, 10.05, 0.0, 54.5)
_COULOMB_NM: Final = (8.22, 1.17, 5.90, 1.07, 0.28)
_VISCOUS_NMS_DEG: Final = (0.132, 0.027, 0.0065, 0.013, 0.0)
#: Assumed: static over Coulomb friction, and the Stribeck velocity.
_STATIC_RATIO: Final = (1.25, 1.35, 1.20, 1.30, 1.40)
_STRIBECK_DEG_S: Final = 0.5


@dataclass(frozen=True)
class RopeSpring:
    """A spring behind a pulley above the shoulder pulls the upper-arm link up by a rope.

    With the link at q from hanging, the rope from pulley to link is
    ``l = sqrt(a^2 + b^2 + 2 a b cos q)`` long; the spring holds the energy ``k (l - l_0)^2 / 2``.

    Attributes
    ----------
    stiffness : float
        k, N/m.
    link_m, pulley_m : float
        a and b, m, from the shoulder.
    slack_m : float
        l_0, m: how much rope is out when the spring is slack.
    """

    stiffness: float = 1150.0
    link_m: float = 0.16
    pulley_m: float = 0.18
    slack_m: float = 0.05

    def rope_m(self, q: FloatArray) -> FloatArray:
        """l at angles q, rad."""
        a, b = self.link_m, self.pulley_m
        return np.sqrt(a * a + b * b + 2 * a * b * np.cos(q))

    def torque(self, q: FloatArray) -> FloatArray:
        """N m that the motor must add; negative where the spring lifts."""
        taut = 1 - self.slack_m / self.rope_m(q)
        return np.asarray(-self.stiffness * self.link_m * self.pulley_m * np.sin(q) * taut)

    def energy(self, q: FloatArray) -> FloatArray:
        """J."""
        return np.asarray(self.stiffness / 2 * (self.rope_m(q) - self.slack_m) ** 2)


@dataclass(frozen=True)
class TherapyDevice:
    """The robot as it really is; n = 5 axes.

    Attributes
    ----------
    name : str
    skeleton : Skeleton
        Links, without rotors; base, column, shoulder, upper_arm, forearm, wrist.
    axes : tuple of n str
        Hinges in the order of a recording's columns.
    motor_inertia_kgm2 : (n,)
        Rotors seen at the joint.
    limits_rad : (n, 2)
    torque_limit_Nm : (n,)
    friction : Friction
    cable_stiffness, cable_rest_rad : (n,)
        k_c, N m/rad, and q_c.
    spring : RopeSpring
        On axis 1.
    torque_noise_Nm : (n,)
        Sd of a recorded motor torque, white.
    encoder_rad : (n,)
        Step of the angles.
    sensor_noise_Nm : float
        Sd of the torque sensor of axis 2, white.
    """

    name: str
    skeleton: Skeleton
    axes: tuple[str, ...]
    motor_inertia_kgm2: FloatArray
    limits_rad: FloatArray
    torque_limit_Nm: FloatArray
    friction: Friction
    cable_stiffness: FloatArray
    cable_rest_rad: FloatArray
    spring: RopeSpring
    torque_noise_Nm: FloatArray
    encoder_rad: FloatArray
    sensor_noise_Nm: float = 0.05

    def __post_init__(self) -> None:
        put, n = object.__setattr__, len(self.axes)
        for name in (
            "motor_inertia_kgm2", "torque_limit_Nm", "cable_stiffness", "cable_rest_rad",
            "torque_noise_Nm", "encoder_rad",
        ):  # fmt: skip
            put(self, name, frozen_array(getattr(self, name), name, (n,)))
        put(self, "limits_rad", frozen_array(self.limits_rad, "limits_rad", (n, 2)))
        positive = (self.motor_inertia_kgm2, self.torque_limit_Nm, self.encoder_rad)
        if not all((values > 0).all() for values in positive):
            raise InputError(
                f"device {self.name}: a rotor, a torque limit or a step is not positive"
            )
        if sorted(self.skeleton.coordinates) != sorted(self.axes):
            raise InputError(f"device {self.name}: axes {', '.join(self.axes)}")

    @property
    def n_axes(self) -> int:
        """n."""
        return len(self.axes)

    @property
    def links(self) -> tuple[Segment, ...]:
        """The moving links, from the base outwards."""
        return self.skeleton.segments[1:]

    @property
    def upper_arm_m(self) -> float:
        """Length that the upper-arm link is adjusted to."""
        return float(-self.skeleton.segments[self.skeleton.index(FOREARM)].origin_m[2])

    def adjusted_to(self, upper_arm_m: float) -> TherapyDevice:
        """With the elbow, and all beyond it, at a person's own length.

        Raises
        ------
        InputError
            The robot cannot be set to it.
        """
        if not 0.15 <= upper_arm_m <= 0.5:
            raise InputError(f"an upper arm of {upper_arm_m} m", expected="0.15 to 0.5 m")
        elbow = np.array([0.0, 0.0, -upper_arm_m])
        moved = (
            replace(s, origin_m=elbow) if s.name == FOREARM else s for s in self.skeleton.segments
        )
        return replace(self, skeleton=replace(self.skeleton, segments=tuple(moved)))

    def mismatched(
        self, mass: float = 0.12, friction: float = 0.45, cable: float = 0.30
    ) -> TherapyDevice:
        """A plant that has grown apart from its drawings and its calibration.

        Parameters
        ----------
        mass, friction, cable : float
            By which fraction links, friction and cables exceed this device's.
        """
        links = (
            replace(s, mass_kg=s.mass_kg * (1 + mass), inertia_kgm2=s.inertia_kgm2 * (1 + mass))
            for s in self.skeleton.segments
        )
        return replace(
            self,
            name=f"{self.name}, mismatched",
            skeleton=replace(self.skeleton, segments=tuple(links)),
            friction=self.friction.scaled(1 + friction),
            cable_stiffness=self.cable_stiffness * (1 + cable),
        )

    def chain(self, upper_arm_m: FloatArray) -> SerialChain:
        """Chain of T robots adjusted to lengths (T,)."""
        return SerialChain.of(self.links, self.axes, upper_arm_m)

    def moments(self, trials: int) -> Moments:
        """Moments of the links' masses, for T trials."""
        whole = Payload.of_skeletons([self.skeleton])
        return Moments.of(
            Payload(
                np.repeat(whole.mass_kg, trials, axis=0),
                np.repeat(whole.com_m, trials, axis=0),
                np.repeat(whole.inertia_kgm2, trials, axis=0),
                np.repeat(whole.upper_arm_m, trials),
            )
        )

    def springs(self, q: FloatArray) -> FloatArray:
        """Cables and counterbalance spring (..., n) at angles (..., n), N m."""
        torque = self.cable_stiffness * (q - self.cable_rest_rad)
        torque[..., 0] += self.spring.torque(q[..., 0])
        return np.asarray(torque)

    def rigid_torque(self, q: FloatArray, qd: FloatArray, qdd: FloatArray) -> FloatArray:
        """``M_r qdd + C_r qd + G_r`` (N, n) of links and rotors."""
        chain, bodies = self.chain(np.full(len(q), self.upper_arm_m)), self.moments(len(q))
        links = inverse_dynamics(chain, bodies, q.T, qd.T, qdd.T)
        return np.asarray(links.T + self.motor_inertia_kgm2 * qdd)

    def load_torque(self, q: FloatArray, qd: FloatArray) -> FloatArray:
        """Steady friction, cables and spring (..., n) at angles and velocities (..., n), N m."""
        return np.asarray(self.springs(q) + self.friction.steady(qd))


def _link(
    name: str,
    parent: str,
    hinge: tuple[str, Sequence[float]],
    origin: Sequence[float],
    mass: float,
    com: Sequence[float],
    size: Sequence[float],
) -> Segment:
    """A link that is a box of outer size (3,)."""
    square = np.square(size)
    inertia = np.diag(mass / 12 * (square.sum() - square))
    return Segment(
        name,
        parent,
        np.array(origin, dtype=float),
        (Hinge(hinge[0], np.array(hinge[1], dtype=float)),),
        mass,
        np.array(com, dtype=float),
        inertia,
    )


def _skeleton() -> Skeleton:
    """19 kg above the base; boxes with their drives."""
    up, flex, none = (0, 0, 1), (0, -1, 0), (0, 0, 0)
    return Skeleton(
        (
            Segment("base", None, np.zeros(3)),
            _link("column", "base", ("horizontal", up), none, 3.5, (0, 0.09, 0.1), (0.2, 0.2, 0.3)),
            _link(
                "shoulder", "column", ("elevation", flex), none,
                5.5, (0.01, 0.06, -0.05), (0.12, 0.14, 0.24),
            ),
            _link(
                "upper_arm", "shoulder", ("rotation", up), none,
                4.8, (-0.02, 0.02, -0.17), (0.14, 0.14, 0.22),
            ),
            _link(
                "forearm", "upper_arm", ("elbow", flex), (0, 0, -UPPER_ARM_M),
                3.4, (-0.01, 0.03, -0.09), (0.10, 0.12, 0.22),
            ),
            _link(
                "wrist", "forearm", ("pronation", up), none,
                1.8, (0.01, 0.01, -0.22), (0.10, 0.08, 0.16),
            ),
        ),
        floating=False,
    )  # fmt: skip


def therapy_device() -> TherapyDevice:
    """The nominal robot; see the module for what is the source's."""
    coulomb = np.array(_COULOMB_NM)
    return TherapyDevice(
        name="ARMin III (simulated)",
        skeleton=_skeleton(),
        axes=AXES,
        motor_inertia_kgm2=np.array([0.35, 0.35, 0.15, 0.10, 0.03]),
        limits_rad=np.deg2rad([[30, 135], [-45, 120], [-80, 80], [-5, 120], [-85, 85]]),
        torque_limit_Nm=np.array([59.5, 59.5, 30.0, 30.0, 10.0]),
        friction=Friction(
            coulomb,
            coulomb * _STATIC_RATIO,
            np.rad2deg(_VISCOUS_NMS_DEG),
            np.full(len(AXES), np.deg2rad(_STRIBECK_DEG_S)),
        ),
        cable_stiffness=np.rad2deg(_CABLE_NM_DEG),
        cable_rest_rad=np.deg2rad(_CABLE_REST_DEG),
        spring=RopeSpring(),
        torque_noise_Nm=np.array([0.10, 0.08, 0.05, 0.05, 0.02]),
        # 4096 counts a turn of the motor, gears of 1:100
        encoder_rad=np.full(len(AXES), 2 * np.pi / 409_600),
    )
