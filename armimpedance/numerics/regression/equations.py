"""Estimating equations per trial, for weighted, instrumental and compensated fits.

An estimator that is not plain least squares still solves ``sum_t (b_t - A_t theta) = 0`` for its n
parameters: generalised least squares with ``A_t = W_t^T V W_t``, instruments with
``A_t = Z_t^T W_t``, a likelihood with the curvature and the score at its maximum. Standard errors,
leave-one-out and bootstrap need only these small matrices per trial.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Final

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import EstimationError, InputError, NotIdentifiableError
from armimpedance.numerics.regression.covariance import check_strata, draw_counts, replicate_sum
from armimpedance.numerics.regression.factors import TrialFactors

#: Largest scaled condition number of equations that count as solvable.
WORST_CONDITION: Final = 1e12
#: Draws of a bootstrap; its standard errors are then precise to about 2 %.
BOOTSTRAP_REPEATS: Final = 1000
#: Largest share of draws that may lose rank; with more, the rest do not represent the data.
MOST_LOST: Final = 0.1


@dataclass(frozen=True, eq=False)
class TrialEquations(FrozenRecord):
    """Equations ``sum_t (b_t - A_t theta) = 0``, one pair (A_t, b_t) per cluster.

    Attributes
    ----------
    A : (T, n, n)
        Need not be symmetric.
    b : (T, n)
    names, units : tuple of str
        Names and units of the n parameters.
    """

    A: Annotated[FloatArray, "t n n"]
    b: Annotated[FloatArray, "t n"]
    names: Annotated[tuple[str, ...], "n"]
    units: Annotated[tuple[str, ...], "n"]

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.A) == 0:
            raise InputError("no clusters", expected="one or more")

    @property
    def n_clusters(self) -> int:
        """Number of clusters T."""
        return len(self.A)

    @classmethod
    def of(
        cls, factors: TrialFactors, names: Sequence[str], units: Sequence[str]
    ) -> TrialEquations:
        """Normal equations of a least-squares fit, parameters in the order of `Fit.parameters`.

        For methods that permute or reweight trials; `solve.fit` itself uses the factors, which lose
        fewer digits.

        Parameters
        ----------
        factors : TrialFactors
            p regressors and q outputs.
        names, units : sequences of p q str
        """
        p, q = factors.n_regressors, factors.n_outputs
        W, Y = factors.r[:, :, :p], factors.r[:, :, p:]
        gram = W.transpose(0, 2, 1) @ W
        score = W.transpose(0, 2, 1) @ Y
        A = np.zeros((factors.n_clusters, q, p, q, p))
        for output in range(q):
            A[:, output, :, output, :] = gram
        b = score.transpose(0, 2, 1).reshape(-1, q * p)
        return cls(A.reshape(-1, q * p, q * p), b, tuple(names), tuple(units))

    def subset(self, clusters: ArrayLike) -> TrialEquations:
        """Return the equations of these clusters only (a mask or indices, which may repeat)."""
        chosen = np.arange(self.n_clusters)[np.asarray(clusters)]
        return replace(self, A=self.A[chosen], b=self.b[chosen])


@dataclass(frozen=True)
class Solution:
    """Solution of a set of equations.

    `parameters` (n,).
    `covariance` (n, n): clustered by trial.
    `dof`: degrees of freedom of the t distribution.
    """

    parameters: FloatArray
    covariance: FloatArray
    dof: float


def solve_equations(
    equations: TrialEquations,
    *,
    covariance: str = "cr3",
    strata: ArrayLike | None = None,
    seed: int = 0,
) -> Solution:
    """Parameters and their covariance clustered by trial.

    Parameters
    ----------
    equations : TrialEquations
    covariance : {"cr3", "cr1", "replicates", "bootstrap"}
        The first three are those of `solve.fit`; weights and instruments are assumed exact.
        "bootstrap" is the spread of `BOOTSTRAP_REPEATS` draws of clusters with replacement.
    strata : (T,), optional
        For replicates: clusters with the same label had the same disturbance.
    seed : int
        Seed of the bootstrap.

    Returns
    -------
    Solution
        The parameters (n,), their covariance (n, n) and its degrees of freedom.

    Raises
    ------
    NotIdentifiableError
        The equations do not determine the parameters, or only one cluster determines some.
    InputError
        A single cluster, an unknown kind, or replicates without strata.
    """
    T = equations.n_clusters
    if T < 2:
        raise InputError("one cluster only: its spread cannot be seen", expected="two or more")
    theta = solve_total(equations)
    # s_t (n,) = b_t - A_t (n, n) theta (n,)
    score = equations.b - equations.A @ theta
    total = equations.A.sum(axis=0)
    if covariance == "replicates":
        numbers = check_strata(T, strata)
        changes = _solve_scaled(total, score.T).T
        return Solution(theta, replicate_sum(changes, numbers), float(T - numbers.max() - 1))
    if covariance == "bootstrap":
        draws = bootstrap_equations(equations, BOOTSTRAP_REPEATS, seed)
        # drawing from the T trials at hand leaves (T - 1)/T of the variance
        spread = T / (T - 1) * np.cov(draws, rowvar=False)
        return Solution(theta, np.atleast_2d(spread), float(T - 1))
    if covariance == "cr1":
        changes = np.sqrt(T / (T - 1)) * _solve_scaled(total, score.T).T
    elif covariance == "cr3":
        changes = np.sqrt((T - 1) / T) * leave_one_out_shift(equations, theta)
    else:
        raise InputError(
            f"no covariance {covariance!r}", expected="cr3, cr1, replicates or bootstrap"
        )
    return Solution(theta, np.asarray(changes.T @ changes), float(T - 1))


def solve_total(equations: TrialEquations) -> FloatArray:
    """Parameters (n,) of all clusters together.

    Parameters
    ----------
    equations : TrialEquations

    Returns
    -------
    (n,) array
        The parameters that solve the sum of all clusters' equations.

    Raises
    ------
    NotIdentifiableError
        The equations do not determine them.
    """
    # (sum_t A_t) (n, n) theta (n,) = sum_t b_t (n,)
    return _solve_scaled(equations.A.sum(axis=0), equations.b.sum(axis=0))


def leave_one_out_shift(equations: TrialEquations, theta: FloatArray) -> FloatArray:
    """Change of the solution by each cluster, ``theta - theta_(t)`` (T, n).

    Parameters
    ----------
    equations : TrialEquations
        T clusters, n parameters.
    theta : (n,)
        Their solution.

    Returns
    -------
    (T, n) array
        The solution with all clusters less the solution without cluster t, one row per cluster.

    Raises
    ------
    NotIdentifiableError
        Only one cluster informs some direction.
    """
    score = equations.b - equations.A @ theta
    rest = equations.A.sum(axis=0) - equations.A
    # (A - A_t) (n, n) d_t (n,) = s_t (n,), for all t
    return _solve_scaled(rest, score[..., None])[..., 0]


def bootstrap_equations(
    equations: TrialEquations, repeats: int, seed: int | np.random.SeedSequence
) -> FloatArray:
    """Parameters (repeats, n) from clusters drawn with replacement, as `resample.bootstrap` does.

    Draws that do not determine the parameters are left out.

    Raises EstimationError: more than a tenth of the draws do not, since there are too few clusters.
    """
    counts, n = draw_counts(equations.n_clusters, repeats, seed), len(equations.names)
    A = (counts @ equations.A.reshape(-1, n * n)).reshape(-1, n, n)
    scale = 1 / np.sqrt(np.maximum(np.abs(np.diagonal(A, axis1=1, axis2=2)), 1e-300))
    scaled = A * scale[:, :, None] * scale[:, None, :]
    sound = np.linalg.cond(scaled) < WORST_CONDITION
    if sound.mean() < 1 - MOST_LOST:
        raise EstimationError(
            f"{(~sound).sum()} of {repeats} resamples of {equations.n_clusters} clusters lose "
            "rank: too few clusters for a bootstrap"
        )
    right = (counts @ equations.b)[sound] * scale[sound]
    return np.asarray(np.linalg.solve(scaled[sound], right[..., None])[..., 0] * scale[sound])


def _solve_scaled(A: FloatArray, b: FloatArray) -> FloatArray:
    """Solve A x = b with rows and columns scaled by the roots of A's diagonal."""
    diagonal = np.abs(np.diagonal(A, axis1=-2, axis2=-1))
    scale = np.where(diagonal > 0, 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0)), 1.0)
    scaled = A * scale[..., :, None] * scale[..., None, :]
    condition = np.linalg.cond(scaled) if A.ndim == 2 else _worst_condition(scaled)
    if not condition < WORST_CONDITION:
        raise NotIdentifiableError(
            f"the equations do not determine the parameters (scaled condition {condition:.1e})"
        )
    right = b * (scale[..., :, None] if b.ndim == A.ndim else scale)
    x = np.linalg.solve(scaled, right)
    return np.asarray(x * (scale[..., :, None] if b.ndim == A.ndim else scale))


def _worst_condition(A: FloatArray) -> float:
    """Largest 1-norm condition number of a stack of matrices; inf if one is singular."""
    try:
        inverse = np.linalg.inv(A)
    except np.linalg.LinAlgError:
        return float("inf")
    norms = np.abs(A).sum(axis=-2).max(axis=-1) * np.abs(inverse).sum(axis=-2).max(axis=-1)
    return float(norms.max())
