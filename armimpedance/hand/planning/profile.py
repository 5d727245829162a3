"""Courses of a disturbance over time: away from rest and back, in closed form.

Time s runs from 0 to 1 and the peak is 1; a profile adds amplitude and duration.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.polynomial import Legendre
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError, check_number
from armimpedance.core.outputs import staged_file

#: Points in [0, 1] at which peaks are evaluated.
FINE: Final = np.linspace(0.0, 1.0, 2001)

#: s in [0, 1] -> displacement, first and second derivative by s, (3, ...).
ShapeFunction = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class Shape:
    """A named course of the displacement.

    `at`: s (...,) in [0, 1] -> (3, ...).
    `caution`: reason why it is not recommended; empty for most.
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
        amplitude_mm = 1e3 * self.amplitude_m
        check_number(
            amplitude_mm, f"an amplitude of {amplitude_mm:g} mm", above=0, high=50, unit="mm"
        )
        duration = f"a duration of {self.duration_s:g} s"
        check_number(self.duration_s, duration, low=0.02, high=2, unit="s")

    def at(self, lag_s: ArrayLike) -> FloatArray:
        """Displacement (m), velocity and acceleration (3, ...) at times since the onset (...,)."""
        lag = np.asarray(lag_s, dtype=float)
        moving = (lag >= 0) & (lag <= self.duration_s)
        shape = self.amplitude_m * self.shape.at(np.clip(lag / self.duration_s, 0.0, 1.0))
        scale = self.duration_s ** -np.arange(3.0)
        return np.asarray(shape * moving * scale.reshape(3, *[1] * lag.ndim))

    @property
    def peak_acceleration(self) -> float:
        """The largest acceleration, m/s^2."""
        return self.amplitude_m * self.shape.peak_curvature / self.duration_s**2


def polynomial_shape(name: str, polynomial: Legendre) -> Shape:
    """Shape of a polynomial in s, without scaling."""
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
    """The shape of these Legendre coefficients, scaled to peak 1."""
    course = rounded_ends(coefficients)
    return polynomial_shape(name, course / largest(course))


def largest(course: Legendre) -> float:
    """Largest ``|course|`` on [0, 1], exactly: at an end or where the derivative vanishes."""
    roots = course.deriv().roots()
    inner = roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real > 0) & (roots.real < 1)]
    return float(np.abs(course(np.concatenate([[0.0, 1.0], inner]))).max())


# Profiles as CSV for a robot: equally spaced samples of the commanded course.

#: Columns, after two lines of comment.
COLUMNS: Final = ("time_s", "displacement_m", "velocity_m_s", "acceleration_m_s2")
#: Profiles that come with the package, at 1 kHz.


def sampled(profile: Profile, rate_hz: float = 1000.0) -> FloatArray:
    """Time, displacement, velocity, acceleration (S, 4), from the onset to the end.

    Raises InputError: if the duration is not a whole number of samples: the robot would stop before
    the end.
    """
    samples = profile.duration_s * rate_hz
    if not (np.isfinite(samples) and abs(samples - round(samples)) < 1e-6 and samples >= 10):
        raise InputError(
            f"{profile.duration_s:g} s at {rate_hz:g} Hz", expected="a whole number of samples"
        )
    time = np.arange(round(samples) + 1) / rate_hz
    course = profile.at(time)
    # remove rounding errors where the course is at rest
    course[np.abs(course) < 1e-9 * np.abs(course).max(axis=1, keepdims=True)] = 0.0
    return np.column_stack([time, course.T])


def write_profile(profile: Profile, path: str | Path, rate_hz: float = 1000.0) -> None:
    """Write a profile as CSV, under a temporary name that is then changed."""
    values = sampled(profile, rate_hz)
    heading = (
        f"# {profile.shape.name}: {1e3 * profile.amplitude_m:g} mm in {profile.duration_s:g} s, "
        f"peak acceleration {profile.peak_acceleration:.3g} m/s^2, {rate_hz:g} Hz\n"
        "# commanded course along the direction of the disturbance; time from the onset in s, "
        "then m, m/s, m/s^2\n"
    )
    with staged_file(path) as staged, staged.open("w", encoding="utf-8", newline="\n") as file:
        file.write(heading + ",".join(COLUMNS) + "\n")
        for time, *motion in values:
            file.write(",".join([f"{time:.6f}", *(f"{value:.9g}" for value in motion)]) + "\n")
