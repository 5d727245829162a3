"""Pushes of a moving hand: force pulses, and displacements along the predicted path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from manipulandum_sim.movement.path import minimum_jerk

#: A displacing servo takes hold, and lets go, over this time (s).
ENGAGE_S: Final = 0.01


@dataclass(frozen=True)
class Push:
    """The course of one push along its direction.

    Attributes
    ----------
    kind : {"pulse", "servo", "random", "random servo"}
        A force, a displacement from the path that is predicted at its onset, or a random one of
        either throughout (`commands`).
    size : float
        Largest force (N) or displacement (m); rms on each axis of a random one.
    parts : tuple of (sign, seconds)
        Half-sine pulses one after another; of a displacement: out, hold, back (signs are ignored).
    servo_n_m : float
        Stiffness of the displacing servo.
    """

    kind: Literal["pulse", "servo", "random", "random servo"]
    size: float
    parts: tuple[tuple[int, float], ...]
    servo_n_m: float = 20_000.0

    def __post_init__(self) -> None:
        if not (self.size > 0 and self.duration_s > 0 and self.servo_n_m > 0):
            raise InputError(
                f"a push of {self.size} over {self.duration_s} s", expected="more than 0"
            )
        if self.kind == "servo" and len(self.parts) != 3:
            raise InputError(f"{len(self.parts)} parts of a displacement", expected="3")

    @property
    def throughout(self) -> bool:
        """True if the perturbation is random."""
        return self.kind.startswith("random")

    @property
    def duration_s(self) -> float:
        """From its onset to its end."""
        return sum(seconds for _, seconds in self.parts)

    def force(self, lag_s: FloatArray) -> FloatArray:
        """Force (...) at times (...) from the onset."""
        lag, force, start = np.nan_to_num(lag_s, nan=-1.0), np.zeros(np.shape(lag_s)), 0.0
        for sign, seconds in self.parts:
            u = (lag - start) / seconds
            force = force + sign * np.sin(np.pi * u) * ((u > 0) & (u < 1))
            start += seconds
        return self.size * force

    def displacement(self, lag_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Displacement and its rate (...) at times (...) from the onset."""
        lag = np.nan_to_num(lag_s, nan=-1.0)
        (_, out), (_, hold), (_, back) = self.parts
        up, d_up, _ = minimum_jerk(np.clip(lag / out, 0, 1))
        down, d_down, _ = minimum_jerk(np.clip((lag - out - hold) / back, 0, 1))
        return self.size * (up - down), self.size * (d_up / out - d_down / back)

    def hold(self, lag_s: FloatArray) -> FloatArray:
        """Share 0..1 of the servo's stiffness that is on."""
        lag = np.nan_to_num(lag_s, nan=-1.0)
        ends = np.minimum(lag, self.duration_s + ENGAGE_S - lag)
        return np.clip(ends / ENGAGE_S, 0.0, 1.0)


#: Pushes by name: what the sources and the plans use.
PUSHES: Final = {
    "doublet": Push("pulse", 10.0, ((1, 0.06), (-1, 0.06))),
    "pulse": Push("pulse", 10.0, ((1, 0.06),)),
    "servo": Push("servo", 0.008, ((1, 0.09), (0, 0.07), (-1, 0.09))),
    "random": Push("random", 2.5, ((1, 0.75),)),
    "random-servo": Push("random servo", 0.002, ((1, 0.75),)),
    "soft-servo": Push("servo", 0.008, ((1, 0.09), (0, 0.07), (-1, 0.09)), 2_000.0),
}
