"""A wrist and an ankle of two rotations: a hand or a foot on a universal joint.

Wrist: flexion, then radial deviation, the forearm level and the thumb up. Ankle: dorsiflexion, then
inversion, the person seated. The numbers are our choice, of a size that lets the limb resonate
between 5 and 12 Hz; what they take from measurements is the order: a relaxed wrist is stiffer in
deviation than in flexion, and its softest direction is tilted by some 20 degrees (D. Formica and
colleagues, J. Neurophysiol. 2012, The passive stiffness of the wrist and forearm); an ankle is
stiffer in the sagittal than in the frontal plane, with little between the two (H. Lee, H. I. Krebs,
N. Hogan, IEEE Trans. Neural Syst. Rehabil. Eng. 2014, on relaxed muscles).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.skeleton import GRAVITY_M_S2
from manipulandum_sim.random_hand.limbs import Held

Joint = Literal["wrist", "ankle"]


@dataclass(frozen=True)
class TwoAxisJoint:
    """A rigid segment that turns about an axis (1) of the ground and one (2) that it carries.

    In the segment's own frame, axes (1, 2, 3), 3 across both:

        M(q2) qdd + h(q2, qd) = tau_gravity(q) - held - K_0 (q - posture) - B qd - late

    Attributes
    ----------
    inertia : (3, 3)
        About the joint, kg m^2.
    moment : (3,)
        Mass times its centre, kg m.
    down : (3,)
        Where gravity points while both angles are 0.
    passive, muscles : (2, 2)
        Stiffness of the relaxed joint, and what co-contraction adds, N m/rad.
    viscosity : (2, 2)
        N m s/rad.
    posture : (2,)
        Where it is held, rad; the muscles bear its weight there.
    reflex_gain : float
        Of the muscles' stiffness.
    """

    inertia: FloatArray
    moment: FloatArray
    down: FloatArray
    passive: FloatArray
    muscles: FloatArray
    viscosity: FloatArray
    posture: FloatArray
    reflex_gain: float = 0.0

    @property
    def start(self) -> FloatArray:
        """The posture."""
        return self.posture

    @property
    def reflex(self) -> FloatArray:
        """Stiffness that the reflex adds after its delay, (2, 2)."""
        return self.reflex_gain * self.muscles

    @property
    def stiffness(self) -> FloatArray:
        """At the posture, the weight's share among it (2, 2)."""
        q, step = self.posture, 1e-5
        sides = q + step * np.concatenate([np.eye(2), -np.eye(2)])
        weight = self._weight(sides)
        return np.asarray(self.passive + self.muscles - (weight[:2] - weight[2:]).T / (2 * step))

    def mass_matrix(self, q: FloatArray) -> FloatArray:
        """M at angles (T, 2), (T, 2, 2)."""
        return _symmetric(*self._masses(q)[:2], self.inertia[1, 1])

    def at(self, q: FloatArray, qd: FloatArray, delayed: FloatArray | None) -> Held:
        """See `Limb`; the stretch is that of the angles."""
        M11, M12, slope11, slope12 = self._masses(q)
        v, w = qd.T
        # Lagrange: M depends on the second angle alone
        turned = np.stack([(slope11 * v + slope12 * w) * w, -slope11 * v**2 / 2], axis=1)
        away = q - self.posture
        pull = self._weight(q) - self._borne - turned
        pull = pull - away @ (self.passive + self.muscles).T - qd @ self.viscosity.T
        if delayed is not None:
            pull = pull - delayed @ self.reflex.T
        A = _symmetric(M11, M12, self.inertia[1, 1])
        J = np.broadcast_to(np.eye(2), A.shape)
        return Held(A, pull, q, qd, J, np.zeros_like(q), away)

    @cached_property
    def _borne(self) -> FloatArray:
        """Torque of the weight at the posture (2,), which the muscles bear."""
        return self._weight(self.posture[None])[0]

    def _masses(self, q: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """M_11, M_12 and their derivatives by the second angle, (T,) each.

        The segment sees the first axis as (cos q2, 0, sin q2) and the second as (0, 1, 0).
        """
        c, s, m = np.cos(q[:, 1]), np.sin(q[:, 1]), self.inertia
        M11 = c**2 * m[0, 0] + 2 * c * s * m[0, 2] + s**2 * m[2, 2]
        slope11 = 2 * ((c**2 - s**2) * m[0, 2] + c * s * (m[2, 2] - m[0, 0]))
        return M11, c * m[0, 1] + s * m[1, 2], slope11, c * m[1, 2] - s * m[0, 1]

    def _weight(self, q: FloatArray) -> FloatArray:
        """Torque of the weight about both axes (T, 2)."""
        (c1, c2), (s1, s2) = np.cos(q).T, np.sin(q).T
        (x, y, z), (along, across, out) = self.down, GRAVITY_M_S2 * self.moment
        level, up = c1 * y + s1 * z, c1 * z - s1 * y
        # gravity as the segment sees it is (c2 x - s2 up, level, s2 x + c2 up)
        first = along * s2 * level + across * up - out * c2 * level
        second = out * (c2 * x - s2 * up) - along * (s2 * x + c2 * up)
        return np.stack([first, second], axis=1)


def _symmetric(first: FloatArray, both: FloatArray, second: float) -> FloatArray:
    """Matrices (T, 2, 2) of two elements (T,) and a constant one."""
    M = np.empty((len(first), 2, 2))
    M[:, 0, 0], M[:, 0, 1], M[:, 1, 0], M[:, 1, 1] = first, both, both, second
    return M


def _tilted(low: float, high: float, degrees: float) -> FloatArray:
    """A symmetric matrix of these eigenvalues, the lower one's axis turned by an angle."""
    a = np.radians(degrees)
    U = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    return np.asarray(U @ np.diag([low, high]) @ U.T)


def find_joint(name: Joint, cocontraction: float, reflex_gain: float = 0.0) -> TwoAxisJoint:
    """The wrist or the ankle at a level of co-contraction, parts of the greatest activation."""
    wrist = {
        "inertia": np.array([[3.0e-3, 2e-4, 0], [2e-4, 3.4e-3, 1e-4], [0, 1e-4, 6e-4]]),
        "moment": np.array([0.0, 0.0, 0.028]),
        "down": np.array([-1.0, 0.0, 0.0]),
        "passive": _tilted(1.0, 2.2, 20.0),
        "muscles": cocontraction * np.array([[26.0, 4.0], [4.0, 34.0]]),
        "viscosity": np.array([[0.060, 0.012], [0.012, 0.085]]),
        "posture": np.array([-0.15, 0.10]),
    }
    ankle = {
        "inertia": np.array([[1.6e-2, -8e-4, 0], [-8e-4, 6.0e-3, -9e-4], [0, -9e-4, 1.5e-2]]),
        "moment": np.array([0.0, 0.055, -0.045]),
        "down": np.array([0.0, 0.0, -1.0]),
        "passive": _tilted(8.0, 22.0, 85.0),
        "muscles": cocontraction * np.array([[420.0, -35.0], [-35.0, 110.0]]),
        "viscosity": np.array([[0.90, 0.05], [0.05, 0.30]]),
        "posture": np.array([0.10, 0.05]),
    }
    return TwoAxisJoint(**{"wrist": wrist, "ankle": ankle}[name], reflex_gain=reflex_gain)


#: Names of the axes' positive directions.
DIRECTIONS: Final = {
    "wrist": ("flexion", "radial deviation"),
    "ankle": ("dorsiflexion", "inversion"),
}
