"""How well a model over posture fits, element by element, and its summary."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.findings import Finding, warnings_of
from armimpedance.muscles.models.posture.data import UNITS, PostureData, element_names
from armimpedance.muscles.models.posture.fitted import FittedMatrix
from armimpedance.muscles.models.posture.model import PosturePolynomial
from armimpedance.muscles.models.posture.terms import exponents, monomials, term_names
from armimpedance.muscles.models.quality import ElementQuality, element_quality
from armimpedance.muscles.models.rows import JointRows
from armimpedance.numerics.regression import FitSummary, NamedParameter, conditioning

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


def _indefinite(symbol: str, made: PosturePolynomial) -> tuple[str, ...]:
    found = made.certificate
    if found.smallest_eigenvalue >= 0 or found.grams:
        return ()
    s, e = np.rad2deg(found.at)
    return (
        f"{symbol} is not positive definite over the whole workspace: eigenvalue "
        f"{found.smallest_eigenvalue:.3g} {UNITS[symbol]} at shoulder {s:.0f}, elbow {e:.0f} deg",
    )


def _explained(values: FloatArray, residual: FloatArray, weights: FloatArray) -> float:
    about = weights * (values - values.mean(axis=0))
    total = float((about**2).sum())
    return 1 - float(((weights * residual) ** 2).sum()) / total if total > 0 else float("nan")
