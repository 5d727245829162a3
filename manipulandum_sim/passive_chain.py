"""Forward dynamics of a chain of segments that hangs on a moving base, many chains at once.

A rigid body moves as four points with weights do (a square root of its pseudo-inertia), so that
Newton's law for points is all: no inertia tensors, no gyroscopic terms. The points' velocities and
accelerations come from products of 12 x 12 matrices that hold a joint's transform and its first
two derivatives in time. Everything is in the base's axes.

Sizes: T chains, K free hinges, S segments that they carry.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from armimpedance.motion import GRAVITY_M_S2, Segment, Skeleton
from armimpedance.records import BoolArray, FloatArray

from .tree_dynamics import move

_GRAVITY: Final = np.array([0.0, 0.0, -GRAVITY_M_S2])
#: Row k holds the matrix of the cross product by the k-th unit vector.
_CROSS: Final = np.array(
    [[0, 0, 0, 0, 0, -1, 0, 1, 0], [0, 0, 1, 0, 0, 0, -1, 0, 0], [0, -1, 0, 1, 0, 0, 0, 0, 0]],
    dtype=float,
)


def cross_matrix(vectors: FloatArray) -> FloatArray:
    """Matrices (..., 3, 3) of the cross product by vectors (..., 3)."""
    return (vectors @ _CROSS).reshape(*vectors.shape, 3)


def weighted_points(segment: Segment) -> FloatArray:
    """Four points (4, 4) that move as the body does: columns are (weight * place, weight).

    ``L L^T = [[Sigma, m c], [m c^T, m]]``, the pseudo-inertia about the segment's frame, with
    ``Sigma = tr(I) / 2 - I``.
    """
    c, m = segment.com_m, segment.mass_kg
    own = np.trace(segment.inertia_kgm2) / 2 * np.eye(3) - segment.inertia_kgm2
    pseudo = np.empty((4, 4))
    pseudo[:3, :3] = own + m * np.outer(c, c)
    pseudo[:3, 3] = pseudo[3, :3] = m * c
    pseudo[3, 3] = m
    values, vectors = np.linalg.eigh(pseudo)
    return vectors * np.sqrt(np.maximum(values, 0.0))


@dataclass(frozen=True)
class Chain:
    """The free end of a skeleton's arm, each segment the child of the one before.

    Attributes
    ----------
    segments : tuple of S Segment
        The first hangs on the base.
    """

    segments: tuple[Segment, ...]

    @cached_property
    def axes(self) -> FloatArray:
        """Axes (K, 3) of the hinges, each in the frame that the hinges before it have reached."""
        return np.array([h.axis for s in self.segments for h in s.hinges])

    @cached_property
    def _owner(self) -> FloatArray:
        """Which segment (K,) each hinge belongs to."""
        return np.repeat(np.arange(len(self.segments)), [len(s.hinges) for s in self.segments])

    @cached_property
    def _joints(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Transforms' parts (K, 4, 4): constant, with the sine, with the cosine of the angle."""
        parts = np.zeros((3, len(self.axes), 4, 4))
        turn = cross_matrix(self.axes)
        parts[1, :, :3, :3], parts[2, :, :3, :3] = turn, -turn @ turn
        parts[0] = np.eye(4) - parts[2]
        first = np.flatnonzero(np.diff(self._owner, prepend=-1))
        for hinge, segment in zip(first, self.segments, strict=True):
            parts[0, hinge, :3, 3] = segment.origin_m
        return parts[0], parts[1], parts[2]

    @cached_property
    def _generators(self) -> FloatArray:
        """Matrices (K, 4, 4) with dA/dq = A U."""
        U = np.zeros((len(self.axes), 4, 4))
        U[:, :3, :3] = cross_matrix(self.axes)
        return U

    @cached_property
    def _points(self) -> FloatArray:
        """Weighted points (S, 12, 12), the same for place, velocity and acceleration."""
        return np.stack([np.kron(np.eye(3), weighted_points(s)) for s in self.segments])

    @cached_property
    def _weights(self) -> FloatArray:
        """(S, 1, 4)"""
        return np.stack([weighted_points(s)[3:] for s in self.segments])

    @cached_property
    def _carries(self) -> FloatArray:
        """Whether (1) a hinge carries a segment (K, S, 1, 1)."""
        carries = self._owner[:, None] <= np.arange(len(self.segments))
        return carries[:, :, None, None].astype(float)

    @cached_property
    def _last(self) -> FloatArray:
        """Each segment's last hinge (S,)."""
        return np.cumsum([len(s.hinges) for s in self.segments]) - 1

    def _jets(self, q: FloatArray, qd: FloatArray) -> list[FloatArray]:
        """After each hinge the transform and its two derivatives, side by side, (T, 3, 12)."""
        constant, sine, cosine = self._joints
        s, c = np.sin(q)[..., None, None], np.cos(q)[..., None, None]
        rate = qd[..., None, None]
        A = constant + s * sine + c * cosine
        A1 = rate * (A @ self._generators)
        G = np.zeros((*q.shape, 12, 12))
        G[..., :4, :4] = G[..., 4:8, 4:8] = G[..., 8:, 8:] = A
        G[..., :4, 4:8] = A1
        G[..., 4:8, 8:] = 2 * A1
        G[..., :4, 8:] = rate * (A1 @ self._generators)
        # (T, 3, 12) = (T, 3, 12) (T, 12, 12): [X X' X''] of the product from those of the factors
        jets = [G[:, 0, :3]]
        for i in range(1, q.shape[1]):
            jets.append(jets[-1] @ G[:, i])
        return jets

    def mass_and_bias(
        self, q: FloatArray, qd: FloatArray, base: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """M (T, K, K) and b (T, K) of ``M qdd + b = tau``.

        Parameters
        ----------
        q, qd : (T, K)
        base : (T, 3, 7)
            Of `base_motion`.
        """
        jets = self._jets(q, qd)
        after = np.stack(jets, axis=1)
        axes = (after[..., :3] @ self.axes[:, :, None])[..., 0]
        moved = after[:, self._last] @ self._points
        place, weights = moved[..., :4], self._weights
        lever = place[:, None] - after[:, :, None, :, 3:4] * weights
        # dP/dq_i (T, K, S, 3, 4) = e_i x (P - w o_i) for the segments that hinge i carries
        J = (cross_matrix(axes)[:, :, None] @ lever) * self._carries
        J = J.reshape(*q.shape, -1)
        # force (T, S, 3, 4) = P'' + Omega P + 2 omega x P' + w (a - g)
        force = (
            moved[..., 8:]
            + base[:, None, :, 1:4] @ place
            + base[:, None, :, 4:] @ moved[..., 4:8]
            + base[:, None, :, :1] * weights
        )
        bias = (J @ force.reshape(len(q), -1, 1))[..., 0]
        return J @ J.transpose(0, 2, 1), bias

    def acceleration(
        self,
        q: FloatArray,
        qd: FloatArray,
        base: FloatArray,
        torque: FloatArray,
        held: BoolArray | None = None,
    ) -> FloatArray:
        """qdd (T, K) under joint torques (T, K); hinges that are `held` (T, K) do not move."""
        M, bias = self.mass_and_bias(q, qd, base)
        right = torque - bias
        if held is not None:
            free = ~held
            M = M * (free[:, :, None] & free[:, None, :]) + held[:, :, None] * np.eye(q.shape[1])
            right = right * free
        return np.linalg.solve(M, right[..., None])[..., 0]


def base_motion(
    skeleton: Skeleton, base: str, q: FloatArray, qd: FloatArray, qdd: FloatArray
) -> FloatArray:
    """What a segment's motion does to what hangs on it, in its axes: (N, 3, 7).

    Columns: ``a - g`` of its origin; ``Omega = [alpha] + [omega]^2`` (3); ``2 [omega]`` (3).
    """
    upto = Skeleton(skeleton.segments[: skeleton.index(base) + 1], floating=skeleton.floating)
    n = len(upto.coordinates)
    motion = move(upto, q[:, :n], qd[:, :n], qdd[:, :n])
    back = motion.rotation[-1].transpose(0, 2, 1)
    omega = cross_matrix((back @ motion.rate[-1][..., None])[..., 0])
    alpha = cross_matrix((back @ motion.angular_acceleration[-1][..., None])[..., 0])
    lift = back @ (motion.acceleration[-1] - _GRAVITY)[..., None]
    return np.concatenate([lift, alpha + omega @ omega, 2 * omega], axis=2)
