"""Whose force a Kinarm's sensor holds, and in which unit, by the robot's own dynamics.

The links obey ``inertial torque = motors + J^T F`` with F the force by the limb on the robot. Held
against it with the sensor's force as F and as -F, friction and the size of the inertias left open,
one of the two balances and the other does not; a factor beside F tells the unit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Final, Literal

import numpy as np

from armimpedance.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.findings import Finding
from armimpedance.recordings.c3d_file import C3DFile
from armimpedance.recordings.kinarm.channels import FRICTION, channels, force_labels, link_labels
from armimpedance.recordings.kinarm.dynamics import LinkInertias, hand_torque, link_inertias
from armimpedance.recordings.kinarm.robot import Robot
from armimpedance.signals import spline_kernels

ForceBy = Literal["limb", "device"]

#: Support of the smoothing of all torques alike, s: the links move below some 20 Hz.
SMOOTHED_S: Final = 0.06
#: One sample in so much time is looked at; between them the smoothed torques do not change, s.
STEP_S: Final = 0.005
#: A link that turns slower than this may stick, rad/s.
MOVING_RAD_S: Final = 0.03
#: Less movement than this says nothing, s.
SHORTEST_S: Final = 0.2
#: How far an inertia may be from the stated one: what is bolted to a link is not in the file.
INERTIA_FACTOR: Final = (0.5, 2.0)
#: The torques balance where this part of their mean square, at most, is left over.
UNBALANCED: Final = 0.4
#: Less left over than this is friction and unstated inertia, not another unit of the force.
WELL_BALANCED: Final = 0.05
#: The other sign must leave so many times more.
CLEARLY_WORSE: Final = 3.0
#: At least this part of the trials must say the same.
AGREEING: Final = 0.8
#: Motors that do less than this beside the links' inertia (mean square) show nothing: where another
#: motor moved the links, the limb's inertia would look like the device's force.
MOTORS_COUNT: Final = 0.05
#: A factor beyond which the force is in another unit, or the sensor's calibration is off.
SCALE_FACTOR: Final = 1.5

#: Below this speed friction is not yet full, rad/s.
_CREEP_RAD_S: Final = 0.05


@dataclass(frozen=True)
class Balance:
    """What the robot's dynamics say of the force sensor.

    Attributes
    ----------
    force_by : {"limb", "device"} or None
        Whose force the sensor holds; None: cannot be told.
    evidence : str
        The numbers that show it; where it cannot be told, why not.
    scale : float or None
        Newtons per unit of the channel, as the motors show it; None where noise hides it.
    """

    force_by: ForceBy | None
    evidence: str
    scale: float | None = None


@dataclass(frozen=True)
class _Torques(FrozenRecord):
    """Smoothed torques of moving links, N samples of 2 axes, Nm, and each sample's trial."""

    inertial: Annotated[FloatArray, "N 2"]
    motor: Annotated[FloatArray, "N 2"]
    hand: Annotated[FloatArray, "N 2"]
    velocity: Annotated[FloatArray, "N 2"]
    trial: Annotated[IntArray, "N"]


def force_balance(files: Sequence[C3DFile], common: C3DFile, robot: Robot) -> Balance:
    """Hold the sensor's force against the robot's own inertias and motors.

    Parameters
    ----------
    files : sequence of C3DFile
        One per trial, sound.
    common : C3DFile
        What all trials share.
    robot : Robot
        With the handle where it is.
    """
    inertias = link_inertias(common, robot)
    if inertias is None:
        return Balance(None, "common.c3d does not hold the inertias of the robot's links")
    motors = tuple(f"{robot.side.title()}_M{i}TorCMD" for i in (1, 2))
    needed = (*motors, *link_labels(robot.side))
    if any(label not in c3d.analog_labels for label in needed for c3d in files):
        return Balance(None, "the motors' torques or the links' angles were not recorded")
    commanded = [_columns(c3d, motors) for c3d in files]
    if not all(np.isfinite(each).all() for each in commanded):
        return Balance(None, "the motors' torques are not finite")
    if not any(each.any() for each in commanded):
        return Balance(None, "the motors' torques are zero throughout")
    torques = _torques(files, motors, inertias, robot)
    moving_s = 0.0 if torques is None else len(torques.trial) * STEP_S
    if torques is None or moving_s < SHORTEST_S:
        text = f"the robot moves for {moving_s:.2g} s only, of {SHORTEST_S:g} s needed"
        return Balance(None, text)
    return _judged(torques)


def _columns(c3d: C3DFile, labels: Sequence[str]) -> FloatArray:
    """Channels of one trial as they are, finite or not, (F, len(labels))."""
    return c3d.analog[:, [c3d.analog_labels.index(label) for label in labels]]


def _torques(
    files: Sequence[C3DFile], motors: Sequence[str], inertias: LinkInertias, robot: Robot
) -> _Torques | None:
    """The torques of all trials where the links move; None where they never do."""
    friction = tuple(f"{robot.side.title()}_{name}" for name in FRICTION)
    if any(label not in c3d.analog_labels for label in friction for c3d in files):
        friction = ()
    kernels = spline_kernels(SMOOTHED_S, files[0].rate_hz)
    step = max(1, round(STEP_S * files[0].rate_hz))
    parts: list[tuple[FloatArray, ...]] = []
    trial: list[int] = []
    for number, c3d in enumerate(files):
        if c3d.frames <= 2 * kernels.half:
            continue
        links = channels([c3d], *link_labels(robot.side))
        force = channels([c3d], *force_labels(robot.side))
        motor = _columns(c3d, motors)
        if friction:
            motor = motor + np.nan_to_num(_columns(c3d, friction))
        angle, velocity, acceleration = (
            _filtered(links, w, step) for w in (kernels.smooth, kernels.first, kernels.second)
        )
        moves = (np.abs(velocity) > MOVING_RAD_S).any(axis=1)
        inertial = inertias.torque(angle, velocity, acceleration)
        pushed = _filtered(motor, kernels.smooth, step)
        hand = _filtered(hand_torque(links, robot, force), kernels.smooth, step)
        parts.append(tuple(each[moves] for each in (inertial, pushed, hand, velocity)))
        trial += [number] * int(moves.sum())
    if not trial:
        return None
    inertial, pushed, hand, velocity = (np.concatenate(each) for each in zip(*parts, strict=True))
    return _Torques(inertial, pushed, hand, velocity, np.array(trial))


def _filtered(signal: FloatArray, weights: FloatArray, step: int) -> FloatArray:
    """Signals (F, 2) through a kernel, where it fits in, every `step` samples."""
    columns = [np.correlate(column, weights, "valid")[::step] for column in signal.T]
    return np.column_stack(columns)


def _judged(torques: _Torques) -> Balance:
    """Which sign balances, and the factor beside the force."""
    free = _without_friction(torques)
    share = {scale: _unbalanced(free, scale) for scale in (1.0, -1.0)}
    winner = min(share, key=lambda scale: share[scale].mean())
    if (free.motor**2).sum() < MOTORS_COUNT * (free.inertial**2).sum():
        return Balance(None, "the motors do hardly anything beside the links' inertia")
    factor: float | None = _factor(free)
    if factor is not None and _other_unit(factor):
        # A noisy sensor shows a small factor as well, but with it the torques balance no better.
        scaled = {scale: _unbalanced(free, scale) for scale in (factor, -factor)}
        plain = share[winner].mean()
        if plain > WELL_BALANCED and CLEARLY_WORSE * scaled[factor].mean() < plain:
            share, winner = scaled, factor
        else:
            factor = None
    worse = share[-winner].mean() / share[winner].mean()
    agree = _agreeing(free, winner)
    evidence = f"{_equation(free)}; {_shares(share, winner)}"
    if share[winner].mean() > UNBALANCED:
        return Balance(None, f"the robot's torques do not balance with either sign: {evidence}")
    if worse < CLEARLY_WORSE:
        return Balance(None, f"both signs balance alike: {evidence}")
    n_trials = len(np.unique(torques.trial))
    evidence += f"; so say {agree} of {n_trials} trials"
    if agree < AGREEING * n_trials:
        return Balance(None, f"the trials contradict each other: {evidence}")
    return Balance("limb" if winner > 0 else "device", evidence, factor)


def _other_unit(factor: float) -> bool:
    return not 1 / SCALE_FACTOR < abs(factor) < SCALE_FACTOR


def _without_friction(torques: _Torques) -> _Torques:
    """The torques after what is constant, dry or viscous in each axis is projected out."""
    bases = []
    for speed in torques.velocity.T:
        columns = np.column_stack([np.ones_like(speed), np.tanh(speed / _CREEP_RAD_S), speed])
        bases.append(np.linalg.qr(columns)[0])

    def projected(torque: FloatArray) -> FloatArray:
        # Each axis (N,) less its part in the span of that axis' basis (N, 3).
        axes = zip(torque.T, bases, strict=True)
        return np.column_stack([each - basis @ (basis.T @ each) for each, basis in axes])

    return replace(
        torques,
        inertial=projected(torques.inertial),
        motor=projected(torques.motor),
        hand=projected(torques.hand),
    )


def _residual(torques: _Torques, scale: float) -> FloatArray:
    """motors + scale J^T F - g inertial torque, (N, 2), each axis with its own best g."""
    pushed = torques.motor + scale * torques.hand
    size = (torques.inertial**2).sum(axis=0)
    along = (pushed * torques.inertial).sum(axis=0)
    g = np.clip(along / np.where(size > 0, size, 1.0), *INERTIA_FACTOR)
    return pushed - g * torques.inertial


def _unbalanced(torques: _Torques, scale: float) -> FloatArray:
    """The part of each axis' mean square that is left over, (2,)."""
    parts = (torques.motor, scale * torques.hand, torques.inertial)
    whole = sum((part**2).mean(axis=0) for part in parts)
    left = (_residual(torques, scale) ** 2).mean(axis=0)
    return np.asarray(left / np.where(whole > 0, whole, 1.0))


def _agreeing(torques: _Torques, scale: float) -> int:
    """How many trials are balanced better with this sign than with the other."""
    squares = [(_residual(torques, s) ** 2).sum(axis=1) for s in (scale, -scale)]
    sums = [np.bincount(torques.trial, weights=each) for each in squares]
    seen = np.bincount(torques.trial) > 0
    return int((sums[0] < sums[1])[seen].sum())


def _factor(torques: _Torques) -> float:
    """The factor k in motors = g inertial - k J^T F."""
    zero = np.zeros_like(torques.inertial[:, 0])
    # [inertial_1  0  J^T F_1; 0  inertial_2  J^T F_2] (2 N, 3) times (g1, g2, -k) (3,) = motors
    # (2 N,), by least squares.
    columns = np.block(
        [
            [torques.inertial[:, :1], zero[:, None], torques.hand[:, :1]],
            [zero[:, None], torques.inertial[:, 1:], torques.hand[:, 1:]],
        ]
    )
    found = np.linalg.lstsq(columns, torques.motor.T.ravel(), rcond=None)[0]
    return float(-found[2])


def _equation(torques: _Torques) -> str:
    """The torques of each link as an equation, fitted freely."""
    texts = []
    for axis in (0, 1):
        columns = np.column_stack([torques.motor[:, axis], torques.hand[:, axis]])
        # [motors  J^T F] (N, 2) times (a, b) (2,) = inertial torque (N,), by least squares.
        a, b = np.linalg.lstsq(columns, torques.inertial[:, axis], rcond=None)[0]
        sign = "-" if b < 0 else "+"
        texts.append(f"{a:.2f} motors {sign} {abs(b):.2f} J^T F on link {axis + 1}")
    return f"inertial torque = {', '.join(texts)}"


def _shares(share: dict[float, FloatArray], winner: float) -> str:
    told = {scale: 100 * part.mean() for scale, part in share.items()}
    names = {True: "by the limb", False: "by the device"}
    first, second = (f"{names[s > 0]} {told[s]:.2g} %" for s in (winner, -winner))
    return f"unbalanced {first}, {second}"


def force_findings(told: ForceBy | None, balance: Balance) -> list[Finding]:
    """What the balance says of the sign and of the unit, beside what the user told."""
    if balance.force_by is None:
        text = f"as told, by the {told}; it cannot be held against the robot: {balance.evidence}"
        return [Finding("force sign", "cannot tell", text)]
    if told is None or told == balance.force_by:
        text = f"by the {balance.force_by}{'' if told is None else ', as told'}: {balance.evidence}"
        sign = Finding("force sign", "ok", text)
    else:
        text = (
            f"told by the {told}, but the robot's own dynamics say by the {balance.force_by}: "
            f"{balance.evidence}; leave --force-by out, or say --force-by {balance.force_by}"
        )
        sign = Finding("force sign", "warning", text)
    return [sign, *_scale_findings(balance)]


def _scale_findings(balance: Balance) -> list[Finding]:
    smallest = f"a factor of {SCALE_FACTOR:g}"
    if balance.scale is None:
        text = "the noise hides the unit of the force"
        return [Finding("force scale", "cannot tell", text)]
    size = abs(balance.scale)
    if not _other_unit(size):
        return [Finding("force scale", "ok", f"{size:.2f} N per unit", smallest)]
    text = (
        f"the motors show {size:.3g} N per unit of the sensor's channels: another unit "
        "(kgf 9.81, lbf 4.45, mN 0.001), or a calibration that is off; nothing was changed"
    )
    return [Finding("force scale", "warning", text, smallest)]
