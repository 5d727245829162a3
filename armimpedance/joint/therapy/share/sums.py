"""What is kept of a movement: sums of products that do not grow with it.

Every sample gives a row ``w = (1, tau_user, tau_h, q, rigid, M_r qdd, ..., d tau_r / d theta)``.
The sums ``B = sum w[:6]^T w`` hold numerator and denominator of every metric and all that their
standard errors need. A recording adds them up at once, a running robot sample by sample: what
follows from them is the same code.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.therapy.arm.torques import MovementTorques

#: Columns of a sample's row; products are kept of the first `FACTORS` with all others.
ONE, USER, ARM, ANGLE, RIGID, INERTIA = range(6)
FACTORS: Final = 6
#: Then magnitudes, and truths as 0 or 1.
ABS_ARM, ABS_SUPPORT, ABS_MOTOR, LOWERING, SATURATED = range(6, 11)
#: Then ``d tau_r / d theta``.
GRADIENT: Final = 11

#: W. The arm drives the movement where ``-tau_h qd`` is more; at rest, rounding decides its sign.
DRIVING_W: Final = 1e-3

#: From this share of its limit on the motor is taken for saturated.
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
    """Write the rows of all samples of a movement, or the row of one.

    Parameters
    ----------
    rows : (S, k) or (k,)
        Written to.
    q, qd, motor, robot, rigid_arm, elastic, robot_inertia : (S,) or ()
        As in `MovementTorques`.
    robot_gradient : (S, p) or (p,)
    torque_limit_Nm : float
        Limit of this axis' motor.
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
    """Rows (S, k) of a movement, those in which the axis stands still with them."""
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
    """The sums of every sample alone, (S, 6, k) of (S, k)."""
    return np.asarray(rows[..., :FACTORS, None] * rows[..., None, :])


def window_sums(rows: FloatArray, window: int) -> FloatArray:
    """Sums (S, 6, k) over the last `window` samples up to each one; fewer at the start.

    Parameters
    ----------
    rows : (S, k)
    window : int
        Samples, the last one included.
    """
    products = products_of(rows)
    samples = len(products)
    padded = np.zeros((-(-samples // window) * window, *products.shape[1:]))
    padded[:samples] = products
    blocks = padded.reshape(-1, window, *products.shape[1:])
    # A window is the end of one block and the start of the next: nothing is subtracted, so that
    # a window in which tau_h is small loses no digits to a movement in which it is large.
    starts = np.cumsum(blocks, axis=1)
    ends = np.cumsum(blocks[:, ::-1], axis=1)[:, ::-1]
    sums = starts
    sums[1:, :-1] += ends[:-1, 1:]
    return np.asarray(sums.reshape(padded.shape)[:samples])
