"""The patient's contribution to a movement: as a share, as a projection, (4) and (19).

(4) divides by torques that pass through zero, in horizontal rotation about the angle at which the
shoulder rests. The projection ``100 sum(tau_user tau_h) / sum(tau_h^2)`` does not: it is the share
of tau_h that tau_user follows over the movement. Where tau_h is constant both are the same.
Samples in which the axis stands still do not count (`sliding`); when a value is valid says
`judgement`. Where the arm is let down its weight drives the movement: 100 % is then to carry the
whole arm all the way down, and whoever pushes downwards contributes less, not more.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.joint.therapy.arm.passive_arm import PassiveArm
from armimpedance.joint.therapy.arm.torques import MovementTorques
from armimpedance.joint.therapy.robot.sliding import slides
from armimpedance.joint.therapy.robot.therapy_robot import TherapyRobot
from armimpedance.joint.therapy.share.error_law import VarianceShares, error_law
from armimpedance.joint.therapy.share.judgement import Judged, Judgement
from armimpedance.joint.therapy.share.notes import (
    course_notes,
    direction_notes,
    range_notes,
    ratio_notes,
    reference_notes,
    refuse_no_torque,
    usable_elastic,
)
from armimpedance.joint.therapy.share.reference import reference_contribution
from armimpedance.joint.therapy.share.result import Contribution, Metric, ReferenceContribution
from armimpedance.joint.therapy.share.sums import (
    ABS_ARM,
    ARM,
    LOWERING,
    ONE,
    SATURATED,
    USER,
    movement_rows,
    sums_of,
)


@dataclass(frozen=True)
class Labels:
    """What a movement is called, and where it starts and ends."""

    trial: str
    condition: str
    movement: str
    axis_name: str
    from_rad: float
    to_rad: float
    notes: tuple[str, ...] = ()


def contribution_of(
    torques: MovementTorques, robot: TherapyRobot, arm: PassiveArm, *, unrepeatable: bool = False
) -> Contribution:
    """A person's share in one movement, with standard errors.

    Parameters
    ----------
    torques : MovementTorques
        What acts on the moving axis.
    robot : TherapyRobot
        Identified.
    arm : PassiveArm
        The person's, calibrated in this robot.
    unrepeatable : bool
        Go on where the passive repetitions of this axis did not agree.

    Returns
    -------
    Contribution

    Raises
    ------
    InputError
        No motor torque, an axis on which the arm is no load, or an axis whose passive stiffness
        was not measured or did not repeat.
    """
    elastic = usable_elastic(arm, torques.axis_name, unrepeatable=unrepeatable)
    law = error_law(robot, arm, torques.axis_name, torques.sample_rate_hz)
    rows, counts = rows_of(torques, robot)
    labels = Labels(
        torques.trial,
        torques.condition,
        torques.movement,
        torques.axis_name,
        float(torques.q[0]),
        float(torques.q[-1]),
        (
            *torques.notes,
            *range_notes(elastic, float(torques.q.min()), float(torques.q.max())),
            *direction_notes(elastic, float(torques.q[0]), float(torques.q[-1])),
        ),
    )
    judgement = Judgement(sums_of(rows[counts]), law)
    return contribution_from(judgement, sums_of(rows), labels, arm, torques.sample_rate_hz)


def rows_of(torques: MovementTorques, robot: TherapyRobot) -> tuple[FloatArray, BoolArray]:
    """Rows (S, k) of a movement, and which of them count, (S,)."""
    axis = torques.axis
    rows = movement_rows(torques, float(robot.torque_limit_Nm[axis]))
    return rows, slides(torques.qd, float(robot.identified.rise_rad_s[axis]))


def contribution_from(
    judgement: Judgement,
    everything: FloatArray,
    labels: Labels,
    arm: PassiveArm,
    sample_rate_hz: float,
) -> Contribution:
    """The result of a movement: one code for a recording and for a running robot.

    Parameters
    ----------
    judgement : Judgement
        Judgement of the sums (6, k) of the samples that count.
    everything : (6, k)
        Sums of all samples.

    Raises
    ------
    InputError
        No motor torque, an axis on which the arm is no load, or one that does not move.
    """
    total, samples = judgement.sums[ONE], everything[ONE, ONE]
    where = f"trial {labels.trial}, axis {labels.axis_name}"
    refuse_no_torque(everything[ONE], total[ONE], where)
    n, law = total[ONE], judgement.law
    compared = _compared(judgement, labels, arm)
    share, parts = _metric(judgement, judgement.share)
    return Contribution(
        trial=labels.trial,
        condition=labels.condition,
        movement=labels.movement,
        axis_name=labels.axis_name,
        n_samples=int(n),
        duration_s=float((samples - 1) / sample_rate_hz),
        still_share=float(1 - n / samples),
        share=share,
        projection=_metric(judgement, judgement.projection)[0],
        ratio=_metric(judgement, judgement.ratio)[0],
        reference=compared,
        inertia_percent=float(judgement.inertia_percent),
        ratio_all_percent=float(Judgement(everything, law).ratio.percent),
        sum_ratio=float(abs(total[ARM]) / total[ABS_ARM]),
        mean_support_Nm=float((total[ARM] - total[USER]) / n),
        mean_arm_Nm=float(total[ARM] / n),
        lowering_share=float(total[LOWERING] / n),
        saturated_share=float(everything[ONE, SATURATED] / samples),
        share_variance=_variance_shares(parts),
        notes=(
            *labels.notes,
            *ratio_notes(judgement),
            *reference_notes(compared),
            *course_notes(total, everything[ONE]),
        ),
    )


def _compared(
    judgement: Judgement, labels: Labels, arm: PassiveArm
) -> ReferenceContribution | None:
    reference = arm.reference_of(labels.movement, labels.axis_name)
    if reference is None:
        return None
    return reference_contribution(judgement, reference, labels.from_rad, labels.to_rad)


def _metric(judgement: Judgement, judged: Judged) -> tuple[Metric, FloatArray]:
    """A metric with its interval, and the parts (5,) of its variance."""
    parts = judgement.law.variance_parts(judged.errors, judged.noise)
    percent, half = float(judged.percent), judgement.law.half_width(parts)
    ci95 = np.array([percent - half, percent + half])
    return Metric(percent, float(judged.sd), ci95, bool(judged.valid)), parts


def _variance_shares(parts: FloatArray) -> VarianceShares:
    """Parts (5,) of a variance over their sum."""
    total = float(parts.sum())
    each = parts / total if total > 0 else np.zeros(len(parts))
    return VarianceShares(*(float(part) for part in each))
