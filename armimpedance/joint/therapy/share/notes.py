"""What is refused of a movement, and what a reader must know beside the numbers."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.joint.therapy.arm.passive_arm import Elastic, PassiveArm
from armimpedance.joint.therapy.share.judgement import Judgement
from armimpedance.joint.therapy.share.result import ReferenceContribution
from armimpedance.joint.therapy.share.sums import ABS_ARM, ABS_MOTOR, ARM, LOWERING, ONE, SATURATED

#: A mean |tau_h| below this is no load at all, N m.
NO_LOAD_NM: Final = 1e-6
#: A share of a movement from which on a reader must know of it.
MUCH: Final = 0.5
#: Angles may leave the range of the passive calibration by this much without a word, rad.
BEYOND_RAD: Final = np.deg2rad(5.0)


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


def refuse_no_torque(total: FloatArray, n_counted: float, where: str) -> None:
    """Refuse a movement that nothing can be a share of.

    Parameters
    ----------
    total : (k,)
        Sums of all its rows.
    n_counted : float
        Samples in which the axis moves.
    where : str
        Trial and axis.

    Raises
    ------
    InputError
        No motor torque, an axis on which the arm is no load, or one that does not move.
    """
    if not n_counted > 0:
        raise InputError(f"{where}: it does not move", expected="a movement")
    if total[ABS_MOTOR] == 0:
        raise InputError(f"{where}: the motor torque is zero throughout", expected="tau_motor")
    if not total[ABS_ARM] > NO_LOAD_NM * total[ONE]:
        raise InputError(
            f"{where}: the passive arm needs no torque (tau_h is zero throughout)",
            expected="an axis that the arm's mass or stiffness loads",
        )


def range_notes(elastic: Elastic, lowest_rad: float, highest_rad: float) -> tuple[str, ...]:
    """A note where a movement leaves the angles over which the stiffness was measured."""
    low, high = elastic.range_rad
    past = max(low - lowest_rad, highest_rad - high)
    if past <= BEYOND_RAD:
        return ()
    return (f"up to {np.degrees(past):.0f} degrees outside of the passive calibration",)


def direction_notes(elastic: Elastic, start_rad: float, end_rad: float) -> tuple[str, ...]:
    """A note where the passive arm was moved the other way only."""
    if elastic.one_way * (end_rad - start_rad) >= 0:
        return ()
    return (
        "viscosity: the passive arm was moved the other way only, and what it then resisted its "
        "speed by counts twice here; calibrate the arm with this movement too",
    )


def ratio_notes(judgement: Judgement) -> tuple[str, ...]:
    """Why (4) of a movement is not valid; nothing where it is."""
    if judgement.ratio.valid:
        return ()
    total = judgement.sums[ONE]
    if not judgement.one_sided:
        share = abs(total[ARM]) / total[ABS_ARM]
        return (f"(4) is singular: tau_h cancels out to {100 * share:.0f} % of its size",)
    error = np.sqrt(judgement.law.variance_of_arm_sum(judgement.sums)) / total[ONE]
    sd = float(judgement.ratio.sd)
    what = f"an error of {sd:.2g} points" if judgement.arm_known else "no denominator"
    mean = total[ARM] / total[ONE]
    return (f"(4) has {what}: mean tau_h {mean:.3g} +- {float(error):.2g} N m",)


def reference_notes(compared: ReferenceContribution | None) -> tuple[str, ...]:
    """Why (19) of a movement is not valid; nothing where it is, or has no reference."""
    return () if compared is None or compared.valid else (f"(19): {compared.why_not}",)


def course_notes(counted: FloatArray, everything: FloatArray) -> tuple[str, ...]:
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
