"""Information of one joint stiffness about the muscles' stiffnesses: sums and ranges.

K_j of two joints, without the curvature term, gives three numbers ``y = A k`` for m muscles, k >=
0: column i of A (3, m) is ``g_s^2, g_s g_e, g_e^2`` of muscle i. Only the combinations ``c k`` with
c in the row space of A are determined. For every other combination K_j determines a range, which is
found by linear programs: least and largest ``c k`` with ``A k = y, k >= 0``.

Limits of the ranges come from the programs' duals. Any p with ``A^T p <= c`` gives ``c k >= p y``
for every feasible k (weak duality), so ``p y`` minus its error is a lower limit for all feasible k,
whatever the true y is. At the measured y the program's p gives the sharpest limit; the least
``c k`` is convex in y, so the limit is conservative where another p would be optimal. The same
holds for the largest value, with opposite signs. Viscosity is treated in the same way without the
curvature term.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linprog, nnls
from scipy.special import chdtri, fdtri

from armimpedance.core.arrays import FloatArray, FrozenRecord, frozen_array
from armimpedance.core.errors import EstimationError, InputError
from armimpedance.numerics.regression import t_factor

# Results for single muscles from one joint matrix: determined sums, and ranges.


@dataclass(frozen=True)
class Combination(FrozenRecord):
    """A sum ``c k`` over muscles that the joint matrix determines.

    `name`: ``ss``, ``se``, ``ee`` for the elements of ``G^T diag(k) G``, or a muscle's name.
    `coefficients` (m,): c; m^2 for elements, 1 for a muscle.
    `value`, `sd`, `low`, `high`: N m/rad (elements) or N/m (a muscle), with 95 % limits; for
    viscosity N m s/rad and N s/m.
    """

    name: str
    coefficients: Annotated[FloatArray, "m"]
    value: float
    sd: float
    low: float
    high: float


@dataclass(frozen=True)
class FeasibleRange(FrozenRecord):
    """Least and largest value of a sum over muscles among all k >= 0 that give the joint matrix.

    `coefficients` (m,).
    `name`: a muscle, or a group and element such as ``two_joint_ss``.
    `low`, `high`: at the measured joint matrix (or at the nearest possible one); nan if there is
    none.
    `outer_low`, `outer_high`: 95 % limits: `low` minus its error, `high` plus its error.
    `determined`: True if the range is a single value for every joint matrix.
    """

    name: str
    coefficients: Annotated[FloatArray, "m"]
    low: float
    high: float
    outer_low: float
    outer_high: float
    determined: bool


@dataclass(frozen=True)
class MuscleShare(FrozenRecord):
    """Information of one joint matrix about the muscles.

    `muscles` (m,) tuple of str.
    `rank`: number of independent combinations that are determined.
    `combinations`: elements of ``G^T diag(k) G``, then single muscles that are determined.
    `single`, `groups`: the ranges of each muscle, and those of the shoulder's, the elbow's and the
    two-joint muscles' parts in the elements.
    `outside_se`: distance of the joint matrix, in standard errors, from the set that muscles with k
    >= 0 can produce; 0 inside.
    `possible`: True if it is inside, or so near that its error may explain the distance (at least
    95 %). Otherwise no stiffnesses of these muscles with these moment arms produce it, and ranges
    are nan.
    """

    muscles: tuple[str, ...]
    rank: int
    combinations: tuple[Combination, ...]
    single: tuple[FeasibleRange, ...]
    groups: tuple[FeasibleRange, ...]
    outside_se: float
    possible: bool


# Nonnegative stiffnesses of muscles for a joint matrix: linear programs and their duals.

#: Singular values of A below this share of the largest (columns scaled to 1) count as zero: moment
#: arms are not known to a thousandth.
RANK_TOLERANCE: Final = 1e-3
#: Smallest relative standard error of a matrix; smaller ones are replaced by it.
_LEAST_ERROR: Final = 1e-9


@dataclass(frozen=True)
class MuscleCone(FrozenRecord):
    """``y (p,) = A (p, m) k (m,)``, k >= 0, y with a covariance.

    `muscles` (m,) tuple of str, `A` (p, m), `y` (p,).
    `covariance` (p, p): covariance of y.
    `dof`: degrees of freedom of the t distribution for limits; inf = normal.
    """

    muscles: Annotated[tuple[str, ...], "m"]
    A: Annotated[FloatArray, "p m"]
    y: Annotated[FloatArray, "p"]
    covariance: Annotated[FloatArray, "p p"]
    dof: float

    def share(self, elements: list[str], groups: dict[str, FloatArray]) -> MuscleShare:
        """Results for single muscles, for the named rows of A, and for groups of muscles."""
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
        """Distance from the truth, in standard errors, within which 95 % of joint matrices lie.

        The distance to a convex set that contains the truth is never larger than that to the truth.
        """
        p = len(self.y)
        squared = chdtri(p, 0.05) if np.isinf(self.dof) else p * fdtri(p, self.dof, 0.95)
        return float(np.sqrt(squared))

    @property
    def _columns(self) -> FloatArray:
        """Norms of A's columns, (m,): in units of the joint matrix all muscles are equivalent."""
        return np.linalg.norm(self.A, axis=0)

    @property
    def _row_space(self) -> FloatArray:
        """Orthonormal rows (rank, m) that span the rows of A, columns scaled."""
        _, sizes, rows = np.linalg.svd(self.A / self._columns, full_matrices=False)
        return np.asarray(rows[sizes > RANK_TOLERANCE * sizes[0]])

    def _is_determined(self, c: FloatArray) -> bool:
        scaled, rows = c / self._columns, self._row_space
        residual = scaled - rows.T @ (rows @ scaled)
        return bool(np.linalg.norm(residual) <= RANK_TOLERANCE * np.linalg.norm(scaled))

    def _whitener(self) -> FloatArray:
        """W (p, p) with ``W C W^T = I``; zero errors are replaced by tiny ones."""
        floor = (_LEAST_ERROR * max(np.abs(self.y).max(), np.finfo(float).tiny)) ** 2
        root = np.linalg.cholesky(self.covariance + floor * np.eye(len(self.y)))
        return np.asarray(np.linalg.inv(root))

    def _nearest(self) -> tuple[FloatArray, float]:
        """The nearest ``A k`` with k >= 0 (p,), and its distance in standard errors."""
        W = self._whitener()
        scaled = W @ self.A / self._columns
        # nnls requires numbers of ordinary size
        size = max(np.abs(scaled).max(), np.finfo(float).tiny)
        k, distance = nnls(scaled / size, W @ self.y)
        rounding = 1e-9 * np.linalg.norm(W @ self.y)
        outside = 0.0 if distance <= rounding else float(distance)
        return self.A / self._columns @ k / size, outside

    def _combination(self, name: str, c: FloatArray) -> Combination:
        """Estimate ``c k`` from the determined part of k by generalised least squares."""
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
        # k = size x / columns: all numbers of the program are of size 1
        solved = linprog(
            scaled / unit,
            A_eq=self.A / self._columns,
            b_eq=y / size,
            bounds=(0, None),
            method="highs",
        )
        if solved.status != 0:
            raise EstimationError(f"a muscle's feasible range was not determined: {solved.message}")
        dual = unit * np.array(solved.eqlin.marginals, dtype=float)
        return float(dual @ y), dual

    def _limit(self, dual: FloatArray, nearest: FloatArray) -> float:
        """``p y`` minus its error: holds for every dual p, whatever the true y is.

        The lower of the values at the measured y and at the nearest possible one is used.
        """
        sd = float(np.sqrt(max(float(dual @ self.covariance @ dual), 0.0)))
        return min(float(dual @ self.y), float(dual @ nearest)) - self._reach * sd


def muscle_share(
    joint_matrix: ArrayLike,
    covariance: ArrayLike,
    G: ArrayLike,
    muscles: Sequence[str],
    *,
    curvature: ArrayLike | None = None,
    dof: float = np.inf,
) -> MuscleShare:
    """Determine the information of K_j (or B_j) about the muscles.

    `muscles` (m,) sequence of str.
    `joint_matrix` (n, n): N m/rad or N m s/rad; its symmetric part is used.
    `covariance` (n^2, n^2): covariance of its elements row by row.
    `G` (m, n): moment arms dL/dq, m.
    `curvature` (n, n): ``sum_n f_n d2L_n`` (`hand.levels.curvature_term`), subtracted; taken as
    known.
    `dof`: degrees of freedom of the t distribution for limits; inf = normal.
    Raises InputError: shapes that do not belong together, or a muscle without any moment arm.
    Raises EstimationError: a linear program ended without an optimum.
    """
    arms: FloatArray = frozen_array(G, "G", (len(muscles), None))
    n = arms.shape[1]
    K: FloatArray = frozen_array(joint_matrix, "joint matrix", (n, n))
    own = K if curvature is None else K - frozen_array(curvature, "curvature", (n, n))
    spread: FloatArray = frozen_array(covariance, "covariance", (n * n, n * n))
    if not np.abs(arms).max(axis=1).all():
        name = muscles[int(np.argmin(np.abs(arms).max(axis=1)))]
        raise InputError(f"muscle {name} has no moment arm at this posture", expected="some")
    pairs = [(i, j) for i in range(n) for j in range(i, n)]
    to_elements = _symmetric_elements(n, pairs)
    A = np.array([arms[:, i] * arms[:, j] for i, j in pairs])
    return MuscleCone(
        muscles=tuple(str(name) for name in muscles),
        A=A,
        y=to_elements @ own.ravel(),
        covariance=to_elements @ spread @ to_elements.T,
        dof=dof,
    ).share(_element_names(n, pairs), _groups(arms, pairs))


def _symmetric_elements(n: int, pairs: list[tuple[int, int]]) -> FloatArray:
    """Map from a matrix row by row (n^2,) to the elements (p,) of its symmetric part."""
    rows = np.zeros((len(pairs), n * n))
    for row, (i, j) in zip(rows, pairs, strict=True):
        row[i * n + j] += 0.5
        row[j * n + i] += 0.5
    return rows


def _element_names(n: int, pairs: list[tuple[int, int]]) -> list[str]:
    letters = "se" if n == 2 else "".join(str(i + 1) for i in range(n))
    return [letters[i] + letters[j] for i, j in pairs]


def _groups(arms: FloatArray, pairs: list[tuple[int, int]]) -> dict[str, FloatArray]:
    """Coefficients of each group's part in each element, if it has one."""
    n = arms.shape[1]
    names, spans = _element_names(n, pairs), arms != 0
    joints = ("shoulder", "elbow") if n == 2 else tuple(f"joint_{i + 1}" for i in range(n))
    members = {joint: spans[:, j] & (spans.sum(axis=1) == 1) for j, joint in enumerate(joints)}
    members["two_joint" if n == 2 else "multi_joint"] = spans.sum(axis=1) > 1
    coefficients = {}
    for group, members_of_group in members.items():
        for name, (i, j) in zip(names, pairs, strict=True):
            part = np.where(members_of_group, arms[:, i] * arms[:, j], 0.0)
            if part.any():
                coefficients[f"{group}_{name}"] = part
    return coefficients
