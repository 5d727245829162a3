"""Base parameters with their covariances on the way to a result."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from armimpedance.arrays import FloatArray
from armimpedance.body.angle_noise import NoiseShift
from armimpedance.body.base_parameters import BaseParameters
from armimpedance.body.consistent import fit_consistent
from armimpedance.body.equations import BodyEquations
from armimpedance.body.estimate import BaseFit
from armimpedance.body.parameters import inertial_parameters, moving_segments
from armimpedance.errors import InputError
from armimpedance.regression import Parameters
from armimpedance.skeleton import Skeleton


@dataclass(frozen=True)
class Solution:
    """Base values (b,), covariances (b, b), and all parameters (p,) where the method has them."""

    values: FloatArray
    covariance: FloatArray
    robust: FloatArray
    phi: FloatArray | None = None
    phi_sd: FloatArray | None = None

    def without(self, noise: NoiseShift | None) -> Solution:
        """The bias that noise of the angles makes taken off."""
        if noise is None:
            return self
        return replace(
            self,
            values=self.values - noise.shift,
            covariance=self.covariance + noise.covariance,
            robust=self.robust + noise.covariance,
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


def consistent_solution(given: WeightedSolution, *, trusted: bool) -> Solution:
    """Physically consistent parameters, near the prior where that is trusted.

    With a prior the curvature says how far to trust; without, the least-squares fit does.

    Raises
    ------
    InputError
        No prior mass of a segment.
    EstimationError
        The iteration does not settle.
    """
    better = fit_consistent(
        given.equations,
        given.base,
        given.least.weights,
        _guess(given.prior),
        prior_sd=given.prior_sd if trusted else None,
        inflation=max(given.inflation, 1.0),
        about=None if given.noise is None else given.solution.values,
    )
    if better.covariance is None:
        return replace(given.solution, values=better.base, phi=better.phi)
    # C_b (b, b) = B (b, p) C (p, p) B^T
    robust = given.base.mapping @ better.covariance @ given.base.mapping.T
    sd = np.sqrt(np.diag(better.covariance))
    classical = robust / max(given.inflation, 1.0)
    return Solution(better.base, classical, robust, better.phi, sd)


def _guess(skeleton: Skeleton) -> FloatArray:
    massless = [s.name for s in moving_segments(skeleton) if not s.mass_kg > 0]
    if massless:
        raise InputError(
            f"no mass of {massless[0]} to start from",
            expected="a prior skeleton with masses and inertias, from a table for example",
        )
    return inertial_parameters(skeleton)
