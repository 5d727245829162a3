"""Metrics of a contribution with their errors, and tests of their validity.

A `Judgement` is computed once from the sums of a movement, of its samples or of its first part.
Standard errors follow by the delta method from `error_law`.

- A sample (3) is valid if the axis moves and ``|tau_h|`` is at least `AWAY_SAMPLE` times its
  own standard error, including the torque's noise.
- The ratio of sums (4) is valid if ``|sum tau_h| / sum |tau_h|`` is at least `LEAST_SUM_RATIO`,
  ``|sum tau_h|`` at least `AWAY_SUM` times its standard error, and its own standard error within
  the limit for the projection.
- The projection is valid if the root mean square of tau_h is at least `AWAY_SUM` times that of
  its standard errors, and the projection's own standard error at most `LARGEST_SD` points, or that
  many per cent of a larger value.
- The share fitted together with the robot's inertia is valid under the same conditions, and if at
  least `LEAST_BESIDE` of the squares of tau_h are orthogonal to the inertia torque; in a movement
  that has only begun `LEAST_BESIDE_SO_FAR`. Otherwise a torque of the person that is neither a
  share of the arm nor of the robot would be counted as one of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.core.errors import InputError
from armimpedance.joint.therapy.arm.passive_arm import Elastic, PassiveArm
from armimpedance.joint.therapy.share.error_law import (
    ABS_ARM,
    ABS_MOTOR,
    ARM,
    INERTIA,
    LOWERING,
    ONE,
    SATURATED,
    USER,
    ErrorLaw,
)
from armimpedance.joint.therapy.share.result import ReferenceContribution

AWAY_SAMPLE: Final = 5.0
AWAY_SUM: Final = 3.0
LEAST_SUM_RATIO: Final = 0.2
#: Largest standard error of a valid metric, percentage points.
LARGEST_SD: Final = 10.0

#: Least share of tau_h (in squares) that is orthogonal to the robot's inertia torque. At the onset
#: of a resisted movement, less than a tenth gave errors of hundreds of points in the share so far.
LEAST_BESIDE: Final = 0.02
LEAST_BESIDE_SO_FAR: Final = 0.1

#: A denominator below this, in N m or N m^2, counts as zero; its square would underflow.
_ZERO: Final = 1e-30
#: Share of tau_h orthogonal to the robot's inertia torque, in squares, below which it is rounding.
_ROUNDING: Final = 1e-9


@dataclass(frozen=True)
class Judged:
    """A metric in per cent, its errors, and its validity.

    `valid` (...) bool.
    `percent` (...): NaN if its denominator is zero.
    `sd` (...): standard error, percentage points.
    `errors` (..., m): change by one standard deviation of each error of the law.
    `noise` (...): variance due to the noise of the torque.
    """

    percent: FloatArray
    sd: FloatArray
    valid: BoolArray
    errors: FloatArray
    noise: FloatArray


class Judgement:
    """All metrics of given sums, each computed once on first use.

    `sums` (..., 6, k): sums of a movement, or of each of several samples or windows.
    `law`: errors of the torques about the axis.
    `so_far`: True for an incomplete movement, for which the limit of the share's validity is
    stricter.
    """

    def __init__(self, sums: FloatArray, law: ErrorLaw, *, so_far: bool = False) -> None:
        self.sums, self.law = sums, law
        self._least_beside = LEAST_BESIDE_SO_FAR if so_far else LEAST_BESIDE

    @cached_property
    def ratio(self) -> Judged:
        """Ratio of sums ``C = 100 sum tau_user / sum tau_h`` (4)."""
        return self._ratio(1.0, (self._arm != 0) & self.one_sided & self.arm_known)

    @cached_property
    def of_sample(self) -> Judged:
        """Contribution ``C = 100 tau_user / tau_h`` (3) of single samples."""
        gain = self.law.kernel_gain
        variance = self.law.variance_of_arm_sum(self.sums) + self.law.noise * gain
        away = (self._arm != 0) & (self._arm**2 >= AWAY_SAMPLE**2 * variance)
        return self._ratio(gain, away, sharp=False)

    @cached_property
    def projection(self) -> Judged:
        """Projection ``P = 100 sum(tau_user tau_h) / sum(tau_h^2)``: the share of tau_h in
        tau_user.
        """
        return self._squares(self.sums[..., USER, :], self.sums[..., ARM, :], self._power)

    @cached_property
    def share(self) -> Judged:
        """Share of tau_h in tau_user, fitted together with a share of the robot's inertia torque.

        A person who moves freely also moves the robot. Its inertia torque is not part of tau_h, but
        resembles it if the arm's torque is small, and the projection then includes it. Least
        squares on both, ``tau_user = c tau_h + d M_r qdd``, does not: with h' the part of tau_h
        orthogonal to ``M_r qdd``, ``c = sum(u h') / sum(h h')``.
        """
        by_user, by_arm = self._beside(USER), self._arm_beside
        power = by_arm[..., ARM]
        independent = power > _ROUNDING * self._power
        # h'^2 / h^2: share of tau_h that is orthogonal to the robot's inertia torque
        enough = power / np.maximum(self._power, _ZERO) >= self._least_beside
        return self._squares(by_user, by_arm, np.where(independent, power, 0.0), enough)

    @property
    def inertia_percent(self) -> FloatArray:
        """Coefficient d of `share`: the person's share of the robot's inertia torque, per cent,
        (...).
        """
        own, arm = self.sums[..., INERTIA, :], self._arm_beside
        part = arm[..., USER] / _not_zero(arm[..., ARM])
        remaining = self.sums[..., USER, INERTIA] - part * self.sums[..., ARM, INERTIA]
        return np.asarray(100 * remaining / _not_zero(own[..., INERTIA]))

    @cached_property
    def one_sided(self) -> BoolArray:
        """Mask (...): True if tau_h keeps its sign for most of the movement."""
        return np.asarray(abs(self._arm) >= LEAST_SUM_RATIO * self.sums[..., ONE, ABS_ARM])

    @cached_property
    def arm_known(self) -> BoolArray:
        """Mask (...): True if the sum of tau_h is significantly different from zero."""
        return np.asarray(self._arm**2 >= AWAY_SUM**2 * self.law.variance_of_arm_sum(self.sums))

    @property
    def _arm(self) -> FloatArray:
        return np.asarray(self.sums[..., ONE, ARM])

    @property
    def _power(self) -> FloatArray:
        return np.asarray(self.sums[..., ARM, ARM])

    @cached_property
    def _heavy(self) -> BoolArray:
        """Mask (...): True if tau_h exceeds its errors over the samples."""
        power = self._power
        significant = power >= AWAY_SUM**2 * self.law.summed_arm_variance(self.sums)
        return np.asarray((power > 0) & significant)

    @cached_property
    def _arm_beside(self) -> FloatArray:
        return self._beside(ARM)

    def _beside(self, column: int) -> FloatArray:
        """Sums ``sum (x - beta M_r qdd) w`` (..., k) of column x, beta its least-squares share."""
        own = self.sums[..., INERTIA, :]
        square = own[..., INERTIA]
        beta = self.sums[..., column, INERTIA] / np.maximum(square, _ZERO)
        beta = np.where(square < _ZERO, 0.0, beta)
        return np.asarray(self.sums[..., column, :] - beta[..., None] * own)

    def _ratio(self, gain: float, valid: BoolArray, *, sharp: bool = True) -> Judged:
        """Metric (4) or (3); `gain`: share of a sample's noise after the kernel."""
        law, total = self.law, self.sums[..., ONE, :]
        bottom = _not_zero(self._arm)
        part, scale = total[..., USER] / bottom, 100 / bottom
        # dC (..., m) = 100 / D (sum w U - c sum w H): tau_h is in numerator and denominator
        errors = scale[..., None] * (total @ law.user - part[..., None] * (total @ law.arm))
        noise = scale**2 * law.noise * gain * total[..., ONE]
        return _judged(100 * part, errors, noise, valid, sharp)

    def _squares(
        self,
        by_user: FloatArray,
        by_arm: FloatArray,
        bottom: FloatArray,
        valid: BoolArray | bool = True,
    ) -> Judged:
        """Least-squares share, from ``sum u w`` and ``sum h w`` (..., k) and ``sum h^2``."""
        bottom = _not_zero(bottom)
        part, scale = by_arm[..., USER] / bottom, 100 / bottom
        # dP (..., m) = 100 / D (sum h w U + sum u w H - 2 c sum h w H)
        errors = scale[..., None] * (
            by_arm @ self.law.user + (by_user - 2 * part[..., None] * by_arm) @ self.law.arm
        )
        noise = scale**2 * self.law.noise * bottom
        return _judged(100 * part, errors, noise, self._heavy & valid)


def _judged(
    percent: FloatArray, errors: FloatArray, noise: FloatArray, valid: BoolArray, sharp: bool = True
) -> Judged:
    sd = np.asarray(np.sqrt((errors**2).sum(-1) + noise))
    if sharp:
        # False for NaN
        valid = valid & (sd <= np.maximum(LARGEST_SD, LARGEST_SD / 100 * abs(percent)))
    return Judged(np.asarray(percent), sd, np.asarray(valid), errors, noise)


def _not_zero(denominator: FloatArray) -> FloatArray:
    return np.where(abs(denominator) < _ZERO, np.nan, denominator)


# Refusals of a movement, and notes for a reader of its numbers.

#: Mean |tau_h| below which the arm is no load, N m.
NO_LOAD_NM: Final = 1e-6
#: Share of a movement from which a note is given.
MUCH: Final = 0.5
#: Distance from the range of the passive calibration above which a note is given, rad.
BEYOND_RAD: Final = np.deg2rad(5.0)


def usable_elastic(arm: PassiveArm, axis_name: str, *, unrepeatable: bool) -> Elastic:
    """Passive stiffness of the axis.

    Raises InputError: it was not measured, or its repetitions are too different.
    """
    elastic = arm.elastic_of(axis_name)
    if not (elastic.repeatable or unrepeatable):
        raise InputError(
            f"subject {arm.subject}: axis {axis_name} has no passive model, {elastic.verdict}",
            expected="passive repetitions that agree",
        )
    return elastic


def refuse_no_torque(total: FloatArray, n_counted: float, where: str) -> None:
    """Refuse a movement without a torque to be shared.

    `total` (k,): sums of all its rows.
    `n_counted`: number of samples in which the axis moves.
    `where`: trial and axis, for the message.
    Raises InputError: no motor torque, an axis without load by the arm, or one that does not move.
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
    """Note if a movement leaves the angles over which the stiffness was measured."""
    low, high = elastic.range_rad
    past = max(low - lowest_rad, highest_rad - high)
    if past <= BEYOND_RAD:
        return ()
    return (f"up to {np.degrees(past):.0f} degrees outside of the passive calibration",)


def direction_notes(elastic: Elastic, start_rad: float, end_rad: float) -> tuple[str, ...]:
    """Note if the passive arm was moved only in the other direction."""
    if elastic.one_way * (end_rad - start_rad) >= 0:
        return ()
    return (
        "viscosity: the passive arm was moved the other way only, and what it then resisted its "
        "speed by counts twice here; calibrate the arm with this movement too",
    )


def ratio_notes(judgement: Judgement) -> tuple[str, ...]:
    """Reason why (4) of a movement is not valid; empty if it is."""
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
    """Reason why (19) of a movement is not valid; empty if it is, or has no reference."""
    return () if compared is None or compared.valid else (f"(19): {compared.why_not}",)


def course_notes(counted: FloatArray, everything: FloatArray) -> tuple[str, ...]:
    """Notes on lowering, standing still and saturation, from sums of rows (k,)."""
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
