"""Rigid bodies on the hinges of a serial chain, for many trials at once.

Everything is in the world's axes about the world's origin, so that bodies add up: a body is its
mass, its first and its second moments. Arrays have the trials last and the components first, for
speed; only elementwise operations and sums over components are used, so that a trial's numbers do
not depend on which others are computed with it.

Sizes: n hinges, each with one body; T trials.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray, frozen_array
from armimpedance.core.errors import InputError, RecordError
from armimpedance.core.skeleton import GRAVITY_M_S2, Segment, Skeleton

FOREARM: Final = "forearm"
_FORWARD, _BACK = [1, 2, 0], [2, 0, 1]


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross product along the first axis."""
    return np.asarray(a[_FORWARD] * b[_BACK] - a[_BACK] * b[_FORWARD])


@dataclass(frozen=True)
class Payload:
    """Payload of the robot's links in each of T trials: an arm, a mock-up.

    Attributes
    ----------
    mass_kg : (T, n)
        On the n moving links, in the order of the chain.
    com_m : (T, n, 3)
        In the link's frame.
    inertia_kgm2 : (T, n, 3, 3)
        About the centre of mass, axes of the link's frame.
    upper_arm_m : (T,)
        Length that the robot is adjusted to: the elbow lies at ``(0, 0, -length)``.
    """

    mass_kg: FloatArray
    com_m: FloatArray
    inertia_kgm2: FloatArray
    upper_arm_m: FloatArray

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "mass_kg", frozen_array(self.mass_kg, "mass_kg", (None, None)))
        t, n = self.mass_kg.shape
        put(self, "com_m", frozen_array(self.com_m, "com_m", (t, n, 3)))
        put(self, "inertia_kgm2", frozen_array(self.inertia_kgm2, "inertia_kgm2", (t, n, 3, 3)))
        put(self, "upper_arm_m", frozen_array(self.upper_arm_m, "upper_arm_m", (t,)))
        if (self.mass_kg < 0).any() or (self.upper_arm_m <= 0).any():
            raise RecordError("a payload of negative mass or length", expected="0 or more")

    @property
    def n_trials(self) -> int:
        """T."""
        return len(self.mass_kg)

    @classmethod
    def of_skeletons(cls, skeletons: Sequence[Skeleton]) -> Payload:
        """Payload of T skeletons with the robot's segments and the arm's masses."""
        links = [s.segments[1:] for s in skeletons]
        elbows = [-s.segments[s.index(FOREARM)].origin_m[2] for s in skeletons]
        return cls(
            np.array([[b.mass_kg for b in own] for own in links]),
            np.array([[b.com_m for b in own] for own in links]),
            np.array([[b.inertia_kgm2 for b in own] for own in links]),
            np.array(elbows),
        )

    @classmethod
    def nothing(cls, upper_arm_m: FloatArray, links: int) -> Payload:
        """An empty robot adjusted to T lengths (T,)."""
        t = len(upper_arm_m)
        zeros = (np.zeros((t, links)), np.zeros((t, links, 3)), np.zeros((t, links, 3, 3)))
        return cls(*zeros, upper_arm_m)


@dataclass(frozen=True)
class Moments:
    """Bodies by their moments about their links' origins.

    Attributes
    ----------
    mass : (n, T)
    first : (3, n, T)
        ``m c``.
    second : (3, 3, n, T)
        ``sum m r r^T``.
    """

    mass: FloatArray
    first: FloatArray
    second: FloatArray

    @classmethod
    def of(cls, payload: Payload) -> Moments:
        """Moments of mass of a payload."""
        m, c, inertia = payload.mass_kg, payload.com_m, payload.inertia_kgm2
        trace = np.trace(inertia, axis1=2, axis2=3)[..., None, None]
        # sum m r r^T = tr(I) / 2 - I about the centre of mass, then the parallel axis
        second = trace / 2 * np.eye(3) - inertia
        second = second + m[..., None, None] * c[..., :, None] * c[..., None, :]
        return cls(
            np.ascontiguousarray(m.T),
            np.ascontiguousarray((m[..., None] * c).transpose(2, 1, 0)),
            np.ascontiguousarray(second.transpose(2, 3, 1, 0)),
        )

    def __add__(self, other: Moments) -> Moments:
        return Moments(self.mass + other.mass, self.first + other.first, self.second + other.second)

    def over_samples(self) -> Moments:
        """With an axis of samples before that of the trials."""
        return Moments(self.mass[..., None, :], self.first[..., None, :], self.second[..., None, :])


@dataclass(frozen=True)
class SerialChain:
    """Hinges along coordinate axes, each link on the one before.

    Attributes
    ----------
    turns : tuple of (int, int)
        Of each hinge: the coordinate axis that it turns about, and its sign.
    origins : (3, n, T) or (3, n, S, T)
        Joint centres in the frame of the link before.
    order : tuple of n int
        Which column of q each hinge is.
    """

    turns: tuple[tuple[int, int], ...]
    origins: FloatArray
    order: tuple[int, ...]

    @classmethod
    def of(
        cls, segments: Sequence[Segment], axes: Sequence[str], upper_arm_m: FloatArray
    ) -> SerialChain:
        """Chain of links from the base outwards, the elbow at each trial's own length (T,).

        Raises
        ------
        InputError
            A link with several hinges, or with a hinge that is along no coordinate axis.
        """
        turns, t = [], len(upper_arm_m)
        origins = np.repeat(np.array([s.origin_m for s in segments]).T[..., None], t, axis=2)
        for i, segment in enumerate(segments):
            axis = segment.hinges[0].axis
            k = int(np.argmax(np.abs(axis)))
            if len(segment.hinges) != 1 or abs(abs(axis[k]) - 1) > 1e-12:
                raise InputError(f"link {segment.name}", expected="one hinge about x, y or z")
            turns.append((k, int(np.sign(axis[k]))))
            if segment.name == FOREARM:
                origins[2, i] = -upper_arm_m
        names = [s.hinges[0].name for s in segments]
        return cls(tuple(turns), origins, tuple(list(axes).index(name) for name in names))

    def over_samples(self) -> SerialChain:
        """With an axis of samples before that of the trials."""
        return SerialChain(self.turns, self.origins[..., None, :], self.order)

    @cached_property
    def back(self) -> list[int]:
        """Which hinge each column of q is."""
        return [self.order.index(i) for i in range(len(self.order))]

    def place(self, q: FloatArray) -> Placed:
        """Where the links are at angles q (n, ..., T)."""
        n, rest = len(self.turns), q.shape[1:]
        sine, cosine = np.sin(q), np.cos(q)
        R, p, e = np.empty((3, 3, n, *rest)), np.empty((3, n, *rest)), np.empty((3, n, *rest))
        frame = np.zeros((3, 3, *rest))
        frame[[0, 1, 2], [0, 1, 2]] = 1.0
        here = np.zeros((3, *rest))
        for i, (axis, sign) in enumerate(self.turns):
            s, c = sign * sine[self.order[i]], cosine[self.order[i]]
            here = here + (frame * self.origins[:, i]).sum(axis=1)
            j, k = _FORWARD[axis], _BACK[axis]
            turned = R[:, :, i]
            turned[:, axis] = frame[:, axis]
            turned[:, j] = c * frame[:, j] + s * frame[:, k]
            turned[:, k] = c * frame[:, k] - s * frame[:, j]
            e[:, i], p[:, i], frame = sign * frame[:, axis], here, turned
        return Placed(R, p, e, cross(p, e))


@dataclass(frozen=True)
class Placed:
    """Frames of the n links in the world, and the hinges' unit motions about its origin.

    Attributes
    ----------
    R : (3, 3, n, ..., T)
    p, e, v : (3, n, ..., T)
        Joint centres, hinge axes, and the velocity at the world's origin of a body that turns about
        the hinge at 1 rad/s.
    """

    R: FloatArray
    p: FloatArray
    e: FloatArray
    v: FloatArray

    def inertia(self, bodies: Moments) -> WorldInertia:
        """The bodies' moments about the world's origin, in its axes."""
        R, p = self.R, self.p
        first = (R * bodies.first).sum(axis=1)
        moment = first + bodies.mass * p
        turned = (R[:, :, None] * bodies.second).sum(axis=1)
        second = (turned[:, None] * R).sum(axis=2)
        # sum m x x^T with x = p + R r
        second += p[:, None] * moment
        second += first[:, None] * p
        return WorldInertia(bodies.mass, moment, second)


@dataclass(frozen=True)
class WorldInertia:
    """Mass, first and second moments of n bodies about the world's origin."""

    mass: FloatArray
    first: FloatArray
    second: FloatArray

    def __add__(self, other: WorldInertia) -> WorldInertia:
        return WorldInertia(
            self.mass + other.mass, self.first + other.first, self.second + other.second
        )

    def carried(self) -> WorldInertia:
        """Sums over each body and all bodies beyond it."""
        return WorldInertia(
            _inwards(self.mass, 0), _inwards(self.first, 1), _inwards(self.second, 2)
        )

    def momentum(self, w: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Linear and angular (3, n, ...) of turning w and moving v at the world's origin."""
        trace = self.second[0, 0] + self.second[1, 1] + self.second[2, 2]
        linear = self.mass * v + cross(w, self.first)
        angular = trace * w - (self.second * w).sum(axis=1) + cross(self.first, v)
        return linear, angular


def mass_and_bias(
    chain: SerialChain, bodies: Moments, q: FloatArray, qd: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """M (n, n, ..., T) and Coriolis and gravity torques (n, ..., T) of ``M qdd + b = tau``."""
    at = chain.place(q)
    inertia = at.inertia(bodies)
    return mass_matrix(chain, at, inertia), needed_torque(chain, at, inertia, qd)


def inverse_dynamics(
    chain: SerialChain, bodies: Moments, q: FloatArray, qd: FloatArray, qdd: FloatArray
) -> FloatArray:
    """``M qdd + C qd + G`` (n, ..., T)."""
    at = chain.place(q)
    return needed_torque(chain, at, at.inertia(bodies), qd, qdd)


def mass_matrix(chain: SerialChain, at: Placed, inertia: WorldInertia) -> FloatArray:
    """M (n, n, ..., T) of placed bodies: composite rigid bodies."""
    linear, angular = inertia.carried().momentum(at.e, at.v)
    # M_ji (n, n) = e_j . angular_i + v_j . linear_i for hinges j that carry hinge i
    M = (at.e[:, :, None] * angular[:, None]).sum(axis=0)
    M += (at.v[:, :, None] * linear[:, None]).sum(axis=0)
    for i in range(len(M)):
        M[i + 1 :, i] = M[i, i + 1 :]
    return np.asarray(M[np.ix_(chain.back, chain.back)])


def needed_torque(
    chain: SerialChain,
    at: Placed,
    inertia: WorldInertia,
    qd: FloatArray,
    qdd: FloatArray | None = None,
) -> FloatArray:
    """``M qdd + C qd + G`` of placed bodies: Newton and Euler outwards and back."""
    order = list(chain.order)
    rate = qd[order]
    W, U = _outwards(at.e * rate), _outwards(at.v * rate)
    before_w, before_u = np.zeros_like(W), np.zeros_like(U)
    before_w[:, 1:], before_u[:, 1:] = W[:, :-1], U[:, :-1]
    # the hinges' axes are carried by the links before them
    alpha = cross(before_w, at.e) * rate
    a = (cross(before_w, at.v) + cross(before_u, at.e)) * rate
    if qdd is not None:
        alpha += at.e * qdd[order]
        a += at.v * qdd[order]
    alpha, a = _outwards(alpha), _outwards(a)
    # gravity counts as the world's acceleration upwards
    a[2] += GRAVITY_M_S2
    linear, angular = inertia.momentum(W, U)
    force, moment = inertia.momentum(alpha, a)
    force += cross(W, linear)
    moment += cross(W, angular) + cross(U, linear)
    force, moment = _inwards(force, 1), _inwards(moment, 1)
    tau = (at.e * moment).sum(axis=0) + (at.v * force).sum(axis=0)
    return np.asarray(tau[chain.back])


def _outwards(values: FloatArray) -> FloatArray:
    """Sums from the base on over the second axis; changes `values`."""
    for i in range(1, values.shape[1]):
        values[:, i] += values[:, i - 1]
    return values


def _inwards(values: FloatArray, axis: int) -> FloatArray:
    """Sums from the end back over an axis, a copy."""
    sums = values.copy()
    along = np.moveaxis(sums, axis, 0)
    for i in range(len(along) - 2, -1, -1):
        along[i] += along[i + 1]
    return sums
