"""The arm's dynamics seen at the hand: Tsuji (1997), eqs. (14)-(20).

``M qdd + h + g = tau`` becomes ``Lambda_e Xdd + h_e + g_e = Jbar^T tau`` for an arm of n >= d
joints. Every function takes leading batch axes: J (..., d, n), M (..., n, n).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError, NotIdentifiableError

#: Above this condition of J the hand cannot move along some direction, to rounding.
SINGULAR_CONDITION = 1e8


def _checked(J: ArrayLike, M: ArrayLike) -> tuple[FloatArray, FloatArray]:
    J, M = np.asarray(J, dtype=float), np.asarray(M, dtype=float)
    if J.ndim < 2 or M.shape[-2:] != (J.shape[-1], J.shape[-1]):
        wanted = "J (..., d, n) and M (..., n, n)"
        raise InputError(
            f"Jacobian of shape {J.shape}, inertia of shape {M.shape}", expected=wanted
        )
    require_full_rank(J)
    return J, M


def require_full_rank(J: FloatArray) -> None:
    """Raise NotIdentifiableError where the hand cannot move along some direction.

    Parameters
    ----------
    J : (..., d, n)
    """
    d, n = J.shape[-2:]
    if n < d:
        raise NotIdentifiableError(f"{n} joints cannot move the hand along {d} axes independently")
    condition = np.linalg.cond(J)
    if not np.all(condition < SINGULAR_CONDITION):
        raise NotIdentifiableError(
            f"singular posture: the hand cannot move along some direction "
            f"(condition of the Jacobian {np.max(condition):.3g})"
        )


def hand_inertia(J: ArrayLike, M: ArrayLike) -> FloatArray:
    """``Lambda_e = (J M^-1 J^T)^-1``, eq. (17), kg, (..., d, d).

    Parameters
    ----------
    J : (..., d, n)
        Jacobian of the hand.
    M : (..., n, n)
        Inertia of the joints, kg m^2.

    Returns
    -------
    (..., d, d)
        Inertia of the hand, kg.

    Raises
    ------
    InputError
        Shapes do not fit.
    NotIdentifiableError
        Singular posture, or fewer joints than hand axes.
    """
    J, M = _checked(J, M)
    # J (d, n) M^-1 (n, n) J^T (n, d)
    mobility = J @ np.linalg.solve(M, np.swapaxes(J, -1, -2))
    return np.linalg.inv(mobility)


def dynamic_inverse(J: ArrayLike, M: ArrayLike) -> FloatArray:
    """``Jbar = M^-1 J^T Lambda_e``, eq. (20): ``J Jbar = I``.

    Parameters
    ----------
    J : (..., d, n)
        Jacobian of the hand.
    M : (..., n, n)
        Inertia of the joints, kg m^2.

    Returns
    -------
    (..., n, d)

    Raises
    ------
    InputError
        Shapes do not fit.
    NotIdentifiableError
        Singular posture, or fewer joints than hand axes.
    """
    J, M = _checked(J, M)
    # M^-1 (n, n) J^T (n, d) Lambda_e (d, d)
    return np.linalg.solve(M, np.swapaxes(J, -1, -2)) @ hand_inertia(J, M)


def hand_bias(J: ArrayLike, Jdot_qd: ArrayLike, M: ArrayLike, h: ArrayLike) -> FloatArray:
    """``h_e = Jbar^T h - Lambda_e Jdot qd``, eq. (18).

    Parameters
    ----------
    J : (..., d, n)
        Jacobian of the hand.
    Jdot_qd : (..., d)
        ``dJ/dt qd``, m/s^2.
    M : (..., n, n)
        Inertia of the joints, kg m^2.
    h : (..., n)
        Coriolis and centrifugal torque, N m.

    Returns
    -------
    (..., d)
        Force at the hand, N.

    Raises
    ------
    InputError
        Shapes do not fit.
    NotIdentifiableError
        Singular posture, or fewer joints than hand axes.
    """
    return hand_gravity(J, M, h) - np.einsum(
        "...ij,...j->...i", hand_inertia(J, M), np.asarray(Jdot_qd, dtype=float)
    )


def hand_gravity(J: ArrayLike, M: ArrayLike, g: ArrayLike) -> FloatArray:
    """``g_e = Jbar^T g``, eq. (19).

    Parameters
    ----------
    J : (..., d, n)
        Jacobian of the hand.
    M : (..., n, n)
        Inertia of the joints, kg m^2.
    g : (..., n)
        Gravity torque, N m.

    Returns
    -------
    (..., d)
        Force at the hand, N.

    Raises
    ------
    InputError
        Shapes do not fit.
    NotIdentifiableError
        Singular posture, or fewer joints than hand axes.
    """
    return np.einsum("...ji,...j->...i", dynamic_inverse(J, M), np.asarray(g, dtype=float))
