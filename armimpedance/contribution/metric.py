"""The patient's contribution: per sample (3), per movement (4), as a projection, over time.

(3) and (4) divide by torques that pass through zero, in horizontal rotation about the angle at
which the shoulder rests. The projection ``100 sum(tau_user tau_h) / sum(tau_h^2)`` does not: it is
the share of tau_h that tau_user follows over the movement. Where tau_h is constant all three are
the same. Where the arm is let down its weight drives the movement: 100 % is then to carry the
whole arm all the way down, and whoever pushes downwards contributes less, not more.

When a value is valid:

- a sample (3): the axis moves, and ``|tau_h|`` is at least `AWAY_SAMPLE` times its own standard
  error and that of the torque's noise;
- the sum (4): ``|sum tau_h| / sum |tau_h|`` is at least `LEAST_SUM_RATIO`, and ``|sum tau_h|`` at
  least `AWAY_SUM` times its standard error;
- the projection: the root mean square of tau_h is at least `AWAY_SUM` times that of its standard
  errors, and the projection's own standard error at most `LARGEST_SD` points, or that many per
  cent of a larger value.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, Final

import numpy as np

from armimpedance.contribution.arm import Elastic, PassiveArm
from armimpedance.contribution.reference import (
    ReferenceContribution,
    reference_contribution,
    reference_of,
)
from armimpedance.contribution.robot import TherapyRobot
from armimpedance.contribution.sliding import slides
from armimpedance.contribution.sums import (
    ABS_ARM,
    ABS_MOTOR,
    ARM,
    LOWERING,
    ONE,
    SATURATED,
    USER,
    movement_rows,
    products_of,
    sums_of,
    window_sums,
)
from armimpedance.contribution.torques import MovementTorques
from armimpedance.contribution.uncertainty import (
    ErrorLaw,
    Quotient,
    VarianceShares,
    error_law,
    half_width,
    projection,
    ratio,
    shares,
    variance_parts,
)
from armimpedance.errors import InputError
from armimpedance.records import BoolArray, FloatArray, frozen, frozen_array

AWAY_SAMPLE: Final = 5.0
AWAY_SUM: Final = 3.0
LEAST_SUM_RATIO: Final = 0.2
#: Percentage points.
LARGEST_SD: Final = 10.0

#: Length of the running view's window, s.
WINDOW_S: Final = 0.5

#: A mean |tau_h| below this is no load at all, Nm.
NO_LOAD_NM: Final = 1e-6
#: A share of a movement from which on a reader must know of it.
MUCH: Final = 0.5
#: Angles may leave the range of the passive calibration by this much without a word, rad.
BEYOND_RAD: Final = np.deg2rad(5.0)


@dataclass(frozen=True)
class Contribution:
    """A person's share in one movement; per cent of what the passive arm needs.

    Attributes
    ----------
    trial, condition, movement, axis_name : str
    n_samples : int
        That count: the axis moves.
    duration_s : float
        From onset to end.
    still_share : float
        Of the samples between, those that do not count.
    ratio_percent, ratio_sd : float
        (4) and its standard error; NaN where the denominator is exactly zero.
    ratio_ci95 : (2,)
    ratio_valid : bool
    ratio_all_percent : float
        (4) of all samples from onset to end.
    sum_ratio : float
        ``|sum tau_h| / sum |tau_h|``.
    projection_percent, projection_sd : float
    projection_ci95 : (2,)
    projection_valid : bool
    reference_percent, reference_sd : float or None
        (19); None where the arm has no reference of this movement.
    reference_valid : bool
    mean_support_Nm, mean_arm_Nm : float
        Of (18) and of tau_h.
    mean_reference_Nm : float or None
    lowering_share, saturated_share : float
        Of the samples: the passive arm drives the movement; the motor is at its limit.
    ratio_shares, projection_shares : VarianceShares
    notes : tuple of str
    """

    trial: str
    condition: str
    movement: str
    axis_name: str
    n_samples: int
    duration_s: float
    still_share: float
    ratio_percent: float
    ratio_sd: float
    ratio_ci95: FloatArray
    ratio_valid: bool
    ratio_all_percent: float
    sum_ratio: float
    projection_percent: float
    projection_sd: float
    projection_ci95: FloatArray
    projection_valid: bool
    reference_percent: float | None
    reference_sd: float | None
    reference_valid: bool
    mean_support_Nm: float
    mean_arm_Nm: float
    mean_reference_Nm: float | None
    lowering_share: float
    saturated_share: float
    ratio_shares: VarianceShares
    projection_shares: VarianceShares
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        # an interval about a denominator of zero is NaN, which frozen_array would refuse
        for name in ("ratio_ci95", "projection_ci95"):
            object.__setattr__(self, name, frozen(np.array(getattr(self, name), dtype=float)))


@dataclass(frozen=True)
class SampleContribution:
    """(3) over a movement of S samples.

    Attributes
    ----------
    time_s, user, arm : (S,)
        s, Nm.
    counts : (S,) bool
        Whether the axis moves.
    percent, sd : (S,)
        NaN where tau_h is exactly zero.
    valid : (S,) bool
    """

    time_s: FloatArray
    user: FloatArray
    arm: FloatArray
    counts: BoolArray
    percent: FloatArray
    sd: FloatArray
    valid: BoolArray

    def __post_init__(self) -> None:
        _freeze(self, finite=("time_s", "user", "arm"))


@dataclass(frozen=True)
class RunningContribution:
    """The projection over the last `window_s` seconds, at each of S samples; for a display.

    Where the axis stands still it is that of the samples before; NaN once there are none left.

    Attributes
    ----------
    window_s : float
        Shorter at the movement's start.
    time_s, percent, sd : (S,)
    valid : (S,) bool
    """

    window_s: float
    time_s: FloatArray
    percent: FloatArray
    sd: FloatArray
    valid: BoolArray

    def __post_init__(self) -> None:
        _freeze(self, finite=("time_s",))


def _freeze(result: Any, finite: tuple[str, ...]) -> None:
    for field in fields(result):
        value = getattr(result, field.name)
        if field.name in finite:
            object.__setattr__(result, field.name, frozen_array(value, field.name, (None,)))
        elif isinstance(value, np.ndarray):
            object.__setattr__(result, field.name, frozen(value.copy()))


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


def usable_elastic(arm: PassiveArm, axis_name: str, *, unrepeatable: bool) -> Elastic:
    """The axis' passive stiffness.

    Raises
    ------
    InputError
        It was not measured, or its repetitions are too different.
    """
    elastic = arm.elastic_of(axis_name)
    if not (elastic.repeatable or unrepeatable):
        raise InputError(
            f"subject {arm.subject}: axis {axis_name} has no passive model, {elastic.verdict}",
            expected="passive repetitions that agree",
        )
    return elastic


def range_notes(elastic: Elastic, lowest_rad: float, highest_rad: float) -> tuple[str, ...]:
    """A note where a movement leaves the angles over which the stiffness was measured."""
    low, high = elastic.range_rad
    past = max(low - lowest_rad, highest_rad - high)
    if past <= BEYOND_RAD:
        return ()
    return (f"up to {np.degrees(past):.0f} degrees outside of the passive calibration",)


def sample_valid(products: FloatArray, law: ErrorLaw) -> BoolArray:
    """Whether tau_h of samples is well away from zero, (...) of sums (..., 5, k) of one each."""
    variance = law.variance_of_arm_sum(products) + law.noise * law.kernel_gain
    arm = products[..., ONE, ARM]
    return np.asarray((arm != 0) & (arm**2 >= AWAY_SAMPLE**2 * variance))


def ratio_valid(sums: FloatArray, law: ErrorLaw) -> BoolArray:
    """Whether (4) has a denominator, (...) of sums (..., 5, k)."""
    arm = sums[..., ONE, ARM]
    one_sided = abs(arm) >= LEAST_SUM_RATIO * sums[..., ONE, ABS_ARM]
    known = arm**2 >= AWAY_SUM**2 * law.variance_of_arm_sum(sums)
    return np.asarray((arm != 0) & one_sided & known)


def projection_valid(sums: FloatArray, value: Quotient, law: ErrorLaw) -> BoolArray:
    """Whether the projection can be told, (...) of sums (..., 5, k)."""
    power = sums[..., ARM, ARM]
    known = power >= AWAY_SUM**2 * law.summed_arm_variance(sums)
    sharp = value.sd <= np.maximum(LARGEST_SD, LARGEST_SD / 100 * abs(value.percent))
    return np.asarray((power > 0) & known & sharp)


def contribution_from(
    sums: FloatArray,
    everything: FloatArray,
    law: ErrorLaw,
    labels: Labels,
    arm: PassiveArm,
    sample_rate_hz: float,
) -> Contribution:
    """The result of a movement from its sums alone.

    Parameters
    ----------
    sums, everything : (5, k)
        Of the samples that count, and of all.

    Raises
    ------
    InputError
        No motor torque, an axis on which the arm is no load, or one that does not move.
    """
    refuse_no_torque(everything[ONE], sums[ONE, ONE], labels)
    total, samples = sums[ONE], everything[ONE, ONE]
    n = total[ONE]
    whole, projected = ratio(sums, law), projection(sums, law)
    parts, projected_parts = variance_parts(whole, law), variance_parts(projected, law)
    compared = _compared(sums, law, labels, arm)
    valid = bool(ratio_valid(sums, law))
    return Contribution(
        trial=labels.trial,
        condition=labels.condition,
        movement=labels.movement,
        axis_name=labels.axis_name,
        n_samples=int(n),
        duration_s=float((samples - 1) / sample_rate_hz),
        still_share=float(1 - n / samples),
        ratio_percent=float(whole.percent),
        ratio_sd=float(whole.sd),
        ratio_ci95=_interval(whole, half_width(parts, law)),
        ratio_valid=valid,
        ratio_all_percent=float(ratio(everything, law).percent),
        sum_ratio=float(abs(total[ARM]) / total[ABS_ARM]),
        projection_percent=float(projected.percent),
        projection_sd=float(projected.sd),
        projection_ci95=_interval(projected, half_width(projected_parts, law)),
        projection_valid=bool(projection_valid(sums, projected, law)),
        reference_percent=None if compared is None else compared.percent,
        reference_sd=None if compared is None else compared.sd,
        reference_valid=compared is not None and compared.valid,
        mean_support_Nm=float((total[ARM] - total[USER]) / n),
        mean_arm_Nm=float(total[ARM] / n),
        mean_reference_Nm=None if compared is None else compared.mean_reference_Nm,
        lowering_share=float(total[LOWERING] / n),
        saturated_share=float(everything[ONE, SATURATED] / samples),
        ratio_shares=shares(parts),
        projection_shares=shares(projected_parts),
        notes=(
            *labels.notes,
            *(() if valid else (_why_no_ratio(sums, law),)),
            *(() if compared is None or compared.valid else (f"(19): {compared.why_not}",)),
            *_course_notes(total, everything[ONE]),
        ),
    )


def _compared(
    sums: FloatArray, law: ErrorLaw, labels: Labels, arm: PassiveArm
) -> ReferenceContribution | None:
    reference = reference_of(arm, labels.movement, labels.axis_name)
    if reference is None:
        return None
    return reference_contribution(sums, law, reference, labels.from_rad, labels.to_rad)


def refuse_no_torque(total: FloatArray, n_counted: float, labels: Labels) -> None:
    """Refuse a movement (sums of all its rows, (k,)) that nothing can be a share of.

    Raises
    ------
    InputError
    """
    where = f"trial {labels.trial}, axis {labels.axis_name}"
    if not n_counted > 0:
        raise InputError(f"{where}: it does not move", expected="a movement")
    if total[ABS_MOTOR] == 0:
        raise InputError(f"{where}: the motor torque is zero throughout", expected="tau_motor")
    if not total[ABS_ARM] > NO_LOAD_NM * total[ONE]:
        raise InputError(
            f"{where}: the passive arm needs no torque (tau_h is zero throughout)",
            expected="an axis that the arm's mass or stiffness loads",
        )


def _interval(value: Quotient, half: float) -> FloatArray:
    return np.array([value.percent - half, value.percent + half])


def _why_no_ratio(sums: FloatArray, law: ErrorLaw) -> str:
    total = sums[ONE]
    share = abs(total[ARM]) / total[ABS_ARM]
    if share < LEAST_SUM_RATIO:
        return f"(4) is singular: tau_h cancels out to {100 * share:.0f} % of its size"
    error = float(np.sqrt(law.variance_of_arm_sum(sums))) / total[ONE]
    return f"(4) has no denominator: mean tau_h {total[ARM] / total[ONE]:.3g} +- {error:.2g} Nm"


def _course_notes(counted: FloatArray, everything: FloatArray) -> tuple[str, ...]:
    """Words on lowering, standing still and saturation, of sums of rows (k,)."""
    notes: tuple[str, ...] = ()
    lowering = counted[LOWERING] / counted[ONE]
    still = 1 - counted[ONE] / everything[ONE]
    saturated = everything[SATURATED] / everything[ONE]
    if lowering > MUCH:
        notes += (
            f"the passive arm drives {100 * lowering:.0f} % of the movement: 100 % is to carry the "
            "whole arm on its way, who pushes along contributes less",
        )
    if still > MUCH:
        notes += (f"the axis stands still for {100 * still:.0f} % of the movement",)
    if saturated > 0:
        notes += (f"the motor was at its limit in {100 * saturated:.1f} % of the samples",)
    return notes
