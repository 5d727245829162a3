"""Where and on whom a disturbance is planned: arm, noise, servo, recording."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.conventions import CAST_MASS_KG
from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.planning.encoder_error import rounding_covariance
from armimpedance.hand.planning.noise_level import NOMINAL, Noise
from armimpedance.hand.planning.servo import IDEAL, Servo
from armimpedance.hand.still import through_impedance
from armimpedance.numerics.signals import MARGIN_S, Modes, spline_modes

#: Disturbances of a set in the plane, in equally spaced directions.
_IN_PLANE: Final = 8

#: Hand of a relaxed 70 kg man's arm in the nominal posture: M, B, K.
RELAXED: Final = (
    ((1.731, -0.655), (-0.655, 1.001)),
    ((8.63, -6.40), (-6.40, 13.86)),
    ((104.8, -74.4), (-74.4, 179.3)),
)


@dataclass(frozen=True, eq=False)
class PlannedArm(FrozenRecord):
    """What is expected to be measured.

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
        """What an earlier experiment found.

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
    """All that precision depends on, the disturbance aside.

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
        """Trials of a set."""
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
        """What sensors add to x'', x', x in modes, (d, 3 n, 3 n), mean over the directions."""
        d = len(displacement)
        white = self.noise.position_sd**2 * modes.stacked @ modes.stacked.T
        total = np.repeat(white[None], d, axis=0)
        if self.noise.encoder_step > 0:
            moved = np.einsum("ta,ais->its", unit_directions(d), displacement)
            for axis in range(d):
                total[axis] += self._rounding(moved[axis], modes)
        return np.asarray(total)

    def _rounding(self, displacement: FloatArray, modes: Modes) -> FloatArray:
        """Mean over trials (T, S) of what an encoder adds, (3 n, 3 n)."""
        # a course and its mirror image err alike: each kind once
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

    Where noise is alike in all directions, more of them than axes add nothing to the bound; both
    ways of each one cancel what is not linear.
    """
    if axes == 2:
        angle = 2 * np.pi * np.arange(_IN_PLANE) / _IN_PLANE
        return np.column_stack([np.cos(angle), np.sin(angle)])
    return np.concatenate([np.eye(axes), -np.eye(axes)])
