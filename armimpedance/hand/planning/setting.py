"""Setting of a plan: arm, noise, servo, encoder, recording."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.conventions import CAST_MASS_KG
from armimpedance.core.errors import InputError, check_number
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.planning.noise_level import NOMINAL, Noise
from armimpedance.hand.still import through_impedance
from armimpedance.numerics.signals import MARGIN_S, Modes, spline_modes

# Response of a robot to a commanded course: the hand's actual motion.
#
# Robot mass m, servo stiffness k_s and damping d_s move hand and robot together:
#
#     (M + m I) x'' + (B + d_s I) x' + (K + k_s I) x = k_s x_c + d_s x_c' + m x_c'' (feedforward)
#
# so that the following error e = x - x_c obeys the same left side with
# ``-(M x_c'' + B x_c' + K x_c)`` on the right (without feedforward ``-((M + m I) x_c'' + ...)``).


@dataclass(frozen=True)
class Servo:
    """Cartesian stiffness and damping around the commanded course.

    Attributes
    ----------
    stiffness : float
        N/m; inf if the hand moves as commanded.
    mass_kg : float
        Mass of robot and handle, as felt at the hand.
    damping_ratio : float
        Damping ratio of robot and handle alone.
    feedforward : bool
        The robot's own inertia is compensated.
    """

    stiffness: float = np.inf
    mass_kg: float = 2.0
    damping_ratio: float = 0.7
    feedforward: bool = True

    def __post_init__(self) -> None:
        if not (self.stiffness > 0 and 0 < self.mass_kg < np.inf and self.damping_ratio >= 0):
            raise InputError(
                f"servo of {self.stiffness:g} N/m, {self.mass_kg:g} kg, "
                f"damping ratio {self.damping_ratio:g}",
                expected="positive stiffness and mass, damping ratio >= 0",
            )

    @classmethod
    def of_bandwidth(cls, hertz: float, mass_kg: float = 2.0) -> Servo:
        """A servo known by its natural frequency only, without feedforward."""
        check_number(hertz, f"a servo bandwidth of {hertz:g} Hz", above=0)
        return cls(mass_kg * (2 * np.pi * hertz) ** 2, mass_kg, feedforward=False)

    @property
    def natural_hz(self) -> float:
        """Natural frequency of robot and servo without a hand."""
        return float(np.sqrt(self.stiffness / self.mass_kg) / (2 * np.pi))


IDEAL: Final = Servo()


def follow(
    servo: Servo, parameters: FloatArray, course: FloatArray, sample_rate_hz: float
) -> FloatArray:
    """Actual displacement of the hand for a command along each axis.

    `parameters` (3, d, d): M (with handle), B, K.
    `course` (3, ..., S): commanded displacement, velocity, acceleration, from rest.
    """
    from scipy.linalg import expm

    d = parameters.shape[1]
    unit = np.eye(d)
    commanded = unit[:, :, None] * course[0][..., None, None, :]
    if np.isinf(servo.stiffness):
        return np.asarray(commanded)
    damping = 2 * servo.damping_ratio * np.sqrt(servo.stiffness * servo.mass_kg)
    robot = np.stack([servo.mass_kg * unit, damping * unit, servo.stiffness * unit])
    M, B, K = parameters + robot
    load = parameters + np.stack([servo.mass_kg * unit * (not servo.feedforward), 0 * B, 0 * K])
    # push (..., a, i, S): on axis i for a command along axis a
    push = -np.einsum("mia,m...s->...ais", load, course[::-1])
    inverse = np.linalg.inv(M)
    # state (e, e') (2 d,), input linear between samples: exponential of [[F, G, 0], [0, 0, 1]]
    F = np.block([[0 * unit, unit], [-inverse @ K, -inverse @ B]])
    G = np.vstack([0 * unit, inverse])
    size, step = 2 * d, 1 / sample_rate_hz
    big = np.zeros((size + 2 * d, size + 2 * d))
    big[:size, :size], big[:size, size : size + d] = F, G
    big[size : size + d, size + d :] = unit
    moved = expm(big * step)
    keep, now, slope = moved[:size, :size], moved[:size, size:-d], moved[:size, -d:] / step
    flat = np.moveaxis(push, -1, 0).reshape(push.shape[-1], -1, d)
    state, error = np.zeros((flat.shape[1], size)), np.zeros(flat.shape)
    for n in range(len(flat) - 1):
        state = state @ keep.T + flat[n] @ now.T + (flat[n + 1] - flat[n]) @ slope.T
        error[n + 1] = state[:, :d]
    return np.asarray(commanded + np.moveaxis(error.reshape(-1, *push.shape[:-1]), 0, -1))


# Errors of an encoder for a motion that is known in advance.
#
# A reading is the position rounded to steps of q on a grid whose place is unknown, uniformly. The
# errors e at positions x and x' then have
#
#     E[e e'] = q^2 (1/12 - f (1 - f)/2),   f the fractional part of (x - x')/q:
#
# equal while the hand is at rest, uncorrelated on average once it has moved some steps.
# Displacements are measured from the rest before the onset, whose error is subtracted from all
# others.


def rounding_covariance(displacement: FloatArray, step: float) -> FloatArray:
    """Covariance (..., S, S) of the error of displacements (..., S) from rest at 0.

    `displacement` (..., S).
    """
    between = _products(displacement[..., :, None] - displacement[..., None, :], step)
    to_rest = _products(displacement, step)
    # cov(e - e0, e' - e0)
    at_rest = step**2 / 12
    return np.asarray(between - to_rest[..., :, None] - to_rest[..., None, :] + at_rest)


def _products(apart: FloatArray, step: float) -> FloatArray:
    f = np.mod(apart / step, 1.0)
    return np.asarray(step**2 * (1 / 12 - f * (1 - f) / 2))


#: Number of disturbances of a set in the plane, in equally spaced directions.
_IN_PLANE: Final = 8

#: Hand of a relaxed 70 kg man's arm in the nominal posture: M, B, K.
RELAXED: Final = (
    ((1.731, -0.655), (-0.655, 1.001)),
    ((8.63, -6.40), (-6.40, 13.86)),
    ((104.8, -74.4), (-74.4, 179.3)),
)


@dataclass(frozen=True, eq=False)
class PlannedArm(FrozenRecord):
    """Expected impedance of the hand.

    Attributes
    ----------
    parameters : (3, d, d)
        M (with the handle), B, K of the hand in two or three axes.
    name : str
        Name of the setting in tables.
    """

    parameters: Annotated[FloatArray, "3 d d"]
    name: str = "relaxed arm"

    def __post_init__(self) -> None:
        super().__post_init__()
        for symbol, matrix in zip("MBK", self.parameters, strict=True):
            if np.linalg.eigvalsh((matrix + matrix.T) / 2)[0] <= 0:
                raise InputError(
                    f"{self.name}: {symbol} is not positive definite", expected="an arm's"
                )

    @property
    def axes(self) -> int:
        """Number of axes d."""
        return int(self.parameters.shape[1])

    @property
    def stiffness(self) -> FloatArray:
        """K, (d, d)."""
        return np.asarray(self.parameters[2])

    @classmethod
    def of(cls, estimate: ImpedanceEstimate, name: str) -> PlannedArm:
        """Build the arm from an earlier estimate.

        Raises
        ------
        InputError
            If it is not of the hand in two or three axes, or a matrix is not positive definite.
        """
        if estimate.level != "hand" or estimate.k not in (2, 3):
            raise InputError(
                f"{name}: {estimate.level} impedance of {estimate.k} axes",
                expected="hand impedance in two or three axes",
            )
        inertia = estimate.inertia_with_handle
        if inertia is None:
            inertia = estimate.inertia
        return cls(np.stack([inertia, estimate.viscosity, estimate.stiffness]), name)


def relaxed_arm(handle_mass_kg: float = CAST_MASS_KG) -> PlannedArm:
    """A relaxed arm of 70 kg body mass with a handle on it."""
    values = np.array(RELAXED)
    values[0] += handle_mass_kg * np.eye(2)
    return PlannedArm(values)


@dataclass(frozen=True)
class Setting:
    """All that precision depends on, except the disturbance.

    Attributes
    ----------
    arm : PlannedArm
    noise : Noise
    servo : Servo
    sample_rate_hz : float
    """

    arm: PlannedArm = field(default_factory=relaxed_arm)
    noise: Noise = NOMINAL
    servo: Servo = IDEAL
    sample_rate_hz: float = 1000.0

    @property
    def directions(self) -> int:
        """Number of trials in a set."""
        return len(unit_directions(self.arm.axes))

    def lags(self, duration_s: float) -> FloatArray:
        """Sample times (S,) of the window that an estimate of this duration uses."""
        rate = self.sample_rate_hz
        margin, end = round(MARGIN_S * rate), int(np.ceil(duration_s * rate - 1e-6))
        return np.arange(-margin, end + margin + 1) / rate

    def modes(self, duration_s: float) -> Modes:
        """Modes of that window."""
        return spline_modes(len(self.lags(duration_s)), self.sample_rate_hz)

    def covariance(self, displacement: FloatArray, duration_s: float) -> FloatArray:
        """Covariance of ``e - A n`` in modes (d n, d n), for a hand that moves like this.

        Parameters
        ----------
        displacement : (d, d, S)
            For a unit command along each axis, m.
        """
        modes, lag = self.modes(duration_s), self.lags(duration_s)
        force = self.noise.force(modes, lag, self.arm.stiffness)
        position = self.position_covariance(displacement, modes)
        total = force + through_impedance(self.arm.parameters.ravel(), position)
        return np.asarray((total + total.T) / 2)

    def position_covariance(self, displacement: FloatArray, modes: Modes) -> FloatArray:
        """Covariance (d, 3 n, 3 n) of the position's noise in x'', x', x in modes.

        Mean over the directions of a set.
        """
        d = len(displacement)
        white = self.noise.position_sd**2 * modes.stacked @ modes.stacked.T
        total = np.repeat(white[None], d, axis=0)
        if self.noise.encoder_step > 0:
            moved = np.einsum("ta,ais->its", unit_directions(d), displacement)
            for axis in range(d):
                total[axis] += self._rounding(moved[axis], modes)
        return np.asarray(total)

    def _rounding(self, displacement: FloatArray, modes: Modes) -> FloatArray:
        """Mean covariance (3 n, 3 n) of the encoder's errors over trials (T, S)."""
        # a course and its mirror image have equal errors: compute each kind once
        sign = np.sign(displacement @ displacement[np.abs(displacement).max(axis=1).argmax()])
        alike = np.round(displacement * sign[:, None], 12)
        courses, counts = np.unique(alike, axis=0, return_counts=True)
        total = np.zeros((3 * modes.count, 3 * modes.count))
        for course, count in zip(courses, counts, strict=True):
            if course.any():
                error = rounding_covariance(course, self.noise.encoder_step)
                total += count / len(displacement) * (modes.stacked @ error @ modes.stacked.T)
        return total


def unit_directions(axes: int = 2) -> FloatArray:
    """The directions of a set: (8, 2) in the plane, (6, 3) back and forth along the axes in space.

    If noise is equal in all directions, more of them than axes add nothing to the bound; opposite
    directions cancel non-linear effects.
    """
    if axes == 2:
        angle = 2 * np.pi * np.arange(_IN_PLANE) / _IN_PLANE
        return np.column_stack([np.cos(angle), np.sin(angle)])
    return np.concatenate([np.eye(axes), -np.eye(axes)])
