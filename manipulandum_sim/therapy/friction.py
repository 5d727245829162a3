"""Dry friction of geared axes that sticks: bristles that bend before they slip (LuGre).

``z' = v - s0 |v| z / g(v)``, ``tau = s0 z + s1 z' + k_v v``,
``g(v) = tau_c + (tau_s - tau_c) exp(-|v| / v_s)``. At a constant velocity z' = 0, and there is
``sign(v) g(v) + k_v v``, odd in the velocity. At rest the bristles hold the torque that the axis
stopped with, up to tau_s. A load that grows finds less than tau_s where it grows fast, tau_c at
least: the bristles creep before they slip.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray, frozen_array
from armimpedance.core.errors import InputError

#: How far an axis gives way before it slips, rad: tau_s / s0. Assumed; that of a harmonic drive.
GIVE_RAD: Final = 5e-4
#: Damping of the bristles over that of a bristle with 1 kg m^2: s1 = share * sqrt(s0).
_DAMPING: Final = 0.3


@dataclass(frozen=True)
class Friction:
    """Friction of n axes.

    Attributes
    ----------
    coulomb, static : (n,)
        tau_c and tau_s, N m.
    viscous : (n,)
        k_v, N m s/rad.
    stribeck_rad_s : (n,)
        v_s, over which static friction falls to Coulomb friction.
    """

    coulomb: FloatArray
    static: FloatArray
    viscous: FloatArray
    stribeck_rad_s: FloatArray

    def __post_init__(self) -> None:
        n = len(np.asarray(self.coulomb))
        for name in ("coulomb", "static", "viscous", "stribeck_rad_s"):
            object.__setattr__(self, name, frozen_array(getattr(self, name), name, (n,)))
        fits = (self.coulomb > 0).all() and (self.static >= self.coulomb).all()
        if not (fits and (self.viscous >= 0).all() and (self.stribeck_rad_s > 0).all()):
            raise InputError(
                "no such friction", expected="0 < coulomb <= static, viscous >= 0, stribeck > 0"
            )

    @property
    def stiffness(self) -> FloatArray:
        """s0 (n,), N m/rad."""
        return np.asarray(self.static / GIVE_RAD)

    def steady(self, velocity: FloatArray) -> FloatArray:
        """Torque (..., n) at constant velocities (..., n)."""
        g = self._level(np.abs(velocity), self.coulomb, self.static, self.stribeck_rad_s)
        return np.asarray(np.sign(velocity) * g + self.viscous * velocity)

    @staticmethod
    def _level(
        speed: FloatArray, coulomb: FloatArray, static: FloatArray, stribeck: FloatArray
    ) -> FloatArray:
        return np.asarray(coulomb + (static - coulomb) * np.exp(-speed / stribeck))

    def scaled(self, factor: float) -> Friction:
        """All torques times a factor; the Stribeck velocity stays."""
        return Friction(
            self.coulomb * factor, self.static * factor, self.viscous * factor, self.stribeck_rad_s
        )

    def bristles(self, inertia: FloatArray) -> Bristles:
        """The law at work on axes that have at least these inertias (n,), kg m^2."""
        damping = 2 * _DAMPING * np.sqrt(self.stiffness * inertia)
        columns = (
            self.coulomb, self.static - self.coulomb, self.viscous,
            1 / self.stribeck_rad_s, self.stiffness, damping,
        )  # fmt: skip
        return Bristles(*(column[:, None] for column in columns))


@dataclass(frozen=True)
class Bristles:
    """The bristles' equations for arrays (n, T); all parameters (n, 1)."""

    coulomb: FloatArray
    excess: FloatArray
    viscous: FloatArray
    per_stribeck: FloatArray
    stiffness: FloatArray
    damping: FloatArray

    def rate(self, velocity: FloatArray) -> FloatArray:
        """``s0 |v| / g(v)``, 1/s: how fast the bristles forget."""
        speed = np.abs(velocity)
        level = self.coulomb + self.excess * np.exp(-speed * self.per_stribeck)
        return np.asarray(self.stiffness * speed / level)

    def torque(
        self, bend: FloatArray, velocity: FloatArray, rate: FloatArray | None = None
    ) -> FloatArray:
        """Friction (n, T), N m, of bristles bent by z (n, T), rad; `rate` where it is known."""
        rate = self.rate(velocity) if rate is None else rate
        damping = self.damping * (velocity - rate * bend)
        return np.asarray(self.stiffness * bend + damping + self.viscous * velocity)

    @staticmethod
    def bent(bend: FloatArray, velocity: FloatArray, rate: FloatArray, dt: float) -> FloatArray:
        """z after dt at a held velocity, implicit (the trapezoid), so stable at any speed.

        ``z+ = ((1 - a dt / 2) z + dt v) / (1 + a dt / 2)`` with the rate a.
        """
        half = rate * (dt / 2)
        return np.asarray(((1 - half) * bend + dt * velocity) / (1 + half))
