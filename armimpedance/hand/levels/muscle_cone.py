"""Nonnegative stiffnesses of muscles that make a joint matrix: linear programs and their duals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np
from scipy.optimize import linprog, nnls
from scipy.special import chdtri, fdtri

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import EstimationError
from armimpedance.hand.levels.muscle_share import Combination, FeasibleRange, MuscleShare
from armimpedance.numerics.regression import t_factor

#: Directions of A below this part of its largest singular value (columns scaled to 1) are none:
#: moment arms are not known to a thousandth.
RANK_TOLERANCE: Final = 1e-3
#: A matrix with smaller standard errors than this part of itself counts as known that well.
_LEAST_ERROR: Final = 1e-9


@dataclass(frozen=True)
class MuscleCone(FrozenRecord):
    """``y (p,) = A (p, m) k (m,)``, k >= 0, y with a covariance.

    Attributes
    ----------
    muscles : (m,) tuple of str
    A : (p, m)
    y : (p,)
    covariance : (p, p)
        Covariance of y.
    dof : float
        Degrees of freedom of the t distribution for limits; inf = normal.
    """

    muscles: Annotated[tuple[str, ...], "m"]
    A: Annotated[FloatArray, "p m"]
    y: Annotated[FloatArray, "p"]
    covariance: Annotated[FloatArray, "p p"]
    dof: float

    def share(self, elements: list[str], groups: dict[str, FloatArray]) -> MuscleShare:
        """What y says of the muscles, of the named rows of A, and of groups of muscles."""
        nearest, outside = self._nearest()
        possible = outside <= self._farthest
        single = dict(zip(self.muscles, np.eye(len(self.muscles)), strict=True))
        wanted = {**single, **groups}
        ranges = {name: self._range(name, c, nearest, possible) for name, c in wanted.items()}
        rows = {name: c for name, c in zip(elements, self.A, strict=True) if c.any()}
        rows |= {name: c for name, c in single.items() if ranges[name].determined}
        return MuscleShare(
            muscles=self.muscles,
            rank=len(self._row_space),
            combinations=tuple(self._combination(name, c) for name, c in rows.items()),
            single=tuple(ranges[name] for name in single),
            groups=tuple(ranges[name] for name in groups),
            outside_se=outside,
            possible=possible,
        )

    @property
    def _reach(self) -> float:
        """Standard errors to a 95 % limit."""
        return t_factor(self.dof)

    @property
    def _farthest(self) -> float:
        """Standard errors from the truth that 95 % of joint matrices keep within.

        The distance to a convex set that holds the truth is never more than that to the truth.
        """
        p = len(self.y)
        squared = chdtri(p, 0.05) if np.isinf(self.dof) else p * fdtri(p, self.dof, 0.95)
        return float(np.sqrt(squared))

    @property
    def _columns(self) -> FloatArray:
        """Sizes of A's columns, (m,): in units of the joint matrix all muscles count alike."""
        return np.linalg.norm(self.A, axis=0)

    @property
    def _row_space(self) -> FloatArray:
        """Orthonormal rows (rank, m) that span the rows of A, columns scaled."""
        _, sizes, rows = np.linalg.svd(self.A / self._columns, full_matrices=False)
        return np.asarray(rows[sizes > RANK_TOLERANCE * sizes[0]])

    def _is_determined(self, c: FloatArray) -> bool:
        scaled, rows = c / self._columns, self._row_space
        left = scaled - rows.T @ (rows @ scaled)
        return bool(np.linalg.norm(left) <= RANK_TOLERANCE * np.linalg.norm(scaled))

    def _whitener(self) -> FloatArray:
        """W (p, p) with ``W C W^T = I``; errors that are zero count as tiny."""
        floor = (_LEAST_ERROR * max(np.abs(self.y).max(), np.finfo(float).tiny)) ** 2
        root = np.linalg.cholesky(self.covariance + floor * np.eye(len(self.y)))
        return np.asarray(np.linalg.inv(root))

    def _nearest(self) -> tuple[FloatArray, float]:
        """The nearest ``A k`` with k >= 0 (p,), and its distance in standard errors."""
        W = self._whitener()
        scaled = W @ self.A / self._columns
        # nnls wants numbers of ordinary size
        size = max(np.abs(scaled).max(), np.finfo(float).tiny)
        k, distance = nnls(scaled / size, W @ self.y)
        rounding = 1e-9 * np.linalg.norm(W @ self.y)
        outside = 0.0 if distance <= rounding else float(distance)
        return self.A / self._columns @ k / size, outside

    def _combination(self, name: str, c: FloatArray) -> Combination:
        """``c k`` from the determined part of k, generalised least squares."""
        W, rows = self._whitener(), self._row_space
        # y (p,) = A (p, m) k (m,), k = R^T z on the row space R (rank, m), columns scaled
        design = W @ (self.A / self._columns) @ rows.T
        through = (c / self._columns) @ rows.T @ np.linalg.pinv(design) @ W
        value, sd = float(through @ self.y), float(np.sqrt(through @ self.covariance @ through))
        reach = self._reach * sd
        return Combination(name, c, value, sd, value - reach, value + reach)

    def _range(
        self, name: str, c: FloatArray, nearest: FloatArray, possible: bool
    ) -> FeasibleRange:
        determined = self._is_determined(c)
        if not possible:
            nan = float("nan")
            return FeasibleRange(name, c, nan, nan, nan, nan, determined)
        low, dual_low = self._least(c, nearest)
        minus_high, dual_high = self._least(-c, nearest)
        outer_low = self._limit(dual_low, nearest)
        outer_high = -self._limit(dual_high, nearest)
        if (c >= 0).all():
            outer_low = max(outer_low, 0.0)
        return FeasibleRange(
            name=name,
            coefficients=c,
            low=low,
            high=-minus_high,
            outer_low=min(outer_low, low),
            outer_high=max(outer_high, -minus_high),
            determined=determined,
        )

    def _least(self, c: FloatArray, y: FloatArray) -> tuple[float, FloatArray]:
        """Least ``c k`` with ``A k = y``, k >= 0, and its derivative by y (p,)."""
        size = max(np.abs(y).max(), np.finfo(float).tiny)
        scaled = c / self._columns
        unit = max(np.abs(scaled).max(), np.finfo(float).tiny)
        # k = size x / columns: the program's numbers are all of size 1
        solved = linprog(
            scaled / unit,
            A_eq=self.A / self._columns,
            b_eq=y / size,
            bounds=(0, None),
            method="highs",
        )
        if solved.status != 0:
            raise EstimationError(f"a muscle's feasible range was not found: {solved.message}")
        dual = unit * np.array(solved.eqlin.marginals, dtype=float)
        return float(dual @ y), dual

    def _limit(self, dual: FloatArray, nearest: FloatArray) -> float:
        """``p y`` less its error: holds for every dual p, wherever the true y is.

        The measured y and the nearest possible one each promise a value; the lower one counts.
        """
        sd = float(np.sqrt(max(float(dual @ self.covariance @ dual), 0.0)))
        return min(float(dual @ self.y), float(dual @ nearest)) - self._reach * sd
