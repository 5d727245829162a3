"""Sign and unit of a Kinarm's force sensor, from the robot's own dynamics.

The links obey ``inertial torque = motors + J^T F`` with F the force by the limb on the robot. The
equation is tested with the sensor's force as F and as -F, with friction and a factor of the
inertias fitted: it balances for one sign and not for the other. A factor of F shows the unit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.findings import Finding
from armimpedance.recordings.kinarm.channels import link_labels
from armimpedance.recordings.kinarm.dynamics import FRAMES, LinkTorques, link_inertias, link_torques
from armimpedance.recordings.kinarm.exam_file import ExamFile
from armimpedance.recordings.kinarm.robot import Robot

ForceBy = Literal["limb", "device"]

#: Least time of movement for the test, s.
SHORTEST_S: Final = 0.2
#: Range of the inertias' factor: parts that are bolted to a link are not in the file.
INERTIA_FACTOR: Final = (0.5, 2.0)
#: Largest residual, as a share of the torques' mean square, with which they balance.
UNBALANCED: Final = 0.4
#: A smaller residual is due to friction and unstated inertia, not to another unit of the force.
WELL_BALANCED: Final = 0.05
#: The residual with the other sign must be this many times larger.
CLEARLY_WORSE: Final = 3.0
#: Least share of the trials that must give the same sign.
AGREEING: Final = 0.8
#: Fewest trials for a test of the sensor's axes: fewer have too few directions.
TRIALS_FOR_AXES: Final = 4
#: Least mean square of the motors' torque relative to the inertial torque. With less, another motor
#: moved the links, and the limb's inertia would look like the device's force.
MOTORS_COUNT: Final = 0.05
#: Factor beyond which the force is in another unit, or the sensor's calibration is wrong.
SCALE_FACTOR: Final = 1.5

#: Weights of `FRAMES` for a force in the axes of the hand.
_AS_IT_IS: Final = np.array([1.0, 0.0, 0.0, 0.0])


@dataclass(frozen=True)
class Balance:
    """Result of the test of the force sensor by the robot's dynamics.

    `force_by`: whose force the sensor holds; None: undetermined.
    `evidence`: the numbers that show it, or why it is undetermined.
    `scale`: newtons per unit of the channel, from the motors; None if noise hides it.
    `axes`: the hand's force in terms of the sensor's channels, if these have other axes.
    """

    force_by: ForceBy | None
    evidence: str
    scale: float | None = None
    axes: str = ""


def force_balance(files: Sequence[ExamFile], common: ExamFile, robot: Robot) -> Balance:
    """Test the sensor's force against the robot's own inertias and motors.

    `files`: one valid file per trial.
    `common`: data common to all trials.
    `robot`: with the actual position of the handle.
    """
    inertias = link_inertias(common, robot)
    if inertias is None:
        return Balance(None, "common.c3d does not hold the inertias of the robot's links")
    motors = tuple(f"{robot.side.title()}_M{i}TorCMD" for i in (1, 2))
    needed = (*motors, *link_labels(robot.side))
    if any(label not in file.channels for label in needed for file in files):
        return Balance(None, "the motors' torques or the links' angles were not recorded")
    if not all(np.isfinite(file.columns(motors)).all() for file in files):
        return Balance(None, "the motors' torques are not finite")
    if not any(file.columns(motors).any() for file in files):
        return Balance(None, "the motors' torques are zero throughout")
    torques = link_torques(files, motors, inertias, robot)
    moving_s = 0.0 if torques is None else torques.moving_s
    if torques is None or moving_s < SHORTEST_S:
        text = f"the robot moves for {moving_s:.2g} s only, of {SHORTEST_S:g} s needed"
        return Balance(None, text)
    return _judged(torques.without_friction())


def _judged(torques: LinkTorques) -> Balance:
    """Determine the sign that balances, and the force's factor, from torques without friction."""
    if (torques.motor**2).sum() < MOTORS_COUNT * (torques.inertial**2).sum():
        return Balance(None, "the motors do hardly anything beside the links' inertia")
    residuals = {scale: _unbalanced(torques, scale * _AS_IT_IS) for scale in (1.0, -1.0)}
    winner = min(residuals, key=lambda scale: residuals[scale])
    plain = residuals[winner]
    factor: float | None = float(_weights(torques, 1)[0])
    if factor is not None and _other_unit(factor):
        # a noisy sensor also gives a small factor, but then the torques balance no better
        scaled = {scale: _unbalanced(torques, scale * _AS_IT_IS) for scale in (factor, -factor)}
        if _explains(scaled[factor], plain):
            residuals, winner = scaled, factor
        else:
            factor = None
    evidence = f"{_equation(torques)}; {_shares(residuals, winner)}"
    agree, n_trials = _agreeing(torques, winner), len(np.unique(torques.trial))
    weights = _weights(torques, 4)
    residual = _unbalanced(torques, weights)
    mostly = np.linalg.norm(weights[1:]) > abs(weights[0])
    explained = _explains(residual, residuals[winner]) or (mostly and _explains(residual, plain))
    if explained and n_trials >= TRIALS_FOR_AXES:
        return Balance(None, f"its axes are not those of the hand: {evidence}", axes=_axes(weights))
    if residuals[winner] > UNBALANCED:
        return Balance(None, f"the robot's torques do not balance with either sign: {evidence}")
    if residuals[-winner] < CLEARLY_WORSE * residuals[winner]:
        return Balance(None, f"both signs balance alike: {evidence}")
    evidence += f"; so say {agree} of {n_trials} trials"
    if agree < AGREEING * n_trials:
        return Balance(None, f"the trials contradict each other: {evidence}")
    return Balance("limb" if winner > 0 else "device", evidence, factor)


def _explains(residual: float, plain: float) -> bool:
    """True if the smaller residual cannot be explained by friction and noise alone."""
    return plain > WELL_BALANCED and CLEARLY_WORSE * residual < plain


def _other_unit(factor: float) -> bool:
    return not 1 / SCALE_FACTOR < abs(factor) < SCALE_FACTOR


def _residual(torques: LinkTorques, weights: FloatArray) -> FloatArray:
    """Residuals motors + J^T F - g inertial torque (N, 2), g fitted per axis; F by `weights`."""
    # hand (N, 2, 4) times the weights of the frames (4,).
    pushed = torques.motor + torques.hand @ weights
    size = (torques.inertial**2).sum(axis=0)
    along = (pushed * torques.inertial).sum(axis=0)
    g = np.clip(along / np.where(size > 0, size, 1.0), *INERTIA_FACTOR)
    return pushed - g * torques.inertial


def _unbalanced(torques: LinkTorques, weights: FloatArray) -> float:
    """Mean square of the residuals as a share of the torques', mean of both axes."""
    parts = (torques.motor, torques.hand @ weights, torques.inertial)
    total = sum((part**2).mean(axis=0) for part in parts)
    residual = (_residual(torques, weights) ** 2).mean(axis=0)
    return float((residual / np.where(total > 0, total, 1.0)).mean())


def _agreeing(torques: LinkTorques, scale: float) -> int:
    """Number of trials that balance better with this sign than with the other."""
    squares = [(_residual(torques, s * _AS_IT_IS) ** 2).sum(axis=1) for s in (scale, -scale)]
    sums = [np.bincount(torques.trial, weights=square) for square in squares]
    seen = np.bincount(torques.trial) > 0
    return int((sums[0] < sums[1])[seen].sum())


def _weights(torques: LinkTorques, frames: int) -> FloatArray:
    """Fit weights (4,) of the first frames to the motors: motors = g inertial - J^T F."""
    zero = np.zeros((len(torques.inertial), 1))
    # [inertial_1  0  hand_1; 0  inertial_2  hand_2] (2 N, 2 + frames) times (g1, g2, -weights)
    # (2 + frames,) = motors (2 N,), by least squares.
    columns = np.block(
        [
            [torques.inertial[:, :1], zero, torques.hand[:, 0, :frames]],
            [zero, torques.inertial[:, 1:], torques.hand[:, 1, :frames]],
        ]
    )
    solution = np.linalg.lstsq(columns, torques.motor.T.ravel(), rcond=None)[0]
    return np.append(-solution[2:], np.zeros(4 - frames))


def _axes(weights: FloatArray) -> str:
    """Text of the force on the robot in terms of the sensor's axes."""
    # weights (4,) times frames (4, 2, 2).
    (xx, xy), (yx, yy) = np.tensordot(weights, FRAMES, axes=1)
    return f"Fx = {xx:+.2f} X {xy:+.2f} Y, Fy = {yx:+.2f} X {yy:+.2f} Y"


def _equation(torques: LinkTorques) -> str:
    """Text of the equation of each link's torques, with fitted coefficients."""
    texts = []
    for axis in (0, 1):
        columns = np.column_stack([torques.motor[:, axis], torques.hand[:, axis, 0]])
        # [motors  J^T F] (N, 2) times (a, b) (2,) = inertial torque (N,), by least squares.
        a, b = np.linalg.lstsq(columns, torques.inertial[:, axis], rcond=None)[0]
        sign = "-" if b < 0 else "+"
        texts.append(f"{a:.2f} motors {sign} {abs(b):.2f} J^T F on link {axis + 1}")
    return f"inertial torque = {', '.join(texts)}"


def _shares(share: dict[float, float], winner: float) -> str:
    names = {True: "by the limb", False: "by the device"}
    first, second = (f"{names[s > 0]} {100 * share[s]:.2g} %" for s in (winner, -winner))
    return f"unbalanced {first}, {second}"


def force_findings(told: ForceBy | None, balance: Balance) -> list[Finding]:
    """Findings on the force's sign and unit: the balance compared with the user's statement."""
    if balance.force_by is None:
        text = f"as told, by the {told}; it cannot be held against the robot: {balance.evidence}"
        sign = Finding("force sign", "cannot tell", text)
        return [sign, *_axes_findings(balance)]
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


def _axes_findings(balance: Balance) -> list[Finding]:
    if not balance.axes:
        return []
    text = (
        f"the robot's torques balance with {balance.axes} of the sensor's X and Y: the sensor is "
        "turned, or its axes are swapped or mirrored; nothing was changed"
    )
    return [Finding("force axes", "warning", text)]


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
