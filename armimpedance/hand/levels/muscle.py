"""Stiffness and viscosity of the joints from those of the muscles.

With ``tau = -G^T f`` (Tsuji (1997), eq. (6)) and muscles whose tension grows by k per lengthening,
``K_j = -dtau/dq = G^T K_m G + sum_n f_n d2L_n/dq2``. The source's eq. (11) lacks the second term;
it holds where the muscles bear no tension or their moment arms are constant.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError


def joint_stiffness(
    G: ArrayLike,
    K_m: ArrayLike,
    tensions: ArrayLike | None = None,
    curvature: ArrayLike | None = None,
) -> FloatArray:
    """``K_j = G^T K_m G + sum_n f_n d2L_n``; Tsuji (1997), eq. (11) without the second term.

    Parameters
    ----------
    G : (..., m, n)
        Moment arms dL/dq, m.
    K_m : (..., m)
        Stiffness of each muscle, N/m.
    tensions : (..., m), optional
        N; with `curvature`. Without both the second term is left out, as the source does.
    curvature : (..., m, n, n), optional
        d2L/dq2, m.

    Returns
    -------
    (..., n, n)
        N m/rad.

    Raises
    ------
    InputError
        Shapes that do not belong together, or only one of `tensions` and `curvature`.
    """
    if (tensions is None) != (curvature is None):
        raise InputError("the curvature term needs both tensions and curvature", expected="both")
    K_j = _through_arms(G, K_m)
    if tensions is None or curvature is None:
        return K_j
    return K_j + curvature_term(tensions, curvature)


def joint_viscosity(G: ArrayLike, B_m: ArrayLike) -> FloatArray:
    """``B_j = G^T B_m G``; Tsuji (1997), eq. (13).

    Parameters
    ----------
    G : (..., m, n)
        Moment arms dL/dq, m.
    B_m : (..., m)
        Viscosity of each muscle, N s/m.

    Returns
    -------
    (..., n, n)
        N m s/rad.
    """
    return _through_arms(G, B_m)


def curvature_term(tensions: ArrayLike, curvature: ArrayLike) -> FloatArray:
    """``sum_n f_n d2L_n/dq2``, N m/rad, (..., n, n), of tensions (..., m)."""
    f, C = np.asarray(tensions, dtype=float), np.asarray(curvature, dtype=float)
    if C.ndim < 3 or f.ndim < 1 or f.shape[-1] != C.shape[-3]:
        raise InputError(
            f"tensions {f.shape} and curvature {C.shape}", expected="(..., m) and (..., m, n, n)"
        )
    return np.einsum("...m,...mij->...ij", f, C)


def _through_arms(G: ArrayLike, per_muscle: ArrayLike) -> FloatArray:
    """``G^T (n, m) diag(k) (m, m) G (m, n)``."""
    arms, k = np.asarray(G, dtype=float), np.asarray(per_muscle, dtype=float)
    if arms.ndim < 2 or k.ndim < 1 or k.shape[-1] != arms.shape[-2]:
        raise InputError(
            f"moment arms {arms.shape} and muscles {k.shape}", expected="(..., m, n) and (..., m)"
        )
    return np.einsum("...mi,...m,...mj->...ij", arms, k, arms)
