"""Arm, cast, handle and robot move as one: equations of motion and their integration.

The grip is rigid, so arm and robot share the hand's position and the system has two degrees of
freedom. Its state is that position and its velocity: both chains are reduced to the hand, added,
and one 2 x 2 system gives the acceleration:

    (L_arm + L_robot + m_cast + m_handle) a = F_servo - b_robot + F_muscles + F_voluntary - b_arm

The sensor sits between robot and cast: it reads ``F_muscles + F_voluntary - L_arm a - b_arm -
m_cast a``, by limb and cast on the robot.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from armimpedance.records import FloatArray, IntArray

from .arm_plant import Arm, MuscleCommand, Stretch
from .robot import Robot, ServoGains


class Command(NamedTuple):
    """Commanded position, velocity, acceleration at one instant, each (T,)."""

    x: FloatArray
    y: FloatArray
    vx: FloatArray
    vy: FloatArray
    ax: FloatArray
    ay: FloatArray


class HandState(NamedTuple):
    """Hand position and velocity, each (T,)."""

    x: FloatArray
    y: FloatArray
    vx: FloatArray
    vy: FloatArray

    def moved(self, step: float, rate: HandState) -> HandState:
        """``self + step rate``."""
        return HandState(*(a + step * b for a, b in zip(self, rate, strict=True)))


class Outcome(NamedTuple):
    """Rate of the state, force at the sensor (by limb and cast) and the muscles' stretch."""

    rate: HandState
    sensor_x: FloatArray
    sensor_y: FloatArray
    stretch: Stretch


@dataclass(frozen=True)
class CoupledPlant:
    """Arm and robot of a batch of trials that hold on to each other."""

    arm: Arm
    robot: Robot
    muscles: MuscleCommand
    gains: ServoGains
    cast_kg: float

    def outcome(
        self,
        state: HandState,
        command: Command,
        time: FloatArray,
        voluntary: FloatArray | None,
        delayed: FloatArray | float = 0.0,
    ) -> Outcome:
        """Equations of motion at one instant; `time` (T,) since each trial's onset."""
        arm = self.arm.link.end_motion(*state)
        (fx, fy), stretch = self.arm.muscle_force_at_hand(arm, self.muscles, time, delayed)
        fx -= arm.bx
        fy -= arm.by
        if voluntary is not None:
            fx += voluntary[0]
            fy += voluntary[1]
        robot = self.robot.link.end_motion(*state)
        g = self.gains
        px = g.stiffness * (command.x - state.x) + g.damping * (command.vx - state.vx)
        py = g.stiffness * (command.y - state.y) + g.damping * (command.vy - state.vy)
        px += g.Fxx * command.ax + g.Fxy * command.ay + g.hold_x - robot.bx
        py += g.Fxy * command.ax + g.Fyy * command.ay + g.hold_y - robot.by
        limb_xx, limb_yy = arm.Lxx + self.cast_kg, arm.Lyy + self.cast_kg
        # (L_arm + L_robot + m) a = push + F, (2, 2) (2,) = (2,)
        Axx = limb_xx + robot.Lxx + self.robot.handle_kg
        Ayy = limb_yy + robot.Lyy + self.robot.handle_kg
        Axy = arm.Lxy + robot.Lxy
        rx, ry = px + fx, py + fy
        det = Axx * Ayy - Axy * Axy
        ax = (Ayy * rx - Axy * ry) / det
        ay = (Axx * ry - Axy * rx) / det
        fx -= limb_xx * ax + arm.Lxy * ay
        fy -= arm.Lxy * ax + limb_yy * ay
        return Outcome(HandState(state.vx, state.vy, ax, ay), fx, fy, stretch)


@dataclass(frozen=True)
class Course:
    """The commanded course of a batch of trials on the grid of substeps.

    Attributes
    ----------
    step_s : float
    onset : (T,) int
        The substep at which each disturbance starts.
    place, direction : (2, T)
        Where each trial starts and the unit vector along which it is disturbed.
    table : (P, 9)
        Per substep since one before the onset: displacement, velocity, acceleration at its start,
        then at its middle, then at its end, as seen from inside the substep: a shape may jump at
        its ends.
    """

    step_s: float
    onset: IntArray
    place: FloatArray
    direction: FloatArray
    table: FloatArray

    def commands(self, step: int) -> tuple[Command, Command, Command]:
        """The command at the start, the middle and the end of a substep."""
        row = np.clip(step - self.onset + 1, 0, len(self.table) - 1)
        p = self.table[row].T
        (dx, dy), (x, y) = self.direction, self.place
        start, middle, end = (
            Command(
                x + dx * p[i],
                y + dy * p[i],
                dx * p[i + 1],
                dy * p[i + 1],
                dx * p[i + 2],
                dy * p[i + 2],
            )
            for i in (0, 3, 6)
        )
        return start, middle, end


@dataclass(frozen=True)
class Track:
    """What happened, at every sample: hand position, velocity and sensor force, (S, 2, T)."""

    position: FloatArray
    velocity: FloatArray
    force: FloatArray


class _ReflexLine:
    """The stretch of the last `delay` substeps; the reflex hears it that much later."""

    def __init__(self, delay: int) -> None:
        self._past: list[Stretch] = []
        self._delay = delay

    def hear(self, now: Stretch, step_s: float) -> tuple[FloatArray, FloatArray]:
        """Delayed stretch in the middle and at the end of the substep that begins `now`."""
        past = self._past
        past.append(now)
        if len(past) > self._delay + 1:
            past.pop(0)
        if len(past) <= self._delay:
            return past[0].length, past[0].length
        a, b = past[0], past[1]
        middle = (a.length + b.length) / 2 + step_s / 8 * (a.velocity - b.velocity)
        return middle, b.length

    def first(self) -> FloatArray | float:
        """Delayed stretch at the start of the next substep."""
        if not self._past:
            return 0.0
        return self._past[1 if len(self._past) > self._delay else 0].length


def integrate(
    plant: CoupledPlant,
    course: Course,
    samples: int,
    substeps: int,
    voluntary: FloatArray | None = None,
    reflex_delay_s: float | None = None,
) -> Track:
    """Fourth-order Runge-Kutta with a fixed step over a batch of trials.

    Parameters
    ----------
    plant, course
        `course.step_s` is the substep.
    samples, substeps : int
        Samples to return and substeps between them.
    voluntary : (S, 2, T), optional
        Force of the hand's own (N) at the samples, linear between them.
    reflex_delay_s : float, optional
        Rounded to whole substeps.

    Returns
    -------
    Track
    """
    h, trials = course.step_s, len(course.onset)
    position, velocity, force = (np.empty((samples, 2, trials)) for _ in range(3))
    rest = np.zeros(trials)
    state = HandState(course.place[0], course.place[1], rest, rest)
    line = _ReflexLine(max(1, round(reflex_delay_s / h))) if reflex_delay_s is not None else None
    for n in range((samples - 1) * substeps + 1):
        at, part = divmod(n, substeps)
        push = _voluntary_over_substep(voluntary, at, part, substeps)
        start, middle, end = course.commands(n)
        time = np.multiply(n - course.onset, h, dtype=np.float64)
        now = plant.outcome(state, start, time, push[0], line.first() if line else 0.0)
        if part == 0:
            position[at] = state.x, state.y
            velocity[at] = state.vx, state.vy
            force[at] = now.sensor_x, now.sensor_y
        heard = line.hear(now.stretch, h) if line else (0.0, 0.0)
        k1 = now.rate
        half, whole = time + h / 2, time + h
        k2 = plant.outcome(state.moved(h / 2, k1), middle, half, push[1], heard[0]).rate
        k3 = plant.outcome(state.moved(h / 2, k2), middle, half, push[1], heard[0]).rate
        k4 = plant.outcome(state.moved(h, k3), end, whole, push[2], heard[1]).rate
        mean = (a + 2 * (b + c) + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True))
        state = state.moved(h / 6, HandState(*mean))
    return Track(position, velocity, force)


def _voluntary_over_substep(
    voluntary: FloatArray | None, at: int, part: int, substeps: int
) -> tuple[FloatArray | None, FloatArray | None, FloatArray | None]:
    """The voluntary force (2, T) at the start, the middle and the end of a substep."""
    if voluntary is None:
        return None, None, None
    here, there = voluntary[at], voluntary[min(at + 1, len(voluntary) - 1)]
    start, middle, end = (
        here + (part + extra) / substeps * (there - here) for extra in (0.0, 0.5, 1.0)
    )
    return start, middle, end
