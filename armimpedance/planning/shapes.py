"""Courses of a disturbance over time: away from rest and back, in closed form.

Time s in [0, 1], peak 1. The simulator has shapes of its own under the same names; a test compares
them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.polynomial import Legendre
from numpy.typing import ArrayLike

from armimpedance.arrays import FloatArray
from armimpedance.errors import InputError

#: Points in [0, 1] at which peaks are looked for.
FINE: Final = np.linspace(0.0, 1.0, 2001)

#: s in [0, 1] -> displacement, first and second derivative by s, (3, ...).
ShapeFunction = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class Shape:
    """A named course of the displacement.

    Attributes
    ----------
    name : str
    at : function
        s (...,) in [0, 1] -> (3, ...).
    caution : str
        Why a planner does not recommend it; empty for most.
    """

    name: str
    at: ShapeFunction
    caution: str = ""

    @property
    def peak_curvature(self) -> float:
        """Largest second derivative by s, relative to the largest displacement."""
        x, _, bend = self.at(FINE)
        return float(np.abs(bend).max() / np.abs(x).max())


@dataclass(frozen=True)
class Profile:
    """A shape with amplitude and duration.

    Attributes
    ----------
    shape : Shape
    amplitude_m, duration_s : float
    """

    shape: Shape
    amplitude_m: float
    duration_s: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.amplitude_m) and 0 < self.amplitude_m <= 0.05):
            raise InputError(
                f"an amplitude of {1e3 * self.amplitude_m:g} mm", expected="more than 0, <= 50 mm"
            )
        if not 0.02 <= self.duration_s <= 2.0:
            raise InputError(f"a duration of {self.duration_s:g} s", expected="0.02 to 2 s")

    def at(self, lag_s: ArrayLike) -> FloatArray:
        """Displacement (m), velocity and acceleration (3, ...) at times since the onset (...,)."""
        lag = np.asarray(lag_s, dtype=float)
        moving = (lag >= 0) & (lag <= self.duration_s)
        shape = self.amplitude_m * self.shape.at(np.clip(lag / self.duration_s, 0.0, 1.0))
        scale = self.duration_s ** -np.arange(3.0)
        return np.asarray(shape * moving * scale.reshape(3, *[1] * lag.ndim))

    @property
    def peak_acceleration(self) -> float:
        """m/s^2."""
        return self.amplitude_m * self.shape.peak_curvature / self.duration_s**2


def polynomial_shape(name: str, polynomial: Legendre) -> Shape:
    """The shape of a polynomial in s, as it is."""
    parts = (polynomial, polynomial.deriv(), polynomial.deriv(2))
    return Shape(name, lambda s: np.stack([part(s) for part in parts]))


def rounded_ends(coefficients: ArrayLike) -> Legendre:
    """``64 s^3 (1 - s)^3 q(s)``, q in Legendre polynomials of 2 s - 1.

    Displacement, velocity and acceleration vanish at both ends, whatever q is.
    """
    # powers of s would lose digits at s = 1
    s = Legendre([0.5, 0.5], domain=[0.0, 1.0])
    q = Legendre(np.asarray(coefficients, dtype=float), domain=[0.0, 1.0])
    course: Legendre = 64 * s**3 * (1 - s) ** 3 * q
    return course


def designed_shape(name: str, coefficients: ArrayLike) -> Shape:
    """Of these Legendre coefficients, scaled to peak 1."""
    course = rounded_ends(coefficients)
    return polynomial_shape(name, course / largest(course))


def largest(course: Legendre) -> float:
    """Largest ``|course|`` on [0, 1], exactly: at an end or where the derivative vanishes."""
    roots = course.deriv().roots()
    inner = roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real > 0) & (roots.real < 1)]
    return float(np.abs(course(np.concatenate([[0.0, 1.0], inner]))).max())


def _raised_cosine(s: FloatArray) -> FloatArray:
    w = 2 * np.pi
    return np.stack([1 - np.cos(w * s), w * np.sin(w * s), w**2 * np.cos(w * s)]) / 2


def _half_sine(s: FloatArray) -> FloatArray:
    w = np.pi
    return np.stack([np.sin(w * s), w * np.cos(w * s), -(w**2) * np.sin(w * s)])


#: Found by `design` at 5 mm, 0.3 s, at most 5.3 m/s^2, nominal noise, an arm at rest: the fewest
#: trials for K (degree 5, goal K alone).
DESIGNED: Final = (0.0, -9.625238, 0.0, -6.828925, 0.0, -2.989463)
#: The same limits: K and the answer to what was 40 to 70 ms earlier, the delay not known
#: (degree 9).
REFLEX_SEPARATING: Final = (
    *(0.056824, -8.970596, 2.063219, -7.981409, 6.097356),
    *(-6.788630, 5.362087, -3.584803, 1.616960, -1.455224),
)

SHAPES: Final = {
    shape.name: shape
    for shape in (
        designed_shape("minimum_jerk", [1.0]),
        designed_shape("biphasic", [0.0, -1.0]),
        designed_shape("designed", DESIGNED),
        designed_shape("reflex_separating", REFLEX_SEPARATING),
        Shape("half_sine", _half_sine, "starts with a step of velocity, which no robot makes"),
        Shape(
            "raised_cosine",
            _raised_cosine,
            "position and acceleration are proportional up to an offset: only the rest before and "
            "after tells K from M",
        ),
    )
}


def shape_named(name: str) -> Shape:
    """A shape by its name.

    Raises
    ------
    InputError
        If there is no such shape.
    """
    if name not in SHAPES:
        raise InputError(f"no shape {name!r}", expected=", ".join(SHAPES))
    return SHAPES[name]
