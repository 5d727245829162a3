"""The spatial arm: shoulder of three hinges, elbow of one, wrist locked; its rigid dynamics.

Frame as everywhere for a right arm: origin at the shoulder, x to the subject's right, y forward, z
up. At zero angles the arm hangs. The hinges turn about the vertical (positive to the left), then
forward and up (elevation), then about the upper arm's own axis, whose turning is the swivel of the
elbow about the line from shoulder to hand as far as the hand stays; the elbow bends forward.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from armimpedance.arrays import FloatArray
from armimpedance.skeleton import Hinge, MarkerSite, Segment, Skeleton
from manipulandum_sim.hand import SimulatedSubject
from manipulandum_sim.tree_dynamics import GRAVITY

_X: Final = np.array([1.0, 0.0, 0.0])
_Z: Final = np.array([0.0, 0.0, 1.0])
#: Radius of gyration about a segment's long axis, parts of its length (de Leva 1996, men).
LONG_GYRATION: Final = (0.158, 0.121)
#: The joint that turns the upper arm about its own axis.
AXIAL: Final = 2


class Dynamics(NamedTuple):
    """One instant of N arms with n moving joints.

    M (N, n, n), bias torque h (N, n) with weight and centrifugal terms, hand place and velocity
    (N, 3), hand Jacobian J (N, 3, n), and ``Jdot qd`` (N, 3).
    """

    M: FloatArray
    h: FloatArray
    place: FloatArray
    velocity: FloatArray
    J: FloatArray
    drift: FloatArray


@dataclass(frozen=True)
class SpaceArm:
    """A subject's arm in space: two rods that are round about their long axes.

    Attributes
    ----------
    lengths : (2,)
        Shoulder to elbow, elbow to the grip's centre, m.
    masses, centres : (2,)
        kg; centre of mass from the upper end, m.
    across, along : (2,)
        Moments of inertia about the centre of mass, kg m^2: across the long axis and along it.
    """

    lengths: FloatArray
    masses: FloatArray
    centres: FloatArray
    across: FloatArray
    along: FloatArray

    @classmethod
    def of(cls, subject: SimulatedSubject) -> SpaceArm:
        """The arm of a subject: the planar subjects' lengths, masses and inertias."""
        parts = (subject.upper_arm, subject.forearm_hand)
        lengths = np.array([subject.upper_arm_m, subject.forearm_hand_m])
        masses = np.array([part.mass for part in parts])
        return cls(
            lengths,
            masses,
            np.array([part.com for part in parts]),
            np.array([part.inertia for part in parts]),
            masses * (np.array(LONG_GYRATION) * lengths) ** 2,
        )

    @property
    def joints(self) -> int:
        """Number n of joints."""
        return 4

    def skeleton(self) -> Skeleton:
        """The same arm as a tree of segments, its hand a marker: for independent dynamics."""
        segments = [Segment("trunk", None, np.zeros(3))]
        turns = (
            (Hinge("shoulder_turn", _Z), Hinge("shoulder_elevation", _X), Hinge("axial", _Z)),
            (Hinge("elbow", _X),),
        )
        for i, name in enumerate(("upper_arm", "forearm")):
            origin = -i * self.lengths[0] * _Z
            inertia = np.diag([self.across[i], self.across[i], self.along[i]])
            mass, com = float(self.masses[i]), -self.centres[i] * _Z
            up = segments[-1].name
            segments.append(Segment(name, up, origin, turns[i], mass, com, inertia))
        hand = MarkerSite("hand", "forearm", -self.lengths[1] * _Z)
        return Skeleton(tuple(segments), (hand,), floating=False)

    def hand(self, q: FloatArray) -> FloatArray:
        """Place of the hand (N, 3) at joint angles (N, 4)."""
        _, u, v = _axes(q)
        return np.asarray(-(self.lengths[0] * u + self.lengths[1] * v).T)

    def dynamics(self, q: FloatArray, qd: FloatArray, gravity: FloatArray = GRAVITY) -> Dynamics:
        """Everything that the equations of motion need, at angles and rates (N, 4)."""
        A, u, v = _axes(q)
        spins, speeds = _spins(A, u, v, qd.T)
        # how points at unit way along the two rods move with the joints, (3, 4, N) each
        turned = np.zeros((2, *A.shape))
        turned[0, :, :3] = _cross(A[:, :3], u[:, None])
        turned[1] = _cross(A, v[:, None])
        turns = np.zeros_like(turned)
        turns[0, :, :3], turns[1] = A[:, :3], A
        M, h = np.zeros((4, *A.shape[1:])), np.zeros(A.shape[1:])
        for i, long in enumerate((u, v)):
            c = [self.centres[0], 0.0] if i == 0 else [self.lengths[0], self.centres[1]]
            Jv, carried = (-(c[0] * part[0] + c[1] * part[1]) for part in (turned, spins.carried))
            Jw, w, alpha = turns[i], speeds[i], spins.turning[i]
            rest = self.along[i] - self.across[i]
            about = (Jw * long[:, None]).sum(axis=0)
            M = M + self.masses[i] * _pairs(Jv, Jv) + self.across[i] * _pairs(Jw, Jw)
            M = M + rest * about[:, None] * about
            push = self.masses[i] * (carried - gravity[:, None])
            gyro = long * (long * alpha).sum(axis=0)
            gyro = gyro + (long * w).sum(axis=0) * _cross(w, long)
            twist = self.across[i] * alpha + rest * gyro
            h = h + (Jv * push[:, None]).sum(axis=0) + (Jw * twist[:, None]).sum(axis=0)
        l1, l2 = self.lengths
        J = np.ascontiguousarray(np.moveaxis(-(l1 * turned[0] + l2 * turned[1]), 2, 0))
        return Dynamics(
            np.ascontiguousarray(np.moveaxis(M, 2, 0)),
            h.T,
            -(l1 * u + l2 * v).T,
            (J @ qd[..., None])[..., 0],
            J,
            -(l1 * spins.carried[0] + l2 * spins.carried[1]).T,
        )


class _Spins(NamedTuple):
    """Where the joints do not accelerate, per rod (3, N): its turning's rate of change, and the
    acceleration of a point at unit way along it."""

    turning: tuple[FloatArray, FloatArray]
    carried: tuple[FloatArray, FloatArray]


def _axes(q: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The hinges' axes (3, 4, N), and unit vectors (3, N) up each rod."""
    (c1, c2, c3, c4), (s1, s2, s3, s4) = np.cos(q.T), np.sin(q.T)
    u = np.stack([s1 * s2, -c1 * s2, c2])
    bend = np.stack([c1 * c3 - s1 * c2 * s3, s1 * c3 + c1 * c2 * s3, s2 * s3])
    front = np.stack([-c1 * s3 - s1 * c2 * c3, -s1 * s3 + c1 * c2 * c3, s2 * c3])
    A = np.zeros((3, 4, len(q)))
    A[2, 0] = 1.0
    A[0, 1], A[1, 1] = c1, s1
    A[:, 2], A[:, 3] = u, bend
    return A, u, c4 * u - s4 * front


def _spins(
    A: FloatArray, u: FloatArray, v: FloatArray, qd: FloatArray
) -> tuple[_Spins, tuple[FloatArray, FloatArray]]:
    """`_Spins` and the rods' turning (3, N), from the joints' rates (4, N)."""
    w2 = A[:, 0] * qd[0] + A[:, 1] * qd[1]
    upper = w2 + A[:, 2] * qd[2]
    fore = upper + A[:, 3] * qd[3]
    alpha = qd[1] * _cross(A[:, 0] * qd[0], A[:, 1]) + qd[2] * _cross(w2, A[:, 2])
    beta = alpha + qd[3] * _cross(upper, A[:, 3])
    carried = (
        _cross(alpha, u) + _cross(upper, _cross(upper, u)),
        _cross(beta, v) + _cross(fore, _cross(fore, v)),
    )
    return _Spins((alpha, beta), carried), (upper, fore)


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross products along the first axis."""
    x, y, z = a
    X, Y, Z = b
    return np.stack([y * Z - z * Y, z * X - x * Z, x * Y - y * X])


def _pairs(a: FloatArray, b: FloatArray) -> FloatArray:
    """``a^T b`` (4, 4, N) of two (3, 4, N)."""
    return np.asarray((a[:, :, None] * b[:, None]).sum(axis=0))
