"""Refinement of a fit where the samples are at hand and every digit counts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_triangular

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.numerics.regression import Fit


def refine(fit: Fit, W: ArrayLike, Y: ArrayLike, *, steps: int = 5) -> Fit:
    """Improve the coefficients by iterative refinement of the augmented system.

    Solution and residual are corrected together (Bjorck 1967), the residuals of both equations
    in extended precision, so that the error no longer grows with the squared condition number
    times the size of the residuals. W in `np.longdouble` is used at that precision. The
    covariance stays.

    Parameters
    ----------
    W : (N, p)
    Y : (N, q)
        The rows that were fitted.

    Raises
    ------
    InputError
        Shapes that do not belong to the fit.
    """
    A, B = np.asarray(W, dtype=np.longdouble), np.asarray(Y, dtype=np.longdouble)
    p, q = fit.coefficients.shape
    if A.ndim != 2 or A.shape[1] != p or B.shape != (len(A), q):
        raise InputError(
            f"regressors of shape {A.shape}, outputs of shape {B.shape}",
            expected=f"(rows, {p}) and (rows, {q})",
        )
    # Powers of two scale without rounding.
    scale = np.exp2(np.round(np.log2(np.linalg.norm(A.astype(np.float64), axis=0))))
    A = A / scale
    Q, R = np.linalg.qr(A.astype(np.float64))
    x = fit.coefficients.astype(np.longdouble) * scale[:, None]
    E = B - A @ x
    for _ in range(steps):
        # [[I, A], [A^T, 0]] [dE; dx] = [f; g] with f (N, q) = B - E - A x, g (p, q) = -A^T E
        f = (B - E - A @ x).astype(np.float64)
        g = (-(A.T @ E)).astype(np.float64)
        dE, dx = _augmented_step(Q, R, f, g)
        E, x = E + dE, x + dx
    return replace(fit, coefficients=(x / scale[:, None]).astype(np.float64))


def _augmented_step(
    Q: FloatArray, R: FloatArray, f: FloatArray, g: FloatArray
) -> tuple[FloatArray, FloatArray]:
    h = solve_triangular(R, g, trans="T")
    d = Q.T @ f
    return f - Q @ (d - h), solve_triangular(R, d - h)
