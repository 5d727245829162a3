"""A planar two-link chain seen from its end point: closed forms over batches of any shape.

Every quantity is a component of shape (...,) so that the inner loop of a simulation makes neither
small matrices nor calls of a linear-algebra library; 2 x 2 solves are written out.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import NamedTuple

import numpy as np

from armimpedance.core.arrays import FloatArray
from manipulandum_sim.hand.subjects import Segment

#: A number, or one per chain of a stack.
Scalar = float | FloatArray


class EndMotion(NamedTuple):
    """State of a chain and its dynamics at the end point, each (...,).

    ``rx, ry`` end point from the base, ``ux, uy`` from the middle joint; ``det`` of the Jacobian
    ``[[-ry, -uy], [rx, ux]]``, which is l1 l2 sin q2, and ``dot`` l1 l2 cos q2; ``w1, w2`` rates
    of the joint angles; ``Lxx, Lxy, Lyy`` inertia and ``bx, by`` centrifugal and Coriolis force at
    the end point: the force that moves the chain is ``L a + b``.
    """

    rx: FloatArray
    ry: FloatArray
    ux: FloatArray
    uy: FloatArray
    det: FloatArray
    dot: FloatArray
    w1: FloatArray
    w2: FloatArray
    Lxx: FloatArray
    Lxy: FloatArray
    Lyy: FloatArray
    bx: FloatArray
    by: FloatArray


@dataclass(frozen=True)
class TwoLink:
    """Lengths and inertia of a chain with two hinges.

    Attributes
    ----------
    l1, l2 : float
        Lengths (m).
    inertia1, inertia2, coupling : float
        kg m^2: ``M11 = inertia1 + inertia2 + 2 coupling cos q2``,
        ``M12 = inertia2 + coupling cos q2``, ``M22 = inertia2``.
    base_x, base_y : float
        Place of the first hinge (m).
    elbow : {1.0, -1.0}
        Sign of the second joint's angle.

    A stack of chains (`stacked`) holds columns (C, 1); what it returns is (C, ...).
    """

    l1: Scalar
    l2: Scalar
    inertia1: Scalar
    inertia2: Scalar
    coupling: Scalar
    base_x: Scalar = 0.0
    base_y: Scalar = 0.0
    elbow: Scalar = 1.0

    @classmethod
    def from_segments(
        cls, l1: float, l2: float, first: Segment, second: Segment, **placement: float
    ) -> TwoLink:
        """Two links that are given as rigid bodies with their lengths."""
        return cls(
            l1,
            l2,
            first.inertia + first.mass * first.com**2 + second.mass * l1**2,
            second.inertia + second.mass * second.com**2,
            second.mass * l1 * second.com,
            **placement,
        )

    def end_position(self, q1: FloatArray, q2: FloatArray) -> tuple[FloatArray, FloatArray]:
        """End point (m) at joint angles (rad), each (...,)."""
        x = self.base_x + self.l1 * np.cos(q1) + self.l2 * np.cos(q1 + q2)
        y = self.base_y + self.l1 * np.sin(q1) + self.l2 * np.sin(q1 + q2)
        return x, y

    def end_motion(self, x: FloatArray, y: FloatArray, vx: FloatArray, vy: FloatArray) -> EndMotion:
        """Joint state and end-point dynamics from end point and velocity, each (...,).

        Out of reach gives NaN: callers check the reach once, before they integrate.
        """
        half, product, square, ratio = self.constants
        rx, ry = x - self.base_x, y - self.base_y
        rr = rx * rx + ry * ry
        # law of cosines: dot = l1 l2 cos q2, det = l1 l2 sin q2
        dot = rr * 0.5 - half
        det = np.sqrt(product - dot * dot)
        det *= self.elbow
        # e middle joint from the base, u end point from the middle joint, r = e + u
        inverse = 1 / rr
        along, across = (square + dot) * inverse, det * inverse
        ex, ey = along * rx + across * ry, along * ry - across * rx
        ux, uy = rx - ex, ry - ey
        # rates of both links in space: [[ux, uy], [-ex, -ey]] v / det, (2,) = (2, 2) (2,)
        scale = 1 / det
        Ux, Uy, Ex, Ey = ux * scale, uy * scale, ex * scale, ey * scale
        w1, w12 = Ux * vx + Uy * vy, -(Ex * vx + Ey * vy)
        # L = inertia1 U U^T - coupling cos q2 (U E^T + E U^T) + inertia2 E E^T, (2, 2): by link
        # rates the mass matrix is [[inertia1, coupling cos q2], [., inertia2]]
        cosine = ratio * dot
        ax, ay = self.inertia1 * Ux - cosine * Ex, self.inertia1 * Uy - cosine * Ey
        bx, by = self.inertia2 * Ex - cosine * Ux, self.inertia2 * Ey - cosine * Uy
        Lxx, Lxy, Lyy = ax * Ux + bx * Ex, ax * Uy + bx * Ey, ay * Uy + by * Ey
        # -Jdot qdot = w1^2 e + w12^2 u: each link turns about its own hinge
        square1, square12 = w1 * w1, w12 * w12
        cx, cy = square1 * ex + square12 * ux, square1 * ey + square12 * uy
        # b = J^-T h - L Jdot qdot, with h the links' centrifugal torques, (2,)
        sine = ratio * det
        b_U = ax * cx + ay * cy - sine * square12
        b_E = bx * cx + by * cy - sine * square1
        return EndMotion(
            *(rx, ry, ux, uy, det, dot, w1, w12 - w1, Lxx, Lxy, Lyy),
            Ux * b_U + Ex * b_E,
            Uy * b_U + Ey * b_E,
        )

    def sines(self, motion: EndMotion) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """``sin q1, cos q1, sin q2, cos q2``, each (...,)."""
        m, inverse = motion, 1 / (self.l1 * self.l2)
        s1, c1 = (m.ry - m.uy) / self.l1, (m.rx - m.ux) / self.l1
        return s1, c1, m.det * inverse, m.dot * inverse

    def angles(self, motion: EndMotion) -> tuple[FloatArray, FloatArray]:
        """Joint angles (rad), each (...,)."""
        s1, c1, s2, c2 = self.sines(motion)
        return np.arctan2(s1, c1), np.arctan2(s2, c2)

    @cached_property
    def constants(self) -> tuple[Scalar, Scalar, Scalar, Scalar]:
        """``(l1^2 + l2^2) / 2, (l1 l2)^2, l1^2, coupling / (l1 l2)``."""
        product = self.l1 * self.l2
        half = (self.l1**2 + self.l2**2) / 2
        return half, product**2, self.l1**2, self.coupling / product

    def reaches(self, x: FloatArray, y: FloatArray) -> bool:
        """Return True if every point lies within reach, neither folded nor stretched."""
        r = np.hypot(x - self.base_x, y - self.base_y)
        return bool(np.all((r < self.l1 + self.l2) & (r > abs(self.l1 - self.l2))))


def stacked(*chains: TwoLink) -> TwoLink:
    """Several chains as one, each field a column (C, 1)."""
    columns = {
        f.name: np.array([[getattr(chain, f.name)] for chain in chains]) for f in fields(TwoLink)
    }
    return TwoLink(**columns)


def end_force(
    motion: EndMotion, tau1: FloatArray, tau2: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Force at the end point of joint torques, ``F = J^-T tau``, each (...,)."""
    x = (motion.ux * tau1 - motion.rx * tau2) / motion.det
    y = (motion.uy * tau1 - motion.ry * tau2) / motion.det
    return x, y
