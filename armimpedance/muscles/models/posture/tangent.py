"""How a sum of squares answers to small changes of the data, and what its errors are.

At the solution write every Gram matrix as ``Q = L L^T``, L (size, rank). A step dL changes the
matrix by ``dQ = dL L^T + L dL^T``; to second order the objective over 2 grows by

    h(dL) = |W A(dQ)|^2 / 2 + <S, dL dL^T> / 2,   S = A^T W^2 (A(Q) - y) * 2 + cost D >= 0

with S the multiplier of ``Q >= 0``: what keeps the solution on its face of the cone. With H the
matrix of 2h (Hessian) and ``J dL = W A(dQ)`` the fit moves with the data by ``J H^+ J^T``, the hat
matrix of this fit; H^+ itself is the covariance of the posterior whose prior is the penalty
(D. Nychka, JASA 83 (1988), 1134: such intervals count the bias of a smooth fit on average; the
sandwich ``H^+ J^T J H^+`` leaves it out).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from armimpedance.core.arrays import FloatArray
from armimpedance.muscles.models.posture.program import GramProgram, GramSolution

#: Eigenvalues of Q below this part of its largest are the solver's way of saying zero.
_FACE = 1e-5

#: Directions of H below this part of its largest only rotate L, which changes nothing.
_GAUGE = 1e-10


@dataclass(frozen=True)
class Tangent:
    """A sum of squares linearised at its solution, in units of the residuals' standard errors.

    Attributes
    ----------
    covariance : (3 terms, 3 terms)
        Covariance of the coefficients: all of ss, then se, then ee.
    spent : (3,)
        Coefficients spent on ss, se, ee: traces of the hat matrix.
    misfit : (3,)
        Weighted sums of squared residuals.
    """

    covariance: FloatArray
    spent: FloatArray
    misfit: FloatArray


def tangent(
    program: GramProgram,
    solution: GramSolution,
    values: FloatArray,
    weights: FloatArray,
    cost: float,
) -> Tangent:
    """Linearise a solution of `program` for values and weights (P, 3) and a cost."""
    residual = weights * (program.X @ solution.coefficients - values)
    steps, moves, holds = [], [], []
    for A, T, c, Q in zip(program.regressors, program.maps, program.costs, solution.Q, strict=True):
        L = _factor(Q)
        # d(w k) and d(coefficients) by dL (size, rank): both maps are symmetric in i, j
        steps.append(2 * np.einsum("pa,paij,jr->pair", weights, A, L))
        moves.append(2 * np.einsum("atij,jr->atir", T, L))
        S = 2 * np.einsum("pa,pa,paij->ij", weights, residual, A) + cost * np.diag(c)
        holds.append(np.kron(_positive(S), np.eye(L.shape[1])))
    rows = values.size
    J = np.concatenate([m.reshape(rows, -1) for m in steps], axis=1)
    move = np.concatenate([m.reshape(3 * program.X.shape[1], -1) for m in moves], axis=1)
    # H (n, n) = J^T (n, 3P) J (3P, n) + S kron I
    back = np.linalg.pinv(J.T @ J + block_diag(*holds), rcond=_GAUGE, hermitian=True)
    hat = np.einsum("ni,ij,nj->n", J, back, J).reshape(values.shape)
    return Tangent(move @ back @ move.T, hat.sum(axis=0), (residual**2).sum(axis=0))


def _factor(Q: FloatArray) -> FloatArray:
    """L (size, rank) of ``Q = L L^T`` without the eigenvalues that are zero."""
    values, vectors = np.linalg.eigh(Q)
    kept = values > _FACE * max(values[-1], 0.0)
    return np.asarray(vectors[:, kept] * np.sqrt(values[kept]))


def _positive(S: FloatArray) -> FloatArray:
    values, vectors = np.linalg.eigh((S + S.T) / 2)
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T)
