"""Reaches of a batch of trials: arm, handle and robot move as one mass at the hand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from manipulandum_sim.hand import RATE_HZ, Arm, MuscleCommand
from manipulandum_sim.movement.commands import Commands
from manipulandum_sim.movement.feedforward import feedforward
from manipulandum_sim.movement.path import Courses, Motion2
from manipulandum_sim.movement.pushes import Push
from manipulandum_sim.movement.rig import MovementRig

#: How fast the speed with which a hand leaves the mean course is forgotten in its prediction (s).
PREDICTION_S: float = 0.1


@dataclass(frozen=True)
class Reaches:
    """T trials to be run.

    Attributes
    ----------
    arm : Arm
    rig : MovementRig
    courses : Courses
        What the person means to do.
    phase : (T,)
        Index of the rig's phases; -1 for trials without a push.
    unit : (2, T)
        Direction of the push.
    commands : Commands or None
        Of random forces.
    """

    arm: Arm
    rig: MovementRig
    courses: Courses
    phase: IntArray
    unit: FloatArray
    commands: Commands | None = None


@dataclass(frozen=True)
class Ran:
    """Course of the reaches: position, velocity, force at the sensor (S, 2, T), onsets (T,)."""

    position: FloatArray
    velocity: FloatArray
    force: FloatArray
    push_onset_s: FloatArray


def intended(reaches: Reaches, time_s: FloatArray) -> Motion2:
    """The intended motion (2, S, T) at the samples' times (S,)."""
    parts = [reaches.courses.at(t) for t in time_s]
    return Motion2(*(np.stack(p, axis=1) for p in zip(*parts, strict=True)))


def commands_of(reaches: Reaches, time_s: FloatArray) -> MuscleCommand:
    """Commands of the muscles (6, S, T)."""
    rig, motion = reaches.rig, intended(reaches, time_s)
    device = rig.held_kg * motion.acceleration - rig.load.force(
        rig.line, motion.position, motion.velocity
    )
    courses = reaches.courses
    share = (time_s[:, None] - courses.onset_s) / courses.duration_s
    gain = rig.reflex.gain if rig.reflex else 0.0
    return feedforward(reaches.arm, motion, device, rig.cocontraction.at(share), gain)


def run(reaches: Reaches, voluntary: FloatArray) -> Ran:
    """Integrate with Runge and Kutta's fourth order, one step a sample.

    Parameters
    ----------
    reaches : Reaches
    voluntary : (S, 2, T)
        Force of the hand's own, N.
    """
    return _Run(reaches, voluntary).all()


class _Run:
    """The state of one integration."""

    def __init__(self, reaches: Reaches, voluntary: FloatArray) -> None:
        self.reaches, self.voluntary = reaches, voluntary
        self.rig, self.arm = reaches.rig, reaches.arm
        samples, trials = len(voluntary), len(reaches.phase)
        self.time_s = np.arange(samples) / RATE_HZ
        self.command = commands_of(reaches, self.time_s)
        self.nominal = Courses.nominal(self.rig.line, self.rig.go_s, trials)
        start = intended(reaches, self.time_s[:1])
        self.state = np.concatenate([start.position[:, 0], start.velocity[:, 0]])
        self.onset = np.full(trials, np.nan)
        self.expected_at = np.full(trials, np.nan)
        self.offset = np.zeros((2, trials))
        self.lead = np.zeros((2, trials))
        shape = (samples, 2, trials)
        self.ran = Ran(np.empty(shape), np.empty(shape), np.empty(shape), self.onset)
        self.stretch = np.zeros((samples, 6, trials))

    def all(self) -> Ran:
        """Every sample."""
        for s in range(len(self.time_s)):
            self._trigger(s)
            self._record(s)
            if s + 1 < len(self.time_s):
                self.state = self._step(s)
        return self.ran

    def _trigger(self, s: int) -> None:
        """Start the pushes that are due at this sample."""
        line, phases, rows = self.rig.line, np.array(self.rig.phases), self.reaches.phase
        now = self.time_s[s]
        wanted = np.where(rows >= 0, phases[rows], np.inf)
        if self.rig.on_time:
            due = now >= self.rig.nominal_time(wanted)
        else:
            start = np.reshape(line.start_m, (2, 1))
            due = line.along @ (self.state[:2] - start) >= wanted * line.length_m
        due &= (rows >= 0) & np.isnan(self.onset)
        if due.any():
            self._begin(due, now)

    def _begin(self, due: np.ndarray, now: float) -> None:
        """The path that the robot predicts: the mean course, from the place and speed of now."""
        line = self.rig.line
        self.onset[due] = now
        travelled = line.along @ (self.state[:2] - np.reshape(line.start_m, (2, 1)))
        at = self.rig.nominal_time(np.clip(travelled / line.length_m, 1e-3, 1 - 1e-3))
        mean = self.nominal.at(at)
        self.expected_at = np.where(due, at, self.expected_at)
        self.offset = np.where(due, self.state[:2] - mean.position, self.offset)
        self.lead = np.where(due, self.state[2:] - mean.velocity, self.lead)

    def _predicted(self, lag: FloatArray) -> tuple[FloatArray, FloatArray]:
        lag = np.nan_to_num(lag)
        fading = np.exp(-lag / PREDICTION_S)
        mean = self.nominal.at(np.nan_to_num(self.expected_at) + lag)
        place = mean.position + self.offset + self.lead * PREDICTION_S * (1 - fading)
        return place, mean.velocity + self.lead * fading

    def _pushed(self, time: float, state: FloatArray) -> FloatArray:
        """Force (2, T) of the robot's push on the hand."""
        push: Push = self.rig.shape
        lag, unit = time - self.onset, self.reaches.unit
        commands = self.reaches.commands
        if commands is not None and push.kind == "random":
            return commands.value(lag)
        if push.kind == "pulse":
            return unit * push.force(lag)
        on = push.hold(lag)
        if not on.any():
            return np.zeros_like(unit)
        place, speed = self._predicted(lag)
        if commands is None:
            d, rate = (unit * part for part in push.displacement(lag))
        else:
            d, rate = commands.value(lag), commands.rate(lag)
        damping = 1.4 * np.sqrt(push.servo_n_m * (self.rig.held_kg + 1.0))
        return on * (
            push.servo_n_m * (place + d - state[:2]) + damping * (speed + rate - state[2:])
        )

    def _outcome(
        self, s: int, half: int, state: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Rate of the state, force at the sensor, and stretch, at sample ``s + half / 2``."""
        rig, e = self.rig, min(s + (half + 1) // 2, len(self.time_s) - 1)
        b = s + half // 2
        command = MuscleCommand(*((p[:, b] + p[:, e]) / 2 for p in self.command))
        time = (s + half / 2) / RATE_HZ
        end = self.arm.link.end_motion(*state)
        pulled, stretch = self.arm.muscle_force_at_hand(end, command, 0.0, self._delayed(s, half))
        own = np.stack(pulled) + (self.voluntary[b] + self.voluntary[e]) / 2
        own -= np.stack([end.bx, end.by])
        device = rig.load.force(rig.line, state[:2], state[2:]) + self._pushed(time, state)
        total = own + device
        m = rig.held_kg
        Axx, Ayy, Axy = end.Lxx + m, end.Lyy + m, end.Lxy
        # (L + m) a = F, (2, 2) (2,) = (2,)
        det = Axx * Ayy - Axy * Axy
        ax, ay = (Ayy * total[0] - Axy * total[1]) / det, (Axx * total[1] - Axy * total[0]) / det
        acceleration = np.stack([ax, ay])
        sensor = rig.robot_kg * acceleration - device
        return np.concatenate([state[2:], acceleration]), sensor, stretch.length

    def _delayed(self, s: int, half: int) -> FloatArray | float:
        if self.rig.reflex is None:
            return 0.0
        back = s + half / 2 - self.rig.reflex.delay_s * RATE_HZ
        if back < 0:
            return np.zeros_like(self.stretch[0])
        low = int(np.floor(back))
        share = back - low
        return np.asarray((1 - share) * self.stretch[low] + share * self.stretch[low + 1])

    def _record(self, s: int) -> None:
        _, sensor, self.stretch[s] = self._outcome(s, 0, self.state)
        self.ran.position[s], self.ran.velocity[s] = self.state[:2], self.state[2:]
        self.ran.force[s] = sensor

    def _step(self, s: int) -> FloatArray:
        h, x = 1 / RATE_HZ, self.state
        k1 = self._outcome(s, 0, x)[0]
        k2 = self._outcome(s, 1, x + h / 2 * k1)[0]
        k3 = self._outcome(s, 1, x + h / 2 * k2)[0]
        k4 = self._outcome(s, 2, x + h * k3)[0]
        return np.asarray(x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
