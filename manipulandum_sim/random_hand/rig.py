"""Settings of a random perturbation: imposed quantity, size, duration, noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, Protocol, get_args

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import CAST_MASS_KG
from armimpedance.core.errors import InputError
from manipulandum_sim.hand import NoiseLevel, Reflex
from manipulandum_sim.space import SPACE_NOISE

Axes = Literal[2, 3]
Driven = Literal["position", "force"]

#: Samples a second.
RATE_HZ: Final = 500.0
#: A force-controlled robot holds the hand about its place by this spring and damper.
SOFT_N_M: Final = 60.0
SOFT_NS_M: Final = 6.0
#: Corner (Hz) above which a commanded displacement falls off, as hands and motors want it.
CORNER_HZ: Final = 4.0
#: Width of the tremor's peak (Hz).
TREMOR_WIDTH_HZ: Final = 2.0


class Driver(Protocol):
    """A robot that moves a limb at random: of a hand in m, N, kg, of a joint in rad, N m, kg m^2.

    Attributes
    ----------
    imposed : str
        "position", or else what the robot pushes with.
    band_hz : (low, high)
    reflex : Reflex or None
    force_lag_s : float
        By how much the force is recorded later than the position.
    axes, trials, samples : int
        Directions, trials, and samples of each.
    level : NoiseLevel
    carried, beyond : (d,)
        Inertia that the limb carries along each axis, and what of it is beyond the sensor.
    spring : (float, float)
        Stiffness and viscosity by which the robot pulls the limb to its place.
    size : float
        Rms of what is commanded.
    """

    @property
    def imposed(self) -> str: ...
    @property
    def band_hz(self) -> tuple[float, float]: ...
    @property
    def reflex(self) -> Reflex | None: ...
    @property
    def force_lag_s(self) -> float: ...
    @property
    def axes(self) -> int: ...
    @property
    def trials(self) -> int: ...
    @property
    def samples(self) -> int: ...
    @property
    def level(self) -> NoiseLevel: ...
    @property
    def carried(self) -> FloatArray: ...
    @property
    def beyond(self) -> FloatArray: ...
    @property
    def spring(self) -> tuple[float, float]: ...
    @property
    def size(self) -> float: ...


def check_run(trials: int, duration_s: float, band_hz: tuple[float, float]) -> None:
    """Refuse a session that no robot can run.

    Raises
    ------
    InputError
    """
    low, high = band_hz
    if not (0 < low < high < RATE_HZ / 4 and trials >= 1 and duration_s >= 2):
        raise InputError(
            f"{trials} trials of {duration_s} s, {low} to {high} Hz",
            expected=f"1 or more of 2 s or more, 0 < low < high < {RATE_HZ / 4:g} Hz",
        )


def servo(stiffness: float, damping_ratio: float, inertia: float) -> tuple[float, float]:
    """Stiffness and viscosity of a servo that moves an inertia."""
    return stiffness, float(2 * damping_ratio * np.sqrt(stiffness * inertia))


@dataclass(frozen=True)
class RandomRig:
    """The robot and how it is used.

    Attributes
    ----------
    axes : {2, 3}
        A hand in the horizontal plane, or in space.
    imposed : {"position", "force"}
        What the robot controls.
    amplitude_m, force_n : float
        Rms of the command on each axis.
    band_hz : (low, high)
    trials : int
    duration_s : float
        Of each trial.
    stiffness, damping_ratio : float
        Of the servo in N/m, and that of robot and handle alone.
    reflex : Reflex or None
    elbow : {"held", "free"}
        In space, whether the upper arm's turning about its axis is held.
    wrist : {"locked", "free"}
        In space, whether forearm and hand turn about the handle.
    noise : str
        Name in `SPACE_NOISE`.
    force_lag_s : float
        By how much the force is recorded later than the position.
    handle_mass_kg : float
        Between the force sensor and the hand.
    robot_kg : (3,)
        Moving mass along x, y, z on the robot's side of the sensor.
    """

    axes: Axes = 2
    imposed: Driven = "position"
    amplitude_m: float = 0.0025
    force_n: float = 4.0
    band_hz: tuple[float, float] = (2.0, 20.0)
    trials: int = 4
    duration_s: float = 15.0
    stiffness: float = 20_000.0
    damping_ratio: float = 0.7
    reflex: Reflex | None = None
    elbow: Literal["held", "free"] = "held"
    wrist: Literal["locked", "free"] = "locked"
    noise: str = "nominal"
    force_lag_s: float = 0.0
    handle_mass_kg: float = CAST_MASS_KG
    robot_kg: tuple[float, float, float] = (2.4, 2.0, 1.6)

    def __post_init__(self) -> None:
        known = {"axes": get_args(Axes), "imposed": get_args(Driven), "noise": tuple(SPACE_NOISE)}
        for name, values in known.items():
            if getattr(self, name) not in values:
                wanted = " or ".join(map(str, values))
                raise InputError(f"{name} {getattr(self, name)!r}", expected=wanted)
        check_run(self.trials, self.duration_s, self.band_hz)
        if not (0 < self.amplitude_m <= 0.02 and 0 < self.force_n <= 30):
            raise InputError(
                f"a command of {self.amplitude_m} m, {self.force_n} N",
                expected="more than 0, at most 0.02 m and 30 N rms",
            )
        for joint, kept in (("elbow", "held"), ("wrist", "locked")):
            said = getattr(self, joint)
            if said not in (kept, "free") or (said == "free" and self.axes == 2):
                raise InputError(f"{joint} {said!r} in {self.axes} axes", expected=kept)
            if said == "free" and self.reflex:
                raise InputError(f"a reflex with a free {joint}", expected="one of them")

    @property
    def level(self) -> NoiseLevel:
        """The noise."""
        return SPACE_NOISE[self.noise]

    @property
    def samples(self) -> int:
        """Samples of a trial."""
        return round(self.duration_s * RATE_HZ) + 1

    @property
    def beyond(self) -> FloatArray:
        """Mass of the robot beyond the sensor, along each axis (d,)."""
        return np.array(self.robot_kg[: self.axes])

    @property
    def carried(self) -> FloatArray:
        """All that the hand carries, along each axis (d,)."""
        return self.beyond + self.handle_mass_kg

    @property
    def spring(self) -> tuple[float, float]:
        """Servo that pulls the hand to the commanded place: N/m and N s/m."""
        if self.imposed == "force":
            return SOFT_N_M, SOFT_NS_M
        return servo(self.stiffness, self.damping_ratio, float(self.carried.mean()))

    @property
    def size(self) -> float:
        """Rms of what is commanded: m, or N where the force is controlled."""
        return self.force_n if self.imposed == "force" else self.amplitude_m
