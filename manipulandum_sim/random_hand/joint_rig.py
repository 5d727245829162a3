"""A robot that moves a wrist or an ankle at random about both of its axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, NamedTuple, get_args

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from manipulandum_sim.hand import NoiseLevel, Reflex
from manipulandum_sim.random_hand.joints import Joint
from manipulandum_sim.random_hand.rig import RATE_HZ, check_run, servo

Turned = Literal["position", "torque"]


class _Device(NamedTuple):
    """Data of such a robot: rad, N m, kg m^2.

    angle, torque: rms of commands; soft, stiff: (stiffness, viscosity) that holds the limb while
    the torque is imposed, and stiffness of the servo; own: slow and tremor of the person.
    """

    angle: float
    torque: float
    inertia: tuple[float, float]
    soft: tuple[float, float]
    stiff: float
    own: tuple[float, float]
    sensor_sd: float
    sensor_step: float
    encoder_step: float


_DEVICES: Final = {
    "wrist": _Device(0.03, 0.3, (4e-3, 5e-3), (0.8, 0.04), 200.0, (0.08, 0.024), 2e-3, 2e-3, 1e-4),
    "ankle": _Device(0.02, 1.5, (0.05, 0.03), (6.0, 0.4), 2500.0, (0.4, 0.12), 0.02, 0.02, 1e-4),
}


@dataclass(frozen=True)
class JointRig:
    """The robot and how it is used.

    Attributes
    ----------
    joint : {"wrist", "ankle"}
    imposed : {"position", "torque"}
        What the robot controls.
    amplitude_rad, torque_nm : float or None
        Rms of the command about each axis; None: what suits the joint.
    band_hz : (low, high)
    trials : int
    duration_s : float
        Of each trial.
    damping_ratio : float
        Of the servo and the robot alone.
    reflex : Reflex or None
    noise : {"nominal", "sensor", "none"}
    force_lag_s : float
        By how much the torque is recorded later than the angle.
    """

    joint: Joint = "wrist"
    imposed: Turned = "position"
    amplitude_rad: float | None = None
    torque_nm: float | None = None
    band_hz: tuple[float, float] = (2.0, 20.0)
    trials: int = 4
    duration_s: float = 15.0
    damping_ratio: float = 0.7
    reflex: Reflex | None = None
    noise: str = "nominal"
    force_lag_s: float = 0.0

    def __post_init__(self) -> None:
        known = {"joint": get_args(Joint), "imposed": get_args(Turned), "noise": NOISES}
        for name, values in known.items():
            if getattr(self, name) not in values:
                raise InputError(f"{name} {getattr(self, name)!r}", expected=" or ".join(values))
        check_run(self.trials, self.duration_s, self.band_hz)
        for name, most in (("amplitude_rad", 0.2), ("torque_nm", 10.0)):
            asked = getattr(self, name)
            if asked is not None and not 0 < asked <= most:
                raise InputError(f"{name} {asked}", expected=f"more than 0, at most {most:g}")

    @property
    def axes(self) -> int:
        """Both rotations."""
        return 2

    @property
    def samples(self) -> int:
        """Samples of a trial."""
        return round(self.duration_s * RATE_HZ) + 1

    @property
    def level(self) -> NoiseLevel:
        """The noise, N m and rad."""
        device = _DEVICES[self.joint]
        slow, tremor = device.own if self.noise == "nominal" else (0.0, 0.0)
        if self.noise == "none":
            return NoiseLevel("none")
        return NoiseLevel(
            self.noise,
            force_sd=device.sensor_sd,
            force_step=device.sensor_step,
            encoder_step=device.encoder_step,
            tremor=tremor,
            voluntary_sd=slow,
        )

    @property
    def beyond(self) -> FloatArray:
        """Inertia of the robot about each axis, all of it beyond the sensor (2,)."""
        return np.array(_DEVICES[self.joint].inertia)

    @property
    def carried(self) -> FloatArray:
        """Inertia that the limb carries about each axis (2,)."""
        return self.beyond

    @property
    def spring(self) -> tuple[float, float]:
        """Servo that pulls the limb to the commanded angle: N m/rad and N m s/rad."""
        device = _DEVICES[self.joint]
        if self.imposed == "torque":
            return device.soft
        return servo(device.stiff, self.damping_ratio, float(self.carried.mean()))

    @property
    def size(self) -> float:
        """Rms of what is commanded: rad, or N m where the torque is controlled."""
        device = _DEVICES[self.joint]
        if self.imposed == "torque":
            return device.torque if self.torque_nm is None else self.torque_nm
        return device.angle if self.amplitude_rad is None else self.amplitude_rad


#: Names of the levels of noise.
NOISES: Final = ("nominal", "sensor", "none")
