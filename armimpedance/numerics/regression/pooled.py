"""All clusters in the basis in which the pooled regressors are orthonormal.

In that basis the pooled Gram matrix is the identity, so that Gram matrices of single clusters are
harmless whatever the condition of the raw columns: leaving out, weighting and summing clusters
is done there, and one triangular solve brings the answer back to SI.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import NotIdentifiableError
from armimpedance.numerics.regression.diagnose import Conditioning, conditioning, refuse_rank_loss
from armimpedance.numerics.regression.factors import TrialFactors

#: What must remain of the information about any direction when clusters are left out.
LEAST_INFORMATION = 1e-10


@dataclass(frozen=True)
class Pooled:
    """The least-squares solution over all clusters and each cluster's part in it.

    Attributes
    ----------
    triangle : (p, p)
        R of the stacked W = Z R.
    coefficients : (p, q)
        Theta, SI.
    residual_triangle : (q, q)
        Triangle of the residuals E = Y - W Theta: ``E^T E`` is its cross product.
    total_squares : (q,)
        Sums of squares of Y: about the mean where the model has an intercept, else about zero.
    gram : (T, p, p)
        ``Z_t^T Z_t``; they sum to the identity.
    score : (T, p, q)
        ``Z_t^T E_t``; they sum to zero.
    state : Conditioning
    """

    triangle: FloatArray
    coefficients: FloatArray
    residual_triangle: FloatArray
    total_squares: FloatArray
    gram: FloatArray
    score: FloatArray
    state: Conditioning

    def to_si(self, orthonormal: FloatArray) -> FloatArray:
        """Bring (p, n) from the orthonormal basis back: solve ``R x = z``."""
        scale = self.state.scale[:, None]
        # (R / scale) (p, p) (scale x) (p, n) = z (p, n)
        scaled = solve_triangular(self.triangle / self.state.scale, orthonormal, check_finite=False)
        return np.asarray(scaled / scale)


def pool(factors: TrialFactors) -> Pooled:
    """Solve over all clusters and express each in the pooled orthonormal basis.

    The solution stays with the factors, which cannot change: fit, leave-one-out and bootstrap of
    the same clusters share it.

    Parameters
    ----------
    factors : TrialFactors

    Returns
    -------
    Pooled
        The coefficients of all clusters, and each cluster in the pooled orthonormal basis.

    Raises
    ------
    NotIdentifiableError
        The columns of W lose rank; names the regressors.
    """
    known: Pooled | None = getattr(factors, "_pooled", None)
    if known is None:
        known = _pool(factors)
        object.__setattr__(factors, "_pooled", known)
    return known


def _pool(factors: TrialFactors) -> Pooled:
    p, k = factors.n_regressors, factors.r.shape[1]
    stack = factors.r.reshape(-1, k)
    # [W Y] (T k, p + q) = [Z U] (T k, p + q) [[R, Z^T Y], [0, R_E]]
    basis, r = np.linalg.qr(stack)
    triangle, cross, residual = r[:p, :p], r[:p, p:], r[p:, p:]
    state = conditioning(triangle, int(factors.rows.sum()))
    refuse_rank_loss(state, factors.regressors)
    Z = basis[:, :p].reshape(-1, k, p)
    E = (basis[:, p:] @ residual).reshape(-1, k, k - p)
    Zt = Z.transpose(0, 2, 1)
    scaled = solve_triangular(triangle / state.scale, cross, check_finite=False)
    return Pooled(
        triangle=triangle,
        coefficients=scaled / state.scale[:, None],
        residual_triangle=residual,
        total_squares=_total_squares(factors, stack),
        gram=Zt @ Z,
        score=Zt @ E,
        state=state,
    )


def leave_out_scores(pooled: Pooled) -> FloatArray:
    """``(I - G_t)^-1 s_t`` (T, p, q): how far each cluster moved the solution.

    Raises
    ------
    NotIdentifiableError
        One cluster alone informs some direction: the others cannot do without it.
    """
    p = len(pooled.triangle)
    rest = np.eye(p) - pooled.gram
    # (I - G_t) (p, p) d_t (p, q) = s_t (p, q), for all t
    moved, pivot = solve_positive(np.moveaxis(rest, 0, -1), np.moveaxis(pooled.score, 0, -1))
    if (pivot < LEAST_INFORMATION).any():
        alone = int(np.argmin(pivot))
        raise NotIdentifiableError(
            f"without cluster {alone} (counted from 0) the others do not identify the parameters"
        )
    return np.moveaxis(moved, -1, 0)


def solve_positive(A: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Solve many small positive definite systems at once by Cholesky elimination.

    The systems lie along the **last** axis, so that each step is one long vector operation:
    for 1,000 systems of 6 unknowns several times faster than one library call per system.

    Parameters
    ----------
    A : (p, p, n)
    b : (p, q, n)

    Returns
    -------
    x : (p, q, n)
        Meaningless where the pivot is not positive, but finite.
    pivot : (n,)
        Smallest pivot of each elimination; zero at rank loss.
    """
    p = len(A)
    A, x = A.copy(), b.copy()
    smallest = np.full(A.shape[2], np.inf)
    for j in range(p):
        smallest = np.minimum(smallest, A[j, j])
        pivot = np.where(A[j, j] > 0, A[j, j], 1.0)
        x[j] /= pivot
        A[j, j + 1 :] /= pivot
        below = A[j + 1 :, j]
        A[j + 1 :, j + 1 :] -= below[:, None] * A[j, None, j + 1 :]
        x[j + 1 :] -= below[:, None] * x[j]
    for j in range(p - 2, -1, -1):
        x[j] -= (A[j, j + 1 :, None] * x[j + 1 :]).sum(axis=0)
    return x, smallest


def _total_squares(factors: TrialFactors, stack: FloatArray) -> FloatArray:
    Y = stack[:, factors.n_regressors :]
    if factors.intercept is not None:
        constant = stack[:, factors.regressors.index(factors.intercept)]
        # In the factor the column of ones is no longer ones, but still that direction.
        Y = Y - np.outer(constant, constant @ Y) / (constant @ constant)
    return np.asarray((Y**2).sum(axis=0))
