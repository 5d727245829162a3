"""The semidefinite program behind a sum of squares: compiled once for one set of postures.

    minimise  |w (A vec(Q) - y)|^2 + cost tr(D Q)   over  Q_b >= 0

A (3P, all elements of all Q_b) and D (what roughness costs) belong to the postures and the
structure; weights w, measurements y and the cost are parameters, so that leaving a row out,
shuffling rows or another cost is a new solution of the same program.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from armimpedance.core.arrays import BoolArray, FloatArray, IntArray
from armimpedance.core.errors import EstimationError
from armimpedance.muscles.models.posture.certificate import (
    Gram,
    GramShape,
    coefficient_map,
    exponents,
    monomials,
)

# Which Gram matrices stand for the muscles of an arm, and what roughness of moment arms costs.
#
# With ``K_j = G^T K_m G`` and moment arms that are polynomials of the scaled angles, every muscle
# adds ``f g g^T``, g = (d_s, d_e). All muscles together are one Gram matrix over the monomials of
# d_s and d_e, positive semidefinite because stiffness is not negative. A single-joint muscle is a
# two-joint one whose other moment arm is zero: blocks of their own would add nothing to the set.

#: What it costs that a moment arm at one joint varies with the other joint's angle, against with
#: its own: chosen by simulation, where anything from 3 to 30 does about as well
#: (docs/explanation/posture_models.md).
OTHER_JOINT = 10.0


def full(order: int) -> tuple[GramShape, ...]:
    """Two-joint moment arms depend on both angles, eq. (37)."""
    both = exponents(order)
    return (GramShape("1", both, both),)


def separable(order: int) -> tuple[GramShape, ...]:
    """All moment arms depend on the angle of their own joint only."""
    k = np.arange(order + 1)
    return (GramShape("1", np.stack([k, 0 * k], axis=1), np.stack([0 * k, k], axis=1)),)


def box(order: int) -> tuple[GramShape, ...]:
    """Definite on the box only: ``K = B^T Q_0 B + sum_j (1 - u_j^2) B_j^T Q_j B_j``."""
    if order == 0:
        return full(0)
    lower = exponents(order - 1)
    return (
        *full(order),
        GramShape("1 - s^2", lower, lower),
        GramShape("1 - e^2", lower, lower),
    )


STRUCTURES: dict[str, Callable[[int], tuple[GramShape, ...]]] = {
    "full": full,
    "separable": separable,
    "box": box,
}


def roughness(shape: GramShape) -> FloatArray:
    """Penalty of each monomial of a moment arm, (size,): the square of its degree.

    Nothing for a constant, so that an arm with constant moment arms is not shrunk; more by
    `OTHER_JOINT` where the angle of the other joint takes part. A multiplier is of degree 2 and
    counts as one degree of the moment arm.
    """
    extra = 0 if shape.multiplier == "1" else 1
    costs = []
    for powers, other in ((shape.shoulder, 1), (shape.elbow, 0)):
        degree = powers.sum(axis=1) + extra
        costs.append(degree**2 * np.where(powers[:, other] > 0, OTHER_JOINT, 1.0))
    return np.concatenate(costs)


#: Weights of about this for the solver, whose tolerance is on the sum of squared residuals, unless
#: roughness would then cost more than what comes second.
_ZOOM, _LARGEST_COST = 100.0, 1.0

#: Tolerances of the interior-point method on numbers scaled to about 1. The second is the solver's
#: own; nearly free fits of noise, flat along many directions, sometimes end short of the first.
_TOLERANCES = (1e-10, 1e-8)


@dataclass(frozen=True)
class GramSolution:
    """A solved program.

    `Q` tuple of (size, size): projected onto the cone: no eigenvalue below 0 but for rounding.
    `coefficients` (terms, 3): coefficients of ss, se, ee.
    """

    Q: tuple[FloatArray, ...]
    coefficients: FloatArray


class GramProgram:
    """The program of P postures.

    Attributes
    ----------
    powers : (terms, 2) int
        Exponents of the elements' monomials.
    X : (P, terms)
        Monomials of the elements at the postures.
    maps : tuple of (3, terms, size, size)
        `coefficient_map` of each block.
    costs : tuple of (size,)
        `roughness` of each block.
    """

    def __init__(self, shapes: tuple[GramShape, ...], scaled: FloatArray, powers: IntArray) -> None:
        self.shapes, self.powers = shapes, powers
        self.X = monomials(scaled, powers)
        self.maps = tuple(coefficient_map(shape, powers) for shape in shapes)
        self.costs = tuple(roughness(shape) for shape in shapes)
        self._compiled = _Compiled(self.regressors, self.costs)

    @classmethod
    def of(cls, structure: str, order: int, scaled: FloatArray) -> GramProgram:
        """The program of moment arms of an order at scaled angles (P, 2).

        Parameters
        ----------
        structure : {"full", "separable", "box"}
        order : int
        scaled : (P, 2)
        """
        return cls(STRUCTURES[structure](order), scaled, exponents(2 * order))

    @property
    def used(self) -> BoolArray:
        """(3, terms): which terms of ss, se, ee the structure has in it."""
        return np.any([(T != 0).any(axis=(2, 3)) for T in self.maps], axis=0)

    @property
    def regressors(self) -> tuple[FloatArray, ...]:
        """``dk/dQ_b`` of each block, (P, 3, size, size): the elements at every posture."""
        return tuple(np.einsum("pt,atij->paij", self.X, T) for T in self.maps)

    def solve(self, values: FloatArray, weights: FloatArray, cost: float) -> GramSolution:
        """Fit ``ss, se, ee`` (P, 3) with weights (P, 3); a row of zeros is left out.

        Raises
        ------
        EstimationError
            The solver ended with anything but an optimal solution.
        """
        # Numbers of about 1 for the solver: values over their size v, weights over theirs 1/s.
        v = float(np.sqrt((values**2).mean())) or 1.0
        used = weights[weights > 0]
        s = 1 / float(np.sqrt((used**2).mean()))
        # Free of cost, the fit is blown up: the tolerance is on its squared residuals.
        rough = cost * s**2 / v
        z = min(_ZOOM, float(np.sqrt(_LARGEST_COST / rough))) if rough > 0 else _ZOOM
        solution = self._compiled.solve(z * s * weights, values / v, z**2 * rough)
        Q = tuple(v * _projected(one) for one in solution)
        parts = [np.einsum("atij,ij->ta", T, q) for T, q in zip(self.maps, Q, strict=True)]
        return GramSolution(Q, np.asarray(np.sum(parts, axis=0)))

    def grams(self, solution: GramSolution) -> tuple[Gram, ...]:
        """The proof that belongs to a solution."""
        return tuple(
            Gram(shape.multiplier, shape.shoulder, shape.elbow, Q)
            for shape, Q in zip(self.shapes, solution.Q, strict=True)
        )


class _Compiled:
    """The same for numbers of about 1, in the solver's terms."""

    def __init__(self, regressors: tuple[FloatArray, ...], costs: tuple[FloatArray, ...]) -> None:
        import cvxpy as cp

        rows = regressors[0].shape[0] * 3
        self._Q = [cp.Variable((len(c), len(c)), PSD=True) for c in costs]
        self._weights = cp.Parameter(rows, nonneg=True)
        self._target = cp.Parameter(rows)
        self._cost = cp.Parameter(nonneg=True)
        # k (3P,) = sum_b A_b (3P, size^2) vec(Q_b)
        k: Any = sum(
            A.reshape(rows, -1) @ cp.vec(Q, order="C")
            for A, Q in zip(regressors, self._Q, strict=True)
        )
        rough: Any = sum(c @ cp.diag(Q) for c, Q in zip(costs, self._Q, strict=True))
        misfit = cp.sum_squares(cp.multiply(self._weights, k) - self._target)
        self._problem = cp.Problem(cp.Minimize(misfit + self._cost * rough))

    def solve(self, weights: FloatArray, values: FloatArray, cost: float) -> list[FloatArray]:
        self._weights.value = weights.ravel()
        self._target.value = (weights * values).ravel()
        self._cost.value = cost
        for tolerance in _TOLERANCES:
            status = self._end(tolerance)
            if status == "optimal":
                return [np.asarray(Q.value, dtype=float) for Q in self._Q]
        raise EstimationError(f"sum of squares: the solver ended {status}, not optimal")

    def _end(self, tolerance: float) -> str:
        """Run the solver; how it ended."""
        import cvxpy as cp

        with warnings.catch_warnings():
            # said by the status
            warnings.filterwarnings("ignore", message="Solution may be inaccurate")
            try:
                self._problem.solve(
                    solver=cp.CLARABEL,
                    tol_gap_abs=tolerance,
                    tol_gap_rel=tolerance,
                    tol_feas=tolerance,
                )
            except cp.SolverError as error:
                return f"with an error ({str(error).splitlines()[0]})"
        return str(self._problem.status)


def _projected(Q: FloatArray) -> FloatArray:
    """The nearest positive semidefinite matrix: interior-point solutions are so to ~1e-9."""
    values, vectors = np.linalg.eigh((Q + Q.T) / 2)
    half = vectors * np.sqrt(np.maximum(values, 0.0))
    return np.asarray(half @ half.T)


# How a sum of squares answers to small changes of the data, and what its errors are.
#
# At the solution write every Gram matrix as ``Q = L L^T``, L (size, rank). A step dL changes the
# matrix by ``dQ = dL L^T + L dL^T``; to second order the objective over 2 grows by
#
#     h(dL) = |W A(dQ)|^2 / 2 + <S, dL dL^T> / 2,   S = A^T W^2 (A(Q) - y) * 2 + cost D >= 0
#
# with S the multiplier of ``Q >= 0``: what keeps the solution on its face of the cone. With H the
# matrix of 2h (Hessian) and ``J dL = W A(dQ)`` the fit moves with the data by ``J H^+ J^T``, the
# hat matrix of this fit; H^+ itself is the covariance of the posterior whose prior is the penalty
# (D. Nychka, JASA 83 (1988), 1134: such intervals count the bias of a smooth fit on average; the
# sandwich ``H^+ J^T J H^+`` leaves it out).

#: Eigenvalues of Q below this part of its largest are the solver's way of saying zero.
_FACE = 1e-5

#: Directions of H below this part of its largest only rotate L, which changes nothing.
_GAUGE = 1e-10


@dataclass(frozen=True)
class Tangent:
    """A sum of squares linearised at its solution, in units of the residuals' standard errors.

    `covariance` (3 terms, 3 terms): covariance of the coefficients: all of ss, then se, then ee.
    `spent` (3,): coefficients spent on ss, se, ee: traces of the hat matrix.
    `misfit` (3,): weighted sums of squared residuals.
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
