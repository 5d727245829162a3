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

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.core.skeleton import GRAVITY_M_S2, Segment, Skeleton
from manipulandum_sim.tree_dynamics import move

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
    def _jet_parts(self) -> FloatArray:
        """Map from the features to a joint's [[A A' A''], [0 A 2A'], [0 0 A]], (K, 7, 144).

        ``A = A_0 + s A_s + c A_c``; with dA/dq = A U and A_0 U = 0, ``A' = qd (s A_s + c A_c) U``
        and ``A'' = qd^2 (s A_s + c A_c) U^2`` (qdd apart). Features: 1, s, c, then s and c times
        qd, then times qd^2.
        """
        first = np.flatnonzero(np.diff(self._owner, prepend=-1))
        origins = {int(i): s.origin_m for i, s in zip(first, self.segments, strict=True)}
        parts = np.zeros((len(self.axes), 7, 12, 12))
        for i, turn in enumerate(cross_matrix(self.axes)):
            constant, sine, cosine, U = np.eye(4), *np.zeros((3, 4, 4))
            U[:3, :3] = sine[:3, :3] = turn
            cosine[:3, :3] = -turn @ turn
            constant -= cosine
            constant[:3, 3] = origins.get(i, 0.0)
            once, twice = np.eye(3, k=1) * [[1], [2], [0]], np.eye(3, k=2)
            parts[i, 0] = np.kron(np.eye(3), constant)
            for row, part in ((1, sine), (2, cosine)):
                parts[i, row] = np.kron(np.eye(3), part)
                parts[i, row + 2] = np.kron(once, part @ U)
                parts[i, row + 4] = np.kron(twice, part @ U @ U)
        return parts.reshape(len(self.axes), 7, 144)

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
        """1 where a hinge carries a segment, else 0, (K, S, 1, 1)."""
        carries = self._owner[:, None] <= np.arange(len(self.segments))
        return carries[:, :, None, None].astype(float)

    @cached_property
    def _last(self) -> FloatArray:
        """Each segment's last hinge (S,)."""
        return np.cumsum([len(s.hinges) for s in self.segments]) - 1

    def _jets(self, q: FloatArray, qd: FloatArray, base: FloatArray) -> FloatArray:
        """After each hinge the transform and its two derivatives, side by side, (T, K, 3, 12)."""
        trials, hinges = q.shape
        features = np.empty((hinges, trials, 7))
        features[:, :, 0] = 1.0
        np.sin(q.T, out=features[:, :, 1])
        np.cos(q.T, out=features[:, :, 2])
        rate = qd.T[:, :, None]
        np.multiply(features[:, :, 1:3], rate, out=features[:, :, 3:5])
        np.multiply(features[:, :, 3:5], rate, out=features[:, :, 5:])
        # (K, T, 144) = (K, T, 7) (K, 7, 144)
        G = (features @ self._jet_parts).reshape(hinges, trials, 12, 12)
        jets = np.empty((trials, hinges, 3, 12))
        # [X X' X''] (T, 3, 12) of a product = that of the factor before, times G (T, 12, 12)
        np.matmul(base, G[0], out=jets[:, 0])
        for i in range(1, hinges):
            np.matmul(jets[:, i - 1], G[i], out=jets[:, i])
        return jets

    def mass_and_bias(
        self, q: FloatArray, qd: FloatArray, base: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """M (T, K, K) and b (T, K) of ``M qdd + b = tau``.

        Parameters
        ----------
        q, qd : (T, K)
        base : (T, 3, 12)
            The motion of the base as `base_motion` gives it.
        """
        after = self._jets(q, qd, base)
        axes = (after[..., :3] @ self.axes[:, :, None])[..., 0]
        moved = after[:, self._last] @ self._points
        place, weights = moved[..., :4], self._weights
        lever = place[:, None] - after[:, :, None, :, 3:4] * weights
        # dP/dq_i (T, K, S, 3, 4) = e_i x (P - w o_i) for the segments that hinge i carries
        J = (cross_matrix(axes)[:, :, None] @ lever) * self._carries
        J = J.reshape(*q.shape, -1)
        # b (T, K) = J (T, K, 12 S) P'' (T, 12 S)
        bias = (J @ moved[..., 8:].reshape(len(q), -1, 1))[..., 0]
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
        # qdd (T, K) = M^-1 (T, K, K) (tau - b) (T, K)
        qdd = np.linalg.solve(M, right[..., None])[..., 0]
        return np.asarray(qdd, dtype=np.float64)


def base_motion(
    skeleton: Skeleton, base: str, q: FloatArray, qd: FloatArray, qdd: FloatArray
) -> FloatArray:
    """Transform of a segment in its own axes with two derivatives, side by side: (N, 3, 12).

    ``[1 0 | [omega] 0 | [alpha] + [omega]^2, a - g]``: gravity counts as the base's acceleration.
    """
    upto = Skeleton(skeleton.segments[: skeleton.index(base) + 1], floating=skeleton.floating)
    n = len(upto.coordinates)
    motion = move(upto, q[:, :n], qd[:, :n], qdd[:, :n])
    back = motion.rotation[-1].transpose(0, 2, 1)
    omega = cross_matrix((back @ motion.rate[-1][..., None])[..., 0])
    alpha = cross_matrix((back @ motion.angular_acceleration[-1][..., None])[..., 0])
    jet = np.zeros((len(q), 3, 12))
    jet[:, :, :3], jet[:, :, 4:7] = np.eye(3), omega
    jet[:, :, 8:11] = alpha + omega @ omega
    jet[:, :, 11:] = back @ (motion.acceleration[-1] - _GRAVITY)[..., None]
    return jet
