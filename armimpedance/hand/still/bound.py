"""The Cramer-Rao bound: what no unbiased estimator can do better on this motion and this noise.

For Gaussian noise e of the force and n of the position, with the motion itself unknown,

    cov(theta) >= (sum_t G_t^T (Sigma_e + A Sigma_n A^T)^-1 G_t)^-1,   G = [X'' X' X]:

the inverse of the information about theta once the unknown motion is projected out, by the matrix
inversion lemma (docs/evidence/estimate.md). With ``Sigma_n = 0`` it is the bound for an exactly
known motion, which no estimator reaches for M if positions come from an encoder.
"""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.hand.still.modal import ModalEquation, weighted_equations
from armimpedance.numerics.regression import TrialEquations


def bound(equation: ModalEquation, covariance: FloatArray) -> FloatArray:
    """Least covariance (r d^2, r d^2) of M, B, K for a motion that is free of noise.

    Parameters
    ----------
    equation : ModalEquation
        Equation of the true, a planned or an expected motion; its force is not read.
    covariance : (d n, d n)
        Covariance of ``e - A n`` in the equation's modes, as `NoiseModel.covariance`.

    Returns
    -------
    (r d^2, r d^2) array
        Cramer-Rao bound of the parameters' covariance, row by row, SI.

    Raises
    ------
    NotIdentifiableError
        If the motion does not determine the parameters.
    """
    V = np.linalg.inv(covariance)
    information = weighted_equations(equation, (V + V.T) / 2, "hand").A.sum(axis=0)
    return inverse_information(information)


def bound_of(equations: TrialEquations) -> FloatArray | None:
    """The bound (r d^2, r d^2) for a recording's own motion and estimated noise.

    ``sum_t A_t`` of the method `weighted` is the information, its expectation free of the
    position's noise. None if noise makes it singular or negative.

    Parameters
    ----------
    equations : TrialEquations
        Equations of the method `weighted`; their parameters are M, B, K row by row.

    Returns
    -------
    (r d^2, r d^2) array or None
        Cramer-Rao bound of the parameters' covariance, SI; None if it cannot be estimated.
    """
    total = equations.A.sum(axis=0)
    symmetric = (total + total.T) / 2
    if not np.linalg.eigvalsh(symmetric)[0] > 0:
        return None
    return inverse_information(symmetric)


def inverse_information(information: FloatArray) -> FloatArray:
    """Inverse of a symmetric information matrix, scaled to a unit diagonal first.

    Parameters
    ----------
    information : (n, n)
        Symmetric, positive definite.

    Returns
    -------
    (n, n) array
        The inverse: the least covariance that the information allows.
    """
    scale = 1 / np.sqrt(np.abs(np.diag(information)))
    inverse = np.linalg.inv(information * scale[:, None] * scale)
    return np.asarray(inverse * scale[:, None] * scale)
