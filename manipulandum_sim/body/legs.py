"""Legs closed between pelvis and floor: where a foot is, and the six angles that put it there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.skeleton import Skeleton
from manipulandum_sim.tree_dynamics import turn_about

LEG_ANGLES: Final = (
    "hip_flexion",
    "hip_abduction",
    "hip_rotation",
    "knee_flexion",
    "ankle_dorsiflexion",
    "ankle_inversion",
)
X, Y, Z = np.eye(3)


@dataclass(frozen=True)
class FootPath:
    """Motion of a foot over N samples.

    Attributes
    ----------
    place : (N, 2)
        Place on the floor below the ankle while the sole is flat, m.
    lift : (N,)
        Height of the sole's ball above the floor, m.
    yaw, heel : (N,)
        Turn to the left, and heel raised about the ball, rad. The foot is one segment whose toes
        give way: their tip is not kept above the floor while the heel is up.
    """

    place: FloatArray
    lift: FloatArray
    yaw: FloatArray
    heel: FloatArray


@dataclass(frozen=True)
class Leg:
    """The measures of one leg.

    Attributes
    ----------
    side : {"right", "left"}
    hip : (3,)
        In the pelvis' frame, m.
    thigh_m, shank_m, ankle_m : float
        Lengths, and the ankle's height above the sole.
    ball_m : float
        From the ankle forwards to the ball of the foot.
    """

    side: str
    hip: FloatArray
    thigh_m: float
    shank_m: float
    ankle_m: float
    ball_m: float

    @property
    def sign(self) -> float:
        """1 on the right, -1 on the left: turns about x and z are mirrored."""
        return 1.0 if self.side == "right" else -1.0

    @property
    def length_m(self) -> float:
        """Hip to ankle, straight."""
        return self.thigh_m + self.shank_m


def leg_of(skeleton: Skeleton, side: str, ankle_m: float, ball_m: float) -> Leg:
    """A leg's measures from the skeleton's joints."""
    thigh, shank, foot = (
        skeleton.segments[skeleton.index(f"{side}_{name}")] for name in ("thigh", "shank", "foot")
    )
    thigh_m, shank_m = (float(-s.origin_m[2]) for s in (shank, foot))
    return Leg(side, thigh.origin_m, thigh_m, shank_m, ankle_m, ball_m)


def foot_pose(leg: Leg, foot: FootPath) -> tuple[FloatArray, FloatArray]:
    """Orientation (N, 3, 3) of the foot and place (N, 3) of the ankle."""
    ball = np.array([leg.ball_m, 0.0, -leg.ankle_m])
    flat = turn_about(Z, foot.yaw)
    R = flat @ turn_about(Y, foot.heel)
    ankle = np.column_stack([foot.place, foot.lift + leg.ankle_m])
    # The ball stays where it is while the heel rises.
    return R, ankle + flat @ ball - R @ ball


def leg_angles(
    leg: Leg, pelvis_R: FloatArray, pelvis: FloatArray, R: FloatArray, ankle: FloatArray
) -> FloatArray:
    """The six angles (N, 6) of `LEG_ANGLES` from the poses of pelvis and foot.

    Parameters
    ----------
    leg : Leg
    pelvis_R, R : (N, 3, 3)
    pelvis, ankle : (N, 3)
        Origins of pelvis and foot in the world, m.

    Raises
    ------
    InputError
        The foot is out of the leg's reach.
    """
    s, hip = leg.sign, pelvis + pelvis_R @ leg.hip
    # From ankle to hip in the foot's frame: v = Rx(-i) Ry(d) u, u without a y of its own, as
    # thigh and shank move in the plane that the knee's axis is normal to.
    v = (np.swapaxes(R, 1, 2) @ (hip - ankle)[..., None])[..., 0]
    far = np.linalg.norm(v, axis=1)
    if (far >= leg.length_m).any():
        raise InputError(
            f"{leg.side} foot out of reach by {(far.max() - leg.length_m) * 1000:.0f} mm"
        )
    a, b = leg.thigh_m, leg.shank_m
    knee = np.arccos(np.clip((far**2 - a**2 - b**2) / (2 * a * b), -1, 1))
    inversion = s * np.arctan2(v[:, 1], v[:, 2])
    # hip in the shank's frame: u = (0, 0, b) + Ry(-knee) (0, 0, a)
    own = np.arctan2(-a * np.sin(knee), b + a * np.cos(knee))
    dorsiflexion = np.arctan2(v[:, 0], np.hypot(v[:, 1], v[:, 2])) - own
    shank_R = R @ turn_about(X, -s * inversion) @ turn_about(Y, dorsiflexion)
    # Ry(-flexion) Rx(-s abduction) Rz(s rotation) (N, 3, 3), seen from the pelvis
    T = np.swapaxes(pelvis_R, 1, 2) @ shank_R @ turn_about(Y, -knee)
    abduction = s * np.arcsin(np.clip(T[:, 1, 2], -1, 1))
    flexion = np.arctan2(-T[:, 0, 2], T[:, 2, 2])
    rotation = s * np.arctan2(T[:, 1, 0], T[:, 1, 1])
    return np.column_stack([flexion, abduction, rotation, knee, dorsiflexion, inversion])


def foot_of_angles(
    leg: Leg, pelvis_R: FloatArray, pelvis: FloatArray, angles: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Orientation (N, 3, 3) of the foot and place (N, 3) of the ankle; undoes `leg_angles`."""
    s = leg.sign
    flexion, abduction, rotation, knee, dorsiflexion, inversion = angles.T
    thigh_R = pelvis_R @ turn_about(Y, -flexion) @ turn_about(X, -s * abduction)
    thigh_R = thigh_R @ turn_about(Z, s * rotation)
    shank_R = thigh_R @ turn_about(Y, knee)
    ankle = pelvis + pelvis_R @ leg.hip - thigh_R @ (leg.thigh_m * Z) - shank_R @ (leg.shank_m * Z)
    return shank_R @ turn_about(Y, -dorsiflexion) @ turn_about(X, s * inversion), ankle


def pelvis_ceiling(
    leg: Leg, pelvis_R: FloatArray, place: FloatArray, ankle: FloatArray, stretch: float
) -> FloatArray:
    """Highest pelvis (N,), m, at which the leg reaches its foot with `stretch` of its length.

    Parameters
    ----------
    leg : Leg
    pelvis_R : (N, 3, 3)
    place : (N, 2)
        Place of the pelvis above the floor, m.
    ankle : (N, 3)
    stretch : float

    Raises
    ------
    InputError
        No height is low enough.
    """
    hip = pelvis_R @ leg.hip
    aside = ((place + hip[:, :2] - ankle[:, :2]) ** 2).sum(axis=1)
    room = (stretch * leg.length_m) ** 2 - aside
    if (room <= 0).any():
        raise InputError(f"{leg.side} foot out of reach at every height of the pelvis")
    return ankle[:, 2] + np.sqrt(room) - hip[:, 2]
