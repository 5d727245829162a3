"""The terms of a passive joint's torque, and what the fitted columns say of k, h, f, q_r, K.

Venture elbow, eqs. (3)-(6): ``k (q - q_r) + h qd + f sign(qd)``; with the poster's quadratic term
``+ K (q - q_r)^2``. With a free rest angle the columns are q, qd, sign(qd), 1 [, q^2], and their
parameters are ``b = k - 2 K q_r`` and ``c = K q_r^2 - k q_r`` in place of k and q_r.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.numerics.regression import Fit, Parameters

RestAngle = float | Literal["free"]

UNITS = {
    "k": "N m/rad",
    "h": "N m s/rad",
    "f": "N m",
    "q_r": "rad",
    "K": "N m/rad^2",
    "C": "N m/rad^3",
}


@dataclass(frozen=True)
class Terms:
    """Which terms are fitted.

    Attributes
    ----------
    rest_angle : float or "free"
        q_r in rad where it is known.
    quadratic : bool
        Whether ``K (q - q_r)^2`` is fitted too.
    friction : bool
        Whether ``f sign(qd)`` is fitted; False: the joint is known to have no dry friction.
    cubic : bool
        Whether ``C (q - q_r)^3`` is fitted too: only the columns, to see whether it is there.
    """

    rest_angle: RestAngle
    quadratic: bool = False
    friction: bool = True
    cubic: bool = False

    def __post_init__(self) -> None:
        if self.rest_angle == "free":
            return
        if not np.isfinite(self.rest_angle):
            raise InputError(f"rest angle {self.rest_angle}", expected="rad, or 'free'")
        if abs(self.rest_angle) > 2 * np.pi:
            raise InputError(
                f"a rest angle of {self.rest_angle:g} looks like degrees",
                expected="radians within a turn of zero",
            )

    @property
    def free(self) -> bool:
        """Whether the rest angle is fitted."""
        return self.rest_angle == "free"

    @property
    def reference(self) -> float:
        """What is taken off q in the columns, rad."""
        return 0.0 if self.rest_angle == "free" else float(self.rest_angle)

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the p columns, by the parameter that they carry."""
        dry = ("f",) if self.friction else ()
        more = ("offset",) if self.free else ()
        return (
            "k",
            "h",
            *dry,
            *more,
            *(("K",) if self.quadratic else ()),
            *(("C",) if self.cubic else ()),
        )

    @property
    def column_units(self) -> tuple[str, ...]:
        """Units of the columns' parameters."""
        return tuple({**UNITS, "offset": "N m"}[name] for name in self.columns)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters: k, h [, f] [, q_r] [, K]."""
        return tuple("q_r" if name == "offset" else name for name in self.columns)

    def matrix(self, q: FloatArray, qd: FloatArray, sign: FloatArray) -> FloatArray:
        """Columns (..., p) from angles, velocities and signs (...)."""
        about = q - self.reference
        more = [sign] if self.friction else []
        more += [np.ones_like(q)] if self.free else []
        more += [about**2] if self.quadratic else []
        more += [about**3] if self.cubic else []
        return np.stack([about, qd, *more], axis=-1)

    def parameters(self, fit: Fit) -> Parameters:
        """k, h [, f] [, q_r] [, K] with their covariance, from the columns' fit.

        Raises
        ------
        EstimationError
            No angle at which the elastic torque vanishes.
        """
        return fit.transform(self._from_columns(), self.names, tuple(UNITS[n] for n in self.names))

    def _from_columns(self) -> Callable[[FloatArray], FloatArray]:
        if not self.free:
            return lambda x: x
        if not self.quadratic:
            return lambda x: np.array([*x[:-1], -x[-1] / x[0]])

        def curved(x: FloatArray) -> FloatArray:
            b, c, K = x[0], x[-2], x[-1]
            # the root of K q^2 + b q + c = 0 that stays when K goes to zero
            root = b**2 - 4 * K * c
            rest = -2 * c / (b + np.sign(b) * np.sqrt(root)) if root >= 0 else np.nan
            return np.array([b + 2 * K * rest, *x[1:-2], rest, K])

        return curved
