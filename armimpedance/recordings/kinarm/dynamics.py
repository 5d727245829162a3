"""Dynamics of a Kinarm's links, and the torques on them, from the inertias in `common.c3d`.

Two motors at the shoulder turn link 1 and, through a crank (link 3) and a bar (link 4) that runs
along link 1, link 2. With the links' absolute angles a1, a2 as coordinates,

    A a1'' + B a2'' + B' a2'^2 = tau_1,        B a1'' + D a2'' - B' a1'^2 = tau_2,

    A = I1 + m1 |c1|^2 + I4 + m4 |c4|^2 + J1 + m2 L1^2,   D = I2 + m2 |c2|^2 + I3 + m3 |c3|^2 + J2
    + m4 L3^2,   B = m2 L1 (c2x cos d - c2y sin d) + m4 L3 (c4x cos e + c4y sin e),   B' = dB/dd,

d = a2 - a1, e = d - (angle between link 2 and the crank), c = (along, across) the centre of mass
from the link's own joint, J the motors' inertias. The torques on the links are
tau = motors + J^T F, F the force **by the limb on the robot** at the hand and J = dX/d(a1, a2).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.numerics.signals import spline_kernels
from armimpedance.recordings.kinarm.channels import FRICTION, channels, force_labels, link_labels
from armimpedance.recordings.kinarm.exam_file import ExamFile
from armimpedance.recordings.kinarm.robot import Robot

#: Parameters that are required for the dynamics.
_NEEDED: Final = ("L1_I", "L1_M", "L1_C_AXIAL", "L2_I", "L2_M", "L2_C_AXIAL")


@dataclass(frozen=True)
class LinkInertias:
    """Coefficients of the equations above, SI units.

    `first`, `second`: A and D.
    `along`, `across`: B = along cos d + across sin d.
    """

    first: float
    second: float
    along: float
    across: float

    def torque(
        self, angle: FloatArray, velocity: FloatArray, acceleration: FloatArray
    ) -> FloatArray:
        """Inertial torque of a motion of the links, (N, 2), N m.

        `angle`, `velocity`, `acceleration` (N, 2): of links 1 and 2, from the x axis.
        """
        difference = angle[:, 1] - angle[:, 0]
        coupling = self.along * np.cos(difference) + self.across * np.sin(difference)
        slope = -self.along * np.sin(difference) + self.across * np.cos(difference)
        a1, a2 = acceleration.T
        v1, v2 = velocity.T
        # [A B; B D] (2, 2) times acceleration (2,) plus B' (v2^2, -v1^2).
        first = self.first * a1 + coupling * a2 + slope * v2**2
        return np.column_stack([first, coupling * a1 + self.second * a2 - slope * v1**2])


def link_inertias(common: ExamFile, robot: Robot) -> LinkInertias | None:
    """Inertias of one side's links; None if `common.c3d` does not state links 1 and 2.

    Other parts that are not stated (crank, bar, motors) count as massless, since the balance of
    torques fits a factor of the inertias.

    `robot`: supplies the length of the first link; an exoskeleton's is adjusted to the subject.
    """
    group = f"{robot.side.upper()}_KINARM"
    names = [
        f"L{i}_{quantity}" for i in (1, 2, 3, 4) for quantity in ("I", "M", "C_AXIAL", "C_ANTERIOR")
    ]
    stated_values = {
        n: common.parameters.number(group, n) for n in (*names, "L3_L", "MOTOR1_I", "MOTOR2_I")
    }
    if robot.links_m is None or not all(map(stated_values.get, _NEEDED)):
        return None
    parameters = {name: value or 0.0 for name, value in stated_values.items()}
    # "Anterior" is counter-clockwise on the right and clockwise on the left.
    turn = -1.0 if robot.side == "left" else 1.0
    mass, axial, anterior = (
        [parameters[f"L{i}_{quantity}"] for i in (1, 2, 3, 4)]
        for quantity in ("M", "C_AXIAL", "C_ANTERIOR")
    )
    aside = [turn * distance for distance in anterior]
    about = [
        parameters[f"L{i + 1}_I"] + mass[i] * (axial[i] ** 2 + aside[i] ** 2) for i in range(4)
    ]
    stated = common.parameters.number(group, "L2_L5_ANGLE")
    angle = stated if stated and robot.kind == "exoskeleton" else 0.0
    crank = mass[3] * parameters["L3_L"]
    cosine, sine = np.cos(turn * angle), np.sin(turn * angle)
    length = float(robot.lengths_m[0])
    second = mass[1] * length
    return LinkInertias(
        first=about[0] + about[3] + parameters["MOTOR1_I"] + second * length,
        second=about[1] + about[2] + parameters["MOTOR2_I"] + mass[3] * parameters["L3_L"] ** 2,
        # cos e = cos d cos g + sin d sin g, sin e = sin d cos g - cos d sin g, g the crank's angle.
        along=float(second * axial[1] + crank * (axial[3] * cosine - aside[3] * sine)),
        across=float(-second * aside[1] + crank * (axial[3] * sine + aside[3] * cosine)),
    )


def hand_torque(links: FloatArray, robot: Robot, force: FloatArray) -> FloatArray:
    """Torque on the links by a force at the hand, J^T F, (N, 2), N m.

    `links` (N, 2): angles of links 1 and 2 from the x axis.
    `robot`: with known lengths.
    `force` (N, 2): on the robot.
    """
    length, along, aside = robot.lengths_m
    sine, cosine = np.sin(links), np.cos(links)
    # J^T (2, 2) times F (2,): rows L1 n(a1) and along n(a2) - aside u(a2).
    lever1 = np.column_stack([-length * sine[:, 0], length * cosine[:, 0]])
    lever2 = np.column_stack(
        [-along * sine[:, 1] - aside * cosine[:, 1], along * cosine[:, 1] - aside * sine[:, 1]]
    )
    return np.column_stack([(lever1 * force).sum(axis=1), (lever2 * force).sum(axis=1)])


# Torques on a Kinarm's links, trial by trial, from its files.

#: Support of the smoothing of all torques, s; the links move at less than about 20 Hz.
SMOOTHED_S: Final = 0.06
#: Largest support as a share of the usual length of trials.
SMOOTHED_PART: Final = 0.3
#: Time between the samples that are used, s; smoothed torques hardly change within it.
STEP_S: Final = 0.005
#: Most samples that are used, evenly spaced over a long exam.
MOST_SAMPLES: Final = 100_000
#: Least speed of a moving link, rad/s; a slower link may stick.
MOVING_RAD_S: Final = 0.03

#: Speed scale below which dry friction is not fully developed, rad/s.
_CREEP_RAD_S: Final = 0.05

#: For any axes of the sensor, the hand's force is a weighted sum of these matrices times the
#: sensor's force: unchanged, turned by 90 degrees, mirrored, swapped.
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

    `velocity` (N, 2): of the links, rad/s.
    `inertial`, `motor` (N, 2): inertial torque of the motion; torque of the motors.
    `hand` (N, 2, 4): J^T F of the sensor's force in each of `FRAMES`.
    `trial` (N,): number of each sample's trial, from 0.
    `step_s`: time between two samples.
    """

    inertial: Annotated[FloatArray, "N 2"]
    motor: Annotated[FloatArray, "N 2"]
    hand: Annotated[FloatArray, "N 2 4"]
    velocity: Annotated[FloatArray, "N 2"]
    trial: Annotated[IntArray, "N"]
    step_s: float

    @property
    def moving_s(self) -> float:
        """Time during which the links move, s."""
        return len(self.trial) * self.step_s

    def without_friction(self) -> LinkTorques:
        """Return the torques with constant, dry and viscous friction of each axis projected out."""
        bases = []
        for speed in self.velocity.T:
            columns = np.column_stack([np.ones_like(speed), np.tanh(speed / _CREEP_RAD_S), speed])
            bases.append(np.linalg.qr(columns)[0])

        def projected(torque: FloatArray) -> FloatArray:
            # each axis (N,) less its projection onto that axis' basis (N, 3)
            axes = zip(torque.T, bases, strict=True)
            return np.column_stack(
                [
                    torque_of_axis - basis @ (basis.T @ torque_of_axis)
                    for torque_of_axis, basis in axes
                ]
            )

        return replace(
            self,
            inertial=projected(self.inertial),
            motor=projected(self.motor),
            hand=np.stack([projected(self.hand[:, :, i]) for i in range(4)], axis=2),
        )


def _friction_channels(files: Sequence[ExamFile], robot: Robot) -> tuple[str, ...]:
    """Channels of the motors' friction; empty unless all files have them."""
    friction = tuple(f"{robot.side.title()}_{name}" for name in FRICTION)
    whole = all(label in file.channels for label in friction for file in files)
    return friction if whole else ()


def link_torques(
    files: Sequence[ExamFile], motors: Sequence[str], inertias: LinkInertias, robot: Robot
) -> LinkTorques | None:
    """Torques of all trials while the links move; None if they never move."""
    friction = _friction_channels(files, robot)
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
        smoothed_motor = _filtered(motor, kernels.smooth, step)
        hand_torques = [hand_torque(links, robot, force @ frame.T) for frame in FRAMES]
        hand = np.stack(
            [_filtered(values, kernels.smooth, step) for values in hand_torques], axis=2
        )
        parts.append(tuple(values[moves] for values in (inertial, smoothed_motor, hand, velocity)))
        trial += [number] * int(moves.sum())
    if not trial:
        return None
    inertial, smoothed_motor, hand, velocity = (
        np.concatenate(values) for values in zip(*parts, strict=True)
    )
    return LinkTorques(
        inertial, smoothed_motor, hand, velocity, np.array(trial), step / files[0].rate_hz
    )


def _filtered(signal: FloatArray, weights: FloatArray, step: int) -> FloatArray:
    """Filter signals (F, 2) with a kernel, without the ends, every `step` samples."""
    return np.column_stack([np.correlate(column, weights, "valid")[::step] for column in signal.T])
