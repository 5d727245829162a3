"""Errors of the torques about one axis: their sources, and their propagation.

``tau_user = tau_r + tau_h - tau_motor``, and ``tau_h`` is also the denominator: if the assumed arm
is 3 % too heavy, both change. Errors are therefore propagated through numerator and denominator
jointly. They are

- robot: friction, cables and spring, including their effect on the fitted passive arm;
- mass: one factor on the arm's masses, less the compensation by the fitted stiffness;
- elastic: of the mean stiffness and rest angle;
- between: this movement's own stiffness and rest angle, which differ from that mean;
- noise: of the torque, autocorrelated, described by its density at low frequencies.

The interval is for the result of the same formula with the true ``tau_user`` and ``tau_h``.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Final

import numpy as np
from scipy.special import ndtri, stdtrit

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.core.errors import InputError
from armimpedance.joint.therapy.arm.movements import MovementTorques
from armimpedance.joint.therapy.arm.passive_arm import PassiveArm
from armimpedance.joint.therapy.robot.steady import kernels_for
from armimpedance.joint.therapy.robot.therapy_robot import TherapyRobot

# Stored data of a movement: sums of products, whose size does not depend on its length.
#
# Every sample gives a row ``w = (1, tau_user, tau_h, q, rigid, M_r qdd, ..., d tau_r / d theta)``.
# The sums ``B = sum w[:6]^T w`` contain numerator and denominator of every metric, and all that
# their standard errors need. A recording adds them up at once, a running robot sample by sample;
# the later code is the same.

#: Columns of a sample's row; products of the first `FACTORS` with all columns are stored.
ONE, USER, ARM, ANGLE, RIGID, INERTIA = range(6)
FACTORS: Final = 6
#: Then absolute values, and flags as 0 or 1.
ABS_ARM, ABS_SUPPORT, ABS_MOTOR, LOWERING, SATURATED = range(6, 11)
#: Then ``d tau_r / d theta``.
GRADIENT: Final = 11

#: Least power ``-tau_h qd`` with which the arm drives the movement, W; less is rounding at rest.
DRIVING_W: Final = 1e-3

#: Share of its limit from which the motor counts as saturated.
SATURATION: Final = 0.999


def row_length(n_parameters: int) -> int:
    """Number of columns k of a sample's row, for p parameters of the robot."""
    return GRADIENT + n_parameters


def fill_rows(
    rows: FloatArray,
    *,
    q: FloatArray,
    qd: FloatArray,
    motor: FloatArray,
    robot: FloatArray,
    rigid_arm: FloatArray,
    elastic: FloatArray,
    robot_inertia: FloatArray,
    robot_gradient: FloatArray,
    torque_limit_Nm: float,
) -> None:
    """Write the rows of all samples of a movement, or the row of a single sample.

    `robot_gradient` (S, p) or (p,).
    `rows` (S, k) or (k,): output.
    `q`, `qd`, `motor`, `robot`, `rigid_arm`, `elastic`, `robot_inertia` (S,) or (): as in
    `MovementTorques`.
    `torque_limit_Nm`: limit of this axis' motor.
    """
    arm, support = rigid_arm + elastic, motor - robot
    rows[..., ONE] = 1.0
    rows[..., USER] = arm - support
    rows[..., ARM] = arm
    rows[..., ANGLE] = q
    rows[..., RIGID] = rigid_arm
    rows[..., INERTIA] = robot_inertia
    rows[..., ABS_ARM] = abs(arm)
    rows[..., ABS_SUPPORT] = abs(support)
    rows[..., ABS_MOTOR] = abs(motor)
    rows[..., LOWERING] = arm * qd < -DRIVING_W
    rows[..., SATURATED] = abs(motor) >= SATURATION * torque_limit_Nm
    rows[..., GRADIENT:] = robot_gradient


def movement_rows(torques: MovementTorques, torque_limit_Nm: float) -> FloatArray:
    """Rows (S, k) of a movement, including those in which the axis stands still."""
    rows = np.empty((len(torques.time_s), row_length(torques.robot_gradient.shape[1])))
    fill_rows(
        rows,
        q=torques.q,
        qd=torques.qd,
        motor=torques.motor,
        robot=torques.robot,
        rigid_arm=torques.rigid_arm,
        elastic=torques.elastic,
        robot_inertia=torques.robot_inertia,
        robot_gradient=torques.robot_gradient,
        torque_limit_Nm=torque_limit_Nm,
    )
    return rows


def sums_of(rows: FloatArray) -> FloatArray:
    """Sums B (6, k) of the rows (S, k) of a movement."""
    return np.asarray(rows[:, :FACTORS].T @ rows)


def products_of(rows: FloatArray) -> FloatArray:
    """Products of every single sample, (S, 6, k) from (S, k)."""
    return np.asarray(rows[..., :FACTORS, None] * rows[..., None, :])


def window_sums(rows: FloatArray, window: int) -> FloatArray:
    """Sums (S, 6, k) over the last `window` samples up to each one; fewer at the start.

    `rows` (S, k).
    `window`: number of samples, including the last.
    """
    products = products_of(rows)
    samples = len(products)
    padded = np.zeros((-(-samples // window) * window, *products.shape[1:]))
    padded[:samples] = products
    blocks = padded.reshape(-1, window, *products.shape[1:])
    # A window is the end of one block plus the start of the next. Nothing is subtracted, so windows
    # with small tau_h lose no accuracy in a movement with large tau_h.
    starts = np.cumsum(blocks, axis=1)
    ends = np.cumsum(blocks[:, ::-1], axis=1)[:, ::-1]
    sums = starts
    sums[1:, :-1] += ends[:-1, 1:]
    return np.asarray(sums.reshape(padded.shape)[:samples])


PARTS: Final = ("robot", "mass", "elastic", "between", "noise")

#: Columns of a row through which the arm's errors act.
_ARM_COLUMNS: Final = (ONE, ANGLE, RIGID)


@dataclass(frozen=True)
class VarianceShares:
    """Shares of the variance by source; they add up to 1, or are all 0."""

    robot: float
    mass: float
    elastic: float
    between: float
    noise: float


@dataclass(frozen=True)
class ErrorLaw(FrozenRecord):
    """Errors of the torques about one axis, m of them, independent and of unit variance.

    `user`, `arm` (k, m): a sample with the row w has the errors ``w user`` in tau_user and
    ``w arm`` in tau_h.
    `part` (m,) int: index in `PARTS` of each error.
    `noise`: variance that a sample adds to a sum of torques, N m^2.
    `kernel_gain`: share of it in a single sample after the kernel.
    `robot_dof`, `elastic_dof`: degrees of freedom of the robot's loads and of the arm's stiffness.
    """

    user: Annotated[FloatArray, "k m"]
    arm: Annotated[FloatArray, "k m"]
    part: Annotated[IntArray, "m"]
    noise: float
    kernel_gain: float
    robot_dof: float
    elastic_dof: float

    @cached_property
    def _arm_gram(self) -> FloatArray:
        columns = self.arm[list(_ARM_COLUMNS)]
        return np.asarray(columns @ columns.T)

    def summed_arm_variance(self, sums: FloatArray) -> FloatArray:
        """Sum ``sum_i var(tau_h,i)`` (...) from sums (..., 6, k), N m^2."""
        products = sums[..., _ARM_COLUMNS, :][..., _ARM_COLUMNS]
        # sum_i w_i H H^T w_i^T = tr(H H^T sum_i w_i^T w_i)
        return np.asarray((products * self._arm_gram).sum((-2, -1)))

    def variance_of_arm_sum(self, sums: FloatArray) -> FloatArray:
        """Variance ``var(sum_i tau_h,i)`` (...) from sums (..., 6, k), N m^2."""
        return np.asarray(((sums[..., ONE, :] @ self.arm) ** 2).sum(-1))

    def variance_of_robot_sum(self, sums: FloatArray) -> FloatArray:
        """Variance ``var(sum_i tau_r,i)`` (...) from sums (..., 6, k), N m^2."""
        own = sums[..., ONE, :] @ (self.user - self.arm)
        return np.asarray((own**2).sum(-1))

    def variance_parts(self, errors: FloatArray, noise: FloatArray) -> FloatArray:
        """Variances (5,) by `PARTS` of a value with errors (m,) and this noise variance."""
        return np.append(np.bincount(self.part, errors**2, minlength=len(PARTS) - 1), noise)

    def half_width(self, parts: FloatArray) -> float:
        """Half-width of the 95 % interval, from the variance's parts (5,).

        Stiffness and its spread come from few repetitions, friction from more, the masses' factor
        from a table. The degrees of freedom are therefore those of Welch and Satterthwaite,
        ``(sum v)^2 / sum (v^2 / nu)``.
        """
        robot, mass, elastic, between, noise = (float(part) for part in parts)
        total = robot + mass + elastic + between + noise
        # elastic and between are both estimated from the scatter of the same repetitions
        spread = robot**2 / self.robot_dof + (elastic + between) ** 2 / self.elastic_dof
        if not spread > 0:
            return float(ndtri(0.975) * np.sqrt(total))
        return float(stdtrit(total**2 / spread, 0.975) * np.sqrt(total))


def error_law(
    robot: TherapyRobot, arm: PassiveArm, axis_name: str, sample_rate_hz: float
) -> ErrorLaw:
    """Errors of the torques about this axis.

    Raises InputError: the robot or this axis of the arm was not calibrated, or the arm with another
    robot.
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
    # H (k, m) = [theta_h  mass  line  line] roots: all errors of tau_h
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
    """Square root R, ``R R^T = covariance``; exactly known terms have zero rows."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))
