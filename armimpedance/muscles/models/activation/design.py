"""The linear equations of joint stiffness over muscle activation at one posture.

``K_j = G^T K_m G`` with ``K_m = diag f_i(alpha_i)`` (Tsuji 1997, (11), (31)) and
``f_i = sum_k c_ik alpha_i^k`` (38): each muscle adds ``f_i(alpha_i) A_i``, with a pattern
``A_i = g_i g_i^T`` that is known from its moment arms ``g_i``. A muscle that bears a tension adds
its length's curvature: with a tension in proportion to stiffness, ``t_i = f_i / kappa``, that is
``A_i = g_i g_i^T + d2L_i / kappa``.

The six constants c_i0 reach the joint only through ``K_0 = sum_i c_i0 A_i``: three numbers. So 6 (N
+ 1) coefficients are 6 N + 3 that data can tell.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.limb.arm import MuscularArm
from armimpedance.muscles.models.packed import triple
from armimpedance.muscles.models.rows import ELEMENTS


def muscle_patterns(
    arm: MuscularArm, q: ArrayLike, *, curvature: bool, stiffness_per_tension: float
) -> FloatArray:
    """What one N/m of each muscle adds to ``ss, se, ee`` at a posture q (..., 2), (..., m, 3)."""
    G = arm.paths.moment_arms(q)
    A = G[..., :, None] * G[..., None, :]
    if curvature:
        A = A + arm.paths.curvature(q) / stiffness_per_tension
    return triple(A)


def powers(activation: FloatArray, order: int) -> FloatArray:
    """``alpha^1 .. alpha^N`` of activations (P, m), (P, m, N)."""
    return activation[..., None] ** np.arange(1, order + 1)


def power_slopes(activation: FloatArray, order: int) -> FloatArray:
    """Their derivatives by alpha, (P, m, N)."""
    k = np.arange(1, order + 1)
    return k * activation[..., None] ** (k - 1)


def joint_columns(activation: FloatArray, patterns: FloatArray, order: int) -> FloatArray:
    """Regressors (P, 3, 3 + m N) of ``ss, se, ee``: ``K_0``, then ``alpha_i^k A_i``."""
    P, m = activation.shape
    # (P, 3, m, N): of element e, the pattern A_ie times alpha_i^k
    active = patterns.T[None, :, :, None] * powers(activation, order)[:, None]
    constants = np.broadcast_to(np.eye(3), (P, 3, 3))
    return np.concatenate([constants, active.reshape(P, 3, m * order)], axis=-1)


def torque_columns(
    activation: FloatArray, G: FloatArray, stiffness_per_tension: float, order: int
) -> FloatArray:
    """Regressors (P, 2, 3 + m N + 2) of the torque ``tau_0 - G^T t``, t = c alpha^k / kappa."""
    P, m = activation.shape
    active = -G.T[None, :, :, None] * powers(activation, order)[:, None] / stiffness_per_tension
    columns = [np.zeros((P, 2, 3)), active.reshape(P, 2, m * order)]
    return np.concatenate([*columns, np.broadcast_to(np.eye(2), (P, 2, 2))], axis=-1)


def slopes_by_activation(
    activation: FloatArray, coefficients: FloatArray, reach: FloatArray
) -> FloatArray:
    """Derivative (P, r, m) of r outputs by each activation.

    Parameters
    ----------
    activation : (P, m)
    coefficients : (m, N)
        ``c_ik``.
    reach : (m, r)
        Contribution of one N/m (or N s/m) of each muscle to each output.
    """
    order = coefficients.shape[1]
    df = (power_slopes(activation, order) * coefficients).sum(axis=-1)
    return np.asarray(df[:, None, :] * reach.T)


def column_names(symbol: str, muscles: tuple[str, ...], order: int) -> tuple[str, ...]:
    """Names of `joint_columns`: ``K_0_ss``, then ``c_pectoralis_major_1``; b for viscosity."""
    letter = "c" if symbol == "K" else "b"
    active = (f"{letter}_{muscle}_{k}" for muscle in muscles for k in range(1, order + 1))
    return (*(f"{symbol}_0_{element}" for element in ELEMENTS), *active)
