"""Fit moment arms over posture: one function for all models of the table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.distance import cdist
from scipy.stats import chi2

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding
from armimpedance.core.progress import Progress
from armimpedance.muscles.models.activation.checks import plausible_size
from armimpedance.muscles.models.posture.certificate import checked_order, monomials
from armimpedance.muscles.models.posture.data import (
    UNITS,
    FittedMatrix,
    PostureData,
    element_names,
    posture_data,
)
from armimpedance.muscles.models.posture.model import (
    PostureModel,
    posture_polynomial,
    posture_quality,
    posture_summary,
)
from armimpedance.muscles.models.posture.models import POSTURE_MODELS, default_model
from armimpedance.muscles.models.rows import JointRows, main_errors
from armimpedance.muscles.models.workspace import (
    AngleScaling,
    Region,
    require_spread,
    stated_scaling,
)

# Whether moment arms of some order describe a matrix over posture, and by how much they do not.
#
# Residuals of neighbouring postures that agree are a course that no polynomial of this order
# follows; residuals that are larger than the stated errors without agreeing are postures at which
# the person was not equally relaxed, rows that are wrong, or errors that were stated too small. The
# first are found by the quadratic form of courses of some lengths, which has the most power against
# small ones of it, as a share of the residuals' sum of squares, so that it needs no stated errors;
# its level is that of white residuals on the same postures.

#: Lengths over shoulder and elbow within which a course that the model misses keeps its sign, in
#: half ranges of the workspace: one that changes with both angles alike, or with one of them.
LENGTHS: Final = ((0.4, 0.4), (0.2, 1.5), (1.5, 0.2))
#: A course is told that white residuals would show this rarely, in draws of so many.
LEVEL: Final = 0.004
DRAWS: Final = 5000
SEED: Final = 20261122
#: Scatter is told where chance makes it this rarely and variances are larger by this factor.
SCATTER_LEVEL: Final = 0.001
SCATTER: Final = 1.5
#: Residuals smaller than this part of the values' sum of squares are rounding.
EXACT: Final = 1e-20
#: Postures beyond the coefficients below which nothing is told.
FEWEST: Final = 4


def judged_fit(
    data: PostureData, fitted: FittedMatrix, labels: tuple[str, ...]
) -> tuple[FittedMatrix, tuple[Finding, ...]]:
    """The fit with intervals that allow for what it misses, and what is to be said of it.

    `labels` (P,): names of the rows.
    """
    symbol, unit = data.symbol, UNITS[data.symbol]
    X = monomials(data.scaled, fitted.powers)
    if len(X) - X.shape[1] < FEWEST:
        sentence = (
            f"{len(X)} postures for {X.shape[1]} coefficients of an element of {symbol} do not "
            "show whether moment arms of this order describe it: record more, or lower the order"
        )
        return fitted, (Finding("lack of fit", "cannot tell", sentence),)
    seen, missed, rest, least = _course(data, X)
    scatter = _scatter(data, fitted, rest if seen else np.zeros(3), labels)
    smallest = f"a course of {least:.2g} {unit} rms"
    if seen or scatter.verdict == "warning":
        fitted = _widened(fitted, missed)
    if not seen and not np.isfinite(least):
        sentence = (
            f"{len(X)} postures for {X.shape[1]} coefficients of an element of {symbol} leave too "
            "little over to show any course: record more, or lower the order"
        )
        return fitted, (Finding("lack of fit", "cannot tell", sentence), scatter)
    if not seen:
        sentence = f"what {symbol} leaves over shows no course over posture"
        return fitted, (Finding("lack of fit", "ok", sentence, smallest), scatter)
    sentence = (
        "neighbouring postures differ from the model alike, by "
        f"{float(np.sqrt(missed.mean())):.2g} {unit} rms of {symbol}: moment arms of this order do "
        "not describe it; use a higher order or a smaller workspace (intervals allow for it)"
    )
    return fitted, (Finding("lack of fit", "warning", sentence, smallest), scatter)


def _widened(fitted: FittedMatrix, missed: FloatArray) -> FittedMatrix:
    """The constants of ss, se, ee take the variances (3,) of a course that nothing follows."""
    wide = np.array(fitted.covariance)
    constant = np.arange(3) * len(fitted.powers)
    wide[constant, constant] += missed
    return replace(fitted, covariance=wide)


def _course(data: PostureData, X: FloatArray) -> tuple[bool, FloatArray, FloatArray, float]:
    """Test of agreement between neighbours; variances of course and rest of ss, se, ee; limit."""
    P, t = X.shape
    weight = np.ones((P, 3)) if data.sd is None else 1 / data.sd
    ways = [data.scaled / np.array(lengths) for lengths in LENGTHS]
    smooth = np.mean([np.exp(-0.5 * cdist(u, u, "sqeuclidean")) for u in ways], axis=0)
    rng = np.random.default_rng(SEED)
    share, by_chance = np.zeros(3), np.zeros(DRAWS)
    missed, rest, slopes = np.zeros(3), np.zeros(3), np.zeros((3, 3))
    for j in range(3):
        w = weight[:, j]
        # Q (P, P - t): orthonormal, no part of it a polynomial; r (P - t,) = Q^T w y
        Q = np.linalg.qr(w[:, None] * X, mode="complete")[0][:, t:]
        r = Q.T @ (w * data.values[:, j])
        S = Q.T @ (w[:, None] * smooth * w) @ Q
        square = float(r @ r)
        z = rng.standard_normal((DRAWS, P - t))
        one, two = float(np.trace(S)), float((S * S).sum())
        by_chance += ((z @ S) * z).sum(axis=1) / (z * z).sum(axis=1) / (one / (P - t))
        # an element that the polynomial meets exactly has the share of white residuals
        exact = square <= EXACT * float(((w * data.values[:, j]) ** 2).sum())
        share[j] = 1.0 if exact else float(r @ S @ r) / square / (one / (P - t))
        # E [r^T S r; r^T r] (2,) = [[two, one], [one, P - t]] (2, 2) [of course; of rest] (2,)
        both = np.linalg.solve([[two, one], [one, P - t]], [r @ S @ r, square])
        missed[j], rest[j] = np.maximum(both, 0.0)
        slopes[j] = two / one, one / (P - t), square / (P - t)
    limit = float(np.quantile(by_chance, 1 - LEVEL))
    return bool(share.sum() > limit), missed, rest, _least(slopes, limit)


def _least(slopes: FloatArray, limit: float) -> float:
    """Rms of a course, the same for all elements, whose mean share is the limit.

    Infinite where even a course without any other residual has less.
    """
    two, one, variance = slopes.T
    if float((two / one).sum()) <= limit:
        return float("inf")
    low, high = 0.0, float(np.sqrt((variance / one).max())) * 100
    for _ in range(60):
        middle = (low + high) / 2
        of_rest = middle**2 / np.maximum(variance, 1e-300)
        reached = float(((1 + of_rest * two) / (1 + of_rest * one)).sum()) > limit
        low, high = (low, middle) if reached else (middle, high)
    return high


def _scatter(
    data: PostureData, fitted: FittedMatrix, rest: FloatArray, labels: tuple[str, ...]
) -> Finding:
    """Residuals against the errors that were stated; `rest` (3,) where a course was seen."""
    symbol = data.symbol
    if data.sd is None:
        sentence = f"no errors of {symbol} are stated to hold the residuals against"
        return Finding("scatter", "ok", sentence)
    standardised = (
        data.values - monomials(data.scaled, fitted.powers) @ fitted.coefficients
    ) / data.sd
    spare = np.maximum(data.n_rows - np.array(fitted.spent), 1.0)
    excess = rest if rest.any() else (standardised**2).sum(axis=0) / spare
    p = chi2.sf(excess * spare, spare)
    limits = chi2.isf(SCATTER_LEVEL / 3, spare) / spare
    smallest = f"errors {100 * (np.sqrt(max(SCATTER, limits.min())) - 1):.0f} % larger than stated"
    excessive = (3 * p < SCATTER_LEVEL) & (excess > SCATTER)
    if not excessive.any():
        return Finding("scatter", "ok", f"rows of {symbol} differ by their errors", smallest)
    worst = int(np.argmax(excess))
    row = int(np.argmax((standardised**2).sum(axis=1)))
    part = float((standardised[row] ** 2).sum() / (standardised**2).sum())
    cause = (
        f"{100 * part:.0f} % of that is {labels[row]}: look at it first"
        if part > 0.5
        else "no row stands out: the person was not equally relaxed everywhere, or errors are "
        "stated too small"
    )
    sentence = (
        f"{element_names(symbol)[worst]} lies {np.sqrt(excess[worst]):.1f} times its stated errors "
        f"from the model, without a course over posture; {cause} (intervals follow the residuals)"
    )
    return Finding("scatter", "warning", sentence, smallest)


def fit_posture_model(
    rows: JointRows,
    *,
    order: int = 2,
    model: str | None = None,
    box: ArrayLike | None = None,
    seed: int = 0,
    judged: bool = True,
    progress: Progress | None = None,
) -> PostureModel:
    """Fit joint stiffness and viscosity over posture, Tsuji (1997), eqs. (33)-(37).

    Parameters
    ----------
    rows : JointRows
        Postures at (nearly) constant activation.
    order : int
        L, the order of the moment arms in the joint angles.
    model : str, optional
        A key of `POSTURE_MODELS`; by default "polynomial" below order 2, then "sos".
    box : (2, 2), optional
        The workspace, rad: of shoulder and elbow the lowest and the highest angle. By default the
        measured range.
    seed : int
        Seed of the shuffles.
    judged : bool
        False neither leaves rows out nor shuffles them, which is faster; the qualities that need
        that are then nan.
    progress : function, optional
        Called with what is done and what there is to do.

    Returns
    -------
    PostureModel

    Raises
    ------
    InputError
        No such model or order, a box without the postures, fewer postures than coefficients.
    NotIdentifiableError
        The postures are one, lie on a line, or cannot tell some term.
    EstimationError
        The solver did not end with an optimal solution.
    """
    order = checked_order(order)
    method = POSTURE_MODELS.named(model or default_model(order))
    rows.require_planar()
    if rows.n_rows == 0:
        raise InputError("no postures", expected="one or more")
    if seed < 0:
        raise InputError(f"seed {seed}", expected="0 or more")
    if order > 0:
        require_spread(rows.joint_angles, order)
    scaling = _scaling(rows, box)
    data = [posture_data(rows, symbol, scaling) for symbol in "KB"]
    seeds = np.random.SeedSequence(seed).spawn(2)
    fitted = [
        method.fit(one, order, np.random.default_rng(own), _part(progress, i), judged)
        for i, (one, own) in enumerate(zip(data, seeds, strict=True))
    ]

    def again(moved: PostureData) -> FloatArray:
        return method.fit(moved, order, np.random.default_rng(0), _silent, False).coefficients

    fitted = [
        _with_shared(made, one, rows.shared(one.symbol), again)
        for made, one in zip(fitted, data, strict=True)
    ]
    judgements = [judged_fit(d, f, rows.labels) for d, f in zip(data, fitted, strict=True)]
    fitted = [made for made, _ in judgements]
    checks = (*judgements[0][1], *judgements[1][1], plausible_size(data[0].values))
    K, B = (posture_polynomial(one, scaling) for one in fitted)
    return PostureModel(
        name=method.name,
        order=order,
        scaling=scaling,
        stiffness=K,
        viscosity=B,
        dof=min(one.dof for one in fitted),
        region=Region.of(scaling.scaled(rows.joint_angles)),
        quality=tuple(q for d, f in zip(data, fitted, strict=True) for q in posture_quality(d, f)),
        summary=posture_summary(method.name, order, rows, data, fitted, (K, B), checks),
    )


def _with_shared(
    fitted: FittedMatrix,
    data: PostureData,
    shared: FloatArray,
    again: Callable[[PostureData], FloatArray],
) -> FittedMatrix:
    """The fit with what errors that all rows share add to its covariance."""
    covariance = np.array(fitted.covariance)
    for error in main_errors(shared, data.sd):
        for moved in (data.values + error, data.values - error):
            # d (3 terms,) of one standard deviation; half for each of both ways
            d = (again(replace(data, values=moved)) - fitted.coefficients).T.ravel()
            covariance += np.outer(d, d) / 2
    return replace(fitted, covariance=covariance)


def _silent(_done: int, _total: int) -> None:
    """Shows no progress."""


def _scaling(rows: JointRows, box: ArrayLike | None) -> AngleScaling:
    if box is None:
        return AngleScaling.of(rows.joint_angles)
    return stated_scaling(box, rows.joint_angles, rows.labels)


def _part(progress: Progress | None, matrix: int) -> Progress:
    """Progress of one of the two matrices as progress of both."""
    if progress is None:
        return _silent
    return lambda done, total: progress(matrix * total + done, 2 * total)
