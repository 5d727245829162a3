"""The result of a movement from its sums: one code for a recording and for a running robot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armimpedance.arrays import FloatArray
from armimpedance.therapy.arm.passive_arm import PassiveArm
from armimpedance.therapy.share.reference import (
    ReferenceContribution,
    reference_contribution,
    reference_of,
)
from armimpedance.therapy.share.result import Contribution
from armimpedance.therapy.share.sums import ABS_ARM, ARM, LOWERING, ONE, SATURATED, USER
from armimpedance.therapy.share.uncertainty import (
    ErrorLaw,
    Quotient,
    half_width,
    inertia_share,
    projection,
    ratio,
    share,
    shares,
    variance_parts,
)
from armimpedance.therapy.share.validity import (
    course_notes,
    projection_valid,
    ratio_valid,
    refuse_no_torque,
    share_valid,
    why_no_ratio,
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
    sums, everything : (6, k)
        Of the samples that count, and of all.

    Raises
    ------
    InputError
        No motor torque, an axis on which the arm is no load, or one that does not move.
    """
    refuse_no_torque(
        everything[ONE], sums[ONE, ONE], f"trial {labels.trial}, axis {labels.axis_name}"
    )
    total, samples = sums[ONE], everything[ONE, ONE]
    n = total[ONE]
    whole, projected = ratio(sums, law), projection(sums, law)
    beside = share(sums, law)
    compared = _compared(sums, law, labels, arm)
    valid = bool(ratio_valid(sums, whole, law))
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
        ratio_ci95=_interval(whole, law),
        ratio_valid=valid,
        ratio_all_percent=float(ratio(everything, law).percent),
        sum_ratio=float(abs(total[ARM]) / total[ABS_ARM]),
        projection_percent=float(projected.percent),
        projection_sd=float(projected.sd),
        projection_ci95=_interval(projected, law),
        projection_valid=bool(projection_valid(sums, projected, law)),
        share_percent=float(beside.percent),
        share_sd=float(beside.sd),
        share_ci95=_interval(beside, law),
        share_valid=bool(share_valid(sums, beside, law)),
        inertia_percent=float(inertia_share(sums)),
        reference_percent=None if compared is None else compared.percent,
        reference_sd=None if compared is None else compared.sd,
        reference_valid=compared is not None and compared.valid,
        mean_support_Nm=float((total[ARM] - total[USER]) / n),
        mean_arm_Nm=float(total[ARM] / n),
        mean_reference_Nm=None if compared is None else compared.mean_reference_Nm,
        lowering_share=float(total[LOWERING] / n),
        saturated_share=float(everything[ONE, SATURATED] / samples),
        share_variance=shares(variance_parts(beside, law)),
        notes=(
            *labels.notes,
            *(() if valid else (why_no_ratio(sums, whole, law),)),
            *(() if compared is None or compared.valid else (f"(19): {compared.why_not}",)),
            *course_notes(total, everything[ONE]),
        ),
    )


def _compared(
    sums: FloatArray, law: ErrorLaw, labels: Labels, arm: PassiveArm
) -> ReferenceContribution | None:
    reference = reference_of(arm, labels.movement, labels.axis_name)
    if reference is None:
        return None
    return reference_contribution(sums, law, reference, labels.from_rad, labels.to_rad)


def _interval(value: Quotient, law: ErrorLaw) -> FloatArray:
    half = half_width(variance_parts(value, law), law)
    return np.array([value.percent - half, value.percent + half])
