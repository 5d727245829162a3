"""The exoskeleton at the elbow: mechanics, motor, sensors and converters.

A. F. Ruiz et al. (2011), section 2, give the resolutions (16 bits in, 12 bits out, 1 kHz), not
the full scales and noise levels: those are of the size of such parts.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError

NoiseLevel = Literal["nominal", "sensor", "none"]

#: Rate of control and record, 1/s.
RATE_HZ: Final = 1000.0


@dataclass(frozen=True)
class Converter:
    """An analogue channel behind a converter: noise, then steps, then its ends.

    Attributes
    ----------
    low, high : float
        Full scale in the quantity's unit.
    bits : int
    noise_sd : float
        White, sd per sample; 0 for a command.
    """

    low: float
    high: float
    bits: int
    noise_sd: float = 0.0

    @property
    def step(self) -> float:
        """One count."""
        return (self.high - self.low) / 2**self.bits

    def convert(self, values: FloatArray) -> FloatArray:
        """Rounded to counts and limited to the full scale."""
        counts = np.rint((np.asarray(values) - self.low) / self.step)
        return np.asarray(self.low + self.step * np.clip(counts, 0, 2**self.bits - 1))


#: Potentiometer, rad.
POTENTIOMETER: Final = Converter(0.0, np.pi, 16, 2e-4)
#: Gyroscope, rad/s (300 degrees/s).
GYROSCOPE: Final = Converter(-5.236, 5.236, 16, 5e-3)
#: Strain gauges between limb and device, N m.
STRAIN_GAUGE: Final = Converter(-30.0, 30.0, 16, 0.02)
#: The motor's torque, read from its current, N m at the joint.
MOTOR_CURRENT: Final = Converter(-24.0, 24.0, 16, 0.01)
#: The command to the motor, N m at the joint.
MOTOR_COMMAND: Final = Converter(-24.0, 24.0, 12)
#: EMG referred to the electrodes: 10 V behind an amplification of 2000.
EMG_INPUT: Final = Converter(-5e-3, 5e-3, 16)


@dataclass(frozen=True)
class Exoskeleton:
    """One hinge strapped to the forearm without play; its link's weight is counterbalanced.

    ``inertia theta'' = motor - viscosity theta' - friction tanh(theta' / slip) - interaction``,
    the interaction being the torque by the device on the limb.

    Attributes
    ----------
    inertia : float
        Link and geared rotor, kg m^2.
    viscosity : float
        N m s/rad.
    friction, slip : float
        Coulomb friction, N m, and the rate over which it builds up, rad/s.
    motor_lag_s : float
        The current's time constant.
    """

    inertia: float = 0.05
    viscosity: float = 0.15
    friction: float = 0.15
    slip: float = 0.05
    motor_lag_s: float = 2e-3

    def __post_init__(self) -> None:
        taken, needed = (self.viscosity, self.friction), (self.inertia, self.slip, self.motor_lag_s)
        # not <= 0, so that NaN is refused too
        if not (min(taken) >= 0 and min(needed) > 0 and np.isfinite([*taken, *needed]).all()):
            raise InputError(
                f"a device of {self.inertia} kg m^2, {self.viscosity} N m s/rad, "
                f"{self.friction} N m",
                expected="inertia, slip and motor lag above 0, no negative friction",
            )

    def resistance(self, rate: FloatArray) -> FloatArray:
        """Torque of viscous and Coulomb friction, N m."""
        return np.asarray(self.viscosity * rate + self.friction * np.tanh(rate / self.slip))


@dataclass(frozen=True)
class Rendered:
    """The reference impedance of (1): what the limb is to feel about q0.

    Attributes
    ----------
    inertia, viscosity, stiffness : float
        kg m^2, N m s/rad, N m/rad.
    """

    inertia: float = 0.0
    viscosity: float = 0.0
    stiffness: float = 0.0


@dataclass(frozen=True)
class Limits:
    """A trial is stopped, power off, where a sensor shows more.

    Attributes
    ----------
    velocity : float
        rad/s, of the gyroscope.
    torque : float
        N m, of the strain gauges.
    """

    velocity: float = 5.0
    torque: float = 25.0
