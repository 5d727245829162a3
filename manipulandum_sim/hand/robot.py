"""The manipulandum: a planar two-joint direct-drive robot, its handle and its servo."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, NamedTuple

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from manipulandum_sim.hand.two_link import TwoLink


@dataclass(frozen=True)
class Robot:
    """Links (motors included) and the handle on the robot's side of the force sensor.

    Its base stands in front of the subject and its elbow points to the subject's left; the
    inertia is that of a direct-drive arm of some 2 kg per link.
    """

    link: TwoLink = field(
        default_factory=lambda: TwoLink(
            0.45, 0.45, 0.62, 0.10, 0.12, base_x=-0.05, base_y=0.98, elbow=-1.0
        )
    )
    handle_kg: float = 0.4


@dataclass(frozen=True)
class Servo:
    """Cartesian stiffness and damping around the commanded motion.

    Attributes
    ----------
    stiffness : float
        inf is the ideal servo: the motion is the commanded one.
    damping_ratio : float
        Damping ratio of robot and handle alone.
    inertia_feedforward : bool
        Adds the force that accelerates the nominal robot, handle and cast.
    force_feedforward : bool
        Adds the hand force of the condition; without it the hand stands F/K off its target.
    """

    stiffness: float = 20_000.0
    damping_ratio: float = 0.7
    inertia_feedforward: bool = True
    force_feedforward: bool = True

    def __post_init__(self) -> None:
        if not (self.stiffness > 0 and self.damping_ratio >= 0):
            raise InputError(
                f"servo of {self.stiffness} N/m, damping ratio {self.damping_ratio}",
                expected="a positive stiffness and a damping ratio >= 0",
            )

    @property
    def is_ideal(self) -> bool:
        """True if the motion is prescribed."""
        return bool(np.isinf(self.stiffness))


IDEAL: Final = Servo(stiffness=np.inf)


class ServoGains(NamedTuple):
    """The servo at each trial's place, every entry (T,) or a number."""

    stiffness: float
    damping: FloatArray
    Fxx: FloatArray
    Fxy: FloatArray
    Fyy: FloatArray
    hold_x: FloatArray
    hold_y: FloatArray


def servo_gains(
    robot: Robot, servo: Servo, place: FloatArray, hold: FloatArray, cast_kg: float
) -> ServoGains:
    """Gains of a servo of finite stiffness with the hand at `place`.

    Parameters
    ----------
    robot : Robot
    servo : Servo
    place, hold : (T, 2)
        Hand position (m) and force by the limb (N) of each trial's condition.
    cast_kg : float
        Mass between the force sensor and the hand.

    Returns
    -------
    ServoGains

    Raises
    ------
    InputError
        If the robot does not reach a place.
    """
    x, y = place.T
    if not robot.link.reaches(x, y):
        raise InputError("a hand location is out of the robot's reach")
    m = robot.link.end_motion(x, y, np.zeros_like(x), np.zeros_like(x))
    mass = robot.handle_kg + cast_kg
    felt = (m.Lxx + m.Lyy) / 2 + mass
    on = float(servo.inertia_feedforward)
    push = -hold * float(servo.force_feedforward)
    return ServoGains(
        servo.stiffness,
        2 * servo.damping_ratio * np.sqrt(servo.stiffness * felt),
        on * (m.Lxx + mass),
        on * m.Lxy,
        on * (m.Lyy + mass),
        push[:, 0],
        push[:, 1],
    )
