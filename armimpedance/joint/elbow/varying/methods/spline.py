"""B(t) and K(t) as cubic splines; the number of knots is chosen by cross-validation."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.interpolate import BSpline
from scipy.linalg import block_diag, cho_factor, cho_solve

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.joint.elbow.varying.basis import BasisFit, fit_basis
from armimpedance.joint.elbow.varying.beginning import Beginning
from armimpedance.joint.elbow.varying.data import VaryingData
from armimpedance.joint.elbow.varying.equation import Course, Linearised, linearise
from armimpedance.joint.elbow.varying.method import (
    EstimatedCourse,
    VaryingMethod,
    VaryingOptions,
    grid,
)

DEGREE: Final = 3
#: Numbers of intervals between knots per second that are compared; 0: constant.
PER_SECOND: Final = (0.0, 0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 8.0)
#: Number of folds, and length of the blocks that alternate between them, s. Rows of the whitened
#: equation are independent, so blocks need only be longer than the memory of the filter.
FOLDS: Final = 5
BLOCK_S: Final = 0.15
#: Long records are cut into pieces of this length for the choice, s: its cost grows with the
#: square of the number of splines.
PIECE_S: Final = 15.0
#: Intensity of the integrated random walk that is the weak prior, over the mean, s^-1.5.
WEAK_INTENSITY: Final = 30.0

#: Least knots per second of the denser spline that shows the error of the chosen one.
LEAST_DENSER: Final = 2.0

Rates = tuple[float, float]


def spline(begun: Beginning, options: VaryingOptions) -> EstimatedCourse:
    """Fit cubic splines; B and K have different knots."""
    data, course = begun.data, begun.course
    scale = np.array([np.abs(course.B).mean(), np.abs(course.K).mean()])
    chosen = _choose(data, course, scale)
    fit = _fit(data, course, chosen, scale)
    course = fit.course
    bias = _bias(data, fit, chosen, scale)
    at = grid(data, options.every_s)
    sd = np.sqrt(_variances(data, fit, chosen)[at] + bias**2)
    return EstimatedCourse(
        at=at,
        B=course.B[at],
        K=course.K[at],
        sd_B=sd[:, 0],
        sd_K=sd[:, 1],
        inertia=course.inertia,
        sd_inertia=fit.sd_inertia,
        notes=(
            f"cubic splines, {_told(chosen[0])} for B and {_told(chosen[1])} for K, chosen by "
            f"cross-validation over {FOLDS} folds",
        ),
        warnings=_at_limit(chosen),
        details={
            "intervals_per_second": {"B": chosen[0], "K": chosen[1]},
            "bias_percent": dict(zip("BK", (100 * bias / scale).tolist(), strict=True)),
        },
    )


def _fit(data: VaryingData, course: Course, rates: Rates, scale: FloatArray) -> BasisFit:
    of_B, of_K = (spline_basis(data, rate) for rate in rates)
    prior = _prior(data, rates, scale)
    # good data must not end in an error: the last rounds, with shorter and shorter steps, are used
    return fit_basis(data, course, of_B, of_K, prior=prior, strict=False)


def _bias(data: VaryingData, fit: BasisFit, rates: Rates, scale: FloatArray) -> FloatArray:
    """Error of the knots' resolution, rms (2,): change of B and K with denser knots, beyond
    noise."""
    denser = tuple(max(_next(rate), LEAST_DENSER) for rate in rates)
    dense_fit = _fit(data, fit.course, (denser[0], denser[1]), scale)
    apart = np.stack([fit.course.B - dense_fit.course.B, fit.course.K - dense_fit.course.K], axis=1)
    more = _variances(data, dense_fit, (denser[0], denser[1])) - _variances(data, fit, rates)
    return np.asarray(np.sqrt(np.maximum((apart**2 - more).mean(axis=0), 0.0)))


def _next(rate: float) -> float:
    return next((r for r in PER_SECOND if r > 1.3 * rate), 1.5 * PER_SECOND[-1])


def _variances(data: VaryingData, fit: BasisFit, rates: Rates) -> FloatArray:
    """Variances of B and K at the samples, (N, 2)."""
    of_B, of_K = (spline_basis(data, rate) for rate in rates)
    C, pB = fit.covariance, of_B.shape[1]
    parts = ((of_B, C[:pB, :pB]), (of_K, C[pB:, pB:]))
    return np.stack([((f @ c) * f).sum(axis=1) for f, c in parts], axis=1)


def _prior(data: VaryingData, rates: Rates, scale: FloatArray) -> FloatArray:
    """Information (p, p) that keeps coefficients finite where there is no motion.

    Second differences of a trial's coefficients have the variance of an integrated random walk of
    `WEAK_INTENSITY` times the mean, over the spacing of the knots cubed.
    """
    blocks = []
    for rate, size in zip(rates, scale, strict=True):
        for a, b in zip(data.offsets[:-1], data.offsets[1:], strict=True):
            intervals = round(rate * int(b - a) / data.rate_hz)
            D = np.diff(np.eye(intervals + DEGREE if intervals else 1), 2, axis=0)
            variance = (WEAK_INTENSITY * size) ** 2 / max(rate, 1e-9) ** 3
            blocks.append(D.T @ D / variance)
    return np.asarray(block_diag(*_merged(blocks, rates, data)))


def _merged(blocks: list[FloatArray], rates: Rates, data: VaryingData) -> list[FloatArray]:
    """Merge the blocks of a constant, all zero, into one: a constant serves all trials."""
    T = len(data.trials)
    out: list[FloatArray] = []
    for k, rate in enumerate(rates):
        out += blocks[k * T : (k + 1) * T] if rate else [np.zeros((1, 1))]
    return out


def spline_basis(data: VaryingData, per_second: float) -> FloatArray:
    """B-splines of each trial at the samples, (N, p); constants if `per_second` is 0."""
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


def _choose(data: VaryingData, course: Course, scale: FloatArray) -> Rates:
    """Intervals per second of B and K: first equal ones, then each separately."""
    eq = linearise(data, course)
    bases = {rate: spline_basis(data, rate) for rate in PER_SECOND}
    pieces = _pieces(data, eq)
    fold = np.arange(len(eq.y)) // round(BLOCK_S * data.rate_hz) % FOLDS
    scores: dict[Rates, float] = {}

    def score(pair: Rates) -> float:
        if pair not in scores:
            prior = _prior(data, pair, scale)
            of_B, of_K = bases[pair[0]], bases[pair[1]]
            scores[pair] = sum(
                _cross_validated(*_piece(eq, piece, of_B, of_K, prior), fold[piece])
                for piece in pieces
            )
        return scores[pair]

    # try all: slightly too few knots can be worse than none
    best = min([(rate, rate) for rate in PER_SECOND], key=score)
    equal = PER_SECOND.index(best[0])
    near = PER_SECOND[max(equal - 2, 0) : equal + 2]
    best = min([(rate, best[1]) for rate in (0.0, *near)], key=score)
    return min([(best[0], rate) for rate in (0.0, *near)], key=score)


def _pieces(data: VaryingData, eq: Linearised) -> list[slice]:
    """Rows of each piece: trials, long ones cut into equal parts."""
    edges = [0, *(np.flatnonzero(np.diff(eq.trial)) + 1).tolist(), len(eq.trial)]
    out = []
    for a, b in zip(edges[:-1], edges[1:], strict=True):
        count = max(round((b - a) / (PIECE_S * data.rate_hz)), 1)
        cuts = np.linspace(a, b, count + 1).astype(int).tolist()
        out += [slice(i, j) for i, j in zip(cuts[:-1], cuts[1:], strict=True)]
    return out


def _piece(
    eq: Linearised, piece: slice, of_B: FloatArray, of_K: FloatArray, prior: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Whitened ``[x2, offsets, nonzero splines, y]`` of a piece, and the prior information."""
    at = eq.centre[piece]
    splines = np.concatenate([of_B[at] * eq.x1[piece, None], of_K[at] * eq.x0[piece, None]], axis=1)
    nonzero = np.flatnonzero(np.concatenate([of_B[at].any(axis=0), of_K[at].any(axis=0)]))
    offsets = eq.nuisance[piece].any(axis=0)
    first = np.column_stack([eq.x2[piece], eq.nuisance[piece][:, offsets]])
    columns = np.column_stack([first, splines[:, nonzero], eq.y[piece]])
    before = np.diag(np.concatenate([[0.0], eq.prior_sd[offsets] ** -2]))
    return eq.whitened(columns, piece), block_diag(before, prior[np.ix_(nonzero, nonzero)])


def _cross_validated(white: FloatArray, before: FloatArray, fold: IntArray) -> float:
    """Sum of squares of each fold's rows, predicted by the other folds; inf if that fails."""
    grams = np.stack([white[fold == f].T @ white[fold == f] for f in range(FOLDS)])
    whole, total = grams.sum(axis=0), 0.0
    for gram in grams:
        A, b = (whole - gram)[:-1, :-1] + before, (whole - gram)[:-1, -1]
        diagonal = np.diag(A)
        if not (diagonal > 0).all():
            return float("inf")
        scale = 1 / np.sqrt(diagonal)
        try:
            factor = cho_factor(A * scale[:, None] * scale)
        except np.linalg.LinAlgError:
            return float("inf")
        p = np.append(scale * cho_solve(factor, scale * b), -1.0)
        total += float(p @ gram @ p)
    return total


def _told(rate: float) -> str:
    return f"{rate:g} intervals per second" if rate else "a constant"


def _at_limit(chosen: Rates) -> tuple[str, ...]:
    return tuple(
        f"{name} asks for more knots than {PER_SECOND[-1]:g} per second: faster than can be shown"
        for name, rate in zip("BK", chosen, strict=True)
        if rate == PER_SECOND[-1]
    )


METHOD = VaryingMethod(
    "spline",
    "cubic splines, the number of knots chosen by cross-validation",
    "",
    "C. de Boor, A Practical Guide to Splines (1978)",
    spline,
)
