"""The planned motion, and the coordinates that follow: legs closed, body in balance."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.linalg import solve_banded
from scipy.ndimage import convolve1d, minimum_filter1d

from armimpedance.core.arrays import FloatArray
from armimpedance.core.skeleton import GRAVITY_M_S2, Skeleton
from manipulandum_sim.body.legs import (
    LEG_ANGLES,
    FootPath,
    Leg,
    foot_of_angles,
    foot_pose,
    leg_angles,
    leg_of,
    pelvis_ceiling,
)
from manipulandum_sim.body.subject import BodySubject
from manipulandum_sim.body.table import ANKLE_HEIGHT, BALL_BEFORE_ANKLE
from manipulandum_sim.tree_dynamics import contact_wrench, turn_about

#: Degree of the splines through the samples: continuous up to the fourth derivative.
DEGREE: Final = 5
#: No leg is ever straighter than this fraction of its length.
STRETCH: Final = 0.993
#: Width (m) over which one limit of the pelvis' height passes into the next.
_SOFT: Final = 0.004
#: How high a swinging foot keeps above the floor, m.
_CLEARANCE_M: Final = 0.02
#: Time (s) within which the pelvis gives way to a leg that is too short.
_CALM_S: Final = 0.20
#: Rounds of the balance; each leaves about a sixth of the error.
_ROUNDS: Final = 6
_AXES: Final = np.eye(3)


@dataclass(frozen=True)
class FreeLeg:
    """A leg that swings on its own: how far it has left its foothold, and its angles.

    Attributes
    ----------
    part : (N,)
        0 on the foothold, 1 free; in between the angles are mixed.
    angles : (N, 6)
        The angles of `LEG_ANGLES`, rad.
    """

    part: FloatArray
    angles: FloatArray


@dataclass(frozen=True)
class BodyPlan:
    """A motion before the legs are closed; N samples.

    Attributes
    ----------
    time_s : (N,)
    pelvis : (N, 6)
        Place (height above standing), then turns about z, y, x. Without feet it is final.
    angles : dict of (N,)
        Angles of the upper body by coordinate; those not named are zero.
    feet : dict of FootPath
        By side; empty where nothing stands on the floor.
    left_share : (N,)
        How much of the body's weight the left foot is to carry; 0 and 1 where a foot is lifted.
    sway : (N, 2)
        Distance of the centre of pressure from the line of the feet, m.
    free : dict of FreeLeg
        By side.
    """

    time_s: FloatArray
    pelvis: FloatArray
    angles: dict[str, FloatArray]
    feet: dict[str, FootPath]
    left_share: FloatArray
    sway: FloatArray
    free: dict[str, FreeLeg] = field(default_factory=dict)


@dataclass(frozen=True)
class BodyMotion:
    """Exact coordinates and derivatives of a motion, and what it stands on; N samples.

    Attributes
    ----------
    time_s : (N,)
    q, qd, qdd : (N, n)
    left_share : (N,)
    supports : (N, 2, 3)
        Centre of the sole of the right and the left foot on the floor, m.
    """

    time_s: FloatArray
    q: FloatArray
    qd: FloatArray
    qdd: FloatArray
    left_share: FloatArray
    supports: FloatArray


def realise(plan: BodyPlan, subject: BodySubject) -> BodyMotion:
    """Close the legs and shift the pelvis until the body is in balance over its feet.

    The pelvis moves over the floor so that the centre of pressure is where the plan wants it; all
    coordinates are quintic splines through the samples.

    Parameters
    ----------
    plan : BodyPlan
    subject : BodySubject

    Raises
    ------
    InputError
        A foot is out of reach.
    """
    skeleton = subject.skeleton
    height = subject.height_m
    legs = {
        side: leg_of(skeleton, side, ANKLE_HEIGHT * height, BALL_BEFORE_ANKLE * height)
        for side in ("right", "left")
    }
    supports = _supports(plan, legs)
    if not plan.feet:
        held = _coordinates(plan, skeleton, legs, plan.pelvis[:, :2])
        motion = _splined(plan.time_s, held)
        return BodyMotion(plan.time_s, *motion, plan.left_share, supports)
    share = plan.left_share[:, None]
    target = (1 - share) * supports[:, 0, :2] + share * supports[:, 1, :2] + plan.sway
    place = _shift(plan.time_s, target, 0.55 * height)
    q, qd, qdd = _splined(plan.time_s, _coordinates(plan, skeleton, legs, place))
    for _ in range(_ROUNDS):
        wrench = contact_wrench(skeleton, q, qd, qdd)
        place = place + _shift(plan.time_s, target - centre_of_pressure(wrench), 0.55 * height)
        q, qd, qdd = _splined(plan.time_s, _coordinates(plan, skeleton, legs, place))
    return BodyMotion(plan.time_s, q, qd, qdd, plan.left_share, supports)


def centre_of_pressure(wrench: FloatArray) -> FloatArray:
    """Where (N, 2) on the floor a wrench (N, 6) about the world's origin acts, m."""
    return np.column_stack([-wrench[:, 4], wrench[:, 3]]) / wrench[:, 2:3]


def _shift(time_s: FloatArray, wanted: FloatArray, height: float) -> FloatArray:
    """Shift of the body (N, 2) that moves its centre of pressure as wanted (N, 2).

    ``s - (h/g) s'' = c`` of an upright pendulum; the bounded solution, so the body starts to move
    before its weight does.
    """
    k = height / GRAVITY_M_S2 / (time_s[1] - time_s[0]) ** 2
    bands = np.full((3, len(time_s)), -k)
    bands[1] = 1 + 2 * k
    bands[1, [0, -1]], bands[0, 1], bands[2, -2] = 1, 0, 0
    # tridiagonal (N, N) s (N, 2) = c (N, 2)
    return np.asarray(solve_banded((1, 1), bands, wanted))


def _splined(time_s: FloatArray, q: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    spline = make_interp_spline(time_s, q, k=DEGREE)
    return q, spline(time_s, nu=1), spline(time_s, nu=2)


def _coordinates(
    plan: BodyPlan, skeleton: Skeleton, legs: dict[str, Leg], place: FloatArray
) -> FloatArray:
    """All coordinates (N, n) with the pelvis over `place` (N, 2)."""
    q = np.zeros((len(plan.time_s), len(skeleton.coordinates)))
    q[:, :2], q[:, 2:6] = place, plan.pelvis[:, 2:]
    for name, values in plan.angles.items():
        q[:, skeleton.coordinate(name)] = values
    R = turn_about(_AXES[2], q[:, 3]) @ turn_about(_AXES[1], q[:, 4])
    R = R @ turn_about(_AXES[0], q[:, 5])
    poses = {side: foot_pose(legs[side], foot) for side, foot in plan.feet.items()}
    if poses:
        q[:, 2] = _pelvis_height(plan, legs, R, place, poses)
    for side, leg in legs.items():
        columns = [skeleton.coordinate(f"{side}_{name}") for name in LEG_ANGLES]
        free = plan.free.get(side)
        if side in poses:
            q[:, columns] = leg_angles(leg, R, q[:, :3], *poses[side])
        if free is not None:
            part = free.part[:, None]
            q[:, columns] = (1 - part) * q[:, columns] + part * free.angles
            if side in poses:
                q[:, columns] = _cleared(plan.time_s, leg, R, q[:, :3], q[:, columns], free.part)
    return q


def _cleared(
    time_s: FloatArray,
    leg: Leg,
    pelvis_R: FloatArray,
    pelvis: FloatArray,
    angles: FloatArray,
    part: FloatArray,
) -> FloatArray:
    """Angles (N, 6) of a swinging leg with its foot lifted where it would scrape the floor."""
    R, ankle = foot_of_angles(leg, pelvis_R, pelvis, angles)
    heel, toe = (np.array([x, 0.0, -leg.ankle_m]) for x in (-0.5 * leg.ball_m, 1.6 * leg.ball_m))
    room = np.minimum(R @ heel, R @ toe)[:, 2] + ankle[:, 2] - _CLEARANCE_M
    # log(1 + exp(x)) without overflow: what is missing, and nothing where there is room
    missing = _SOFT * np.logaddexp(0.0, -room / _SOFT)
    # None while the foot stands, all of it soon after.
    lift = -_calmed(time_s, -missing) * (1 - (1 - part) ** 8)
    return leg_angles(leg, pelvis_R, pelvis, R, ankle + lift[:, None] * _AXES[2])


def _pelvis_height(
    plan: BodyPlan,
    legs: dict[str, Leg],
    R: FloatArray,
    place: FloatArray,
    poses: dict[str, tuple[FloatArray, FloatArray]],
) -> FloatArray:
    """The planned height (N,) where the legs are long enough, else lower; always smooth."""
    leg = legs["right"]
    limits = [leg.ankle_m + STRETCH * leg.length_m + plan.pelvis[:, 2]]
    for side, (_, ankle) in poses.items():
        limits.append(pelvis_ceiling(legs[side], R, place, ankle, STRETCH))
    low = np.min(limits, axis=0)
    soft = low - _SOFT * np.log(np.exp(-(np.array(limits) - low) / _SOFT).sum(axis=0))
    return _calmed(plan.time_s, soft)


def _calmed(time_s: FloatArray, limit: FloatArray) -> FloatArray:
    """A smooth curve (N,) that nowhere exceeds `limit` (N,).

    The lowest value around each sample, averaged over no more than that neighbourhood.
    """
    half = max(2, round(_CALM_S / (time_s[1] - time_s[0])))
    kernel = (1 - (np.arange(-half, half + 1) / (half + 1)) ** 2) ** 4
    lowest = minimum_filter1d(limit, 2 * half + 1, mode="nearest")
    return np.asarray(convolve1d(lowest, kernel / kernel.sum(), mode="nearest"))


def _supports(plan: BodyPlan, legs: dict[str, Leg]) -> FloatArray:
    """Centre (N, 2, 3) of the sole; with the heel raised it moves to the ball."""
    centres = np.zeros((len(plan.time_s), 2, 3))
    for i, side in enumerate(("right", "left")):
        if side in plan.feet:
            foot, ball = plan.feet[side], legs[side].ball_m
            forward = np.column_stack([np.cos(foot.yaw), np.sin(foot.yaw)])
            on_ball = 1 - np.exp(-((foot.heel / 0.15) ** 2))
            ahead = 0.45 * ball + 0.55 * ball * on_ball
            centres[:, i, :2] = foot.place + ahead[:, None] * forward
    return centres
