"""Shapes of the disturbance: displacement 0 -> amplitude -> 0 in closed form."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.polynomial import Legendre, Polynomial

from armimpedance.core.arrays import FloatArray, frozen_array
from armimpedance.core.errors import InputError

#: Shape at s in [0, 1] -> itself and its first two derivatives, (3, ...).
ShapeFunction = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class Disturbance:
    """A named shape with peak 1 over s = 0..1.

    Attributes
    ----------
    name : str
    shape : callable
        s (...,) -> displacement, first and second derivative with respect to s, (3, ...).
    velocity_steps : bool
        The velocity jumps at the ends: no prescribed motion can do that.
    caution : str
        What a user must know before choosing it; emitted as a warning.
    """

    name: str
    shape: ShapeFunction
    velocity_steps: bool = False
    caution: str = ""

    def warn(self) -> None:
        """Emit the caution, if there is one."""
        if self.caution:
            warnings.warn(f"{self.name}: {self.caution}", UserWarning, stacklevel=3)

    def profile(
        self, lag_s: FloatArray, duration_s: float, amplitude_m: float, residual_m: float = 0.0
    ) -> FloatArray:
        """Displacement (m), velocity and acceleration along the direction of the disturbance.

        Parameters
        ----------
        lag_s : (...,)
            Time since the onset.
        duration_s, amplitude_m : float
        residual_m : float
            How far from the start the motion ends: a smooth step of this height is added.

        Returns
        -------
        (3, ...) : 0 before the onset and, without residual, after the end.
        """
        lag_s = np.asarray(lag_s, dtype=float)
        s = np.clip(lag_s / duration_s, 0.0, 1.0)
        inside = (lag_s >= 0) & (lag_s <= duration_s)
        shape = amplitude_m * self.shape(s) + residual_m * smooth_step(s)
        shape[0] *= lag_s >= 0
        shape[1:] *= inside
        shape[1] /= duration_s
        shape[2] /= duration_s**2
        return shape


def _polynomial(coefficients: Polynomial) -> ShapeFunction:
    parts = [coefficients, coefficients.deriv(), coefficients.deriv(2)]
    return lambda s: np.stack([part(s) for part in parts])


def _rounded(coefficients: Sequence[float]) -> ShapeFunction:
    """``64 s^3 (1 - s)^3 q(s)``, q in Legendre polynomials of 2 s - 1; exact rest at both ends."""
    q = Legendre(coefficients, domain=[0.0, 1.0])
    slope, bend = q.deriv(), q.deriv(2)

    def at(s: FloatArray) -> FloatArray:
        r = s * (1 - s)
        # b = 64 r^3, r' = 1 - 2 s, r'' = -2
        b, db = 64 * r**3, 192 * r**2 * (1 - 2 * s)
        ddb = 384 * r * ((1 - 2 * s) ** 2 - r)
        return np.stack(
            [
                b * q(s),
                db * q(s) + b * slope(s),
                ddb * q(s) + 2 * db * slope(s) + b * bend(s),
            ]
        )

    return at


def _half_sine(s: FloatArray) -> FloatArray:
    w = np.pi
    return np.stack([np.sin(w * s), w * np.cos(w * s), -(w**2) * np.sin(w * s)])


def _raised_cosine(s: FloatArray) -> FloatArray:
    w = 2 * np.pi
    return np.stack([1 - np.cos(w * s), w * np.sin(w * s), w**2 * np.cos(w * s)]) / 2


_S = Polynomial([0, 1])
_BUMP = 64 * _S**3 * (1 - _S) ** 3
#: |(1 - 2 s) 64 s^3 (1 - s)^3| peaks where (1 - 2 s)^2 = 1/7, at (1/sqrt 7) (6/7)^3.
_DOUBLET = _BUMP * (1 - 2 * _S) * (7**0.5 * (7 / 6) ** 3)
#: Position, velocity and acceleration are zero or at rest at both ends.
smooth_step: Final = _polynomial(10 * _S**3 - 15 * _S**4 + 6 * _S**5)

#: Optimised on the Cramer-Rao bound by armimpedance's planner (docs/explanation/plan.md), for 5 mm
#: in 0.3 s with at most 5.3 m/s^2: the fewest trials for the stiffness,
_DESIGNED: Final = (0.0, -9.625238, 0.0, -6.828925, 0.0, -2.989463)
#: and the stiffness apart from a reflex that is 40 to 70 ms late.
_REFLEX_SEPARATING: Final = (
    *(0.056824, -8.970596, 2.063219, -7.981409, 6.097356),
    *(-6.788630, 5.362087, -3.584803, 1.616960, -1.455224),
)

DISTURBANCES: Final = {
    d.name: d
    for d in (
        Disturbance("minimum_jerk", _polynomial(_BUMP)),
        Disturbance("biphasic", _polynomial(_DOUBLET)),
        Disturbance("designed", _rounded(_DESIGNED)),
        Disturbance("reflex_separating", _rounded(_REFLEX_SEPARATING)),
        Disturbance("half_sine", _half_sine, velocity_steps=True),
        Disturbance(
            "raised_cosine",
            _raised_cosine,
            caution="position and acceleration are proportional up to an offset; with a free "
            "offset inertia and stiffness cannot be told apart",
        ),
    )
}


def custom(name: str, displacement: FloatArray) -> Disturbance:
    """A disturbance from samples at equal spacing, 0 at both ends, scaled to peak 1.

    A quintic spline with vanishing velocity and acceleration at the ends runs through them.

    Parameters
    ----------
    name : str
    displacement : (n,)
        8 samples or more.

    Returns
    -------
    Disturbance

    Raises
    ------
    InputError
        If there are fewer than 8 samples, the ends are not 0, or nothing moves.
    """
    from scipy.interpolate import make_interp_spline

    values = frozen_array(displacement, "displacement", (None,))
    peak = np.abs(values).max(initial=0.0)
    if len(values) < 8 or peak == 0:
        raise InputError(
            f"disturbance {name} of {len(values)} samples", expected="8 or more, not 0"
        )
    if max(abs(values[0]), abs(values[-1])) > 1e-9 * peak:
        raise InputError(f"disturbance {name} does not return", expected="0 at both ends")
    rest: Any = ([(1, 0.0), (2, 0.0)], [(1, 0.0), (2, 0.0)])
    spline = make_interp_spline(np.linspace(0, 1, len(values)), values / peak, k=5, bc_type=rest)
    parts = [spline, spline.derivative(1), spline.derivative(2)]
    return Disturbance(name, lambda s: np.stack([part(s) for part in parts]))


def find_disturbance(disturbance: str | Disturbance) -> Disturbance:
    """A disturbance by its name.

    Raises
    ------
    InputError
        If there is no such shape.
    """
    if isinstance(disturbance, Disturbance):
        return disturbance
    if disturbance not in DISTURBANCES:
        raise InputError(
            f"no disturbance {disturbance!r}", expected=" or ".join(sorted(DISTURBANCES))
        )
    return DISTURBANCES[disturbance]
