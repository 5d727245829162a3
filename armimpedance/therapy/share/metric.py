"""The patient's contribution: per sample (3), per movement (4), as a projection, over time.

(3) and (4) divide by torques that pass through zero, in horizontal rotation about the angle at
which the shoulder rests. The projection ``100 sum(tau_user tau_h) / sum(tau_h^2)`` does not: it is
the share of tau_h that tau_user follows over the movement. Where tau_h is constant all three are
the same. Samples in which the axis stands still do not count (`sliding`); when a value is valid
says `validity`. Where the arm is let down its weight drives the movement: 100 % is then to carry
the whole arm all the way down, and whoever pushes downwards contributes less, not more.
"""

from __future__ import annotations

from typing import Final, Literal

import numpy as np

from armimpedance.arrays import BoolArray, FloatArray
from armimpedance.errors import InputError
from armimpedance.therapy.arm.passive_arm import PassiveArm
from armimpedance.therapy.arm.torques import MovementTorques
from armimpedance.therapy.robot.sliding import slides
from armimpedance.therapy.robot.therapy_robot import TherapyRobot
from armimpedance.therapy.share.from_sums import Labels, contribution_from
from armimpedance.therapy.share.result import (
    Contribution,
    ContributionSoFar,
    RunningContribution,
    SampleContribution,
)
from armimpedance.therapy.share.sums import movement_rows, products_of, sums_of, window_sums
from armimpedance.therapy.share.uncertainty import error_law, projection, ratio, share
from armimpedance.therapy.share.validity import (
    LEAST_BESIDE_SO_FAR,
    projection_valid,
    range_notes,
    sample_valid,
    share_valid,
    usable_elastic,
)

#: Length of the running view's window, s.
WINDOW_S: Final = 0.5
#: How long the share so far must have been valid before it is shown, s: at the onset, arm and
#: robot may seem to differ for a tenth of a second.
STEADY_S: Final = 0.2


def contribution_of(
    torques: MovementTorques, robot: TherapyRobot, arm: PassiveArm, *, unrepeatable: bool = False
) -> Contribution:
    """A person's share in one movement, with standard errors.

    Parameters
    ----------
    torques : MovementTorques
    robot : TherapyRobot
        Identified.
    arm : PassiveArm
    unrepeatable : bool
        Go on where the passive repetitions of this axis did not agree.

    Raises
    ------
    InputError
        No motor torque, an axis on which the arm is no load, or an axis whose passive stiffness
        was not measured or did not repeat.
    """
    elastic = usable_elastic(arm, torques.axis_name, unrepeatable=unrepeatable)
    law = error_law(robot, arm, torques.axis_name, torques.sample_rate_hz)
    rows, counts = _rows(torques, robot)
    labels = Labels(
        torques.trial,
        torques.condition,
        torques.movement,
        torques.axis_name,
        float(torques.q[0]),
        float(torques.q[-1]),
        (*torques.notes, *range_notes(elastic, float(torques.q.min()), float(torques.q.max()))),
    )
    counted, whole = sums_of(rows[counts]), sums_of(rows)
    return contribution_from(counted, whole, law, labels, arm, torques.sample_rate_hz)


def _rows(torques: MovementTorques, robot: TherapyRobot) -> tuple[FloatArray, BoolArray]:
    """Rows (S, k) of a movement, and which of them count, (S,)."""
    axis = torques.axis
    rows = movement_rows(torques, float(robot.torque_limit_Nm[axis]))
    return rows, slides(torques.qd, float(robot.identified.rise_rad_s[axis]))


def sample_contribution(
    torques: MovementTorques, robot: TherapyRobot, arm: PassiveArm
) -> SampleContribution:
    """(3) of every sample, its standard error, and whether tau_h is well away from zero.

    Raises
    ------
    InputError
        The robot or this axis of the arm was not calibrated.
    """
    law = error_law(robot, arm, torques.axis_name, torques.sample_rate_hz)
    rows, counts = _rows(torques, robot)
    products = products_of(rows)
    value = ratio(products, law, law.kernel_gain)
    return SampleContribution(
        torques.time_s,
        torques.user,
        torques.arm,
        counts,
        value.percent,
        value.sd,
        counts & sample_valid(products, law),
    )


def running_contribution(
    torques: MovementTorques, robot: TherapyRobot, arm: PassiveArm, window_s: float = WINDOW_S
) -> RunningContribution:
    """The projection in a causal window over the movement, with its standard error.

    Parameters
    ----------
    window_s : float
        Seconds up to each sample.

    Raises
    ------
    InputError
        A window shorter than two samples, or as `sample_contribution`.
    """
    law = error_law(robot, arm, torques.axis_name, torques.sample_rate_hz)
    rows, counts = _rows(torques, robot)
    counted = rows * counts[:, None]
    sums = window_sums(counted, window_samples(window_s, torques.sample_rate_hz))
    value = projection(sums, law)
    return RunningContribution(
        window_s, torques.time_s, value.percent, value.sd, projection_valid(sums, value, law)
    )


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

    Raises
    ------
    InputError
        As `sample_contribution`.
    """
    law = error_law(robot, arm, torques.axis_name, torques.sample_rate_hz)
    rows, counts = _rows(torques, robot)
    sums = np.cumsum(products_of(rows * counts[:, None]), axis=0)
    if metric == "share":
        value = share(sums, law)
        valid = share_valid(sums, value, law, LEAST_BESIDE_SO_FAR)
    else:
        value = projection(sums, law)
        valid = projection_valid(sums, value, law)
    steady = _steady(valid, round(STEADY_S * torques.sample_rate_hz))
    return ContributionSoFar(metric, torques.time_s, value.percent, value.sd, steady)


def _steady(valid: BoolArray, samples: int) -> BoolArray:
    """Where the last so many samples are all valid, (S,); none before there are as many."""
    total = np.concatenate([np.zeros(samples), np.cumsum(valid)])
    return np.asarray(total[samples:] - total[:-samples] == samples)


def window_samples(window_s: float, sample_rate_hz: float) -> int:
    """Samples of a running window.

    Raises
    ------
    InputError
        Fewer than two, or more than a minute.
    """
    if not 2 <= window_s * sample_rate_hz <= 60 * sample_rate_hz:
        raise InputError(f"a running window of {window_s} s", expected="two samples to 60 s")
    return round(window_s * sample_rate_hz)
