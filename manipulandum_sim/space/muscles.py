"""Twelve muscles of a spatial arm: paths whose moment arms change with posture, their mechanics.

Lengths are polynomials of the second order in the angles, ``L = -r.u - u^T R u / 2`` with u from
the middle of the joints' ranges: moment arms ``r + R u`` of the size that textbooks of anatomy
give, turning with posture by some 20 to 40 % over a radian. They are no published table.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray

#: name -> moment arms (cm) at the middle posture about turn, elevation, axial, elbow; their change
#: (cm/rad) with turn, elevation, axial, elbow on the diagonal; elevation-turn coupling (cm/rad);
#: greatest tension (N); fibre length (cm).
_TABLE: Final = {
    "deltoid_anterior": ((1.8, 3.6, 0.3, 0), (-0.5, -0.7, 0.2, 0), 0.3, 900, 9.8),
    "deltoid_middle": ((-1.2, 3.0, -0.3, 0), (-0.3, -0.5, 0.1, 0), -0.3, 900, 10.8),
    "deltoid_posterior": ((-3.6, -1.6, -0.6, 0), (0.5, 0.4, 0.1, 0), -0.4, 500, 13.7),
    "pectoralis_major": ((4.4, -0.9, 1.2, 0), (-0.6, -0.4, 0.2, 0), 0.5, 900, 14.4),
    "latissimus_dorsi": ((-2.2, -3.8, 1.0, 0), (0.4, 0.8, 0.2, 0), 0.3, 800, 25.4),
    "infraspinatus": ((-2.0, 0.6, -2.1, 0), (0.3, -0.3, 0.4, 0), -0.2, 1100, 7.6),
    "subscapularis": ((1.6, 0.4, 2.2, 0), (-0.3, -0.2, -0.4, 0), 0.2, 1200, 8.7),
    "biceps_long": ((0.6, 1.6, 0.3, 3.6), (-0.2, -0.4, 0.1, -0.9), 0.1, 600, 11.6),
    "biceps_short": ((1.4, 1.8, 0.5, 3.6), (-0.2, -0.4, 0.1, -0.9), 0.2, 450, 13.2),
    "triceps_long": ((-0.9, -2.2, 0.2, -2.2), (0.2, 0.5, 0.1, 0.3), -0.1, 800, 13.4),
    "triceps_lateral": ((0, 0, 0, -2.2), (0, 0, 0, 0.3), 0.0, 1000, 11.4),
    "brachialis": ((0, 0, 0, 2.2), (0, 0, 0, -0.5), 0.0, 950, 8.6),
}
SPACE_MUSCLES: Final = tuple(_TABLE)
#: Posture of the moment arms in the table, rad.
MIDDLE_RAD: Final = (0.2, 0.9, 0.0, 1.4)
#: Short-range stiffness: tension over fibre length, times this (Cui and colleagues 2008: 23.4).
SHORT_RANGE: Final = 23.4
#: Share of the fibre's short-range stiffness that muscle and tendon in series show.
IN_SERIES: Final = 0.35
#: Stiffness without tension, parts of the greatest tension over fibre length.
PASSIVE_SHARE: Final = 0.10
#: Viscosity over stiffness, s.
LAG_S: Final = 0.045


class Muscles(ABC):
    """Paths and mechanics of m muscles over n joints: what all kinds share.

    Attributes
    ----------
    names : (m,) tuple of str
    greatest, fibre : (m,)
        Greatest tension (N) and fibre length (m).
    """

    names: tuple[str, ...]
    greatest: FloatArray
    fibre: FloatArray

    @abstractmethod
    def paths(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Lengths (N, m) up to a constant, and ``G = dL/dq`` (N, m, n), at angles (N, n)."""

    def length(self, q: FloatArray) -> FloatArray:
        """The first of `paths`."""
        return self.paths(q)[0]

    def jacobian(self, q: FloatArray) -> FloatArray:
        """The second of `paths`."""
        return self.paths(q)[1]

    def stiffness(self, tension: FloatArray) -> FloatArray:
        """N/m at a tension (N, m) in N."""
        own = PASSIVE_SHARE * self.greatest + SHORT_RANGE * tension
        return np.asarray(IN_SERIES * own / self.fibre)

    def viscosity(self, tension: FloatArray) -> FloatArray:
        """N s/m at a tension (N, m) in N."""
        return LAG_S * self.stiffness(tension)


@dataclass(frozen=True)
class SpaceMuscles(Muscles):
    """Paths and mechanics of m muscles over n joints.

    Attributes
    ----------
    arms, change : (m, n), (m, n, n)
        Moment arms at the middle posture (m) and their derivatives (m/rad).
    greatest, fibre : (m,)
        Greatest tension (N) and fibre length (m).
    """

    arms: FloatArray
    change: FloatArray
    greatest: FloatArray
    fibre: FloatArray
    names: tuple[str, ...] = SPACE_MUSCLES

    @classmethod
    def of(cls, strength: float) -> SpaceMuscles:
        """The muscles of a subject of this strength."""
        arms = 1e-2 * np.array([row[0] for row in _TABLE.values()], dtype=float)
        change = np.array([1e-2 * np.diag(row[1]) for row in _TABLE.values()])
        coupling = 1e-2 * np.array([row[2] for row in _TABLE.values()])
        change[:, 0, 1] = change[:, 1, 0] = coupling
        greatest = strength * np.array([row[3] for row in _TABLE.values()], dtype=float)
        fibre = 1e-2 * np.array([row[4] for row in _TABLE.values()])
        return cls(arms, change, greatest, fibre)

    def paths(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Lengths (N, m) beyond those of the middle posture, and ``G = dL/dq`` (N, m, n)."""
        u = q - np.array(MIDDLE_RAD)
        # (N, m, n) = (N, n) (m, n, n)
        turned = (u @ self.change.reshape(-1, u.shape[1]).T).reshape(len(u), *self.arms.shape)
        length = -((self.arms + turned / 2) @ u[..., None])[..., 0]
        return np.asarray(length), -(self.arms + turned)
