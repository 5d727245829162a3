"""Linear least squares in which some coefficients are combinations of numbers >= 0."""

from __future__ import annotations

import numpy as np
from scipy.optimize import nnls

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError


def least_squares_in(
    X: FloatArray, y: FloatArray, cone: FloatArray | None, n_free: int
) -> FloatArray:
    """Theta (p,) that minimises ``|X theta - y|^2``, where asked in a cone.

    `X`, `y` (n, p), (n,): without a cone y may be (n, c): theta is then (p, c).
    `cone` (p - n_free, g) or None: theta without its last `n_free` entries is ``cone @ gamma``,
    gamma >= 0.
    Raises EstimationError: the bounded problem ends without a solution.
    """
    if cone is None:
        length = np.linalg.norm(X, axis=0)
        length[length == 0] = 1.0
        return np.asarray((np.linalg.lstsq(X / length, y, rcond=None)[0].T / length).T)
    k = X.shape[1] - n_free
    Q = np.linalg.qr(X[:, k:])[0]
    Z = X[:, :k] @ cone
    # the free columns taken out: (I - Q Q^T) Z gamma = (I - Q Q^T) y
    Z, rest = Z - Q @ (Q.T @ Z), y - Q @ (Q.T @ y)
    length = np.linalg.norm(Z, axis=0)
    length[length == 0] = 1.0
    try:
        gamma = nnls(Z / length, rest, maxiter=50 * Z.shape[1])[0] / length
    except RuntimeError as error:
        raise EstimationError(f"bounded least squares ended without a solution: {error}") from error
    theta = cone @ gamma
    free = np.linalg.lstsq(X[:, k:], y - X[:, :k] @ theta, rcond=None)[0]
    return np.concatenate([theta, free])


def whitening(covariance: FloatArray) -> FloatArray:
    """``L^-1`` of covariances ``L L^T`` (..., r, r): rows times it have errors of unit variance.

    `covariance` (..., r, r).
    Returns: (..., r, r).
    Raises EstimationError: a combination of the rows is known without error.
    """
    try:
        return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)))
    except np.linalg.LinAlgError:
        problem = "a standard error is so small that a row is known without error"
        raise EstimationError(f"{problem} (expected those that `estimate` found)") from None
