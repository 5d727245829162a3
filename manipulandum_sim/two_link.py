"""A planar two-link chain seen from its end point: closed forms over batches of any shape.

Every quantity is a component of shape (...,) so that the inner loop of a simulation makes neither
small matrices nor calls of a linear-algebra library; 2 x 2 solves are written out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from armimpedance.records import FloatArray

from .subjects import Segment


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
    """

    l1: float
    l2: float
    inertia1: float
    inertia2: float
    coupling: float
    base_x: float = 0.0
    base_y: float = 0.0
    elbow: float = 1.0

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
        # qdot = J^-1 v, (2,) = (2, 2) (2,)
        w1 = (ux * vx + uy * vy) / det
        w2 = -(rx * vx + ry * vy) / det
        m12 = self.inertia2 + self.coupling * c2
        m11 = self.inertia1 + self.coupling * c2 + m12
        m22 = self.inertia2
        # L = J^-T M J^-1, (2, 2)
        dd = det * det
        Lxx = (m11 * ux * ux - 2 * m12 * ux * rx + m22 * rx * rx) / dd
        Lxy = (m11 * ux * uy - m12 * (ux * ry + uy * rx) + m22 * rx * ry) / dd
        Lyy = (m11 * uy * uy - 2 * m12 * uy * ry + m22 * ry * ry) / dd
        # Jdot qdot: each link turns its part of r about its own hinge.
        squared1, squared12 = w1 * w1, (w1 + w2) ** 2
        ax = -squared1 * (rx - ux) - squared12 * ux
        ay = -squared1 * (ry - uy) - squared12 * uy
        h1 = -self.coupling * s2 * (2 * w1 + w2) * w2
        h2 = self.coupling * s2 * squared1
        # b = J^-T h - L Jdot qdot, (2,)
        bx = (ux * h1 - rx * h2) / det - Lxx * ax - Lxy * ay
        by = (uy * h1 - ry * h2) / det - Lxy * ax - Lyy * ay
        return EndMotion(rx, ry, ux, uy, det, s1, c1, s2, c2, w1, w2, Lxx, Lxy, Lyy, bx, by)

    def reaches(self, x: FloatArray, y: FloatArray) -> bool:
        """Whether every point lies within reach, neither folded nor stretched."""
        r = np.hypot(x - self.base_x, y - self.base_y)
        return bool(np.all((r < self.l1 + self.l2) & (r > abs(self.l1 - self.l2))))


def end_force(
    motion: EndMotion, tau1: FloatArray, tau2: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Force at the end point of joint torques, ``F = J^-T tau``, each (...,)."""
    x = (motion.ux * tau1 - motion.rx * tau2) / motion.det
    y = (motion.uy * tau1 - motion.ry * tau2) / motion.det
    return x, y
