"""Least squares for base parameters, and its solution on the way to a result.

Weighted: each row of the wrench (N, N m) is divided by its own residual level. The levels come
from the fit before, once or twice.
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
#: Levels below this part of a row's size are rounding, not noise.
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
        All rows alike, or each divided by the level of its residuals.

    Returns
    -------
    BaseFit

    Raises
    ------
    NotIdentifiableError
        These motions do not show all base parameters; names them.
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
    left, _ = equations.squares(phi)
    total = (equations.r[..., -1] ** 2).sum(axis=(0, 2))
    count = equations.samples.sum()
    size = np.sqrt(total / count)
    floor = _LEAST_LEVEL * np.where(size > 0, size, max(size.max(), 1e-300))
    return np.maximum(np.sqrt(left.sum(axis=0) / count), floor)


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
    ``s_g = W_g^T e_g`` of G blocks: neighbouring samples and the six components of a wrench may be
    correlated, blocks not. Goes over the samples once more.

    `trials`: those that were fitted; all by default.
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


# Base parameters with their covariances on the way to a result.


@dataclass(frozen=True)
class BodySolution:
    """Base values (b,), covariances (b, b), and all parameters (p,) where the method has them."""

    values: FloatArray
    covariance: FloatArray
    robust: FloatArray
    phi: FloatArray | None = None
    phi_sd: FloatArray | None = None
    checks: tuple[Finding, ...] = ()

    def without(self, noise: NoiseShift | None) -> BodySolution:
        """The bias that noise of the angles makes taken off."""
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
    """What a method that improves on least squares is given.

    `equations`: equations of the motions that are fitted.
    `least`: the least squares as they are.
    `solution`: the same without the bias from noise of the angles.
    `inflation`: median ratio of robust to classical variance.
    `prior`: masses and inertias that are expected.
    `prior_sd`: how well they are trusted, relative.
    """

    equations: BodyEquations
    base: BaseParameters
    least: BaseFit
    solution: BodySolution
    inflation: float
    noise: NoiseShift | None
    prior: Skeleton
    prior_sd: float


def consistent_solution(given: WeightedSolution) -> BodySolution:
    """Physically consistent parameters; the least-squares fit says how far to trust them.

    Raises InputError: no prior mass of a segment.
    Raises EstimationError: the iteration does not settle.
    """
    better = _fitted(given, None)
    return replace(given.solution, values=better.base, phi=better.phi)


def prior_solution(given: WeightedSolution) -> BodySolution:
    """Physically consistent parameters near the prior; the curvature says how far to trust them.

    The prior is held against the least squares first, and trusted no further than they bear out.

    Raises InputError: no prior mass of a segment.
    Raises EstimationError: the iteration does not settle.
    """
    base, least, inflation = given.base, given.least.fit, max(given.inflation, 1.0)
    unsure = np.zeros((base.rank, base.rank))
    if given.noise is not None:
        unsure = given.noise.uncertainty(given.solution.values)
    trust = trust_in_prior(
        base,
        _guess(given.prior),
        given.solution.values,
        inflation * least.covariance + unsure,
        given.prior_sd,
    )
    better = _fitted(given, trust.used)
    C = np.asarray(better.covariance)
    # what b of least squares errs by comes through: dphi (p,) = C (p, p) B^T (p, b) R^T R db / infl
    through = C @ base.mapping.T @ (least.triangle.T @ least.triangle) / inflation
    C_phi = C + through @ unsure @ through.T
    # C_b (b, b) = B (b, p) C_phi (p, p) B^T
    robust = base.mapping @ C_phi @ base.mapping.T
    sd = np.sqrt(np.diag(C_phi))
    checks = (trust.finding,)
    return BodySolution(better.base, robust / inflation, robust, better.phi, sd, checks)


def _fitted(given: WeightedSolution, prior_sd: float | None) -> ConsistentFit:
    return fit_consistent(
        given.equations,
        given.base,
        given.least.weights,
        _guess(given.prior),
        prior_sd=prior_sd,
        inflation=max(given.inflation, 1.0),
        about=None if given.noise is None else given.solution.values,
    )


def _guess(skeleton: Skeleton) -> FloatArray:
    massless = [s.name for s in moving_segments(skeleton) if not s.mass_kg > 0]
    if massless:
        raise InputError(
            f"no mass of {massless[0]} to start from",
            expected="a prior skeleton with masses and inertias, from a table for example",
        )
    return inertial_parameters(skeleton)
