"""Least squares for base parameters, and the steps from there to a result.

With weights, each row of the wrench (N, N m) is divided by its own residual level. The levels come
from the previous fit; this is repeated twice.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
from scipy.linalg import solve_triangular

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding
from armimpedance.core.motion import MotionRecording
from armimpedance.core.skeleton import Skeleton
from armimpedance.joint.body.angle_noise import NoiseShift
from armimpedance.joint.body.base_parameters import BaseParameters
from armimpedance.joint.body.consistent import ConsistentFit, fit_consistent, trust_in_prior
from armimpedance.joint.body.equations import BodyEquations, trial_factors_of
from armimpedance.joint.body.regressor import inertial_parameters, moving_segments
from armimpedance.joint.body.rows import RowChoice, each_trial
from armimpedance.numerics.regression import Fit, Parameters, fit, split_blocks

Weighting = Literal["none", "levels"]
#: Levels below this share of a row's size are rounding, not noise.
_LEAST_LEVEL = 1e-9
_ROUNDS = 2


@dataclass(frozen=True)
class BaseFit(FrozenRecord):
    """Least-squares base parameters.

    `fit`: classical covariance; rows weighted.
    `weights` (R,): weight of each row.
    """

    fit: Fit
    weights: Annotated[FloatArray, "R"]

    @property
    def values(self) -> FloatArray:
        """Base parameters (b,)."""
        return self.fit.parameters


def fit_base(
    equations: BodyEquations, base: BaseParameters, weighting: Weighting = "levels"
) -> BaseFit:
    """Solve ``w = W_base b`` over all motions of the equations.

    Parameters
    ----------
    equations : BodyEquations
    base : BaseParameters
    weighting : {"none", "levels"}
        Rows with equal weights, or each divided by the level of its residuals.

    Returns
    -------
    BaseFit

    Raises
    ------
    NotIdentifiableError
        These motions do not show all base parameters; the error names them.
    InputError
        Fewer rows than parameters, or an unknown weighting.
    """
    if weighting not in ("none", "levels"):
        raise InputError(f"no weighting {weighting!r}", expected="'none' or 'levels'")
    rows = int(equations.samples.sum()) * len(equations.rows)
    if rows <= base.rank:
        raise InputError(f"{rows} rows for {base.rank} parameters", expected="more rows")
    weights = np.ones(len(equations.rows))
    solved = _solve(equations, base, weights)
    for _ in range(_ROUNDS if weighting == "levels" else 0):
        weights = 1 / row_levels(equations, base.lift(solved.parameters))
        solved = _solve(equations, base, weights)
    return BaseFit(solved, weights)


def row_levels(equations: BodyEquations, phi: FloatArray) -> FloatArray:
    """Residual root mean square (R,) of each row over all motions, never zero."""
    residual, _ = equations.squares(phi)
    total = (equations.r[..., -1] ** 2).sum(axis=(0, 2))
    count = equations.samples.sum()
    size = np.sqrt(total / count)
    floor = _LEAST_LEVEL * np.where(size > 0, size, max(size.max(), 1e-300))
    return np.maximum(np.sqrt(residual.sum(axis=0) / count), floor)


def _solve(equations: BodyEquations, base: BaseParameters, weights: FloatArray) -> Fit:
    factors = trial_factors_of(equations, base.leading, base.names, base.units, weights)
    return fit(
        factors, covariance="classical", parameter_names=base.names, parameter_units=base.units
    )


def clustered_covariance(
    recording: MotionRecording,
    choice: RowChoice,
    base: BaseParameters,
    solved: BaseFit,
    *,
    block_s: float = 1.0,
    trials: tuple[int, ...] | None = None,
) -> FloatArray:
    """Covariance (b, b) of base parameters, clustered by blocks of a trial's time.

    ``R^-1 R^-T (G/(G-1) (N-1)/(N-p) sum_g s_g s_g^T) R^-1 R^-T`` with the scores
    ``s_g = W_g^T e_g`` of G blocks. Neighbouring samples and the six components of a wrench may be
    correlated, blocks may not. All samples are read once more.

    `trials`: the fitted trials; all by default.
    Raises InputError: fewer than two blocks.
    """
    rows, scores = 0, []
    size = max(round(block_s * recording.sample_rate_hz), 1)
    for t, trial in enumerate(each_trial(recording, choice)):
        if trials is not None and t not in trials:
            continue
        W = trial.W[..., base.leading] * solved.weights[:, None]
        e = trial.w * solved.weights - W @ solved.values
        blocks = split_blocks(len(W), size) if len(W) >= 2 * size else (slice(None),)
        # s_g (b,) = sum over the block's samples and rows of W e
        scores += [np.einsum("src,sr->c", W[g], e[g]) for g in blocks]
        rows += e.size
    if len(scores) < 2:
        raise InputError("one block only: its spread cannot be seen", expected="a longer recording")
    G, b = len(scores), base.rank
    small_sample = G / (G - 1) * (rows - 1) / max(rows - b, 1)
    R = solved.fit.triangle
    scale = np.linalg.norm(R, axis=0)
    # R^T R x = s, columns scaled
    half = solve_triangular(R / scale, np.array(scores).T / scale[:, None], trans="T")
    moved = solve_triangular(R / scale, half) / scale[:, None]
    return np.asarray(small_sample * moved @ moved.T)


# Base parameters with their covariances, before they become a result.


@dataclass(frozen=True)
class BodySolution:
    """Base values (b,), covariances (b, b), and all parameters (p,) if the method estimates
    them."""

    values: FloatArray
    covariance: FloatArray
    robust: FloatArray
    phi: FloatArray | None = None
    phi_sd: FloatArray | None = None
    checks: tuple[Finding, ...] = ()

    def without(self, noise: NoiseShift | None) -> BodySolution:
        """Return the solution with the bias from noise of the angles removed."""
        if noise is None:
            return self
        values = self.values - noise.shift
        unsure = noise.uncertainty(values)
        return replace(
            self,
            values=values,
            covariance=self.covariance + unsure,
            robust=self.robust + unsure,
        )

    def parameters(self, base: BaseParameters, dof: float) -> Parameters:
        """The base parameters with names, units and both covariances."""
        kind = "by blocks of time" if self.phi_sd is None else "of data and prior"
        texts = (base.names, base.units)
        return Parameters(*texts, self.values, self.robust, kind, dof, self.covariance)


@dataclass(frozen=True)
class WeightedSolution:
    """Input of a method that improves on least squares.

    `equations`: of the fitted motions.
    `least`: the least-squares fit.
    `solution`: the least-squares fit without the bias from noise of the angles.
    `inflation`: median ratio of robust to classical variance.
    `prior`: expected masses and inertias.
    `prior_sd`: their relative standard deviation.
    """

    equations: BodyEquations
    base: BaseParameters
    least: BaseFit
    solution: BodySolution
    inflation: float
    noise: NoiseShift | None
    prior: Skeleton
    prior_sd: float


def consistent_solution(least_fit: WeightedSolution) -> BodySolution:
    """Physically consistent parameters, with the covariance of the least-squares fit.

    Raises InputError: a segment without a prior mass.
    Raises EstimationError: the iteration does not converge.
    """
    better = _fitted(least_fit, None)
    return replace(least_fit.solution, values=better.base, phi=better.phi)


def prior_solution(start: WeightedSolution) -> BodySolution:
    """Physically consistent parameters near the prior, with the covariance from the curvature.

    The prior's sd is first tested against the least squares, and increased if they contradict it.

    Raises InputError: a segment without a prior mass.
    Raises EstimationError: the iteration does not converge.
    """
    base, least, inflation = start.base, start.least.fit, max(start.inflation, 1.0)
    unsure = np.zeros((base.rank, base.rank))
    if start.noise is not None:
        unsure = start.noise.uncertainty(start.solution.values)
    trust = trust_in_prior(
        base,
        _guess(start.prior),
        start.solution.values,
        inflation * least.covariance + unsure,
        start.prior_sd,
    )
    better = _fitted(start, trust.used)
    C = np.asarray(better.covariance)
    # an error db of least squares gives dphi (p,) = C (p, p) B^T (p, b) R^T R db / inflation
    through = C @ base.mapping.T @ (least.triangle.T @ least.triangle) / inflation
    C_phi = C + through @ unsure @ through.T
    # C_b (b, b) = B (b, p) C_phi (p, p) B^T
    robust = base.mapping @ C_phi @ base.mapping.T
    sd = np.sqrt(np.diag(C_phi))
    checks = (trust.finding,)
    return BodySolution(better.base, robust / inflation, robust, better.phi, sd, checks)


def _fitted(start: WeightedSolution, prior_sd: float | None) -> ConsistentFit:
    return fit_consistent(
        start.equations,
        start.base,
        start.least.weights,
        _guess(start.prior),
        prior_sd=prior_sd,
        inflation=max(start.inflation, 1.0),
        about=None if start.noise is None else start.solution.values,
    )


def _guess(skeleton: Skeleton) -> FloatArray:
    massless = [s.name for s in moving_segments(skeleton) if not s.mass_kg > 0]
    if massless:
        raise InputError(
            f"no mass of {massless[0]} to start from",
            expected="a prior skeleton with masses and inertias, from a table for example",
        )
    return inertial_parameters(skeleton)
