"""The semidefinite program behind a sum of squares: compiled once for one set of postures.

    minimise  |w (A vec(Q) - y)|^2 + cost tr(D Q)   over  Q_b >= 0

A (3P, all elements of all Q_b) and D (what roughness costs) belong to the postures and the
structure; weights w, measurements y and the cost are parameters, so that leaving a row out,
shuffling rows or another cost is a new solution of the same program.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, IntArray
from armimpedance.core.errors import EstimationError
from armimpedance.muscles.models.posture.certificate import Gram, GramShape, coefficient_map
from armimpedance.muscles.models.posture.gram import STRUCTURES, roughness
from armimpedance.muscles.models.posture.terms import exponents, monomials

#: Weights of about this for the solver, whose tolerance is on the sum of squared residuals, unless
#: roughness would then cost more than what comes second.
_ZOOM, _LARGEST_COST = 100.0, 1.0

#: Tolerances of the interior-point method on numbers scaled to about 1. The second is the solver's
#: own; nearly free fits of noise, flat along many directions, sometimes end short of the first.
_TOLERANCES = (1e-10, 1e-8)


@dataclass(frozen=True)
class GramSolution:
    """A solved program.

    Attributes
    ----------
    Q : tuple of (size, size)
        Projected onto the cone: no eigenvalue below 0 but for rounding.
    coefficients : (terms, 3)
        Coefficients of ss, se, ee.
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
        found = self._compiled.solve(z * s * weights, values / v, z**2 * rough)
        Q = tuple(v * _projected(one) for one in found)
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
