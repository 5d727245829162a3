"""Settings of a spatial measurement: robot, control, disturbance, noise, recorded channels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, get_args

import numpy as np

from armimpedance.core.conventions import CAST_MASS_KG
from armimpedance.core.errors import InputError
from manipulandum_sim.hand import (
    DISTURBANCES,
    ONSET_S,
    RATE_HZ,
    Disturbance,
    NoiseLevel,
    smooth_step,
)
from manipulandum_sim.space.directions import sphere_directions

Elbow = Literal["held", "free"]
Wrist = Literal["locked", "free"]
Control = Literal["position", "force"]
#: The record goes on this long after the disturbance is back (s).
AFTER_S: Final = 0.3
#: A servo's fastest motion turns by at most this much per substep (rad).
TURN_PER_SUBSTEP: Final = 0.15
#: A force-controlled robot holds the hand about its place by this spring and damper.
SOFT_N_M: Final = 60.0
SOFT_NS_M: Final = 6.0
#: Parts of a plateau's duration that it takes to rise and to return.
RISE: Final = 0.2


def _plateau(s: np.ndarray) -> np.ndarray:
    up, down = np.clip(s / RISE, 0.0, 1.0), np.clip((1.0 - s) / RISE, 0.0, 1.0)
    shape = smooth_step(up) + smooth_step(down) * np.array([1.0, -1.0, 1.0]).reshape(
        3, *([1] * np.ndim(s))
    )
    shape[0] -= 1.0
    shape[1] /= RISE
    shape[2] /= RISE**2
    return np.asarray(shape)


#: The planar rig's shapes, and one that stays out for three fifths of its duration.
SHAPES: Final = {**DISTURBANCES, "plateau": Disturbance("plateau", _plateau)}

_SENSORS: Final = {"force_sd": 0.03, "force_step": 0.05, "encoder_step": 20e-6, "led_sd": 0.002}
#: The person's own force: 1 N slow (.4 s) and a tremor of .3 N; sensors as in the planar rig.
SPACE_NOISE: Final = {
    "nominal": NoiseLevel("nominal", **_SENSORS, tremor=0.3, voluntary_sd=1.0),
    "sensor": NoiseLevel("sensor", **_SENSORS),
    "none": NoiseLevel("none"),
}


@dataclass(frozen=True)
class SpaceRig:
    """The robot and how it is used.

    Attributes
    ----------
    disturbance : str
        Name in `SHAPES`; of the place, or of the force where that is controlled.
    amplitude_m, force_n : float
        Peak of a disturbance of the place, or of the force.
    duration_s : float
        Whole milliseconds.
    directions : int
        A set of `sphere_directions`.
    elbow : {"held", "free"}
        Whether the upper arm's turning about its axis is held.
    wrist : {"locked", "free"}
        Free: the forearm turns and the hand bends about a handle on a ball joint.
    control : {"position", "force"}
    stiffness, damping_ratio : float
        Of the servo in N/m, and that of robot and handle alone.
    noise : str
        Name in `SPACE_NOISE`.
    command : bool
        Whether the commanded place is recorded beside the measured one.
    emg : bool
        Whether raw EMG of every muscle is recorded.
    handle_mass_kg : float
        Between the force sensor and the hand; its weight is tared.
    robot_kg : (3,)
        Moving mass along x, y, z on the robot's side of the sensor.
    """

    disturbance: str = "minimum_jerk"
    amplitude_m: float = 0.010
    force_n: float = 6.0
    duration_s: float = 0.3
    directions: int = 26
    elbow: Elbow = "held"
    wrist: Wrist = "locked"
    control: Control = "position"
    stiffness: float = 20_000.0
    damping_ratio: float = 0.7
    noise: str = "nominal"
    command: bool = True
    emg: bool = False
    handle_mass_kg: float = CAST_MASS_KG
    robot_kg: tuple[float, float, float] = (2.4, 2.0, 1.6)

    def __post_init__(self) -> None:
        self._check_names()
        samples = self.duration_s * RATE_HZ
        if not (samples >= 20 and abs(samples - round(samples)) < 1e-6):
            raise InputError(
                f"a disturbance of {self.duration_s} s", expected="whole milliseconds, 20 or more"
            )
        if not (0 < self.amplitude_m <= 0.05 and 0 < self.force_n <= 30):
            raise InputError(
                f"a disturbance of {self.amplitude_m} m, {self.force_n} N",
                expected="more than 0, at most 0.05 m and 30 N",
            )
        if not (1e3 <= self.stiffness <= 1e6 and 0 <= self.damping_ratio <= 2):
            raise InputError(
                f"servo of {self.stiffness} N/m, damping ratio {self.damping_ratio}",
                expected="1000 to 1000000 N/m, a damping ratio of 0 to 2",
            )

    def _check_names(self) -> None:
        asked: dict[str, tuple[str, tuple[str, ...]]] = {
            "disturbance": (self.disturbance, tuple(SHAPES)),
            "elbow": (self.elbow, get_args(Elbow)),
            "wrist": (self.wrist, get_args(Wrist)),
            "control": (self.control, get_args(Control)),
            "noise": (self.noise, tuple(SPACE_NOISE)),
        }
        for name, (value, known) in asked.items():
            if value not in known:
                raise InputError(f"{name} {value!r}", expected=" or ".join(known))
        sphere_directions(self.directions)

    @property
    def shape(self) -> Disturbance:
        """The disturbance."""
        return SHAPES[self.disturbance]

    @property
    def level(self) -> NoiseLevel:
        """The noise."""
        return SPACE_NOISE[self.noise]

    @property
    def peak(self) -> float:
        """Peak of what is commanded: m, or N where the force is controlled."""
        return self.force_n if self.control == "force" else self.amplitude_m

    @property
    def samples(self) -> int:
        """Samples of the longest possible trial."""
        return round((ONSET_S[1] + self.duration_s + AFTER_S) * RATE_HZ) + 1

    @property
    def substeps(self) -> int:
        """Integration steps per sample."""
        turn = np.sqrt(self.stiffness / min(self.robot_kg)) / RATE_HZ
        return max(1, int(np.ceil(turn / TURN_PER_SUBSTEP)))

    @property
    def sentences(self) -> tuple[str, ...]:
        """Sentences for a recording's provenance."""
        if self.control == "force":
            driven = f"{self.disturbance} of {self.force_n:g} N"
            held = "force-controlled"
        else:
            driven = f"{self.disturbance} of {1e3 * self.amplitude_m:g} mm"
            held = f"servo of {self.stiffness:g} N/m, damping ratio {self.damping_ratio:g}"
        return (
            f"simulated robot of three axes: {driven} in {self.duration_s:g} s, "
            f"{self.directions} directions; {held}; elbow {self.elbow}; wrist {self.wrist}; "
            f"noise {self.noise!r}",
        )
