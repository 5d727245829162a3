"""The torques on a Kinarm's links, trial by trial, as far as its files show them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.numerics.signals import spline_kernels
from armimpedance.recordings.kinarm.channels import FRICTION, channels, force_labels, link_labels
from armimpedance.recordings.kinarm.dynamics import LinkInertias, hand_torque
from armimpedance.recordings.kinarm.exam_file import ExamFile
from armimpedance.recordings.kinarm.robot import Robot

#: Support of the smoothing of all torques alike, s: the links move below some 20 Hz.
SMOOTHED_S: Final = 0.06
#: Of short trials, at most this part of the usual length.
SMOOTHED_PART: Final = 0.3
#: One sample in so much time is looked at; between them the smoothed torques do not change, s.
STEP_S: Final = 0.005
#: Of a long exam fewer samples suffice: so many of the recording, evenly.
MOST_SAMPLES: Final = 100_000
#: A link that turns slower than this may stick, rad/s.
MOVING_RAD_S: Final = 0.03

#: Below this speed friction is not yet full, rad/s.
_CREEP_RAD_S: Final = 0.05

#: Whatever the sensor's axes are, the hand's force is a sum of these times the sensor's: as it is,
#: a quarter turn on, mirrored, swapped.
FRAMES: Final = np.array(
    [
        [[1.0, 0.0], [0.0, 1.0]],
        [[0.0, -1.0], [1.0, 0.0]],
        [[1.0, 0.0], [0.0, -1.0]],
        [[0.0, 1.0], [1.0, 0.0]],
    ]
)


@dataclass(frozen=True)
class LinkTorques(FrozenRecord):
    """Smoothed torques while the links move, N samples of 2 axes, N m.

    Attributes
    ----------
    inertial, motor : (N, 2)
        What the motion takes; what the motors do.
    hand : (N, 2, 4)
        J^T F of the sensor's force in each of `FRAMES`.
    velocity : (N, 2)
    trial : (N,)
        Number of each sample's trial, from 0.
    step_s : float
        Time between two samples.
    """

    inertial: Annotated[FloatArray, "N 2"]
    motor: Annotated[FloatArray, "N 2"]
    hand: Annotated[FloatArray, "N 2 4"]
    velocity: Annotated[FloatArray, "N 2"]
    trial: Annotated[IntArray, "N"]
    step_s: float

    @property
    def moving_s(self) -> float:
        """For how long the links move."""
        return len(self.trial) * self.step_s

    def without_friction(self) -> LinkTorques:
        """The same after what is constant, dry or viscous in each axis is projected out."""
        bases = []
        for speed in self.velocity.T:
            columns = np.column_stack([np.ones_like(speed), np.tanh(speed / _CREEP_RAD_S), speed])
            bases.append(np.linalg.qr(columns)[0])

        def projected(torque: FloatArray) -> FloatArray:
            # Each axis (N,) less its part in the span of that axis' basis (N, 3).
            axes = zip(torque.T, bases, strict=True)
            return np.column_stack([each - basis @ (basis.T @ each) for each, basis in axes])

        return replace(
            self,
            inertial=projected(self.inertial),
            motor=projected(self.motor),
            hand=np.stack([projected(self.hand[:, :, i]) for i in range(4)], axis=2),
        )


def link_torques(
    files: Sequence[ExamFile], motors: Sequence[str], inertias: LinkInertias, robot: Robot
) -> LinkTorques | None:
    """The torques of all trials where the links move; None where they never do."""
    friction = tuple(f"{robot.side.title()}_{name}" for name in FRICTION)
    if any(label not in file.channels for label in friction for file in files):
        friction = ()
    usual_s = float(np.median([file.frames for file in files])) / files[0].rate_hz
    kernels = spline_kernels(min(SMOOTHED_S, SMOOTHED_PART * usual_s), files[0].rate_hz)
    step = max(1, round(STEP_S * files[0].rate_hz))
    step *= 1 + sum(file.frames for file in files) // (step * MOST_SAMPLES)
    parts: list[tuple[FloatArray, ...]] = []
    trial: list[int] = []
    for number, file in enumerate(files):
        if file.frames <= 2 * kernels.half:
            continue
        links = channels([file], *link_labels(robot.side))
        force = channels([file], *force_labels(robot.side))
        motor = file.columns(motors)
        if friction:
            motor = motor + np.nan_to_num(file.columns(friction))
        angle, velocity, acceleration = (
            _filtered(links, w, step) for w in (kernels.smooth, kernels.first, kernels.second)
        )
        moves = (np.abs(velocity) > MOVING_RAD_S).any(axis=1)
        inertial = inertias.torque(angle, velocity, acceleration)
        pushed = _filtered(motor, kernels.smooth, step)
        held = [hand_torque(links, robot, force @ frame.T) for frame in FRAMES]
        hand = np.stack([_filtered(each, kernels.smooth, step) for each in held], axis=2)
        parts.append(tuple(each[moves] for each in (inertial, pushed, hand, velocity)))
        trial += [number] * int(moves.sum())
    if not trial:
        return None
    inertial, pushed, hand, velocity = (np.concatenate(each) for each in zip(*parts, strict=True))
    return LinkTorques(inertial, pushed, hand, velocity, np.array(trial), step / files[0].rate_hz)


def _filtered(signal: FloatArray, weights: FloatArray, step: int) -> FloatArray:
    """Signals (F, 2) through a kernel, where it fits in, every `step` samples."""
    return np.column_stack([np.correlate(each, weights, "valid")[::step] for each in signal.T])
