"""Base parameters with their covariances on the way to a result."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding
from armimpedance.core.skeleton import Skeleton
from armimpedance.joint.body.angle_noise import NoiseShift
from armimpedance.joint.body.base_parameters import BaseParameters
from armimpedance.joint.body.consistent import ConsistentFit, fit_consistent
from armimpedance.joint.body.equations import BodyEquations
from armimpedance.joint.body.estimate import BaseFit
from armimpedance.joint.body.parameters import inertial_parameters, moving_segments
from armimpedance.joint.body.trust import trust_in_prior
from armimpedance.numerics.regression import Parameters


@dataclass(frozen=True)
class Solution:
    """Base values (b,), covariances (b, b), and all parameters (p,) where the method has them."""

    values: FloatArray
    covariance: FloatArray
    robust: FloatArray
    phi: FloatArray | None = None
    phi_sd: FloatArray | None = None
    checks: tuple[Finding, ...] = ()

    def without(self, noise: NoiseShift | None) -> Solution:
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

    Attributes
    ----------
    equations : BodyEquations
        Equations of the motions that are fitted.
    base : BaseParameters
    least : BaseFit
        The least squares as they are.
    solution : Solution
        The same without the bias from noise of the angles.
    inflation : float
        Median ratio of robust to classical variance.
    noise : NoiseShift or None
    prior : Skeleton
        Masses and inertias that are expected.
    prior_sd : float
        How well they are trusted, relative.
    """

    equations: BodyEquations
    base: BaseParameters
    least: BaseFit
    solution: Solution
    inflation: float
    noise: NoiseShift | None
    prior: Skeleton
    prior_sd: float


def consistent_solution(given: WeightedSolution) -> Solution:
    """Physically consistent parameters; the least-squares fit says how far to trust them.

    Raises
    ------
    InputError
        No prior mass of a segment.
    EstimationError
        The iteration does not settle.
    """
    better = _fitted(given, None)
    return replace(given.solution, values=better.base, phi=better.phi)


def prior_solution(given: WeightedSolution) -> Solution:
    """Physically consistent parameters near the prior; the curvature says how far to trust them.

    The prior is held against the least squares first, and trusted no further than they bear out.

    Raises
    ------
    InputError
        No prior mass of a segment.
    EstimationError
        The iteration does not settle.
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
    return Solution(better.base, robust / inflation, robust, better.phi, sd, checks)


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
