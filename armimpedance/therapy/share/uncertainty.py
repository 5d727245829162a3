"""Standard errors of the contribution: what the torques' errors are made of, and the delta method.

``tau_user = tau_r + tau_h - tau_motor`` and ``tau_h`` stands below the line as well: an arm that is
taken for 3 % too heavy moves both. Errors are therefore carried through numerator and denominator
jointly. They are

- robot: friction, cables and spring, of which the passive arm took its share when it was fitted;
- mass: one factor on the arm's masses, less what the fitted stiffness takes back of it;
- elastic: of the mean stiffness and rest angle;
- between: this movement's own stiffness and rest angle, which differ from that mean;
- noise: of the torque, autocorrelated, as the density of its low frequencies says.

The interval is for what the same formula gives with the true ``tau_user`` and the true ``tau_h``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.arrays import FloatArray, IntArray, frozen_array
from armimpedance.errors import InputError
from armimpedance.therapy.arm.passive_arm import PassiveArm
from armimpedance.therapy.robot.smooth import kernels_for
from armimpedance.therapy.robot.therapy_robot import TherapyRobot
from armimpedance.therapy.share.sums import (
    ANGLE,
    ARM,
    GRADIENT,
    INERTIA,
    ONE,
    RIGID,
    USER,
    row_length,
)

PARTS: Final = ("robot", "mass", "elastic", "between", "noise")

#: Columns of a row that the arm's errors act through.
_ARM_COLUMNS: Final = (ONE, ANGLE, RIGID)

#: A denominator below this, in Nm or Nm^2, is zero; its square would be no number.
_ZERO: Final = 1e-30
#: What is left of tau_h beside the robot's inertia, in squares, is rounding below this part of it.
_ROUNDING: Final = 1e-9


@dataclass(frozen=True)
class VarianceShares:
    """Which part of the variance comes from where; they add up to 1, or are all 0."""

    robot: float
    mass: float
    elastic: float
    between: float
    noise: float


@dataclass(frozen=True)
class ErrorLaw:
    """Errors of the torques about one axis, m of them, independent and of unit variance.

    Attributes
    ----------
    user, arm : (k, m)
        A sample with the row w errs by ``w user`` in tau_user and ``w arm`` in tau_h.
    part : (m,) int
        Of `PARTS`.
    noise : float
        Nm^2: variance that a sample adds to a sum of torques.
    kernel_gain : float
        What the kernel leaves of it in a single sample.
    robot_dof, elastic_dof : float
    """

    user: FloatArray
    arm: FloatArray
    part: IntArray
    noise: float
    kernel_gain: float
    robot_dof: float
    elastic_dof: float

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "user", frozen_array(self.user, "user", (None, None)))
        put(self, "arm", frozen_array(self.arm, "arm", self.user.shape))
        put(self, "part", frozen_array(self.part, "part", self.user.shape[1:], np.int64))
        columns = self.arm[list(_ARM_COLUMNS)]
        put(self, "_arm_gram", frozen_array(columns @ columns.T, "arm", (3, 3)))

    def summed_arm_variance(self, sums: FloatArray) -> FloatArray:
        """``sum_i var(tau_h,i)`` (...) of sums (..., 6, k), Nm^2."""
        products = sums[..., _ARM_COLUMNS, :][..., _ARM_COLUMNS]
        # sum_i w_i H H^T w_i^T = tr(H H^T sum_i w_i^T w_i)
        return np.asarray((products * self._arm_gram).sum((-2, -1)))  # type: ignore[attr-defined]

    def variance_of_arm_sum(self, sums: FloatArray) -> FloatArray:
        """``var(sum_i tau_h,i)`` (...) of sums (..., 6, k), Nm^2."""
        return np.asarray(((sums[..., ONE, :] @ self.arm) ** 2).sum(-1))

    def variance_of_robot_sum(self, sums: FloatArray) -> FloatArray:
        """``var(sum_i tau_r,i)`` (...) of sums (..., 6, k), Nm^2."""
        own = sums[..., ONE, :] @ (self.user - self.arm)
        return np.asarray((own**2).sum(-1))


@dataclass(frozen=True)
class Quotient:
    """A metric in per cent and its errors.

    Attributes
    ----------
    percent : (...)
        NaN where its denominator is zero.
    errors : (..., m)
        Change by one standard deviation of each error of the law.
    noise : (...)
        Variance by the noise of the torque.
    """

    percent: FloatArray
    errors: FloatArray
    noise: FloatArray

    @property
    def sd(self) -> FloatArray:
        """Standard error, percentage points, (...)."""
        return np.asarray(np.sqrt((self.errors**2).sum(-1) + self.noise))


def error_law(
    robot: TherapyRobot, arm: PassiveArm, axis_name: str, sample_rate_hz: float
) -> ErrorLaw:
    """Errors of the torques about this axis.

    Raises
    ------
    InputError
        The robot or this axis of the arm was not calibrated, or the arm with another robot.
    """
    loads, elastic = robot.identified, arm.elastic_of(axis_name)
    p = len(loads.theta)
    if elastic.robot_gradient.shape[1] != p:
        raise InputError(
            f"subject {arm.subject}: measured in a robot of {elastic.robot_gradient.shape[1]} "
            f"parameters ({arm.robot}), {robot.name} has {p}",
            expected="the robot that the arm was measured in",
        )
    theta = np.zeros((row_length(p), p))
    theta[[ANGLE, ONE]] = elastic.robot_gradient
    mass = np.zeros((row_length(p), 1))
    mass[RIGID], mass[[ANGLE, ONE], 0] = 1.0, elastic.mass_gradient
    line = np.zeros((row_length(p), 2))
    line[[ANGLE, ONE]] = np.eye(2)
    # H (k, m) = [theta_h  mass  line  line] roots: all that tau_h errs by
    roots = (
        theta @ _root(loads.covariance),
        mass * arm.mass_sd,
        line @ _root(elastic.covariance),
        line @ _root(elastic.between),
    )
    in_arm = np.hstack(roots)
    # U (k, m) = H, and the robot's own: tau_user = tau_r + tau_h - tau_motor
    in_user = in_arm.copy()
    in_user[GRADIENT:, :p] += _root(loads.covariance)
    part = np.repeat(np.arange(len(roots)), [root.shape[1] for root in roots])
    acts = in_user.any(0)
    smooth = kernels_for(sample_rate_hz).smooth
    return ErrorLaw(
        in_user[:, acts],
        in_arm[:, acts],
        part[acts],
        noise=elastic.noise_density * sample_rate_hz,
        kernel_gain=float(smooth @ smooth),
        robot_dof=loads.dof,
        elastic_dof=elastic.dof,
    )


def _root(covariance: FloatArray) -> FloatArray:
    """A square root R, ``R R^T = covariance``; terms that are known exactly have zero rows."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def ratio(sums: FloatArray, law: ErrorLaw, noise_gain: float | FloatArray = 1.0) -> Quotient:
    """``C = 100 sum tau_user / sum tau_h`` (4); (3) where the sums are of one sample.

    Parameters
    ----------
    sums : (..., 6, k)
    law : ErrorLaw
    noise_gain : float or (...)
        `ErrorLaw.kernel_gain` for a single sample.
    """
    total = sums[..., ONE, :]
    bottom = _not_zero(total[..., ARM])
    share, scale = total[..., USER] / bottom, 100 / bottom
    # dC (..., m) = 100 / D (sum w U - c sum w H): tau_h stands above the line and below it
    errors = scale[..., None] * (total @ law.user - share[..., None] * (total @ law.arm))
    noise = scale**2 * law.noise * noise_gain * total[..., ONE]
    return Quotient(100 * share, errors, noise)


def projection(sums: FloatArray, law: ErrorLaw) -> Quotient:
    """``P = 100 sum(tau_user tau_h) / sum(tau_h^2)``: the least-squares share of tau_h in tau_user.

    Parameters
    ----------
    sums : (..., 6, k)
    law : ErrorLaw
    """
    by_user, by_arm = sums[..., USER, :], sums[..., ARM, :]
    bottom = _not_zero(by_arm[..., ARM])
    share, scale = by_arm[..., USER] / bottom, 100 / bottom
    # dP (..., m) = 100 / D (sum h w U + sum u w H - 2 c sum h w H)
    errors = scale[..., None] * (
        by_arm @ law.user + (by_user - 2 * share[..., None] * by_arm) @ law.arm
    )
    noise = scale**2 * law.noise * bottom
    return Quotient(100 * share, errors, noise)


def share(sums: FloatArray, law: ErrorLaw) -> Quotient:
    """The share of tau_h in tau_user beside any share of the robot's own inertia torque.

    Whoever moves freely moves the robot too. Its inertia is no part of tau_h, but resembles it
    where the arm's torque is small, and the projection counts it. Least squares on both,
    ``tau_user = c tau_h + d M_r qdd``, does not: with h' and u' what is left of tau_h and tau_user
    beside ``M_r qdd``, ``c = sum(u h') / sum(h h')``.

    Parameters
    ----------
    sums : (..., 6, k)
    law : ErrorLaw
    """
    by_user, by_arm = _beside_inertia(sums, USER), _beside_inertia(sums, ARM)
    alone = by_arm[..., ARM] > _ROUNDING * sums[..., ARM, ARM]
    bottom = _not_zero(np.where(alone, by_arm[..., ARM], 0.0))
    part, scale = by_arm[..., USER] / bottom, 100 / bottom
    # dc (..., m) = 100 / D (sum h' w U + sum u' w H - 2 c sum h' w H)
    errors = scale[..., None] * (
        by_arm @ law.user + (by_user - 2 * part[..., None] * by_arm) @ law.arm
    )
    return Quotient(100 * part, errors, scale**2 * law.noise * bottom)


def inertia_share(sums: FloatArray) -> FloatArray:
    """d of `share`, per cent: how much of the robot's inertia the person moves, (...)."""
    own = sums[..., INERTIA, :]
    arm, user = _beside_inertia(sums, ARM), sums[..., USER, :]
    part = arm[..., USER] / _not_zero(arm[..., ARM])
    left = user[..., INERTIA] - part * sums[..., ARM, INERTIA]
    return np.asarray(100 * left / _not_zero(own[..., INERTIA]))


def beside_inertia(sums: FloatArray) -> FloatArray:
    """``sum h'^2 / sum tau_h^2``, (...): what of tau_h is no multiple of the robot's inertia."""
    square = np.maximum(sums[..., ARM, ARM], _ZERO)
    return np.asarray(_beside_inertia(sums, ARM)[..., ARM] / square)


def _beside_inertia(sums: FloatArray, column: int) -> FloatArray:
    """``sum (x - beta M_r qdd) w`` (..., k) for the column x, beta its least-squares share."""
    own = sums[..., INERTIA, :]
    square = own[..., INERTIA]
    beta = np.where(square < _ZERO, 0.0, sums[..., column, INERTIA] / np.maximum(square, _ZERO))
    return np.asarray(sums[..., column, :] - beta[..., None] * own)


def _not_zero(denominator: FloatArray) -> FloatArray:
    return np.where(abs(denominator) < _ZERO, np.nan, denominator)


def variance_parts(quotient: Quotient, law: ErrorLaw) -> FloatArray:
    """Variances (5,) by `PARTS` of one metric."""
    squares = quotient.errors**2
    each = np.bincount(law.part, squares, minlength=len(PARTS) - 1)
    return np.append(each, quotient.noise)


def shares(parts: FloatArray) -> VarianceShares:
    """Parts (5,) of a variance over their sum."""
    total = float(parts.sum())
    each = parts / total if total > 0 else np.zeros(len(PARTS))
    return VarianceShares(*(float(part) for part in each))


def half_width(parts: FloatArray, law: ErrorLaw) -> float:
    """Half of the 95 % interval, of the variance's parts (5,).

    Stiffness and its spread come from few repetitions, friction from more, the masses' factor from
    a table: the degrees of freedom are Welch's and Satterthwaite's, ``(sum v)^2 / sum (v^2 / nu)``.
    """
    from scipy.special import ndtri, stdtrit

    robot, mass, elastic, between, noise = (float(part) for part in parts)
    total = robot + mass + elastic + between + noise
    # elastic and between are both measured by the scatter of the same repetitions
    spread = robot**2 / law.robot_dof + (elastic + between) ** 2 / law.elastic_dof
    if not spread > 0:
        return float(ndtri(0.975) * np.sqrt(total))
    return float(stdtrit(total**2 / spread, 0.975) * np.sqrt(total))
