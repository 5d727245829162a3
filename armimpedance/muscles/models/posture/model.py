"""Joint stiffness and viscosity as functions of posture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import block_diag

from armimpedance.core.arrays import BoolArray, FloatArray, FrozenRecord, frozen_array
from armimpedance.core.errors import InputError
from armimpedance.muscles.models.angle_scaling import AngleScaling
from armimpedance.muscles.models.fitted_model import FittedModel
from armimpedance.muscles.models.posture.certificate import (
    GRID,
    Certificate,
    proves,
    smallest_eigenvalues,
)
from armimpedance.muscles.models.posture.fitted import FittedMatrix
from armimpedance.muscles.models.posture.terms import checked_order, exponents, monomials
from armimpedance.muscles.models.prediction import JointPrediction
from armimpedance.muscles.models.quality import ElementQuality
from armimpedance.muscles.models.region import Region
from armimpedance.numerics.regression import FitSummary, Parameters


@dataclass(frozen=True)
class PosturePolynomial(FrozenRecord):
    """One matrix, K or B, over posture.

    Attributes
    ----------
    coefficients : (terms, 3)
        Coefficients of ss, se, ee over the monomials ``exponents(2 order)`` of the scaled angles.
    covariance : (3 terms, 3 terms)
        All terms of ss, then se, then ee.
    structure : str
        "free", "full", "separable" or "box" (docs/muscles/posture.md).
    penalty : float
        The regularisation that was chosen; 0 where there is none.
    certificate : Certificate
    """

    coefficients: Annotated[FloatArray, "t 3"]
    covariance: Annotated[FloatArray, "c c covariance"]
    structure: str
    penalty: float
    certificate: Certificate

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.covariance) != self.coefficients.size:
            have = f"a covariance of {len(self.covariance)} coefficients"
            raise InputError(have, expected=f"{self.coefficients.size}")

    def at(self, X: FloatArray) -> FloatArray:
        """``ss, se, ee`` (P, 3) at monomials X (P, terms)."""
        # plain einsum adds in one order, however many postures are asked for at once
        return np.asarray(np.einsum("pt,ta->pa", X, self.coefficients))

    def covariance_at(self, X: FloatArray) -> FloatArray:
        """Covariance (P, 3, 3) of `at`."""
        terms = len(self.coefficients)
        blocks = self.covariance.reshape(3, terms, 3, terms)
        half = np.einsum("pt,atbv->pabv", X, blocks)
        both = np.einsum("pabv,pv->pab", half, X)
        return np.asarray((both + both.transpose(0, 2, 1)) / 2)


@dataclass(frozen=True, repr=False)
class PostureModel(FittedModel):
    """Joint impedance over posture at one level of activation.

    Attributes
    ----------
    name : str
        Name of the way it was fitted, a key of `POSTURE_MODELS`.
    order : int
        Order L of the moment arms; elements of K and B are polynomials of order 2L.
    scaling : AngleScaling
        Made of the stated workspace, or of the measured range.
    stiffness, viscosity : PosturePolynomial
        N m/rad, N m s/rad.
    dof : float
        Degrees of freedom of the t distribution for intervals; inf = normal.
    region : Region
        Hull of the measured postures, in scaled angles.
    quality : tuple of ElementQuality
        K_ss, K_se, K_es, K_ee, then the same of B, against the elements as measured.
    summary : FitSummary

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.hand import simulate
    >>> places, _ = simulate("postures", seed=1, sets=1)
    >>> model = ai.fit_posture(ai.to_joint(ai.estimate(places)), order=1)
    >>> model.predict([1.0, 1.5]).extrapolated.tolist()
    [False]
    """

    name: str
    order: int
    scaling: AngleScaling
    stiffness: PosturePolynomial
    viscosity: PosturePolynomial
    dof: float
    region: Region
    quality: tuple[ElementQuality, ...]
    summary: FitSummary

    def __post_init__(self) -> None:
        super().__post_init__()
        terms = len(exponents(2 * checked_order(self.order)))
        for made in (self.stiffness, self.viscosity):
            if len(made.coefficients) != terms:
                have = f"{len(made.coefficients)} coefficients of an element"
                raise InputError(have, expected=f"{terms} for order {self.order}")
            grams = made.certificate.grams
            if grams and not proves(grams, made.coefficients, self.order):
                raise InputError("Gram matrices that do not make the coefficients prove nothing")

    @property
    def parameters(self) -> Parameters:
        """The coefficients of K, then of B, whose fits are independent, with their covariance."""
        both, named = (self.stiffness, self.viscosity), self.summary.parameters
        return Parameters(
            tuple(p.name for p in named),
            tuple(p.unit for p in named),
            np.concatenate([one.coefficients.T.ravel() for one in both]),
            block_diag(*(one.covariance for one in both)),
            dof=self.dof,
        )

    def predict(self, joint_angles: ArrayLike) -> JointPrediction:
        """Stiffness and viscosity at postures (P, 2) or one posture (2,), rad.

        Raises
        ------
        RecordError
            Not angles of two joints, or not finite.
        """
        q = frozen_array(np.atleast_2d(np.asarray(joint_angles, float)), "joint_angles", (None, 2))
        u = self.scaling.scaled(q)
        X = monomials(u, exponents(2 * self.order))
        inside = self.region.contains(u)
        return JointPrediction(
            joint_angles=q,
            stiffness=self.stiffness.at(X),
            viscosity=self.viscosity.at(X),
            stiffness_covariance=self.stiffness.covariance_at(X),
            viscosity_covariance=self.viscosity.covariance_at(X),
            dof=self.dof,
            extrapolated=~inside,
            reasons=self._reasons(u, inside),
        )

    def _reasons(self, u: FloatArray, inside: BoolArray) -> tuple[str, ...]:
        beyond = np.abs(u - self.region.nearest(u)) * np.rad2deg(self.scaling.half_range)
        return tuple(
            ""
            if within
            else f"{s:.0f} deg (shoulder) and {e:.0f} deg (elbow) outside of what was measured"
            for within, (s, e) in zip(inside, beyond, strict=True)
        )


def posture_polynomial(fitted: FittedMatrix, scaling: AngleScaling) -> PosturePolynomial:
    """A fitted matrix as part of a model, with its smallest eigenvalue over the workspace."""
    q = scaling.grid(GRID)
    X = monomials(scaling.scaled(q), fitted.powers)
    lowest = smallest_eigenvalues(X @ fitted.coefficients)
    where = int(lowest.argmin())
    return PosturePolynomial(
        coefficients=fitted.coefficients,
        covariance=fitted.covariance,
        structure=fitted.structure,
        penalty=fitted.penalty,
        certificate=Certificate(float(lowest[where]), q[where], fitted.grams),
    )
