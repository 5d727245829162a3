"""The patient's contribution to a movement: as a share, as a projection, (4) and (19).

(4) divides by torques that pass through zero, in horizontal rotation about the rest angle of the
shoulder. The projection ``100 sum(tau_user tau_h) / sum(tau_h^2)`` does not: it is the share of
tau_h that tau_user follows over the movement. If tau_h is constant, both are the same. Samples in
which the axis stands still are not used (`steady.slides`); `judgement` decides if a value is valid.
When the arm is lowered, its weight drives the movement. 100 % then means carrying the whole arm all
the way down; a person who pushes downwards contributes less, not more.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.core.errors import InputError
from armimpedance.joint.therapy.arm.movements import MovementTorques
from armimpedance.joint.therapy.arm.passive_arm import PassiveArm, Reference
from armimpedance.joint.therapy.robot.steady import slides
from armimpedance.joint.therapy.robot.therapy_robot import TherapyRobot
from armimpedance.joint.therapy.share.error_law import (
    ABS_ARM,
    ABS_SUPPORT,
    ARM,
    LOWERING,
    ONE,
    SATURATED,
    USER,
    VarianceShares,
    error_law,
    movement_rows,
    products_of,
    sums_of,
    window_sums,
)
from armimpedance.joint.therapy.share.judgement import (
    Judged,
    Judgement,
    course_notes,
    direction_notes,
    range_notes,
    ratio_notes,
    reference_notes,
    refuse_no_torque,
    usable_elastic,
)
from armimpedance.joint.therapy.share.result import (
    Contribution,
    ContributionSoFar,
    Metric,
    ReferenceContribution,
    RunningContribution,
    SampleContribution,
)

# Contribution by a reference torque, (18)-(19): the support of the same movement when passive.
#
# ``C' = 100 (1 - mean support / mean reference support)`` needs no model of the arm, but passive
# repetitions of every movement. The reference predicts the support that this repetition would have
# needed if passive. Repetitions differ by the scatter s of the R references, so its error is
# ``s sqrt(1 + 1/R)``, with R - 1 degrees of freedom. Errors of the robot's model are also in the
# reference; they cancel to the extent that the person is passive.

#: Least distance of the mean reference from zero, in its own standard errors.
AWAY_SD: Final = 3.0
#: Least mean reference as a share of the mean size of its torques.
LEAST_SHARE: Final = 0.2
#: If a movement's mean tau_h differs from the reference by more than this share, and more than its
#: errors, it had another timing.
OTHER_SHARE: Final = 0.1
#: Largest distance of a movement's start or end from the reference's, rad.
OTHER_RAD: Final = np.deg2rad(10.0)


def reference_contribution(
    judgement: Judgement, reference: Reference, from_rad: float, to_rad: float
) -> ReferenceContribution:
    """Contribution ``C'`` (19) and its standard error, from the scatter of the reference's
    repetitions.

    `judgement`: judgement of the sums (6, k) of the movement.
    `reference`: the support of its passive repetitions.
    `from_rad`, `to_rad`: angles at which this movement starts and ends.
    """
    sums, law, repetitions = judgement.sums, judgement.law, len(reference.support_Nm)
    total = sums[ONE]
    n = total[ONE]
    support = (total[ARM] - total[USER]) / n
    mean = float(reference.support_Nm.mean())
    scatter = float(reference.support_Nm.std(ddof=1)) if repetitions > 1 else float("nan")
    error = scatter * np.sqrt(1 + 1 / repetitions)
    size = max(total[ABS_ARM], total[ABS_SUPPORT]) / n
    why_not = _why_not(mean, error, float(size)) or _other_timing(mean, error, judgement)
    away = max(abs(from_rad - reference.from_rad), abs(to_rad - reference.to_rad))
    if away > OTHER_RAD:
        why_not = f"starts or ends {np.degrees(away):.0f} degrees from where the reference does"
    if mean == 0:
        return ReferenceContribution(float("nan"), float("nan"), mean, False, why_not)
    # the robot's errors are in the support and in the reference: dC' = 100 (1 - s / ref) dr / ref
    robot = (1 - support / mean) ** 2 * law.variance_of_robot_sum(sums) / n**2
    # noise of the mean support: variance law.noise / n
    sd = 100 / abs(mean) * np.sqrt((support / mean * error) ** 2 + robot + law.noise / n)
    return ReferenceContribution(
        float(100 * (1 - support / mean)), float(sd), mean, not why_not, why_not
    )


def _why_not(mean: float, error: float, size: float) -> str:
    """Reason why the reference cannot be a denominator; empty if it can."""
    if np.isnan(error):
        return "one repetition of the reference: its scatter is not known"
    if not abs(mean) >= AWAY_SD * error:
        return f"the mean reference {mean:.3g} N m is less than {AWAY_SD:g} times its error"
    if not abs(mean) >= LEAST_SHARE * size:
        return f"the mean reference {mean:.3g} N m is small against the torques of {size:.3g} N m"
    return ""


def _other_timing(mean: float, error: float, judgement: Judgement) -> str:
    """Reason why the reference is of another course; empty if it is not."""
    sums = judgement.sums
    needs = float(sums[ONE, ARM] / sums[ONE, ONE])
    variance = float(judgement.law.variance_of_arm_sum(sums)) / sums[ONE, ONE] ** 2
    apart = abs(needs - mean)
    if apart > max(OTHER_SHARE * abs(mean), AWAY_SD * float(np.hypot(error, np.sqrt(variance)))):
        return (
            f"the arm needs {needs:.3g} N m over this movement, {mean:.3g} N m over the reference"
        )
    return ""


@dataclass(frozen=True)
class Labels:
    """Names of a movement, and the angles at which it starts and ends."""

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
    """Compute a person's share in one movement, with standard errors.

    Parameters
    ----------
    torques : MovementTorques
        Torques on the moving axis.
    robot : TherapyRobot
        Identified.
    arm : PassiveArm
        The person's, calibrated in this robot.
    unrepeatable : bool
        True to continue if the passive repetitions of this axis did not agree.

    Returns
    -------
    Contribution

    Raises
    ------
    InputError
        No motor torque, an axis without load by the arm, or an axis whose passive stiffness was not
        measured or did not repeat.
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
    """Rows (S, k) of a movement, and mask of those that are used, (S,)."""
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
    """Result of a movement, by the same code for a recording and for a running robot.

    `judgement`: judgement of the sums (6, k) of the used samples.
    `everything` (6, k): sums of all samples.
    Raises InputError: no motor torque, an axis without load by the arm, or one that does not move.
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
    shares = parts / total if total > 0 else np.zeros(len(parts))
    return VarianceShares(*(float(part) for part in shares))


# Contribution over a movement: of every sample (3), in a window, and from the onset.
#
# Sums of torques and their judgement are those of a whole movement (`of_movement`).

#: Length of the running view's window, s.
WINDOW_S: Final = 0.5
#: Time for which the share so far must have been valid before it is shown, s: at the onset, arm
#: and robot may seem to differ for a tenth of a second.
STEADY_S: Final = 0.2


def sample_contribution(
    torques: MovementTorques, robot: TherapyRobot, arm: PassiveArm
) -> SampleContribution:
    """Contribution (3) of every sample, its standard error, and its validity.

    Parameters
    ----------
    torques : MovementTorques
        Torques on the moving axis.
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
    judged = Judgement(products_of(rows), law).of_sample
    return SampleContribution(
        torques.time_s,
        torques.user,
        torques.arm,
        counts,
        judged.percent,
        judged.sd,
        counts & judged.valid,
    )


def running_contribution(
    torques: MovementTorques, robot: TherapyRobot, arm: PassiveArm, window_s: float = WINDOW_S
) -> RunningContribution:
    """Projection in a causal window over the movement, with its standard error.

    `window_s`: length of the window before each sample, s.
    Raises InputError: a window shorter than two samples, or as `sample_contribution`.
    """
    law = error_law(robot, arm, torques.axis_name, torques.sample_rate_hz)
    rows, counts = rows_of(torques, robot)
    window = window_samples(window_s, torques.sample_rate_hz)
    judged = Judgement(window_sums(rows * counts[:, None], window), law).projection
    return RunningContribution(window_s, torques.time_s, judged.percent, judged.sd, judged.valid)


def contribution_so_far(
    torques: MovementTorques,
    robot: TherapyRobot,
    arm: PassiveArm,
    metric: Literal["share", "projection"] = "share",
) -> ContributionSoFar:
    """Share or projection from the onset up to each sample, with its standard error.

    A window shorter than the movement cannot separate arm and robot while either changes little.
    The sums from the onset can, and end at the value of the whole movement. The limit of validity
    is stricter than for a complete movement, because the rest is not known yet.

    `torques`: torques on the moving axis.
    `robot`: identified.
    `arm`: the person's, calibrated in this robot.
    `metric`: "share" or "projection".
    Raises InputError: the robot or this axis of the arm was not calibrated.
    """
    law = error_law(robot, arm, torques.axis_name, torques.sample_rate_hz)
    rows, counts = rows_of(torques, robot)
    sums = np.cumsum(products_of(rows * counts[:, None]), axis=0)
    judgement = Judgement(sums, law, so_far=True)
    judged = judgement.share if metric == "share" else judgement.projection
    steady = _steady(judged.valid, round(STEADY_S * torques.sample_rate_hz))
    return ContributionSoFar(metric, torques.time_s, judged.percent, judged.sd, steady)


def _steady(valid: BoolArray, samples: int) -> BoolArray:
    """Mask (S,) of samples up to which the last `samples` samples are all valid."""
    total = np.concatenate([np.zeros(samples), np.cumsum(valid)])
    return np.asarray(total[samples:] - total[:-samples] == samples)


def window_samples(window_s: float, sample_rate_hz: float) -> int:
    """Number of samples of a running window.

    Raises InputError: fewer than two, or more than a minute.
    """
    if not 2 <= window_s * sample_rate_hz <= 60 * sample_rate_hz:
        raise InputError(f"a running window of {window_s} s", expected="two samples to 60 s")
    return round(window_s * sample_rate_hz)
