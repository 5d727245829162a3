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
from functools import cached_property
from typing import NamedTuple

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from manipulandum_sim.hand.arm_plant import Arm, MuscleCommand, Stretch
from manipulandum_sim.hand.robot import Robot, ServoGains
from manipulandum_sim.hand.two_link import EndMotion, TwoLink, stacked


class Command(NamedTuple):
    """Commanded position, velocity and acceleration at one instant, each (2, T)."""

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


class Outcome(NamedTuple):
    """Rate of the state (4, T), force at the sensor (2, T) by limb and cast, muscles' stretch."""

    rate: FloatArray
    sensor: FloatArray
    stretch: Stretch


@dataclass(frozen=True)
class CoupledPlant:
    """Arm and robot of a batch of trials that hold on to each other."""

    arm: Arm
    robot: Robot
    muscles: MuscleCommand
    gains: ServoGains
    cast_kg: float

    @cached_property
    def chains(self) -> TwoLink:
        """Arm and robot as one batch of two: half the calls in the inner loop."""
        return stacked(self.arm.link, self.robot.link)

    def servo_force(self, state: FloatArray, command: Command) -> FloatArray:
        """Force (2, T) of the robot's motors at the hand."""
        g = self.gains
        push = g.stiffness * (command.position - state[:2])
        push += g.damping * (command.velocity - state[2:])
        ax, ay = command.acceleration
        push[0] += g.Fxx * ax + g.Fxy * ay + g.hold_x
        push[1] += g.Fxy * ax + g.Fyy * ay + g.hold_y
        return push

    def outcome(
        self,
        state: FloatArray,
        command: Command,
        time: FloatArray,
        voluntary: FloatArray | None,
        delayed: FloatArray | float = 0.0,
    ) -> Outcome:
        """Equations of motion at one instant.

        Parameters
        ----------
        state : (4, T)
            Hand position and velocity.
        command : Command
        time : (T,)
            Since each trial's onset.
        voluntary : (2, T) or None
            Force of the hand's own.
        delayed : (6, T) or 0
            The stretch that the reflex answers to.
        """
        both = self.chains.end_motion(*state)
        arm = EndMotion(*(part[0] for part in both))
        pulled, stretch = self.arm.muscle_force_at_hand(arm, self.muscles, time, delayed)
        force = np.stack(pulled)
        force[0] -= arm.bx
        force[1] -= arm.by
        if voluntary is not None:
            force += voluntary
        push = self.servo_force(state, command)
        push += force
        push[0] -= both.bx[1]
        push[1] -= both.by[1]
        mass = self.cast_kg + self.robot.handle_kg
        # (L_arm + L_robot + m) a = push, (2, 2) (2,) = (2,)
        Axx = both.Lxx[0] + both.Lxx[1] + mass
        Ayy = both.Lyy[0] + both.Lyy[1] + mass
        Axy = both.Lxy[0] + both.Lxy[1]
        px, py = push / (Axx * Ayy - Axy * Axy)
        rate = np.empty_like(state)
        rate[:2] = state[2:]
        rate[2] = ax = Ayy * px - Axy * py
        rate[3] = ay = Axx * py - Axy * px
        force[0] -= (arm.Lxx + self.cast_kg) * ax + arm.Lxy * ay
        force[1] -= arm.Lxy * ax + (arm.Lyy + self.cast_kg) * ay
        return Outcome(rate, force, stretch)


@dataclass(frozen=True)
class Course:
    """The commanded course of a batch of trials on the grid of substeps.

    Attributes
    ----------
    step_s : float
    onset : (T,) int
        The substep at which each disturbance starts.
    place, direction : (2, T)
        Place where each trial starts, and unit vector along which it is disturbed.
    table : (9, P)
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
        # before the first column there is the first, after the last the last
        p = np.take(self.table, step - self.onset + 1, axis=1, mode="clip")
        # (9, 2, T): start, middle, end of displacement, velocity, acceleration
        moved = self.direction * p[:, None]
        start, middle, end = (
            Command(self.place + moved[i], moved[i + 1], moved[i + 2]) for i in (0, 3, 6)
        )
        return start, middle, end


@dataclass(frozen=True)
class Track:
    """Course of the trials: hand position, velocity and sensor force at every sample, (S, 2, T)."""

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
    state = np.concatenate([course.place, np.zeros((2, trials))])
    line = _ReflexLine(max(1, round(reflex_delay_s / h))) if reflex_delay_s is not None else None
    for n in range((samples - 1) * substeps + 1):
        at, part = divmod(n, substeps)
        push = _voluntary_over_substep(voluntary, at, part, substeps)
        start, middle, end = course.commands(n)
        time = np.multiply(n - course.onset, h, dtype=np.float64)
        now = plant.outcome(state, start, time, push[0], line.first() if line else 0.0)
        if part == 0:
            position[at], velocity[at], force[at] = state[:2], state[2:], now.sensor
        heard = line.hear(now.stretch, h) if line else (0.0, 0.0)
        half, whole = time + h / 2, time + h
        k1 = now.rate
        k2 = plant.outcome(state + h / 2 * k1, middle, half, push[1], heard[0]).rate
        k3 = plant.outcome(state + h / 2 * k2, middle, half, push[1], heard[0]).rate
        k4 = plant.outcome(state + h * k3, end, whole, push[2], heard[1]).rate
        state = state + h / 6 * (k1 + 2 * (k2 + k3) + k4)
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
