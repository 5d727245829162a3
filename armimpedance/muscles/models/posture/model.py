"""Joint stiffness and viscosity as functions of posture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import block_diag

from armimpedance.core.arrays import BoolArray, FloatArray, FrozenRecord, frozen_array
from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding, warnings_of
from armimpedance.muscles.models.fitted_model import ElementQuality, FittedModel, element_quality
from armimpedance.muscles.models.posture.certificate import (
    GRID,
    Certificate,
    checked_order,
    exponents,
    monomials,
    proves,
    smallest_eigenvalues,
    term_names,
)
from armimpedance.muscles.models.posture.data import UNITS, FittedMatrix, PostureData, element_names
from armimpedance.muscles.models.prediction import JointPrediction
from armimpedance.muscles.models.rows import JointRows
from armimpedance.muscles.models.workspace import AngleScaling, Region
from armimpedance.numerics.regression import FitSummary, NamedParameter, Parameters, conditioning


@dataclass(frozen=True)
class PosturePolynomial(FrozenRecord):
    """One matrix, K or B, over posture.

    `coefficients` (terms, 3): coefficients of ss, se, ee over the monomials ``exponents(2 order)``
    of the scaled angles.
    `covariance` (3 terms, 3 terms): all terms of ss, then se, then ee.
    `structure`: "free", "full", "separable" or "box" (docs/explanation/posture_models.md).
    `penalty`: the regularisation that was chosen; 0 where there is none.
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


# How well a model over posture fits, element by element, and its summary.

#: Rows, columns and the fitted element of the four measured ones.
_MEASURED = (("ss", 0, 0, 0), ("se", 0, 1, 1), ("es", 1, 0, 1), ("ee", 1, 1, 2))


def posture_quality(data: PostureData, fitted: FittedMatrix) -> tuple[ElementQuality, ...]:
    """Quality of the four elements as measured; se and es are judged against one polynomial.

    With one coefficient (order 0) the fit and each fit without a row are constants: their
    correlations are 0 (the constants without a row correlate with the rows left out by -1, which
    says nothing of the model).
    """
    prediction = monomials(data.scaled, fitted.powers) @ fitted.coefficients
    held_out = prediction if len(fitted.powers) == 1 else fitted.held_out
    return tuple(
        element_quality(
            f"{data.symbol}_{name}",
            data.measured[:, a, b],
            prediction[:, j],
            held_out=None if held_out is None else held_out[:, j],
            null_r=float(fitted.null_r[2 * a + b]),
            coefficients=fitted.spent[j],
        )
        for name, a, b, j in _MEASURED
    )


def posture_summary(
    method: str,
    order: int,
    rows: JointRows,
    data: Sequence[PostureData],
    fitted: Sequence[FittedMatrix],
    made: Sequence[PosturePolynomial],
    checks: tuple[Finding, ...],
) -> FitSummary:
    """Condition, rank, coefficients and warnings.

    `cond_raw` is that of the monomials of the angles in rad, `cond_scaled` of the scaled angles
    with unit columns; r2 (of the stiffness, about the mean of each element) counts the elements as
    the fit does, vaf in their own unit.
    """
    raw = monomials(rows.joint_angles, exponents(2 * order))
    stiffness, fit = data[0], fitted[0]
    residual = stiffness.values - monomials(stiffness.scaled, fit.powers) @ fit.coefficients
    parameters = [p for f in fitted for p in _parameters(f)]
    return FitSummary(
        method=method,
        n=rows.n_rows,
        cond_raw=_condition(raw),
        cond_scaled=max(f.cond_scaled for f in fitted),
        rank=min(f.rank for f in fitted),
        r2=_explained(stiffness.values, residual, stiffness.weights),
        vaf=_explained(stiffness.values, residual, np.ones((1, 3))),
        parameters=tuple(parameters),
        warnings=(
            *(w for f in fitted for w in f.warnings),
            *(w for f, p in zip(fitted, made, strict=True) for w in _indefinite(f.symbol, p)),
            *warnings_of(checks),
        ),
        checks=checks,
    )


def _parameters(fitted: FittedMatrix) -> list[NamedParameter]:
    sd = np.sqrt(np.maximum(np.diag(fitted.covariance), 0.0)).reshape(3, -1)
    return [
        NamedParameter(
            name=f"{element}[{term}]",
            value=float(fitted.coefficients[i, j]),
            sd=float(sd[j, i]),
            sd_robust=float(sd[j, i]),
            unit=UNITS[fitted.symbol],
            dof=fitted.dof,
        )
        for j, element in enumerate(element_names(fitted.symbol))
        for i, term in enumerate(term_names(fitted.powers))
    ]


def _condition(W: FloatArray) -> float:
    """Condition of W (P, p); inf with fewer rows than columns."""
    p, count = W.shape
    if p < count:
        return float("inf")
    return conditioning(np.asarray(np.linalg.qr(W, mode="r")), p).cond_raw


def _indefinite(symbol: str, polynomial: PosturePolynomial) -> tuple[str, ...]:
    certificate = polynomial.certificate
    if certificate.smallest_eigenvalue >= 0 or certificate.grams:
        return ()
    s, e = np.rad2deg(certificate.at)
    smallest = f"{certificate.smallest_eigenvalue:.3g} {UNITS[symbol]}"
    return (
        f"{symbol} is not positive definite over the whole workspace: eigenvalue {smallest} at "
        f"shoulder {s:.0f}, elbow {e:.0f} deg",
    )


def _explained(values: FloatArray, residual: FloatArray, weights: FloatArray) -> float:
    about = weights * (values - values.mean(axis=0))
    total = float((about**2).sum())
    return 1 - float(((weights * residual) ** 2).sum()) / total if total > 0 else float("nan")
