"""Expected noise of a measurement: named levels, or estimated from a pilot recording.

Both give the covariance of the force noise in the modes of any window, and the errors of the
position's sensor: white noise, and the steps of an encoder.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final, Protocol

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import InputError
from armimpedance.core.records import Window
from armimpedance.hand.still import NoiseModel, force_covariance
from armimpedance.numerics.signals import Modes, position_noise, spline_modes


class Noise(Protocol):
    """Properties of the noise that a plan needs."""

    @property
    def name(self) -> str:
        """Name for tables."""

    @property
    def encoder_step(self) -> float:
        """Resolution of the position (m); 0 for none."""

    @property
    def position_sd(self) -> float:
        """White noise of the position (m), the same at rest and in motion."""

    def force(self, modes: Modes, lag_s: FloatArray, stiffness: FloatArray) -> FloatArray:
        """Covariance (d n, d n) of the force's noise in modes of a window at lags (S,)."""


@dataclass(frozen=True)
class NoiseLevel:
    """Physical description of the noise; every entry may be 0, but not all.

    `force_sd`, `force_step`: white noise (sd) and resolution of the force sensor (N).
    `encoder_step`, `position_sd`: resolution and white noise (sd) of the position (m).
    `tremor`, `tremor_hz`: amplitude (N) and frequency of the tremor along each axis, of unknown
    phase.
    `slow_sd`, `slow_time_s`: sd (N) and correlation time of slow voluntary force.
    `drift_sd`: sd of the virtual position's velocity (m/s), along each axis.
    """

    name: str
    force_sd: float = 0.0
    force_step: float = 0.0
    encoder_step: float = 0.0
    position_sd: float = 0.0
    tremor: float = 0.0
    tremor_hz: float = 9.0
    slow_sd: float = 0.0
    slow_time_s: float = 0.4
    drift_sd: float = 0.0

    def __post_init__(self) -> None:
        sensors = (self.force_sd, self.force_step, self.encoder_step, self.position_sd)
        subject = (self.tremor, self.tremor_hz, self.slow_sd, self.slow_time_s, self.drift_sd)
        sizes = (*sensors, *subject)
        if not all(np.isfinite(sizes)) or min(sizes) < 0 or self.slow_time_s == 0:
            raise InputError(f"noise {self.name!r} is negative or not finite", expected=">= 0")
        if self.force_sd == 0 == self.force_step:
            raise InputError(
                f"noise {self.name!r} leaves the force exact", expected="force_sd or force_step > 0"
            )

    def force(self, modes: Modes, lag_s: FloatArray, stiffness: FloatArray) -> FloatArray:
        """Covariance of the force's noise in modes, (d n, d n); see `Noise`."""
        apart = np.abs(lag_s[:, None] - lag_s)
        over_time = self.slow_sd**2 * np.exp(-apart / self.slow_time_s)
        over_time += self.tremor**2 / 2 * np.cos(2 * np.pi * self.tremor_hz * apart)
        by_mode = modes.smooth @ over_time @ modes.smooth.T
        # orthonormal modes: white noise stays white; a step s is uniform noise of s^2/12
        by_mode += (self.force_sd**2 + self.force_step**2 / 12) * np.eye(modes.count)
        ramp = modes.smooth @ lag_s
        # f = K c t (d n,): cov = drift_sd^2 (K K^T) (x) (ramp ramp^T)
        drift = self.drift_sd**2 * np.kron(stiffness @ stiffness.T, np.outer(ramp, ramp))
        return np.kron(np.eye(len(stiffness)), by_mode) + drift


SENSOR: Final = NoiseLevel("sensor", force_sd=0.03, force_step=0.05, encoder_step=20e-6)
#: With the force resolution of the source the multiple correlation is near its .979.
NOMINAL: Final = NoiseLevel(
    "nominal",
    force_sd=0.03,
    force_step=0.05,
    encoder_step=20e-6,
    tremor=0.08,
    slow_sd=0.25,
    drift_sd=0.003,
)
NOISE_LEVELS: Final = {level.name: level for level in (SENSOR, NOMINAL)}


def noise_named(name: str | None = None) -> NoiseLevel:
    """A level of noise by its name.

    Parameters
    ----------
    name : {"nominal", "sensor"}, optional
        Default: "nominal".

    Returns
    -------
    NoiseLevel

    Raises
    ------
    InputError
        If there is no such level.
    """
    if name is None:
        return NOMINAL
    if name not in NOISE_LEVELS:
        raise InputError(f"no noise level {name!r}", expected=" or ".join(NOISE_LEVELS))
    return NOISE_LEVELS[name]


@dataclass(frozen=True, eq=False)
class PilotNoise(FrozenRecord):
    """The components of the noise that a weighted fit estimated from a pilot recording.

    `sizes` (J, d, d): covariance over axes of each component, the same as `NoiseModel.sizes`.
    `floor`: white share of every mode (N^2).
    """

    sizes: Annotated[FloatArray, "j d d"]
    floor: float
    encoder_step: float
    position_sd: float
    name: str = "pilot"

    @classmethod
    def of(cls, noise: NoiseModel, window: Window) -> PilotNoise:
        """Build the noise level from the noise model of a window."""
        variance, step = noise.sensor_variance, noise.sensor_step
        if step > 0:
            floor = float(noise.floor[0, 0])
            return cls(noise.sizes, floor, encoder_step=step, position_sd=0.0)
        at_rest = window.position[window.usable][:, window.lag_s <= 0]
        rest = 0.0
        if at_rest.shape[1] >= 32:
            modes = spline_modes(at_rest.shape[1], window.sample_rate_hz)
            rest = position_noise(at_rest, window.sample_rate_hz, modes).variance
        rest = min(rest, variance)
        return cls(
            sizes=noise.sizes,
            floor=float(noise.floor[0, 0]),
            encoder_step=float(np.sqrt(12 * (variance - rest))),
            position_sd=float(np.sqrt(rest)),
        )

    def force(self, modes: Modes, lag_s: FloatArray, stiffness: FloatArray) -> FloatArray:
        """Covariance of the force's noise in modes, (d n, d n); see `Noise`."""
        rate = (len(lag_s) - 1) / (lag_s[-1] - lag_s[0])
        floor = self.floor * np.eye(len(stiffness) * modes.count)
        return force_covariance(self.sizes, floor, modes, len(lag_s), float(rate))
