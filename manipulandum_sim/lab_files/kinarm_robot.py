"""A Kinarm End-Point robot that holds the hand of a recording: its links, and what its motors do.

Two motors at the shoulder turn link 1 and, through a crank (link 3) and a bar (link 4) along link
1, link 2. Angles count from the x axis. The torques follow from d'Alembert's principle body by
body: places of the centres of mass, their accelerations, and how they move with each angle.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.signal import savgol_filter

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError

VERSION: Final = "KINARM_EP_Rev2"
#: Lengths of links 1 and 2 and of the crank, m, in single precision as in the file.
LENGTHS: Final = tuple(float(np.float32(length)) for length in (0.30, 0.33, 0.11))
#: How far in front of its first axis the robot holds the middle of the hand's places, m.
AHEAD: Final = 0.42

#: Inertia kg m^2, mass kg, centre of mass along and across the link m, of links 1 to 4.
LINKS: Final = (
    (0.020, 2.1, 0.14, 0.012),
    (0.011, 0.9, 0.16, -0.008),
    (0.002, 0.7, 0.05, 0.004),
    (0.009, 0.6, 0.15, 0.003),
)
MOTORS: Final = (0.007, 0.006)

#: Samples over which the robot's own velocities and accelerations are smoothed.
SMOOTHED: Final = 21


@dataclass(frozen=True)
class LinkMotion:
    """The links of one trial, each (S, 2): links 1 and 2."""

    angle: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


def shoulder_for(hand: FloatArray) -> FloatArray:
    """Where a robot stands, (2,), that reaches all places of the hand, (N, 2).

    Raises
    ------
    InputError
        No place of the robot lets it reach them all.
    """
    middle = (hand.min(axis=0) + hand.max(axis=0)) / 2
    shoulder = (middle - [0.0, AHEAD]).astype(np.float32).astype(np.float64)
    apart = np.linalg.norm(hand - shoulder, axis=1)
    nearest, farthest = abs(LENGTHS[0] - LENGTHS[1]), LENGTHS[0] + LENGTHS[1]
    if not (nearest < apart.min() and apart.max() < farthest):
        problem = f"the hand is {apart.min():.2f} to {apart.max():.2f} m from the robot's axis"
        expected = f"between {nearest:.2f} and {farthest:.2f} m, for a Kinarm to reach it"
        raise InputError(problem, expected=expected)
    return np.asarray(shoulder)


def link_motion(hand: FloatArray, shoulder: FloatArray, rate_hz: float) -> LinkMotion:
    """The links that put the handle at these places, (S, 2), the elbow to the right."""
    first, second, _ = LENGTHS
    x, y = (hand - shoulder).T
    apart = np.hypot(x, y)
    # The law of cosines: the angle at the shoulder between link 1 and the hand.
    inner = np.arccos((first**2 + apart**2 - second**2) / (2 * first * apart))
    a1 = np.arctan2(y, x) - inner
    a2 = np.arctan2(y - first * np.sin(a1), x - first * np.cos(a1))
    angle = np.column_stack([a1, a2])
    velocity, acceleration = (_derivative(angle, order, rate_hz) for order in (1, 2))
    return LinkMotion(angle, velocity, acceleration)


def _derivative(values: FloatArray, order: int, rate_hz: float) -> FloatArray:
    window = min(SMOOTHED, len(values) - 1 + len(values) % 2)
    if window < 5:
        return np.zeros_like(values)
    return np.asarray(savgol_filter(values, window, 4, order, 1 / rate_hz, axis=0))


def motor_torques(motion: LinkMotion, force: FloatArray) -> FloatArray:
    """Torques of the motors, (S, 2) in N m, for this motion under the limb's force, (S, 2) in N."""
    lever1, lever2 = (
        LENGTHS[0] * _across(motion.angle[:, 0]),
        LENGTHS[1] * _across(motion.angle[:, 1]),
    )
    by_limb = np.column_stack([(lever1 * force).sum(axis=1), (lever2 * force).sum(axis=1)])
    return _inertial(motion) - by_limb


def _inertial(motion: LinkMotion) -> FloatArray:
    """Torques on the angles of links 1 and 2 that the bodies' accelerations take."""
    crank = LENGTHS[2]
    torque = np.array(MOTORS) * motion.acceleration
    # Link: its own angle, and the angle and length of what carries its joint.
    carried = ((0, None, 0.0), (1, 0, LENGTHS[0]), (1, None, 0.0), (0, 1, crank))
    for (own, base, length), (inertia, mass, along, aside) in zip(carried, LINKS, strict=True):
        torque[:, own] += inertia * motion.acceleration[:, own]
        parts = [(own, along, aside)] + ([] if base is None else [(base, length, 0.0)])
        moved = sum(_accelerated(motion, *part) for part in parts)
        for axis, forward, across in parts:
            lever = _moved(motion.angle[:, axis], forward, across, turn=1)
            torque[:, axis] += mass * (lever * moved).sum(axis=1)
    return np.asarray(torque)


def _accelerated(motion: LinkMotion, axis: int, along: float, aside: float) -> FloatArray:
    """Acceleration of a point fixed to a link, of the link's turning alone, (S, 2)."""
    angle = motion.angle[:, axis]
    spin, rise = motion.velocity[:, axis, None], motion.acceleration[:, axis, None]
    first, second = (_moved(angle, along, aside, turn=turn) for turn in (1, 2))
    return rise * first + spin**2 * second


def _moved(angle: FloatArray, along: float, aside: float, turn: int) -> FloatArray:
    """The place along u + aside n, differentiated `turn` times by the angle, (S, 2)."""
    turned = angle + turn * np.pi / 2
    return along * np.column_stack([np.cos(turned), np.sin(turned)]) + aside * _across(turned)


def _across(angle: FloatArray) -> FloatArray:
    return np.column_stack([-np.sin(angle), np.cos(angle)])
