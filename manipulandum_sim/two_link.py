"""A planar two-link chain seen from its end point: closed forms over batches of any shape.

Every quantity is a component of shape (...,) so that the inner loop of a simulation makes neither
small matrices nor calls of a linear-algebra library; 2 x 2 solves are written out.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from armimpedance.records import FloatArray

from .subjects import Segment

#: A number, or one per chain of a stack.
Scalar = float | FloatArray


class EndMotion(NamedTuple):
    """State of a chain and its dynamics at the end point, each (...,).

    ``rx, ry`` end point from the base, ``ux, uy`` from the middle joint, ``det`` of the Jacobian
    ``[[-ry, -uy], [rx, ux]]``; sines, cosines and rates of both joint angles;
    ``Lxx, Lxy, Lyy`` inertia and ``bx, by`` centrifugal and Coriolis force at the end point:
    the force that moves the chain is ``L a + b``.
    """

    rx: FloatArray
    ry: FloatArray
    ux: FloatArray
    uy: FloatArray
    det: FloatArray
    s1: FloatArray
    c1: FloatArray
    s2: FloatArray
    c2: FloatArray
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
        Where the first hinge is (m).
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
        """From two rigid links and their lengths."""
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
        l1, l2 = self.l1, self.l2
        rx, ry = x - self.base_x, y - self.base_y
        rr = rx * rx + ry * ry
        c2 = (rr - (l1 * l1 + l2 * l2)) / (2 * l1 * l2)
        s2 = self.elbow * np.sqrt(1 - c2 * c2)
        along, across = l1 + l2 * c2, l2 * s2
        c1 = (along * rx + across * ry) / rr
        s1 = (along * ry - across * rx) / rr
        ux, uy = rx - l1 * c1, ry - l1 * s1
        det = l1 * l2 * s2
        # J^-1 = [[ux, uy], [-rx, -ry]] / det; qdot = J^-1 v, (2,) = (2, 2) (2,)
        inverse = 1 / det
        i11, i12, i21, i22 = ux * inverse, uy * inverse, -rx * inverse, -ry * inverse
        w1, w2 = i11 * vx + i12 * vy, i21 * vx + i22 * vy
        m12 = self.inertia2 + self.coupling * c2
        m11 = self.inertia1 + self.coupling * c2 + m12
        m22 = self.inertia2
        # M J^-1 with rows (i11, i12), (i21, i22) of J^-1; L = J^-T (M J^-1), (2, 2)
        p11, p12 = m11 * i11 + m12 * i21, m11 * i12 + m12 * i22
        p21, p22 = m12 * i11 + m22 * i21, m12 * i12 + m22 * i22
        Lxx, Lyy = i11 * p11 + i21 * p21, i12 * p12 + i22 * p22
        Lxy = i11 * p12 + i21 * p22
        # -Jdot qdot: each link turns its part of r about its own hinge.
        squared1, squared12 = w1 * w1, (w1 + w2) ** 2
        turn = squared12 - squared1
        cx, cy = squared1 * rx + turn * ux, squared1 * ry + turn * uy
        # b = J^-T h - L Jdot qdot, (2,)
        bend = self.coupling * s2
        h1, h2 = bend * (squared1 - squared12), bend * squared1
        bx = i11 * h1 + i21 * h2 + Lxx * cx + Lxy * cy
        by = i12 * h1 + i22 * h2 + Lxy * cx + Lyy * cy
        return EndMotion(rx, ry, ux, uy, det, s1, c1, s2, c2, w1, w2, Lxx, Lxy, Lyy, bx, by)

    def reaches(self, x: FloatArray, y: FloatArray) -> bool:
        """Whether every point lies within reach, neither folded nor stretched."""
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
