"""The dynamics of a Kinarm's links, and the torques on them, from the inertias in `common.c3d`.

Two motors at the shoulder turn link 1 and, through a crank (link 3) and a bar (link 4) that runs
along link 1, link 2. With the links' absolute angles a1, a2 as coordinates,

    A a1'' + B a2'' + B' a2'^2 = tau_1,        B a1'' + D a2'' - B' a1'^2 = tau_2,

    A = I1 + m1 |c1|^2 + I4 + m4 |c4|^2 + J1 + m2 L1^2,   D = I2 + m2 |c2|^2 + I3 + m3 |c3|^2 + J2
    + m4 L3^2,   B = m2 L1 (c2x cos d - c2y sin d) + m4 L3 (c4x cos e + c4y sin e),   B' = dB/dd,

d = a2 - a1, e = d - (angle between link 2 and the crank), c = (along, across) the centre of mass
from the link's own joint, J the motors' inertias. What acts on the links is tau = motors + J^T F,
with F the force **by the limb on the robot** at the hand and J = dX/d(a1, a2).
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

#: Without these there are no links to speak of.
_NEEDED: Final = ("L1_I", "L1_M", "L1_C_AXIAL", "L2_I", "L2_M", "L2_C_AXIAL")


@dataclass(frozen=True)
class LinkInertias:
    """What the equations above need of the links, SI units.

    `first`, `second`: a and D.
    `along`, `across`: B = along cos d + across sin d.
    """

    first: float
    second: float
    along: float
    across: float

    def torque(
        self, angle: FloatArray, velocity: FloatArray, acceleration: FloatArray
    ) -> FloatArray:
        """Torque that this motion of the links takes, (N, 2) in N m.

        `angle`, `velocity`, `acceleration` (N, 2): of links 1 and 2, from the x axis.
        """
        apart = angle[:, 1] - angle[:, 0]
        coupling = self.along * np.cos(apart) + self.across * np.sin(apart)
        slope = -self.along * np.sin(apart) + self.across * np.cos(apart)
        a1, a2 = acceleration.T
        v1, v2 = velocity.T
        # [A B; B D] (2, 2) times acceleration (2,) plus B' (v2^2, -v1^2).
        first = self.first * a1 + coupling * a2 + slope * v2**2
        return np.column_stack([first, coupling * a1 + self.second * a2 - slope * v1**2])


def link_inertias(common: ExamFile, robot: Robot) -> LinkInertias | None:
    """The inertias of one side's links; None where `common.c3d` does not hold links 1 and 2.

    What else is not stated (crank, bar, motors) counts as massless: the balance leaves the size of
    the inertias open.

    `robot`: its first link's length counts; an exoskeleton's is set to the subject.
    """
    group = f"{robot.side.upper()}_KINARM"
    names = [f"L{i}_{what}" for i in (1, 2, 3, 4) for what in ("I", "M", "C_AXIAL", "C_ANTERIOR")]
    found = {
        n: common.parameters.number(group, n) for n in (*names, "L3_L", "MOTOR1_I", "MOTOR2_I")
    }
    if robot.links_m is None or not all(map(found.get, _NEEDED)):
        return None
    known = {name: value or 0.0 for name, value in found.items()}
    # "Anterior" is counter-clockwise on the right and clockwise on the left.
    turn = -1.0 if robot.side == "left" else 1.0
    mass, axial, anterior = (
        [known[f"L{i}_{what}"] for i in (1, 2, 3, 4)] for what in ("M", "C_AXIAL", "C_ANTERIOR")
    )
    aside = [turn * distance for distance in anterior]
    about = [known[f"L{i + 1}_I"] + mass[i] * (axial[i] ** 2 + aside[i] ** 2) for i in range(4)]
    stated = common.parameters.number(group, "L2_L5_ANGLE")
    angle = stated if stated and robot.kind == "exoskeleton" else 0.0
    crank = mass[3] * known["L3_L"]
    cosine, sine = np.cos(turn * angle), np.sin(turn * angle)
    length = float(robot.lengths_m[0])
    second = mass[1] * length
    return LinkInertias(
        first=about[0] + about[3] + known["MOTOR1_I"] + second * length,
        second=about[1] + about[2] + known["MOTOR2_I"] + mass[3] * known["L3_L"] ** 2,
        # cos e = cos d cos g + sin d sin g, sin e = sin d cos g - cos d sin g, g the crank's angle.
        along=float(second * axial[1] + crank * (axial[3] * cosine - aside[3] * sine)),
        across=float(-second * aside[1] + crank * (axial[3] * sine + aside[3] * cosine)),
    )


def hand_torque(links: FloatArray, robot: Robot, force: FloatArray) -> FloatArray:
    """Torque on the links from a force at the hand, J^T F, (N, 2) in N m.

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


# The torques on a Kinarm's links, trial by trial, as far as its files show them.

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

    `velocity` (N, 2).
    `inertial`, `motor` (N, 2): what the motion takes; what the motors do.
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


def _friction_channels(files: Sequence[ExamFile], robot: Robot) -> tuple[str, ...]:
    """The channels of the motors' friction, where all files have them."""
    friction = tuple(f"{robot.side.title()}_{name}" for name in FRICTION)
    whole = all(label in file.channels for label in friction for file in files)
    return friction if whole else ()


def link_torques(
    files: Sequence[ExamFile], motors: Sequence[str], inertias: LinkInertias, robot: Robot
) -> LinkTorques | None:
    """The torques of all trials where the links move; None where they never do."""
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
