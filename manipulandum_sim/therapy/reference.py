"""The movements of the therapy robot and what a controller is told to follow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from manipulandum_sim.therapy.steps import smooth_step

#: Mean speed of a minimum-jerk movement, deg/s.
SPEED_deg_s: Final = 20.0
#: Rest before and after a movement, s.
REST_S: Final = 0.5


@dataclass(frozen=True)
class Movement:
    """One axis moves, the others stay.

    Attributes
    ----------
    name : str
    axis : int
        From 0.
    start_deg : (5,)
        Where the robot stands before it.
    to_deg : float
        Where the moving axis ends.
    """

    name: str
    axis: int
    start_deg: tuple[float, float, float, float, float]
    to_deg: float

    @property
    def size_rad(self) -> float:
        """Signed."""
        return float(np.deg2rad(self.to_deg - self.start_deg[self.axis]))


MOVEMENTS: Final = {
    movement.name: movement
    for movement in (
        Movement("elevation", 0, (45.0, 0.0, 0.0, 0.0, 0.0), 110.0),
        Movement("horizontal", 1, (60.0, 0.0, 0.0, 0.0, 0.0), 90.0),
        Movement("lowering", 0, (110.0, 0.0, 0.0, 0.0, 0.0), 45.0),
    )
}


def find_movement(name: str) -> Movement:
    """A movement by its name.

    Raises
    ------
    InputError
        There is none.
    """
    if name not in MOVEMENTS:
        raise InputError(f"no movement {name!r}", expected=" or ".join(MOVEMENTS))
    return MOVEMENTS[name]


@dataclass(frozen=True)
class Reference:
    """Reference of T trials, each with one moving axis.

    Attributes
    ----------
    start : (T, 5)
        rad.
    axis : (T,) int
        From 0.
    size : (T,)
        Signed, rad.
    begin_s, duration_s : (T,)
        Of the movement, on the clock of the record.
    ramp_s : (T,)
        0: minimum jerk. Else constant speed between two ramps of this length.
    """

    start: FloatArray
    axis: Any
    size: FloatArray
    begin_s: FloatArray
    duration_s: FloatArray
    ramp_s: FloatArray

    def course(self, time_s: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Displacement of the moving axis and its two derivatives, each (T,)."""
        since = time_s - self.begin_s
        smooth = self._minimum_jerk(since)
        cruises = self.ramp_s > 0
        if not cruises.any():
            return smooth
        steady = self._cruise(since)
        place, speed, acceleration = (
            np.where(cruises, a, b) for a, b in zip(steady, smooth, strict=True)
        )
        return place, speed, acceleration

    def _minimum_jerk(self, since: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        step, rate = smooth_step(since / self.duration_s), self.size / self.duration_s
        return self.size * step.value, rate * step.slope, rate / self.duration_s * step.curvature

    def _cruise(self, since: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Up to speed over one ramp, down over another: two smooth steps of the velocity."""
        ramp = np.where(self.ramp_s > 0, self.ramp_s, 1.0)
        speed = self.size / (self.duration_s - ramp)
        up = smooth_step(since / ramp)
        down = smooth_step((since - self.duration_s) / ramp + 1)
        return (
            speed * ramp * (up.integral - down.integral),
            speed * (up.value - down.value),
            speed / ramp * (up.slope - down.slope),
        )

    def at(self, time_s: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Angles, rates and accelerations of all axes, each (T, 5)."""
        rows = np.arange(len(self.axis))
        q, qd, qdd = self.start.copy(), np.zeros_like(self.start), np.zeros_like(self.start)
        place, speed, acceleration = self.course(time_s)
        q[rows, self.axis] += place
        qd[rows, self.axis] = speed
        qdd[rows, self.axis] = acceleration
        return q, qd, qdd

    @property
    def end_s(self) -> FloatArray:
        """(T,)."""
        return np.asarray(self.begin_s + self.duration_s)


def reference(
    movements: list[Movement], speed_deg_s: float = SPEED_deg_s, rest_s: float = REST_S
) -> Reference:
    """Minimum jerk of every trial's movement.

    Raises
    ------
    InputError
        No such speed.
    """
    if not 2.0 <= speed_deg_s <= 60.0:
        raise InputError(f"{speed_deg_s} deg/s", expected="2 to 60 deg/s")
    size = np.array([m.size_rad for m in movements])
    return Reference(
        start=np.deg2rad([m.start_deg for m in movements]),
        axis=np.array([m.axis for m in movements]),
        size=size,
        begin_s=np.full(len(movements), rest_s),
        duration_s=np.abs(size) / np.deg2rad(speed_deg_s),
        ramp_s=np.zeros(len(movements)),
    )
