"""Newton and Euler for a tree of segments, in the world's frame, all samples at once.

Own dynamics of the rigs of moving bodies; nothing of the analysis (see `armimpedance.core.skeleton`
for frames, signs and the order of the coordinates).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.skeleton import GRAVITY_M_S2, Segment, Skeleton

GRAVITY: Final = np.array([0.0, 0.0, -GRAVITY_M_S2])
_AXES: Final = np.eye(3)


@dataclass(frozen=True)
class SegmentMotion:
    """Motion of every segment in the world; N samples, S segments.

    Attributes
    ----------
    rotation : (S, N, 3, 3)
        Columns are the segment's axes.
    origin, acceleration : (S, N, 3)
        Place and acceleration of the joint's centre.
    rate, angular_acceleration : (S, N, 3)
    axes : tuple of (N, 3)
        Every turning coordinate's axis, in the order of the coordinates.
    """

    rotation: FloatArray
    origin: FloatArray
    acceleration: FloatArray
    rate: FloatArray
    angular_acceleration: FloatArray
    axes: tuple[FloatArray, ...]


def move(
    skeleton: Skeleton,
    q: FloatArray,
    qd: FloatArray | None = None,
    qdd: FloatArray | None = None,
) -> SegmentMotion:
    """Motion of every segment from coordinates (N, n) and their derivatives (zero if absent)."""
    qd = np.zeros_like(q) if qd is None else qd
    qdd = np.zeros_like(q) if qdd is None else qdd
    samples, count, next_ = len(q), len(skeleton.segments), 0
    R, p, a = np.empty((count, samples, 3, 3)), *np.zeros((2, count, samples, 3))
    w, alpha = np.zeros((2, count, samples, 3))
    axes: list[FloatArray] = []
    for i, segment in enumerate(skeleton.segments):
        if segment.parent is None:
            turn = np.broadcast_to(np.eye(3), (samples, 3, 3))
            rate, spin = np.zeros((2, samples, 3))
            turning = [_AXES[2], _AXES[1], _AXES[0]] if skeleton.floating else []
            if skeleton.floating:
                p[i], a[i], next_ = q[:, :3], qdd[:, :3], 3
        else:
            up = skeleton.index(segment.parent)
            turn, rate, spin = R[up], w[up], alpha[up]
            arm = R[up] @ segment.origin_m
            p[i] = p[up] + arm
            a[i] = a[up] + np.cross(spin, arm) + np.cross(rate, np.cross(rate, arm))
            turning = [hinge.axis for hinge in segment.hinges]
        for axis in turning:
            here = turn @ axis
            velocity = here * qd[:, next_, None]
            spin = spin + here * qdd[:, next_, None] + np.cross(rate, velocity)
            rate = rate + velocity
            turn = turn @ turn_about(axis, q[:, next_])
            axes.append(here)
            next_ += 1
        R[i], w[i], alpha[i] = turn, rate, spin
    return SegmentMotion(R, p, a, w, alpha, tuple(axes))


def turn_about(axis: FloatArray, angle: FloatArray) -> FloatArray:
    """Rodrigues' rotation (N, 3, 3) about a unit axis (3,) by angles (N,)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.eye(3) + s * cross + (1 - c) * (cross @ cross)


def inverse_dynamics(
    skeleton: Skeleton,
    q: FloatArray,
    qd: FloatArray | None = None,
    qdd: FloatArray | None = None,
    gravity: FloatArray = GRAVITY,
) -> FloatArray:
    """Generalised forces (N, n) that make the skeleton move so; the root's six come first.

    The root's are those of all outside contacts together; a joint's torque is on the child.
    """
    motion = move(skeleton, q, qd, qdd)
    force, moment = _subtree_wrenches(skeleton, motion, gravity)
    taus: list[FloatArray] = []
    axes = iter(motion.axes)
    for i, segment in enumerate(skeleton.segments):
        turns = len(segment.hinges)
        if segment.parent is None and skeleton.floating:
            taus += [force[i, :, k] for k in range(3)]
            turns = 3
        # tau (N,) = e (N, 3) . n (N, 3), the moment about the joint's own centre
        taus += [(next(axes) * moment[i]).sum(axis=1) for _ in range(turns)]
    return np.stack(taus, axis=1) if taus else np.empty((len(q), 0))


def contact_wrench(
    skeleton: Skeleton,
    q: FloatArray,
    qd: FloatArray | None = None,
    qdd: FloatArray | None = None,
    gravity: FloatArray = GRAVITY,
) -> FloatArray:
    """Force and moment about the world's origin (N, 6) that the outside must exert on the body."""
    motion = move(skeleton, q, qd, qdd)
    force, moment = _subtree_wrenches(skeleton, motion, gravity)
    return np.concatenate([force[0], moment[0] + np.cross(motion.origin[0], force[0])], axis=1)


def marker_positions(skeleton: Skeleton, q: FloatArray) -> FloatArray:
    """World positions (N, P, 3) of the skeleton's markers."""
    motion = move(skeleton, q)
    sites = []
    for site in skeleton.markers:
        i = skeleton.index(site.segment)
        sites.append(motion.origin[i] + motion.rotation[i] @ site.position_m)
    return np.stack(sites, axis=1)


def mass_matrix(skeleton: Skeleton, q: FloatArray) -> FloatArray:
    """Generalised inertia (N, n, n), a column from each unit acceleration."""
    none = np.zeros(3)
    columns = [
        inverse_dynamics(skeleton, q, None, np.broadcast_to(unit, q.shape), none)
        for unit in np.eye(q.shape[1])
    ]
    return np.stack(columns, axis=2)


def _subtree_wrenches(
    skeleton: Skeleton, motion: SegmentMotion, gravity: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Force and moment (S, N, 3) that each joint passes on, about its own centre."""
    force, moment = np.empty((2, *motion.origin.shape))
    for i, segment in enumerate(skeleton.segments):
        force[i], moment[i] = _own_wrench(segment, motion, i, gravity)
    for i in range(len(skeleton.segments) - 1, 0, -1):
        up = skeleton.index(str(skeleton.segments[i].parent))
        lever = motion.origin[i] - motion.origin[up]
        force[up] += force[i]
        moment[up] += moment[i] + np.cross(lever, force[i])
    return force, moment


def _own_wrench(
    segment: Segment, motion: SegmentMotion, i: int, gravity: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Rate of change of one segment's momentum less its weight, about its joint's centre."""
    R, w, alpha = motion.rotation[i], motion.rate[i], motion.angular_acceleration[i]
    arm = R @ segment.com_m
    centre = motion.acceleration[i] + np.cross(alpha, arm) + np.cross(w, np.cross(w, arm))
    force = segment.mass_kg * (centre - gravity)
    inertia = R @ segment.inertia_kgm2 @ np.swapaxes(R, 1, 2)
    spin = (inertia @ w[..., None])[..., 0]
    turning = (inertia @ alpha[..., None])[..., 0] + np.cross(w, spin)
    return force, turning + np.cross(arm, force)
