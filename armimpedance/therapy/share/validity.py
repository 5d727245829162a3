"""When a contribution is valid, what is refused, and what a reader must know beside the numbers.

- A sample (3): the axis moves, and ``|tau_h|`` is at least `AWAY_SAMPLE` times its own standard
  error and that of the torque's noise.
- The sum (4): ``|sum tau_h| / sum |tau_h|`` is at least `LEAST_SUM_RATIO`, ``|sum tau_h|`` at least
  `AWAY_SUM` times its standard error, and (4)'s own as small as the projection's.
- The projection: the root mean square of tau_h is at least `AWAY_SUM` times that of its standard
  errors, and the projection's own standard error at most `LARGEST_SD` points, or that many per
  cent of a larger value.
- The share beside the robot's inertia: the same, and at least `LEAST_BESIDE` of the squares of
  tau_h are left; of a movement that has only begun `LEAST_BESIDE_SO_FAR`. What a person does that
  is neither a share of the arm nor of the robot is else taken for the one or the other.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.arrays import BoolArray, FloatArray
from armimpedance.errors import InputError
from armimpedance.therapy.arm.passive_arm import Elastic, PassiveArm
from armimpedance.therapy.share.sums import ABS_ARM, ABS_MOTOR, ARM, LOWERING, ONE, SATURATED
from armimpedance.therapy.share.uncertainty import ErrorLaw, Quotient, beside_inertia

AWAY_SAMPLE: Final = 5.0
AWAY_SUM: Final = 3.0
LEAST_SUM_RATIO: Final = 0.2
#: Percentage points.
LARGEST_SD: Final = 10.0

#: Share of tau_h (in squares) that must be left beside the robot's inertia torque. At the onset of
#: a movement that is resisted less than a tenth let the share so far be off by hundreds of points.
LEAST_BESIDE: Final = 0.02
LEAST_BESIDE_SO_FAR: Final = 0.1
#: A mean |tau_h| below this is no load at all, Nm.
NO_LOAD_NM: Final = 1e-6
#: A share of a movement from which on a reader must know of it.
MUCH: Final = 0.5
#: Angles may leave the range of the passive calibration by this much without a word, rad.
BEYOND_RAD: Final = np.deg2rad(5.0)


def sample_valid(products: FloatArray, law: ErrorLaw) -> BoolArray:
    """Whether tau_h of samples is well away from zero, (...) of sums (..., 6, k) of one each."""
    variance = law.variance_of_arm_sum(products) + law.noise * law.kernel_gain
    arm = products[..., ONE, ARM]
    return np.asarray((arm != 0) & (arm**2 >= AWAY_SAMPLE**2 * variance))


def ratio_valid(sums: FloatArray, value: Quotient, law: ErrorLaw) -> BoolArray:
    """Whether (4) can be told, (...) of sums (..., 6, k)."""
    arm = sums[..., ONE, ARM]
    one_sided = abs(arm) >= LEAST_SUM_RATIO * sums[..., ONE, ABS_ARM]
    known = arm**2 >= AWAY_SUM**2 * law.variance_of_arm_sum(sums)
    return np.asarray((arm != 0) & one_sided & known & _sharp(value))


def projection_valid(sums: FloatArray, value: Quotient, law: ErrorLaw) -> BoolArray:
    """Whether the projection can be told, (...) of sums (..., 6, k)."""
    power = sums[..., ARM, ARM]
    known = power >= AWAY_SUM**2 * law.summed_arm_variance(sums)
    return np.asarray((power > 0) & known & _sharp(value))


def share_valid(
    sums: FloatArray, value: Quotient, law: ErrorLaw, least: float = LEAST_BESIDE
) -> BoolArray:
    """Whether the share beside the robot's inertia can be told, (...) of sums (..., 6, k)."""
    return np.asarray(projection_valid(sums, value, law) & (beside_inertia(sums) >= least))


def _sharp(value: Quotient) -> BoolArray:
    """Whether the standard error is small; False where there is no number."""
    return np.asarray(value.sd <= np.maximum(LARGEST_SD, LARGEST_SD / 100 * abs(value.percent)))


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


def why_no_ratio(sums: FloatArray, value: Quotient, law: ErrorLaw) -> str:
    """Why (4) of sums (6, k) is not valid."""
    total = sums[ONE]
    share = abs(total[ARM]) / total[ABS_ARM]
    if share < LEAST_SUM_RATIO:
        return f"(4) is singular: tau_h cancels out to {100 * share:.0f} % of its size"
    mean, error = total[ARM] / total[ONE], np.sqrt(law.variance_of_arm_sum(sums)) / total[ONE]
    known = abs(mean) >= AWAY_SUM * error
    what = f"an error of {float(value.sd):.2g} points" if known else "no denominator"
    return f"(4) has {what}: mean tau_h {mean:.3g} +- {float(error):.2g} Nm"


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
