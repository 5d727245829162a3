"""Equation of motion with errors in both channels, for all time-varying methods.

The measurements are ``tau_m = tau + n1`` and ``theta_m = theta + n2``, both noises white. With the
difference operator ``L = I D2 + diag(B) D1 + diag(K)`` the equation error is

    e = tau_m - L theta_m = n1 - L n2,    Sigma = s1^2 1 + s2^2 L L^T    (banded)

so that frequencies at which the angle's noise exceeds the torque have little weight, without a
filter, which would not commute with K(t). A torque v of the subject's own is an autoregression with
the whitening operator A (`data.Autoregression`). With it the error is ``A e``, whose covariance
``sd^2 1 + A Sigma A^T`` is banded too: rows are filtered after the products were formed. The
gradient of ``e^T Sigma^-1 e`` by the parameters contains the most likely motion, ``theta^ = theta_m
+ s2^2 L^T Sigma^-1 e``, not the measured one. With the most likely motion as regressors there is no
bias from errors in the regressors (weighted total least squares; the envelope theorem gives the
gradient). The equation is solved repeatedly, with new L and theta^ in every round.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Final

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.linalg.lapack import dtbtrs

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.errors import EstimationError
from armimpedance.joint.elbow.varying.data import (
    EDGE,
    Autoregression,
    VaryingData,
    applied,
    transposed,
)

# A course of B and K over time with its constants, and damped steps from one course to another.

#: Least length of a step, as a share of the full step.
SHORTEST_STEP: Final = 0.125


@dataclass(frozen=True)
class Course:
    """Present state of an iteration: I, B and K over time, and offsets.

    `B`, `K` (N,).
    `torque_offset`, `angle_offset` (T,): operating point of a trial less its means, N m and rad.
    """

    inertia: float
    B: FloatArray
    K: FloatArray
    torque_offset: FloatArray
    angle_offset: FloatArray


def with_offsets(course: Course, offsets: FloatArray) -> Course:
    """Return the course with the offsets (2 T,) of the nuisance columns."""
    T = len(course.torque_offset)
    return replace(course, torque_offset=offsets[:T], angle_offset=offsets[T:])


@dataclass(frozen=True)
class Step:
    """Length of the next step, and the size of the last one.

    If a round changes the course hardly less than the previous one, the iteration oscillates; the
    following steps are then halved.
    """

    length: float = 1.0
    moved: float = float("inf")

    def taken(self, old: Course, new: Course) -> tuple[Course, Step]:
        """Go from `old` towards `new`."""
        size = float(np.sqrt(((new.K - old.K) ** 2).mean()))
        swings = size > 0.7 * self.moved
        length = max(self.length / 2, SHORTEST_STEP) if swings else self.length
        if length == 1:
            return new, Step(length, size)
        mixed = {
            f.name: (1 - length) * getattr(old, f.name) + length * getattr(new, f.name)
            for f in fields(Course)
        }
        return Course(**mixed), Step(length, size)


#: Number of samples on either side in a difference of order 8.
HALF: Final = 4
WIDTH: Final = 2 * HALF + 1
#: First and second difference of order 8 (B. Fornberg, Math. Comp. 51 (1988) 699-706), times the
#: step and its square.
FIRST: Final = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
SECOND: Final = np.array(
    [-1 / 560, 8 / 315, -1 / 5, 8 / 5, -205 / 72, 8 / 5, -1 / 5, 8 / 315, -1 / 560]
)


@dataclass(frozen=True)
class Linearised:
    """Equation about a `Course`: ``y = I x2 + B x1 + K x0 + U u + e``, with Sigma of e.

    `trial` (R,) int, `sd_torque`, `sd_angle` (R,), (N,).
    `centre` (R,) int: sample of each row.
    `L` (R, 9): coefficients of the angle about each row's sample.
    `x2`, `x1`, `x0` (R,): most likely acceleration, velocity and angle.
    `y`, `torque_side` (R,): ``y = torque_side - L theta_m``.
    `nuisance` (R, 2 T): columns of each trial's offset of torque, then of angle.
    `prior_sd` (2 T,): prior standard deviation of the offsets; inf = none.
    `own`: the subject's own torque.
    `e` (R,): error of the equation for the course itself, with the measured angle.
    """

    centre: IntArray
    trial: IntArray
    L: FloatArray
    x2: FloatArray
    x1: FloatArray
    x0: FloatArray
    y: FloatArray
    torque_side: FloatArray
    nuisance: FloatArray
    prior_sd: FloatArray
    sd_torque: FloatArray
    sd_angle: FloatArray
    own: Autoregression
    e: FloatArray

    @cached_property
    def sigma(self) -> FloatArray:
        """Sigma of the rows after the operator of `own`, lower banded (9 + p, R)."""
        return self._whitening[1]

    @cached_property
    def _whitening(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        return self._whitening_of(slice(0, len(self.centre)))

    def _whitening_of(self, rows: slice) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Operator A, Sigma of ``A e`` and its Cholesky factor, for given rows only."""
        A = self.own.operator(np.unique(self.trial[rows], return_counts=True)[1])
        sigma = _sigma(
            self.centre[rows], self.L[rows], self.sd_torque[rows], self.sd_angle, A, self.own.sd
        )
        return A, sigma, _cholesky(sigma)

    def whitened(self, columns: FloatArray, rows: slice | None = None) -> FloatArray:
        """Columns ``C^-1 A columns`` with ``Cov(A e) = C C^T``: white errors of unit variance.

        `columns` (R, q), or those of the given rows.
        `rows`: consecutive rows to be treated alone, with their block of Sigma.
        """
        A, _, factor = self._whitening if rows is None else self._whitening_of(rows)
        # C (R, R) banded, A X (R, q)
        solved, info = dtbtrs(factor, applied(A, columns), uplo="L")
        if info != 0:
            raise EstimationError("the noise covariance of the equation of motion is singular")
        return np.asarray(solved)


def rows_of(data: VaryingData) -> IntArray:
    """Samples (R,) whose differences lie inside a trial, without its filtered ends."""
    margin = HALF + EDGE
    return np.concatenate(
        [
            np.arange(a + margin, b - margin)
            for a, b in zip(data.offsets[:-1], data.offsets[1:], strict=True)
        ]
    )


def start(data: VaryingData) -> Course:
    """Constant course from the weighted equation, the start of every method.

    Raises EstimationError: torque and angle do not give a joint to start from.
    """
    centre = rows_of(data)
    near = data.angle[centre[:, None] + np.arange(-HALF, HALF + 1)]
    # a first guess by plain least squares with the measured angle
    X = np.stack([near @ SECOND * data.rate_hz**2, near @ FIRST * data.rate_hz, near[:, HALF]], 1)
    smooth = np.hanning(13)
    X, y = (
        np.apply_along_axis(np.convolve, 0, a, smooth, "same") for a in (X, data.torque[centre])
    )
    guess = np.linalg.lstsq(X, y, rcond=None)[0]
    zeros = np.zeros(len(data.trials))
    N = len(data.angle)
    course = Course(
        float(guess[0]), np.full(N, guess[1]), np.full(N, guess[2]), zeros, zeros.copy()
    )
    for _ in range(8):
        eq = linearise(data, course)
        X = np.column_stack([eq.x2, eq.x1, eq.x0, eq.nuisance])
        p, _ = solve_weighted(eq, X)
        course = with_offsets(
            replace(course, inertia=float(p[0]), B=np.full(N, p[1]), K=np.full(N, p[2])), p[3:]
        )
    return course


def linearise(data: VaryingData, course: Course) -> Linearised:
    """Linearise the equation about a course, with the most likely motion as regressors.

    Raises EstimationError: the covariance of the equation's noise is not positive definite.
    """
    centre, trial = rows_of(data), data.trial_of
    at = trial[centre]
    step, B, K = 1 / data.rate_hz, course.B[centre], course.K[centre]
    L = course.inertia / step**2 * SECOND + B[:, None] / step * FIRST
    L[:, HALF] += K
    near = centre[:, None] + np.arange(-HALF, HALF + 1)
    s1, s2 = data.sd_torque[at], data.sd_angle[trial]
    # e (R,) = tau - c - L (theta - d): L of a constant d is K d
    bias = course.torque_offset[at] - K * course.angle_offset[at]
    e = data.torque[centre] - bias - (L * data.angle[near]).sum(axis=1)
    A = data.own.operator(np.bincount(at, minlength=len(data.trials)))
    factor = _cholesky(_sigma(centre, L, s1, data.sd_angle[trial], A, data.own.sd))
    # A^T Cov(A e)^-1 A e, (R,)
    solved = np.asarray(cho_solve_banded((factor, True), applied(A, e[:, None])))
    weighted = transposed(A, solved)[:, 0]
    angle = np.array(data.angle)
    for a in range(WIDTH):
        angle[near[:, a]] += s2[near[:, a]] ** 2 * L[:, a] * weighted
    likely = angle[near]
    x2, x1 = likely @ SECOND / step**2, likely @ FIRST / step
    x0 = likely[:, HALF] - course.angle_offset[at]
    side = data.torque[centre] + course.inertia * x2 + B * x1 + K * x0
    in_trial = at[:, None] == np.arange(len(data.trials))
    return Linearised(
        centre=centre,
        trial=at,
        L=L,
        x2=x2,
        x1=x1,
        x0=x0,
        y=side - (L * data.angle[near]).sum(axis=1),
        torque_side=side,
        nuisance=np.concatenate([in_trial, -K[:, None] * in_trial], axis=1),
        prior_sd=np.concatenate([np.full(len(data.trials), np.inf), _rms_of_trials(data)]),
        sd_torque=s1,
        sd_angle=s2,
        own=data.own,
        e=e,
    )


def solve_weighted(eq: Linearised, X: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Generalised least squares of y on X (R, q); the last 2 T columns are nuisance columns.

    Returns: parameters (q,), covariance (q, q).
    Raises EstimationError: the columns do not determine the parameters.
    """
    white = eq.whitened(np.column_stack([X, eq.y]))
    gram = white.T @ white
    return solve_gram(gram[:-1, :-1], gram[:-1, -1], eq.prior_sd)


def solve_gram(A: FloatArray, b: FloatArray, prior_sd: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Solve normal equations A (q, q), b (q,), with priors on the last parameters; give covariance.

    Raises EstimationError: A is singular.
    """
    A = np.array(A)
    last = np.arange(len(A) - len(prior_sd), len(A))
    A[last, last] += 1 / prior_sd**2
    diagonal = np.diag(A)
    if not (diagonal > 0).all():
        raise EstimationError("a regressor of the time-varying equation is zero")
    scale = 1 / np.sqrt(diagonal)
    scaled = A * scale[:, None] * scale
    if not np.linalg.cond(scaled) < 1e12:
        raise EstimationError(
            "the record does not determine I, B(t) and K(t): too little motion for so many terms"
        )
    # A (q, q) p (q,) = b (q,)
    covariance = np.linalg.inv(scaled) * scale[:, None] * scale
    return covariance @ b, covariance


def _rms_of_trials(data: VaryingData) -> FloatArray:
    square = np.add.reduceat(data.angle**2, data.offsets[:-1])
    return np.asarray(np.sqrt(square / np.diff(data.offsets)))


def _sigma(
    centre: IntArray, L: FloatArray, s1: FloatArray, s2: FloatArray, A: FloatArray, sd: float
) -> FloatArray:
    """Covariance ``sd^2 1 + A (s1^2 1 + L diag(s2^2) L^T) A^T``, lower banded, (9 + p, R)."""
    p, R = len(A) - 1, len(L)
    wide = np.zeros((R, WIDTH + p))
    torque = np.zeros((R, p + 1))
    for k in range(min(p + 1, R)):
        # row i takes row i - k, whose samples lie k earlier: columns count from sample c - 4 - p
        wide[k:, p - k : p - k + WIDTH] += A[k, k:, None] * L[: R - k]
        torque[k:, p - k] = A[k, k:] * s1[: R - k]
    for a in range(WIDTH + p):
        wide[:, a] *= s2[np.clip(centre - HALF - p + a, 0, len(s2) - 1)]
    sigma = np.zeros((WIDTH + p, R))
    for k in range(min(WIDTH + p, R)):
        # rows i and i + k overlap in columns a + k of row i and a of row i + k
        product = (wide[: R - k, k:] * wide[k:, : WIDTH + p - k]).sum(axis=1)
        if k <= p:
            product += (torque[: R - k, k:] * torque[k:, : p + 1 - k]).sum(axis=1)
        sigma[k, : R - k] = np.where(centre[k:] - centre[: R - k] == k, product, 0.0)
    sigma[0] += sd**2
    return sigma


def _cholesky(sigma: FloatArray) -> FloatArray:
    try:
        return np.asarray(cholesky_banded(sigma, lower=True))
    except np.linalg.LinAlgError as error:
        raise EstimationError(
            "the noise covariance of the equation of motion is not positive definite"
        ) from error
