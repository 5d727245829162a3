"""One matrix over posture as free polynomials: the source's least squares, Tsuji (1997), 5.2.

Moment arms of order L make every element of ``K_j = G^T K_m G`` a polynomial of order 2L in the
joint angles. Each element is fitted on its own, se and es with one common polynomial. Nothing
keeps the matrix positive definite.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import block_diag

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.progress import Progress
from armimpedance.muscles.models.fitted_model import correlations
from armimpedance.muscles.models.posture.certificate import exponents, monomials, term_names
from armimpedance.muscles.models.posture.data import FittedMatrix, PostureData, element_names
from armimpedance.muscles.models.posture.models import PostureMethod
from armimpedance.muscles.models.posture.sos import checked_rank

#: Shuffles of the rows whose R is averaged.
_SHUFFLES = 400

#: A leverage above this is 1 rounded: without that posture a coefficient cannot be told.
_FULL_LEVERAGE = 1 - 1e-8


def fit_polynomial(
    data: PostureData,
    order: int,
    rng: np.random.Generator,
    progress: Progress,
    judged: bool = True,
) -> FittedMatrix:
    """Weighted least squares of each element.

    Covariance: without standard errors ``S kron (X^T X)^-1``, S (3, 3) the residuals' own; with
    them the weights', times the residuals' mean square over them where that is above 1.

    Raises NotIdentifiableError: the postures cannot tell all terms; names them.
    Raises InputError: as many coefficients as postures, and no standard errors.
    """
    powers = exponents(2 * order)
    X = monomials(data.scaled, powers)
    state = checked_rank(X, term_names(powers), order)
    spare = data.n_rows - X.shape[1]
    if spare == 0 and data.sd is None:
        raise InputError(
            f"{data.n_rows} postures for {X.shape[1]} coefficients of order {order}: none to "
            "spare to judge errors by",
            expected=f"{X.shape[1] + 1} postures or more, or standard errors",
        )
    solved = [_solve(X, data, j) for j in range(3)]
    C = np.stack([one.coefficients for one in solved], axis=1)
    residual = data.values - X @ C
    scaled_up, covariance = _covariance(solved, residual, data, spare)
    leverage = np.stack([one.leverage for one in solved], axis=1)
    progress(1, 1)
    return FittedMatrix(
        symbol=data.symbol,
        powers=powers,
        coefficients=C,
        covariance=covariance,
        dof=float(spare) if scaled_up else float("inf"),
        held_out=_held_out(data, residual, leverage),
        null_r=_null_r(X, data, rng) if judged else np.full(4, np.nan),
        spent=(float(X.shape[1]),) * 3,
        cond_scaled=state.cond_scaled,
        rank=state.rank,
        structure="free",
        penalty=0.0,
        warnings=_warnings(data.symbol, spare, order),
    )


class _Solved:
    """One element: coefficients (p,), leverage (P,), inverse (p, p) of ``X^T W X``."""

    def __init__(self, X: FloatArray, y: FloatArray, weight: FloatArray) -> None:
        # w X (P, p) = Z (P, p) R (p, p); R c = Z^T w y
        Z, R = np.linalg.qr(weight[:, None] * X)
        back = np.linalg.inv(R)
        self.coefficients = back @ (Z.T @ (weight * y))
        self.leverage = (Z**2).sum(axis=1)
        self.inverse = back @ back.T


def _solve(X: FloatArray, data: PostureData, j: int) -> _Solved:
    weight = np.ones(data.n_rows) if data.sd is None else 1 / data.sd[:, j]
    return _Solved(X, data.values[:, j], weight)


def _covariance(
    solved: list[_Solved], residual: FloatArray, data: PostureData, spare: int
) -> tuple[bool, FloatArray]:
    """True if residuals scale it, and the covariance (3p, 3p): all of ss, then se, then ee."""
    if data.sd is None:
        S = residual.T @ residual / spare
        return True, np.kron(S, solved[0].inverse)
    blocks, scaled_up = [], False
    for j, one in enumerate(solved):
        excess = float(((residual[:, j] / data.sd[:, j]) ** 2).sum()) / spare if spare else 1.0
        scaled_up |= excess > 1
        blocks.append(max(excess, 1.0) * one.inverse)
    return scaled_up, np.asarray(block_diag(*blocks))


def _held_out(data: PostureData, residual: FloatArray, leverage: FloatArray) -> FloatArray | None:
    """Predictions (P, 3) of each posture by a fit without it; None where there is none."""
    if (leverage > _FULL_LEVERAGE).any():
        return None
    return np.asarray(data.values - residual / (1 - leverage))


def _null_r(X: FloatArray, data: PostureData, rng: np.random.Generator) -> FloatArray:
    """Mean R (4,) of ss, se, es, ee over shuffles of the rows."""
    orders = rng.permuted(np.tile(np.arange(data.n_rows), (_SHUFFLES, 1)), axis=1)
    r_of_draws = np.zeros(4)
    for j, elements in enumerate((((0, 0),), ((0, 1), (1, 0)), ((1, 1),))):
        weight = np.ones(data.n_rows) if data.sd is None else 1 / data.sd[:, j]
        w, y = weight[orders], data.values[:, j][orders]
        # batched over shuffles: w X (n, P, p) = Z R, fitted (n, P) = Z Z^T w y / w
        Z = np.linalg.qr(w[..., None] * X)[0]
        fitted = np.einsum("npi,ni->np", Z, np.einsum("npi,np->ni", Z, w * y)) / w
        for a, b in elements:
            measured = data.measured[:, a, b][orders]
            r_of_draws[2 * a + b] = correlations(measured, fitted).mean()
    return r_of_draws


def _warnings(symbol: str, spare: int, order: int) -> tuple[str, ...]:
    if spare > 0:
        return ()
    names = ", ".join(element_names(symbol))
    return (
        f"{names}: as many coefficients of order {order} as postures: the fit passes through "
        "every point and cannot be judged",
    )


MODEL = PostureMethod(
    "polynomial",
    "least squares of each element, as in the source; may be indefinite at a posture",
    fit_polynomial,
)
