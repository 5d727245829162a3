"""The robot that a reaching hand holds: its mass, the field that it makes, and its pushes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from manipulandum_sim.hand import Reflex
from manipulandum_sim.movement.feedforward import Cocontraction
from manipulandum_sim.movement.path import ReachLine, Variability, minimum_jerk
from manipulandum_sim.movement.pushes import PUSHES, Push


@dataclass(frozen=True)
class Device:
    """Force of the robot on a hand that is not pushed: ``F = -D v - S (p - p_0)``.

    Attributes
    ----------
    damping_n_s_m, stiffness_n_m : (2, 2) as nested tuples
        Along and across the reach. `stiffness_n_m` acts on the distance from the line's start.
    """

    damping_n_s_m: tuple[tuple[float, float], tuple[float, float]] = ((0.0, 0.0), (0.0, 0.0))
    stiffness_n_m: tuple[tuple[float, float], tuple[float, float]] = ((0.0, 0.0), (0.0, 0.0))

    def force(self, line: ReachLine, position: FloatArray, velocity: FloatArray) -> FloatArray:
        """Force (2, ...) of the device on the hand at a motion (2, ...)."""
        R = np.stack([line.along, line.aside])
        offset = position - np.reshape(line.start_m, (2,) + (1,) * (position.ndim - 1))
        D, S = R.T @ np.array(self.damping_n_s_m) @ R, R.T @ np.array(self.stiffness_n_m) @ R
        return -np.einsum("ij,j...->i...", D, velocity) - np.einsum("ij,j...->i...", S, offset)


#: What laboratories let the robot do: nothing, walls aside, a force across the velocity, and a
#: force that grows with the distance from the line (Burdet and colleagues 2001 use the last two).
DEVICES: Final = {
    "free": Device(),
    "channel": Device(((0.0, 0.0), (0.0, 60.0)), ((0.0, 0.0), (0.0, 5000.0))),
    "curl": Device(((0.0, 10.0), (-10.0, 0.0))),
    "divergent": Device(stiffness_n_m=((0.0, 0.0), (0.0, -200.0))),
}


@dataclass(frozen=True)
class MovementRig:
    """Settings of reaches and their pushes.

    Attributes
    ----------
    line : ReachLine
    device : str
        A name of `DEVICES`.
    push : Push or str
        Or a name of `PUSHES`.
    phases : tuple of float
        Travelled share of the reach at which pushes come; default: .12, .5 and .94, and .02 for
        the onset of a random force.
    directions : int
        Equally spaced, from 0 degrees.
    variability : Variability
    cocontraction : Cocontraction
    reflex : Reflex or None
    robot_kg, handle_mass_kg : float
        Mass on the robot's side of the force sensor, and between sensor and hand.
    noise : str
        Level of the sensors' noise: ``nominal``, ``sensor`` (the same) or ``none``.
    go_s, after_s : float
        The mean onset on the trial's clock, and how long the record goes on after the reach.
    on_time : bool
        Pushes come at a time after the go signal and not at a distance travelled.
    """

    line: ReachLine = field(default_factory=ReachLine)
    device: str = "free"
    push: Push | str = "doublet"
    phases: tuple[float, ...] = ()
    directions: int = 8
    variability: Variability = field(default_factory=Variability)
    cocontraction: Cocontraction = Cocontraction()
    reflex: Reflex | None = None
    robot_kg: float = 1.0
    handle_mass_kg: float = 0.164
    noise: str = "nominal"
    go_s: float = 0.3
    after_s: float = 0.5
    on_time: bool = False

    def __post_init__(self) -> None:
        if self.device not in DEVICES:
            raise InputError(f"no device {self.device!r}", expected=" or ".join(DEVICES))
        if isinstance(self.push, str) and self.push not in PUSHES:
            raise InputError(f"no push {self.push!r}", expected=" or ".join(PUSHES))
        if not self.phases:
            usual = (0.02,) if self.shape.throughout else (0.12, 0.5, 0.94)
            object.__setattr__(self, "phases", usual)
        if not all(0 < p < 1 for p in self.phases) or self.directions < 1:
            raise InputError(
                f"pushes at {self.phases} of the way in {self.directions} directions",
                expected="shares between 0 and 1, and one direction or more",
            )

    @property
    def shape(self) -> Push:
        """The push itself."""
        return PUSHES[self.push] if isinstance(self.push, str) else self.push

    def nominal_time(self, share: FloatArray) -> FloatArray:
        """When the nominal course has travelled a share (...), s on the trial's clock."""
        u = np.linspace(0, 1, 2001)
        when = self.go_s + self.line.duration_s * np.interp(share, minimum_jerk(u)[0], u)
        return np.where(np.isfinite(share), when, np.inf)

    @property
    def load(self) -> Device:
        """The device itself."""
        return DEVICES[self.device]

    @property
    def held_kg(self) -> float:
        """All that the hand carries."""
        return self.robot_kg + self.handle_mass_kg

    @property
    def duration_s(self) -> float:
        """Length of a trial's record."""
        return self.go_s + self.line.duration_s + self.after_s
