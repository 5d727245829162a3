"""Settings of an experiment: servo, disturbance, noise, reflex, recorded channels."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from armimpedance.core.conventions import CAST_MASS_KG
from armimpedance.core.errors import InputError
from manipulandum_sim.hand.compiled import check_compiler
from manipulandum_sim.hand.disturbances import Disturbance, find_disturbance
from manipulandum_sim.hand.noise import NoiseLevel, find_noise
from manipulandum_sim.hand.robot import Robot, Servo

RATE_HZ: Final = 1000.0
#: The onset lies this long after the trial's start (s), uniformly.
ONSET_S: Final = (0.3, 0.5)
#: The record goes on this long after the disturbance is back (s).
AFTER_S: Final = 0.3
#: A servo's fastest motion turns by at most this much per substep (rad).
TURN_PER_SUBSTEP: Final = 0.15


@dataclass(frozen=True)
class Reflex:
    """A delayed stretch reflex.

    Attributes
    ----------
    gain : float
        Tension of each muscle per delayed stretch, as a fraction of its stiffness.
    delay_s : float
    """

    gain: float = 0.25
    delay_s: float = 0.055

    def __post_init__(self) -> None:
        if not (self.delay_s >= 1 / RATE_HZ and np.isfinite(self.gain)):
            raise InputError(
                f"reflex of gain {self.gain}, {self.delay_s} s late", expected="1 ms late or more"
            )


@dataclass(frozen=True)
class Rig:
    """The manipulandum and how it is used. Names are accepted for `disturbance` and `noise`.

    Attributes
    ----------
    disturbance : str or Disturbance
    amplitude_m, duration_s : float
        Duration in whole milliseconds.
    residual_m : float
        How far from its start the disturbance ends.
    servo : Servo
    noise : str or NoiseLevel
    reflex : Reflex or None
    emg : bool
        Whether raw EMG is recorded.
    command : bool
        Whether the commanded position is recorded beside the measured one.
    handle_mass_kg : float
        Cast between the force sensor and the hand.
    robot : Robot
    substeps : int or None
        Integration steps per sample; None: as many as the servo needs.
    compiled : bool
        Whether Numba compiles the integration: the same course to within rounding. An ideal servo
        integrates nothing and gives the same bits either way.
    """

    disturbance: str | Disturbance = "minimum_jerk"
    amplitude_m: float = 0.005
    duration_s: float = 0.3
    residual_m: float = 0.0
    servo: Servo = field(default_factory=Servo)
    noise: str | NoiseLevel = "nominal"
    reflex: Reflex | None = None
    emg: bool = True
    command: bool = False
    handle_mass_kg: float = CAST_MASS_KG
    robot: Robot = field(default_factory=Robot)
    substeps: int | None = None
    compiled: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "disturbance", find_disturbance(self.disturbance))
        object.__setattr__(self, "noise", find_noise(self.noise))
        if self.compiled:
            check_compiler()
        samples = self.duration_s * RATE_HZ
        if not (samples >= 20 and abs(samples - round(samples)) < 1e-6):
            raise InputError(
                f"a disturbance of {self.duration_s} s",
                expected="whole milliseconds, 20 ms or more",
            )
        if not (np.isfinite(self.amplitude_m) and 0 < abs(self.amplitude_m) <= 0.05):
            raise InputError(
                f"an amplitude of {self.amplitude_m} m", expected="more than 0, at most 0.05 m"
            )
        if self.servo.is_ideal and self.shape.velocity_steps:
            raise InputError(
                f"{self.shape.name} starts with a step of velocity; no ideal servo makes that",
                expected="a servo of finite stiffness or another disturbance",
            )

    @property
    def shape(self) -> Disturbance:
        """The disturbance."""
        return find_disturbance(self.disturbance)

    @property
    def level(self) -> NoiseLevel:
        """The noise."""
        return find_noise(self.noise)

    @property
    def reflex_numbers(self) -> tuple[float, float]:
        """Gain and delay (s) of the reflex; zeros without one."""
        return (self.reflex.gain, self.reflex.delay_s) if self.reflex else (0.0, 0.0)

    @property
    def samples(self) -> int:
        """Samples of the longest possible trial."""
        return round((ONSET_S[1] + self.duration_s + AFTER_S) * RATE_HZ) + 1

    @property
    def steps_per_sample(self) -> int:
        """Integration steps per sample."""
        if self.substeps is not None:
            return self.substeps
        # the limb adds to the mass, so robot and handle alone give the fastest motion
        lightest_kg = 1.5
        turn = np.sqrt(self.servo.stiffness / lightest_kg) / RATE_HZ
        return max(1, int(np.ceil(turn / TURN_PER_SUBSTEP)))

    @property
    def sentences(self) -> tuple[str, ...]:
        """Sentences for a recording's provenance."""
        s = self.servo
        held = (
            "ideal servo"
            if s.is_ideal
            else f"servo of {s.stiffness:g} N/m, damping ratio {s.damping_ratio:g}"
        )
        if self.compiled and not s.is_ideal:
            held += ", compiled"
        reflex = (
            f"; reflex of {100 * self.reflex.gain:g} %, {1e3 * self.reflex.delay_s:g} ms late"
            if self.reflex
            else ""
        )
        return (
            f"simulated manipulandum: {self.shape.name} of {1e3 * self.amplitude_m:g} mm in "
            f"{self.duration_s:g} s; {held}; noise {self.level.name!r}{reflex}",
        )
