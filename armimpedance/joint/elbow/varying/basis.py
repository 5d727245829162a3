"""B(t) and K(t) as sums of known functions: a weighted regression, repeated until it converges."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.errors import EstimationError
from armimpedance.joint.elbow.varying.data import VaryingData
from armimpedance.joint.elbow.varying.equation import (
    Course,
    Linearised,
    Step,
    linearise,
    solve_gram,
    with_offsets,
)

ROUNDS: Final = 20
#: The fit has converged if K changes by less than this share of its standard error.
SETTLED: Final = 0.02
#: If it still changes by more than this share, the fit fails.
UNSETTLED: Final = 0.5
#: Lowest share of the whitened residual's spectrum, where a joint moves: excess there is misfit.
LOW_PART: Final = 0.125
#: Number of blocks of rows whose scores are treated as independent, if regressors have errors; in a
#: long record more, of `BLOCK_S` seconds each.
BLOCKS: Final = 50
MOST_BLOCKS: Final = 150
BLOCK_S: Final = 0.5


@dataclass(frozen=True)
class BasisFit:
    """Coefficients of the functions of B, then of K, and the course that they give.

    `coefficients` (p,): functions of B, then of K.
    `covariance` (p, p): including `excess`.
    `excess`: power of the residuals at low frequencies over that of the noise; 1 or more.
    `eq`: the equation linearised about the course.
    """

    course: Course
    coefficients: FloatArray
    covariance: FloatArray
    sd_inertia: float
    excess: float
    eq: Linearised


def fit_basis(
    data: VaryingData,
    first: Course,
    of_B: FloatArray,
    of_K: FloatArray,
    error: FloatArray | None = None,
    prior: FloatArray | None = None,
    *,
    strict: bool = True,
    rounds: int = ROUNDS,
) -> BasisFit:
    """Fit B = of_B b and K = of_K k.

    `of_B`, `of_K` (N, p_B), (N, p_K): functions at the samples.
    `error` (M, N, p_B + p_K) or None: draws of the functions' errors, whose moments are
    subtracted.
    `prior` (p_B + p_K, p_B + p_K) or None: prior information on the coefficients.
    `strict`: True if rounds that do not converge are a failure.
    `rounds`: largest number of rounds.
    Raises EstimationError: the record does not determine the functions, or the rounds do not
    converge.
    """
    course, pB, step = first, of_B.shape[1], Step()
    for turn in range(rounds):
        eq = linearise(data, course)
        columns = basis_columns(eq, of_B, of_K)
        p, covariance = _solve(data, eq, columns, error, pB, prior)
        b, k = p[1 : 1 + pB], p[1 + pB : 1 + pB + of_K.shape[1]]
        new = replace(course, inertia=float(p[0]), B=of_B @ b, K=of_K @ k)
        course, step = step.taken(course, with_offsets(new, p[1 + pB + len(k) :]))
        within = covariance[1 + pB : 1 + pB + len(k), 1 + pB : 1 + pB + len(k)]
        typical = np.sqrt(((of_K @ within) * of_K).sum(axis=1).mean())
        if turn and step.moved < SETTLED * typical:
            break
    else:
        if strict and not step.moved < UNSETTLED * typical:
            raise EstimationError(f"B(t) and K(t) do not settle within {ROUNDS} rounds")
    residual = eq.whitened((eq.y - columns @ p)[:, None])[:, 0]
    # clustered errors include all residuals beyond the sensors' noise
    excess = low_excess(residual) if error is None else 1.0
    inner = slice(1, 1 + pB + len(k))
    return BasisFit(
        course,
        p[inner],
        covariance[inner, inner] * excess,
        float(np.sqrt(covariance[0, 0] * excess)),
        excess,
        eq,
    )


def basis_columns(eq: Linearised, of_B: FloatArray, of_K: FloatArray) -> FloatArray:
    """Columns [x2, functions of B times x1, functions of K times x0, offsets], (R, q)."""
    at = eq.centre
    return np.column_stack(
        [eq.x2, of_B[at] * eq.x1[:, None], of_K[at] * eq.x0[:, None], eq.nuisance]
    )


def low_excess(white: FloatArray) -> float:
    """Power of whitened residuals (R,) at low frequencies over that of white noise, at least 1."""
    power = np.abs(np.fft.rfft(white)) ** 2 / len(white)
    return max(float(power[1 : max(int(LOW_PART * len(power)), 8)].mean()), 1.0)


def _solve(
    data: VaryingData,
    eq: Linearised,
    columns: FloatArray,
    error: FloatArray | None,
    pB: int,
    prior: FloatArray | None,
) -> tuple[FloatArray, FloatArray]:
    white = eq.whitened(np.column_stack([columns, eq.y]))
    gram = white.T @ white
    A, b = gram[:-1, :-1], gram[:-1, -1]
    if prior is not None:
        A[1 : 1 + len(prior), 1 : 1 + len(prior)] += prior
    if error is None:
        return solve_gram(A, b, eq.prior_sd)
    inner = np.arange(1, 1 + error.shape[2])
    S = error_moments(data, eq, columns.shape[1], error_columns(eq, error, pB), inner)
    p, inverse = solve_gram(A - S.sum(axis=0), b, eq.prior_sd)
    return p, clustered(blocked(data, white), p, inverse, S)


def error_columns(eq: Linearised, error: FloatArray, pB: int) -> Iterator[FloatArray]:
    """Errors of the columns for draws (M, N, k) of the functions' errors: (R, k) each."""
    motion = np.where(np.arange(error.shape[2]) < pB, eq.x1[:, None], eq.x0[:, None])
    return (draw[eq.centre] * motion for draw in error)


def error_moments(
    data: VaryingData, eq: Linearised, q: int, draws: Iterable[FloatArray], inner: IntArray
) -> FloatArray:
    """Moments ``E[U_b^T Sigma^-1 U_b]`` (blocks, q, q) of errors U of the columns `inner` of q.

    Each draw of U is (R, k); blocks as in `blocked`.
    """
    total: FloatArray = np.zeros(1)
    count = 0
    for draw in draws:
        total, count = total + blocked(data, eq.whitened(draw)), count + 1
    S = np.zeros((len(total), q, q))
    S[:, inner[:, None], inner] = total / count
    return S


def blocked(data: VaryingData, white: FloatArray) -> FloatArray:
    """Gram matrices (C, q, q) of blocks of whitened rows (R, q)."""
    rows = len(white)
    count = min(max(BLOCKS, round(rows / (BLOCK_S * data.rate_hz))), MOST_BLOCKS, rows)
    starts = np.unique(np.linspace(0, rows, count + 1).astype(np.int64)[:-1])
    return np.stack([part.T @ part for part in np.split(white, starts[1:])])


def clustered(grams: FloatArray, p: FloatArray, inverse: FloatArray, S: FloatArray) -> FloatArray:
    """Covariance (q, q) of p from the scores of blocks, for regressors with errors.

    Scores ``s_b = X_b^T y_b - (X_b^T X_b - S_b) p`` from moments of [X, y], (C, q + 1, q + 1).
    """
    scores = grams[:, :-1, -1] - (grams[:, :-1, :-1] - S) @ p
    count = len(scores)
    # C (q, q) = M^-1 (sum_b s_b s_b^T) M^-1, M the corrected moments
    moved = scores @ inverse
    return np.asarray(moved.T @ moved) * count / max(count - len(p), 1)
