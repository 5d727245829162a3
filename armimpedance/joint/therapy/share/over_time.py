"""The contribution over a movement: of every sample (3), in a window, and so far.

Sums of torques and their judgement are those of a whole movement (`of_movement`).
"""

from __future__ import annotations

from typing import Final, Literal

import numpy as np

from armimpedance.core.arrays import BoolArray
from armimpedance.core.errors import InputError
from armimpedance.joint.therapy.arm.movements import MovementTorques
from armimpedance.joint.therapy.arm.passive_arm import PassiveArm
from armimpedance.joint.therapy.robot.therapy_robot import TherapyRobot
from armimpedance.joint.therapy.share.error_law import error_law, products_of, window_sums
from armimpedance.joint.therapy.share.judgement import Judgement
from armimpedance.joint.therapy.share.of_movement import rows_of
from armimpedance.joint.therapy.share.result import (
    ContributionSoFar,
    RunningContribution,
    SampleContribution,
)

#: Length of the running view's window, s.
WINDOW_S: Final = 0.5
#: How long the share so far must have been valid before it is shown, s: at the onset, arm and
#: robot may seem to differ for a tenth of a second.
STEADY_S: Final = 0.2


def sample_contribution(
    torques: MovementTorques, robot: TherapyRobot, arm: PassiveArm
) -> SampleContribution:
    """(3) of every sample, its standard error, and whether tau_h is well away from zero.

    Parameters
    ----------
    torques : MovementTorques
        What acts on the moving axis.
    robot : TherapyRobot
        Identified.
    arm : PassiveArm
        The person's, calibrated in this robot.

    Returns
    -------
    SampleContribution

    Raises
    ------
    InputError
        The robot or this axis of the arm was not calibrated.
    """
    law = error_law(robot, arm, torques.axis_name, torques.sample_rate_hz)
    rows, counts = rows_of(torques, robot)
    each = Judgement(products_of(rows), law).of_sample
    return SampleContribution(
        torques.time_s,
        torques.user,
        torques.arm,
        counts,
        each.percent,
        each.sd,
        counts & each.valid,
    )


def running_contribution(
    torques: MovementTorques, robot: TherapyRobot, arm: PassiveArm, window_s: float = WINDOW_S
) -> RunningContribution:
    """The projection in a causal window over the movement, with its standard error.

    `window_s`: seconds up to each sample.
    Raises InputError: a window shorter than two samples, or as `sample_contribution`.
    """
    law = error_law(robot, arm, torques.axis_name, torques.sample_rate_hz)
    rows, counts = rows_of(torques, robot)
    window = window_samples(window_s, torques.sample_rate_hz)
    told = Judgement(window_sums(rows * counts[:, None], window), law).projection
    return RunningContribution(window_s, torques.time_s, told.percent, told.sd, told.valid)


def contribution_so_far(
    torques: MovementTorques,
    robot: TherapyRobot,
    arm: PassiveArm,
    metric: Literal["share", "projection"] = "share",
) -> ContributionSoFar:
    """The share, or the projection, from the onset up to each sample, with its standard error.

    A window shorter than the movement cannot tell arm and robot apart where either changes little;
    the sums so far can, and end at the value of the whole movement. The share so far is valid later
    than that of a movement that is complete: nobody knows yet what follows.

    `torques`: what acts on the moving axis.
    `robot`: identified.
    `arm`: the person's, calibrated in this robot.
    `metric`: which of the two.
    Raises InputError: the robot or this axis of the arm was not calibrated.
    """
    law = error_law(robot, arm, torques.axis_name, torques.sample_rate_hz)
    rows, counts = rows_of(torques, robot)
    sums = np.cumsum(products_of(rows * counts[:, None]), axis=0)
    judgement = Judgement(sums, law, so_far=True)
    told = judgement.share if metric == "share" else judgement.projection
    steady = _steady(told.valid, round(STEADY_S * torques.sample_rate_hz))
    return ContributionSoFar(metric, torques.time_s, told.percent, told.sd, steady)


def _steady(valid: BoolArray, samples: int) -> BoolArray:
    """Where the last so many samples are all valid, (S,); none before there are as many."""
    total = np.concatenate([np.zeros(samples), np.cumsum(valid)])
    return np.asarray(total[samples:] - total[:-samples] == samples)


def window_samples(window_s: float, sample_rate_hz: float) -> int:
    """Samples of a running window.

    Raises InputError: fewer than two, or more than a minute.
    """
    if not 2 <= window_s * sample_rate_hz <= 60 * sample_rate_hz:
        raise InputError(f"a running window of {window_s} s", expected="two samples to 60 s")
    return round(window_s * sample_rate_hz)
