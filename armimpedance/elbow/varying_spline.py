"""B(t) and K(t) as cubic splines; how many knots is chosen by cross-validation."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.interpolate import BSpline

from armimpedance.elbow.varying_basis import basis_columns, fit_basis
from armimpedance.elbow.varying_data import VaryingData
from armimpedance.elbow.varying_equation import Course, linearise
from armimpedance.elbow.varying_found import Found, grid
from armimpedance.elbow.varying_smoother import free_course
from armimpedance.errors import EstimationError
from armimpedance.records import FloatArray, IntArray

DEGREE: Final = 3
#: Intervals between knots per second that are compared; 0: constant.
PER_SECOND: Final = (0.0, 0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 8.0)
#: Folds, and the length of the blocks that go round them, s: rows of the whitened equation are
#: independent, so that blocks need only hide what a filter's memory carries over.
FOLDS: Final = 5
BLOCK_S: Final = 0.15
#: Rounds of choosing knots and linearising again.
ROUNDS: Final = 2


def spline(data: VaryingData, *, every_s: float | None = None) -> Found:
    """Cubic splines; B and K have knots of their own."""
    course = free_course(data)
    chosen = (0.0, 0.0)
    for _ in range(ROUNDS):
        chosen = _choose(data, course)
        of_B, of_K = (spline_basis(data, rate) for rate in chosen)
        fit = fit_basis(data, course, of_B, of_K)
        course = fit.course
    at = grid(data, every_s)
    pB = of_B.shape[1]
    C = fit.covariance
    return Found(
        trial=data.trial_of[at],
        time_s=data.time_s[at],
        B=course.B[at],
        K=course.K[at],
        sd_B=_sd(of_B[at], C[:pB, :pB]),
        sd_K=_sd(of_K[at], C[pB:, pB:]),
        inertia=course.inertia,
        sd_inertia=fit.sd_inertia,
        notes=(
            f"cubic splines, {_told(chosen[0])} for B and {_told(chosen[1])} for K, chosen by "
            f"cross-validation over {FOLDS} folds",
        ),
        warnings=_at_limit(chosen),
        details={"intervals_per_second": {"B": chosen[0], "K": chosen[1]}},
    )


def spline_basis(data: VaryingData, per_second: float) -> FloatArray:
    """B-splines of each trial at the samples, (N, p); constants where `per_second` is 0."""
    parts = []
    for a, b in zip(data.offsets[:-1], data.offsets[1:], strict=True):
        count = int(b - a)
        intervals = round(per_second * count / data.rate_hz)
        if intervals == 0:
            parts.append(np.ones((count, 1)))
            continue
        inner = np.linspace(0, count - 1, intervals + 1)
        knots = np.concatenate([np.full(DEGREE, inner[0]), inner, np.full(DEGREE, inner[-1])])
        parts.append(BSpline.design_matrix(np.arange(count), knots, DEGREE).toarray())
    if per_second == 0:
        return np.concatenate(parts)
    out = np.zeros((sum(len(p) for p in parts), sum(p.shape[1] for p in parts)))
    row = column = 0
    for p in parts:
        out[row : row + len(p), column : column + p.shape[1]] = p
        row, column = row + len(p), column + p.shape[1]
    return out


def _sd(functions: FloatArray, covariance: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(((functions @ covariance) * functions).sum(axis=1)))


def _choose(data: VaryingData, course: Course) -> tuple[float, float]:
    """Intervals per second of B and K: both alike first, then each by itself."""
    eq = linearise(data, course)
    n = round(BLOCK_S * data.rate_hz)
    fold = np.arange(len(eq.y)) // n % FOLDS
    bases = {rate: spline_basis(data, rate) for rate in PER_SECOND}
    scores: dict[tuple[float, float], float] = {}

    def score(pair: tuple[float, float]) -> float:
        if pair not in scores:
            columns = basis_columns(eq, bases[pair[0]], bases[pair[1]])
            white = eq.whitened(np.column_stack([columns, eq.y]))
            scores[pair] = _cross_validated(white, fold, eq.prior_sd)
        return scores[pair]

    # all of them: a few knots too few can be worse than none
    best = min([(rate, rate) for rate in PER_SECOND], key=score)
    both = PER_SECOND.index(best[0])
    near = PER_SECOND[max(both - 2, 0) : both + 2]
    best = min([(rate, best[1]) for rate in (0.0, *near)], key=score)
    return min([(best[0], rate) for rate in (0.0, *near)], key=score)


def _cross_validated(white: FloatArray, fold: IntArray, prior_sd: FloatArray) -> float:
    """Sum of squares of rows that the fit to the other folds predicts; inf where it cannot."""
    grams = np.stack([white[fold == f].T @ white[fold == f] for f in range(FOLDS)])
    last = np.arange(white.shape[1] - 1 - len(prior_sd), white.shape[1] - 1)
    total = 0.0
    for f in range(FOLDS):
        rest = grams.sum(axis=0) - grams[f]
        A = rest[:-1, :-1]
        A[last, last] += prior_sd**-2
        diagonal = np.diag(A)
        if not (diagonal > 0).all():
            return float("inf")
        scale = 1 / np.sqrt(diagonal)
        try:
            factor = np.linalg.cholesky(A * scale[:, None] * scale)
        except np.linalg.LinAlgError:
            return float("inf")
        right = rest[:-1, -1] * scale
        p = np.append(scale * np.linalg.solve(factor.T, np.linalg.solve(factor, right)), -1.0)
        total += float(p @ grams[f] @ p)
    if not np.isfinite(total):
        raise EstimationError("cross-validation of the splines has no finite score")
    return total


def _told(rate: float) -> str:
    return f"{rate:g} intervals per second" if rate else "a constant"


def _at_limit(chosen: tuple[float, float]) -> tuple[str, ...]:
    return tuple(
        f"{name} asks for more knots than {PER_SECOND[-1]:g} per second: faster than can be shown"
        for name, rate in zip("BK", chosen, strict=True)
        if rate == PER_SECOND[-1]
    )
