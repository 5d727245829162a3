"""The spatial arm: three hinges in the shoulder, one in the elbow, three in a free wrist; dynamics.

Frame as everywhere for a right arm: origin at the shoulder, x to the subject's right, y forward, z
up. At zero angles the arm hangs, the palm to the left. The hinges turn about the vertical (positive
to the left), then forward and up (elevation), then about the upper arm's own axis, whose turning is
the swivel of the elbow about the line from shoulder to hand as far as the hand stays; the elbow
bends forward. The wrist is locked, or the forearm pronates, the hand deviates to the thumb's side
and then flexes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.skeleton import Hinge, MarkerSite, Segment, Skeleton
from manipulandum_sim.hand import SimulatedSubject
from manipulandum_sim.tree_dynamics import GRAVITY

_X, _Y, _Z = np.eye(3)
#: Radius of gyration about a segment's long axis, parts of its length (de Leva 1996, men); the
#: hand's is of its length to the knuckles.
LONG_GYRATION: Final = (0.158, 0.121)
HAND_LONG_GYRATION: Final = 0.401
#: The hand after Winter (see `SimulatedSubject`): parts of the body's mass, of its height, of the
#: hand's length to the finger tip; the grip's centre is halfway. Knuckles: de Leva 1996.
HAND_MASS: Final = 0.006
HAND_LENGTH: Final = 0.108
HAND_COM: Final = 0.506
HAND_GYRATION: Final = 0.297
KNUCKLES: Final = 0.0495
FOREARM_MASS: Final = 0.016
FOREARM_COM: Final = 0.430
FOREARM_GYRATION: Final = 0.303
#: The joint that turns the upper arm about its own axis.
AXIAL: Final = 2
#: Joints of an arm whose wrist is locked.
FOUR: Final = 4
#: The axes that follow x, y, z, and those after them.
_NEXT: Final = [1, 2, 0]
_AFTER: Final = [2, 0, 1]
#: The rod that each joint turns first.
_TURNS: Final = (0, 0, 0, 1, 1, 2, 2)


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
    """A subject's arm in space: rods that are round about their long axes.

    Attributes
    ----------
    lengths : (r,)
        Shoulder to elbow, elbow to the grip's centre; with a free wrist elbow to wrist, wrist to
        grip. m.
    masses, centres : (r,)
        kg; centre of mass from the upper end, m.
    across, along : (r,)
        Moments of inertia about the centre of mass, kg m^2: across the long axis and along it.
    """

    lengths: FloatArray
    masses: FloatArray
    centres: FloatArray
    across: FloatArray
    along: FloatArray

    @classmethod
    def of(cls, subject: SimulatedSubject, free_wrist: bool = False) -> SpaceArm:
        """The arm of a subject: the planar subjects' lengths, masses and inertias."""
        if free_wrist:
            return cls._with_hand(subject)
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

    @classmethod
    def _with_hand(cls, subject: SimulatedSubject) -> SpaceArm:
        upper, hand = subject.upper_arm, HAND_LENGTH * subject.height_m
        grip = hand / 2
        forearm = subject.forearm_hand_m - grip
        masses = np.array([upper.mass, *(subject.mass_kg * np.array([FOREARM_MASS, HAND_MASS]))])
        lengths = np.array([subject.upper_arm_m, forearm, grip])
        spans = np.array([FOREARM_GYRATION * forearm, HAND_GYRATION * hand])
        thin = (*(LONG_GYRATION * lengths[:2]), HAND_LONG_GYRATION * KNUCKLES * subject.height_m)
        return cls(
            lengths,
            masses,
            np.array([upper.com, FOREARM_COM * forearm, HAND_COM * hand]),
            np.array([upper.inertia, *(masses[1:] * spans**2)]),
            masses * np.array(thin) ** 2,
        )

    @property
    def joints(self) -> int:
        """Number n of joints."""
        return FOUR if len(self.lengths) == 2 else len(_TURNS)

    def skeleton(self) -> Skeleton:
        """The same arm as a tree of segments, its hand a marker: for independent dynamics."""
        segments = [Segment("trunk", None, np.zeros(3))]
        turns: list[tuple[Hinge, ...]] = [
            (Hinge("shoulder_turn", _Z), Hinge("shoulder_elevation", _X), Hinge("axial", _Z)),
            (Hinge("elbow", _X),),
        ]
        names = ["upper_arm", "forearm"]
        if self.joints > FOUR:
            turns[1] += (Hinge("pronation", _Z),)
            turns.append((Hinge("deviation", _X), Hinge("flexion", _Y)))
            names.append("hand")
        for i, name in enumerate(names):
            origin = -(self.lengths[i - 1] if i else 0.0) * _Z
            inertia = np.diag([self.across[i], self.across[i], self.along[i]])
            mass, com = float(self.masses[i]), -self.centres[i] * _Z
            up = segments[-1].name
            segments.append(Segment(name, up, origin, turns[i], mass, com, inertia))
        hand = MarkerSite("hand", names[-1], -self.lengths[-1] * _Z)
        return Skeleton(tuple(segments), (hand,), floating=False)

    def hand(self, q: FloatArray) -> FloatArray:
        """Place of the hand (N, 3) at joint angles (N, n)."""
        return np.asarray(-np.tensordot(self.lengths, np.stack(_axes(q)[1]), 1).T)

    def dynamics(self, q: FloatArray, qd: FloatArray, gravity: FloatArray = GRAVITY) -> Dynamics:
        """Everything that the equations of motion need, at angles and rates (N, n)."""
        A, long = _axes(q)
        rods, n = np.stack(long, axis=1), self.joints
        spins = _spins(A, rods, qd.T)
        # how points at unit way along the rods move with the joints, (3, rods, n, N)
        turned = _cross(A[:, None], rods[:, :, None])
        moved = [sum(turn <= i for turn in _TURNS[:n]) for i in range(len(long))]
        M, h = np.zeros((n, *A.shape[1:])), np.zeros(A.shape[1:])
        reached, carried = np.zeros(A.shape), np.zeros(long[0].shape)
        for i, up in enumerate(long):
            turned[:, i, moved[i] :] = 0.0
            way, alpha = spins.way[:, i], spins.turning[:, i]
            Jv = reached - self.centres[i] * turned[:, i]
            push = self.masses[i] * (carried - self.centres[i] * way - gravity[:, None])
            Jw = np.zeros(A.shape)
            Jw[:, : moved[i]] = A[:, : moved[i]]
            rest = self.along[i] - self.across[i]
            about = (Jw * up[:, None]).sum(axis=0)
            M = M + self.masses[i] * _pairs(Jv, Jv) + self.across[i] * _pairs(Jw, Jw)
            M = M + rest * about[:, None] * about
            gyro = up * (up * alpha).sum(axis=0)
            gyro = gyro + (up * spins.rate[:, i]).sum(axis=0) * spins.swing[:, i]
            twist = self.across[i] * alpha + rest * gyro
            h = h + (Jv * push[:, None]).sum(axis=0) + (Jw * twist[:, None]).sum(axis=0)
            reached = reached - self.lengths[i] * turned[:, i]
            carried = carried - self.lengths[i] * way
        J = np.ascontiguousarray(np.moveaxis(reached, 2, 0))
        return Dynamics(
            np.ascontiguousarray(np.moveaxis(M, 2, 0)),
            h.T,
            -np.tensordot(self.lengths, np.stack(long), 1).T,
            (J @ qd[..., None])[..., 0],
            J,
            carried.T,
        )


class _Spins(NamedTuple):
    """Motion of rods whose joints do not accelerate, (3, rods, N) each.

    `rate`, `turning`: their angular velocity and its derivative.
    `swing`, `way`: velocity and acceleration of a point per unit distance along them.
    """

    rate: FloatArray
    turning: FloatArray
    swing: FloatArray
    way: FloatArray


def _axes(q: FloatArray) -> tuple[FloatArray, tuple[FloatArray, ...]]:
    """The hinges' axes (3, n, N), and unit vectors (3, N) up each rod."""
    cosines, sines = np.cos(q.T), np.sin(q.T)
    (c1, c2, c3, c4), (s1, s2, s3, s4) = cosines[:4], sines[:4]
    u = np.stack([s1 * s2, -c1 * s2, c2])
    bend = np.stack([c1 * c3 - s1 * c2 * s3, s1 * c3 + c1 * c2 * s3, s2 * s3])
    front = np.stack([-c1 * s3 - s1 * c2 * c3, -s1 * s3 + c1 * c2 * c3, s2 * c3])
    A = np.zeros((3, *q.T.shape))
    A[2, 0] = 1.0
    A[0, 1], A[1, 1] = c1, s1
    A[:, 2], A[:, 3] = u, bend
    v = c4 * u - s4 * front
    if q.shape[1] == FOUR:
        return A, (u, v)
    (c5, c6, c7), (s5, s6, s7) = cosines[4:], sines[4:]
    front = c4 * front + s4 * u
    side, front = c5 * bend + s5 * front, c5 * front - s5 * bend
    palm, up = c6 * front + s6 * v, c6 * v - s6 * front
    A[:, 4], A[:, 5], A[:, 6] = v, side, palm
    return A, (u, v, c7 * up + s7 * side)


def _spins(A: FloatArray, rods: FloatArray, qd: FloatArray) -> _Spins:
    """Turning of the rods (3, rods, N) by the joints' rates (n, N)."""
    turns = qd * A
    w = np.cumsum(turns, axis=1)
    before = np.zeros_like(w)
    before[:, 1:] = w[:, :-1]
    # a joint's axis is carried along by the joints before it
    alpha = np.cumsum(qd * _cross(before, A), axis=1)
    # the last joint of each rod
    each = _TURNS[: A.shape[1]]
    last = [max(j for j, turn in enumerate(each) if turn == i) for i in range(rods.shape[1])]
    w, alpha = w[:, last], alpha[:, last]
    swing = _cross(w, rods)
    return _Spins(w, alpha, swing, _cross(alpha, rods) + _cross(w, swing))


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross products along the first axis."""
    return a[_NEXT] * b[_AFTER] - a[_AFTER] * b[_NEXT]


def _pairs(a: FloatArray, b: FloatArray) -> FloatArray:
    """``a^T b`` (n, n, N) of two (3, n, N)."""
    return np.asarray((a[:, :, None] * b[:, None]).sum(axis=0))
