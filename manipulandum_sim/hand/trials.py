"""A batch of trials from commands to what the sensors say."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from manipulandum_sim.hand.arm_plant import Arm, Motion, force_on_handle, muscle_stretch
from manipulandum_sim.hand.compiled import integrate_compiled
from manipulandum_sim.hand.coupled import CoupledPlant, Course, Track, integrate
from manipulandum_sim.hand.emg import raw_emg
from manipulandum_sim.hand.equilibrium import muscle_command
from manipulandum_sim.hand.noise import LED_EVERY, Draws, draw, quantised, voluntary_force
from manipulandum_sim.hand.rig import RATE_HZ, Rig
from manipulandum_sim.hand.robot import servo_gains
from manipulandum_sim.hand.schedule import Schedule
from manipulandum_sim.hand.truth import Truth, joint_angles

#: Trials of an ideal servo that are computed at once: their arrays fit a core's cache.
IDEAL_CHUNK: Final = 32


@dataclass(frozen=True)
class Batch:
    """Trials `rows` of a schedule, B of them."""

    arm: Arm
    rig: Rig
    truth: Truth
    schedule: Schedule
    rows: IntArray

    @property
    def condition(self) -> IntArray:
        """Row in the truth of each trial, (B,)."""
        return self.schedule.condition[self.rows]

    @property
    def onset(self) -> IntArray:
        """Sample of each onset, (B,)."""
        return self.schedule.onset[self.rows]

    @property
    def keys(self) -> list[tuple[int, ...]]:
        """Keys of the trials' random numbers."""
        return [self.schedule.keys[r] for r in self.rows]


@dataclass(frozen=True)
class Sensed:
    """Recorded channels of a batch: position, force, joint angles (B, S, 2), EMG (B, S, 6).

    The commanded position (B, S, 2) goes beside them where the rig records it.
    """

    position: FloatArray
    force: FloatArray
    joint_angles: FloatArray
    emg: FloatArray | None
    commanded: FloatArray | None = None


def run_batch(batch: Batch, seed: int) -> Sensed:
    """Simulate and measure a batch of trials."""
    rig = batch.rig
    draws = draw(seed, batch.keys, rig.samples)
    drift = rig.level.drift_sd * draws.drift
    voluntary = voluntary_force(rig.level, draws, RATE_HZ)
    move = _prescribed if rig.servo.is_ideal else _driven
    track = move(batch, drift, voluntary)
    emg = None
    if rig.emg:
        activation = batch.truth.activation[batch.condition]
        emg = raw_emg(seed, batch.keys, activation, rig.samples, RATE_HZ)
    return _sense(batch, track, draws, emg)


def _driven(batch: Batch, drift: FloatArray, voluntary: FloatArray | None) -> Track:
    """The servo drives arm and robot: integrate."""
    arm, rig, truth, c = batch.arm, batch.rig, batch.truth, batch.condition
    gain = rig.reflex.gain if rig.reflex else 0.0
    muscles = muscle_command(
        arm, truth.posture[c], truth.activation[c], drift=drift, reflex_gain=gain
    )
    cast = rig.handle_mass_kg
    gains = servo_gains(rig.robot, rig.servo, truth.hand[c], truth.force[c], cast)
    plant = CoupledPlant(arm, rig.robot, muscles, gains, cast)
    delay = rig.reflex.delay_s if rig.reflex else None
    substeps = rig.steps_per_sample
    move = integrate_compiled if rig.compiled else integrate
    return move(plant, make_course(batch), rig.samples, substeps, voluntary, delay)


def make_course(batch: Batch) -> Course:
    """The commanded course of a batch on the grid of substeps.

    Parameters
    ----------
    batch : Batch

    Returns
    -------
    Course
    """
    rig, substeps = batch.rig, batch.rig.steps_per_sample
    step = 1 / (RATE_HZ * substeps)
    count = round(rig.duration_s * RATE_HZ) * substeps
    lag = np.minimum((np.arange(count)[:, None] + [0.0, 0.5, 1.0]) * step, rig.duration_s)
    profile = rig.shape.profile(lag, rig.duration_s, rig.amplitude_m, rig.residual_m)
    table = np.zeros((9, count + 2))
    table[:, 1:-1] = profile.transpose(2, 0, 1).reshape(9, count)
    table[[0, 3, 6], -1] = rig.residual_m
    return Course(
        step_s=step,
        onset=batch.onset * substeps,
        place=np.ascontiguousarray(batch.truth.hand[batch.condition].T),
        direction=np.ascontiguousarray(batch.schedule.unit[batch.rows].T),
        table=table,
    )


def _prescribed(batch: Batch, drift: FloatArray, voluntary: FloatArray | None) -> Track:
    """The motion is the commanded one: inverse dynamics, a few trials at a time."""
    shape = (batch.rig.samples, 2, len(batch.rows))
    track = Track(np.empty(shape), np.empty(shape), np.empty(shape))
    for start in range(0, len(batch.rows), IDEAL_CHUNK):
        part = slice(start, start + IDEAL_CHUNK)
        _prescribe(batch, drift, part, track)
    if voluntary is not None:
        track.force[...] += voluntary
    return track


def _prescribe(batch: Batch, drift: FloatArray, part: slice, track: Track) -> None:
    arm, rig, truth, c = batch.arm, batch.rig, batch.truth, batch.condition[part]
    gain = rig.reflex.gain if rig.reflex else 0.0
    command = muscle_command(
        arm, truth.posture[c], truth.activation[c], drift=drift[part], reflex_gain=gain
    ).over_time()
    lag = (np.arange(rig.samples) - batch.onset[part, None]) / RATE_HZ
    hand = truth.hand[c][:, :, None]
    unit = batch.schedule.unit[batch.rows[part]][:, :, None]

    def course(at: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        p, v, a = rig.shape.profile(at, rig.duration_s, rig.amplitude_m, rig.residual_m)
        return hand + unit * p[:, None], unit * v[:, None], unit * a[:, None]

    position, velocity, acceleration = course(lag)
    delayed: FloatArray | float = 0.0
    if rig.reflex:
        past, earlier = lag - rig.reflex.delay_s, course(lag - rig.reflex.delay_s)[0]
        delayed = muscle_stretch(arm, earlier[:, 0], earlier[:, 1], command, past)
    motion = Motion(
        *(component for s in (position, velocity, acceleration) for component in (s[:, 0], s[:, 1]))
    )
    fx, fy = force_on_handle(arm, motion, command, lag, delayed)
    force = np.stack([fx, fy], axis=1) - rig.handle_mass_kg * acceleration
    track.position[..., part] = position.transpose(2, 1, 0)
    track.velocity[..., part] = velocity.transpose(2, 1, 0)
    track.force[..., part] = force.transpose(2, 1, 0)


def _sense(batch: Batch, track: Track, draws: Draws, emg: FloatArray | None) -> Sensed:
    """Encoders, force sensor and LEDs read what happened."""
    level = batch.rig.level
    position = np.ascontiguousarray(track.position.transpose(2, 0, 1))
    force = np.ascontiguousarray(track.force.transpose(2, 0, 1))
    force = quantised(force + level.force_sd * draws.white, level.force_step)
    angles = joint_angles(batch.arm, position[:, ::LED_EVERY]) + level.led_sd * draws.led
    held = np.repeat(angles, LED_EVERY, axis=1)[:, : position.shape[1]]
    # No hand stands twice at the same place of the encoders' grid: each trial has its own.
    grid = draws.grid[:, None]
    measured = quantised(position, level.encoder_step, grid)
    commanded = _commanded(batch) if batch.rig.command else None
    return Sensed(measured, force, held, emg, commanded)


def _commanded(batch: Batch) -> FloatArray:
    """Where the robot was told to be at every sample (B, S, 2)."""
    rig = batch.rig
    lag = (np.arange(rig.samples) - batch.onset[:, None]) / RATE_HZ
    along = rig.shape.profile(lag, rig.duration_s, rig.amplitude_m, rig.residual_m)[0]
    unit = batch.schedule.unit[batch.rows]
    return np.asarray(batch.truth.hand[batch.condition][:, None] + unit[:, None] * along[..., None])
