"""Joints that the hand does not show: inertia and viscosity of slow motion, their slowest mode.

A hand that hangs on more joints than it has directions answers at once with one inertia and
viscosity, and with others where it moves so slowly that its joints keep their balance. With all
joints' ``A(s) = M s^2 + B s + K`` the hand's ``(J A^-1 J^T)^-1`` is for small s

    K_e + s V^T B V + s^2 (V^T M V - V^T B N (N^T K N)^-1 N^T B V),

V (r, 3) the joints' motion under a slow unit of the hand's and N (r, r - 3) a basis of what leaves
the hand where it is.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh

from armimpedance.core.arrays import FloatArray


def slow_motion(
    J: FloatArray, M: FloatArray, B: FloatArray, K: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Inertia and viscosity (3, 3) of slow motion.

    Parameters
    ----------
    J : (3, r)
        Of the joints that move.
    M, B, K : (r, r)
        Theirs; K with the weight's gradient and the term of the hand's force.
    """
    V = np.linalg.solve(K, J.T)
    V = V @ np.linalg.inv(J @ V)
    N = np.linalg.svd(J)[2][3:].T
    lag = N.T @ B @ V  # (r - 3, 3): what drags the inner joints behind
    return V.T @ M @ V - lag.T @ np.linalg.solve(N.T @ K @ N, lag), V.T @ B @ V


def slowest_mode(J: FloatArray, M: FloatArray, B: FloatArray, K: FloatArray) -> tuple[float, float]:
    """Natural frequency (Hz) and damping ratio of the slowest motion while the hand is held.

    Parameters
    ----------
    J : (3, r)
    M, B, K : (r, r)
        As for `slow_motion`.

    Returns
    -------
    tuple of float
        0, 0 where the hand holds all joints.
    """
    N = np.linalg.svd(J)[2][3:].T
    if not N.size:
        return 0.0, 0.0
    n = N @ eigh(N.T @ (K + K.T) / 2 @ N, N.T @ M @ N)[1][:, 0]
    mass, damping, stiffness = n @ M @ n, n @ B @ n, n @ K @ n
    hz = np.sqrt(stiffness / mass) / (2 * np.pi)
    return float(hz), float(damping / (2 * np.sqrt(stiffness * mass)))
