"""B and K in overlapping windows, constant (as in the source) or quadratic in each window.

In each window the weighted equation of `equation` is solved for the window's own coefficients; I
and the offsets are shared by all windows. To find the error by time variation, the same windows are
solved with two more powers of time. The part of the difference at the centres that noise does not
explain is this error; it is added to the bands.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.errors import EstimationError, InputError
from armimpedance.joint.elbow.varying.beginning import Beginning
from armimpedance.joint.elbow.varying.data import VaryingData
from armimpedance.joint.elbow.varying.equation import (
    WIDTH,
    Course,
    Linearised,
    linearise,
    solve_gram,
    with_offsets,
)
from armimpedance.joint.elbow.varying.method import EstimatedCourse, VaryingOptions

ROUNDS: Final = 4
#: Error by time variation, over the mean, above which there is a warning.
TOO_FAST: Final = 0.05


@dataclass(frozen=True)
class _Values:
    """B and K at the windows' centres (W, 2) with variances; shared parameters (s,) with
    covariance.
    """

    values: FloatArray
    variance: FloatArray
    shared: FloatArray
    shared_covariance: FloatArray


def in_windows(
    begun: Beginning, options: VaryingOptions, *, length_s: float, per_window: int, degree: int
) -> EstimatedCourse:
    """Fit B and K as polynomials of time in windows; the values are those at the centres.

    `options`: `window_s` and `every_s`, if stated, override the following two.
    `per_window`: number of steps from window to window in a window's length.
    `degree`: degree of the polynomials.
    Raises InputError: windows that are too short for their coefficients, or longer than a trial.
    """
    data, course = begun.data, begun.course
    length_s = length_s if options.window_s is None else options.window_s
    step_s = options.every_s or length_s / per_window
    rows = round(length_s * data.rate_hz)
    fewest = 4 * (degree + 1) + WIDTH
    if rows < fewest:
        raise InputError(
            f"windows of {length_s:g} s", expected=f"{fewest / data.rate_hz:.2f} s or longer"
        )
    eq = linearise(data, course)
    first = _first_rows(data, eq, rows, max(round(step_s * data.rate_hz), 1))
    at = eq.centre[first] + rows // 2
    for _ in range(ROUNDS):
        eq = linearise(data, course)
        solved = _solve_windows(eq, first, rows, degree)
        course = _course_of(data, course, at, solved)
    finer = _solve_windows(eq, first, rows, degree + 2)
    apart = ((solved.values - finer.values) ** 2 - (finer.variance - solved.variance)).mean(axis=0)
    bias = np.sqrt(np.maximum(apart, 0.0))
    sd = np.sqrt(solved.variance + bias**2)
    relative = bias / np.abs(solved.values).mean(axis=0)
    return EstimatedCourse(
        at=at,
        B=solved.values[:, 0],
        K=solved.values[:, 1],
        sd_B=sd[:, 0],
        sd_K=sd[:, 1],
        inertia=float(solved.shared[0]),
        sd_inertia=float(np.sqrt(solved.shared_covariance[0, 0])),
        notes=(f"windows of {length_s:g} s every {step_s:g} s, B and K of degree {degree} inside",),
        warnings=_too_fast(relative, length_s),
        details={"bias_percent": dict(zip("BK", (100 * relative).tolist(), strict=True))},
    )


def _too_fast(relative: FloatArray, length_s: float) -> tuple[str, ...]:
    return tuple(
        f"{name} varies faster than windows of {length_s:g} s can show: error by time variation "
        f"about {100 * part:.0f} % of its mean, taken into the band; use 'smoother'"
        for name, part in zip("BK", relative, strict=True)
        if part > TOO_FAST
    )


def _first_rows(data: VaryingData, eq: Linearised, rows: int, step: int) -> IntArray:
    """First row (W,) of each window that lies within a trial."""
    ends = np.flatnonzero(np.diff(eq.trial)) + 1
    edges = [0, *ends.tolist(), len(eq.trial)]
    first = [np.arange(a, b - rows + 1, step) for a, b in zip(edges[:-1], edges[1:], strict=True)]
    if any(len(f) == 0 for f in first):
        raise InputError(
            f"windows of {rows / data.rate_hz:g} s in a trial that is shorter",
            expected="a shorter window",
        )
    return np.concatenate(first)


def _solve_windows(eq: Linearised, first: IntArray, rows: int, degree: int) -> _Values:
    u = np.linspace(-1, 1, rows)
    powers = u[:, None] ** np.arange(degree + 1)
    U = np.column_stack([eq.x2, eq.nuisance])
    p, s = 2 * (degree + 1), U.shape[1]
    gram = np.empty((len(first), p + s + 1, p + s + 1))
    for w, a in enumerate(first):
        row = slice(a, a + rows)
        x1, x0 = eq.x1[row, None] * powers, eq.x0[row, None] * powers
        columns = np.column_stack([x1, x0, U[row], eq.y[row]])
        white = eq.whitened(columns, row)
        gram[w] = white.T @ white
    return _reduced(gram, p, s, eq.prior_sd, rows / np.diff(first).min() if len(first) > 1 else 1.0)


def _reduced(gram: FloatArray, p: int, s: int, prior_sd: FloatArray, overlap: float) -> _Values:
    """Shared parameters from all windows, then each window's own.

    A sample lies in `overlap` windows, so the sum of their information is divided by this.
    """
    own = gram[:, :p, :p]
    scale = 1 / np.sqrt(np.maximum(np.diagonal(own, axis1=1, axis2=2), 1e-300))
    scaled = own * scale[:, :, None] * scale[:, None, :]
    if not np.linalg.cond(scaled).max() < 1e12:
        raise EstimationError("a window holds too little motion for B and K: use longer windows")
    inverse = np.linalg.inv(scaled) * scale[:, :, None] * scale[:, None, :]
    # G (W, p, s + 1) = A^-1 [X^T U, X^T y]
    G = inverse @ gram[:, :p, p:]
    remaining = gram[:, p:, p:] - gram[:, p:, :p] @ G
    total = remaining.sum(axis=0) / max(overlap, 1.0)
    shared, covariance = solve_gram(total[:s, :s], total[:s, s], prior_sd)
    values = G[:, :, s] - G[:, :, :s] @ shared
    spread = inverse + G[:, :, :s] @ covariance @ G[:, :, :s].transpose(0, 2, 1)
    centre = [0, p // 2]
    variance = np.diagonal(spread, axis1=1, axis2=2)[:, centre]
    return _Values(values[:, centre], variance, shared, covariance)


def _course_of(data: VaryingData, course: Course, at: IntArray, solved: _Values) -> Course:
    """B and K of all samples: lines between the centres of a trial, constant beyond them."""
    trial = data.trial_of
    B, K = np.empty(len(trial)), np.empty(len(trial))
    for t in range(len(data.trials)):
        points, samples = trial[at] == t, np.flatnonzero(trial == t)
        for k, out in ((0, B), (1, K)):
            out[samples] = np.interp(samples, at[points], solved.values[points, k])
    new = replace(course, inertia=float(solved.shared[0]), B=B, K=K)
    return with_offsets(new, solved.shared[1:])
