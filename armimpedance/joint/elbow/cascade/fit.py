"""Courses of a whole record, solved in pieces, under the prior of greatest likelihood."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final, Literal

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.core.errors import EstimationError
from armimpedance.joint.elbow.cascade.jumps import Stretches, jumping, sharpened, stretches_of
from armimpedance.joint.elbow.cascade.rows import Cells, CourseEstimates, joined
from armimpedance.joint.elbow.cascade.task import CascadeCourses, CascadeTask, beginning

# Smooth courses: integrated random walks over the cells, by one banded solution.
#
# The prior of course j: its second differences are independent, of variance ``(intensity_j
# scale_j)^2 width^3``; the first two cells have wide priors. With the sums of products the
# posterior's information is a banded matrix, so that time grows with the number of cells, and the
# marginal likelihood is its determinant and a quadratic form. I is eliminated exactly.

#: Limits of the intensity, s^-1.5; below the lower one a course is practically a straight line.
INTENSITY: Final = (0.01, 1000.0)
#: Prior sd of the first value, and of the first slope per unit of the variable, over the scale.
LEVEL, SLOPE = 3.0, 10.0
#: Cells are merged to this number while the intensities are optimised.
MOST_CELLS: Final = 3000
_NEVER: Final = "the record does not determine I and the courses: too little motion"


@dataclass(frozen=True)
class Strengths:
    """Hyperparameters: relative intensities (m,), scales (m,), noise variance."""

    intensity: FloatArray
    scale: FloatArray
    noise: float


@dataclass(frozen=True)
class _Solved:
    factor: FloatArray
    course: FloatArray
    of_inertia: FloatArray
    information: float
    inertia: float
    evidence: float


def scales_of(cells: Cells) -> FloatArray:
    """Scales of the courses (m,), from a fit with constant courses."""
    total = cells.products.sum(axis=0)
    m = cells.courses
    A, b = total[:-1, :-1], total[:-1, -1]
    d = 1 / np.sqrt(np.maximum(np.diag(A), 1e-300))
    solution = d * (np.linalg.pinv(A * d[:, None] * d, rcond=1e-10) @ (d * b))
    n = max(int(cells.rows.sum()), 1)
    rms = np.sqrt(total[-1, -1] / n)
    # the least scale is that which explains about a hundredth of the torque
    least = 0.02 * rms / np.sqrt(np.maximum(np.diag(A)[:m] / n, 1e-300))
    return np.maximum(np.abs(solution[:m]), least)


def smooth(cells: Cells, strengths: Strengths) -> CourseEstimates:
    """Smooth courses and their variances for given hyperparameters.

    Raises EstimationError: the record does not determine them.
    """
    s = _solved(cells, strengths)
    n, m = len(cells.rows), cells.courses
    variance = _inverse_diagonal(s.factor).reshape(n, m)
    var_I = 1 / s.information
    carried = s.of_inertia.reshape(n, m) ** 2 * var_I
    mean = (s.course - s.inertia * s.of_inertia).reshape(n, m)
    return CourseEstimates(mean, variance + carried, s.inertia, var_I, s.evidence, strengths.noise)


def smooth_means(cells: Cells, of: Strengths) -> tuple[float, FloatArray]:
    """Logarithm of the marginal likelihood, and means (m,) of the courses over the cells.

    Raises EstimationError: the record does not determine them.
    """
    s = _solved(cells, of)
    course = (s.course - s.inertia * s.of_inertia).reshape(-1, cells.courses)
    return s.evidence, course.mean(axis=0)


def strengths_of(cells: Cells, start: Strengths | None = None) -> Strengths:
    """Hyperparameters of greatest marginal likelihood, by Nelder and Mead's search.

    Raises EstimationError: the record does not determine the courses.
    """
    from scipy.optimize import minimize

    cells = cells.merged(-(-len(cells.rows) // MOST_CELLS))
    first = start or Strengths(np.ones(cells.courses), scales_of(cells), _noise_of(cells))
    m, low, high = cells.courses, *np.log(INTENSITY)

    def strengths_at(x: FloatArray) -> Strengths:
        return Strengths(np.exp(np.clip(x[:m], low, high)), first.scale, first.noise * np.exp(x[m]))

    def loss(x: Any) -> float:
        beyond = np.maximum(x[:m] - high, 0) + np.maximum(low - x[:m], 0)
        return float(beyond @ beyond) - _solved(cells, strengths_at(x)).evidence

    x0 = np.append(np.log(first.intensity), 0.0)
    simplex = np.vstack([x0, x0 + 1.5 * np.diag(np.append(np.ones(m), -0.3))])
    search: Any = {"initial_simplex": simplex, "maxfev": 60 * (m + 1), "fatol": 0.2, "xatol": 0.05}
    end: Any = minimize(loss, x0, method="Nelder-Mead", options=search)
    return strengths_at(end.x)


def _noise_of(cells: Cells) -> float:
    """Variance of the residual of a fit with constant courses."""
    total = cells.products.sum(axis=0)
    A, b = total[:-1, :-1], total[:-1, -1]
    residual = total[-1, -1] - b @ np.linalg.pinv(A, rcond=1e-12) @ b
    return float(max(residual, 1e-9 * total[-1, -1]) / max(cells.rows.sum(), 1))


def _solved(cells: Cells, of: Strengths) -> _Solved:
    from scipy.linalg import cho_solve_banded, cholesky_banded

    n, m = len(cells.rows), cells.courses
    P = cells.products / of.noise
    # b (n m, 2): of I's column and of the torque
    b = P[:, :m, m:].reshape(n * m, 2)
    band, log_prior = _information(P[:, :m, :m], of, cells.width)
    try:
        factor = cholesky_banded(band, lower=True, check_finite=False)
    except np.linalg.LinAlgError as error:
        raise EstimationError(_NEVER) from error
    x = cho_solve_banded((factor, True), b, check_finite=False)
    reduced = P[:, m:, m:].sum(axis=0) - b.T @ x
    information = float(reduced[0, 0])
    if not information > 0:
        raise EstimationError(_NEVER)
    inertia = float(reduced[0, 1] / information)
    loss = reduced[1, 1] - reduced[0, 1] ** 2 / information
    log_det = 2 * np.log(factor[0]).sum()
    count = int(cells.rows.sum())
    evidence = -0.5 * (loss + log_det - log_prior + np.log(information))
    evidence -= 0.5 * count * np.log(2 * np.pi * of.noise)
    return _Solved(factor, x[:, 1], x[:, 0], information, inertia, float(evidence))


def _information(products: FloatArray, of: Strengths, width: float) -> tuple[FloatArray, float]:
    """Posterior information in lower banded form, and log determinant of the prior's."""
    n, m = products.shape[:2]
    band = np.zeros((2 * m + 1, n, m))
    for i in range(m):
        for j in range(i + 1):
            band[i - j, :, j] = products[:, i, j]
    second = 1 / ((of.intensity * of.scale) ** 2 * width**3)
    level, slope = 1 / (LEVEL * of.scale) ** 2, 1 / (SLOPE * of.scale * width) ** 2
    # second differences c_k - 2 c_(k+1) + c_(k+2); the first value; the first slope
    for weight, steps in ((second, (1.0, -2.0, 1.0)), (slope, (-1.0, 1.0)), (level, (1.0,))):
        rows = n - 2 if len(steps) == 3 else 1
        for a, u in enumerate(steps):
            for b in range(a, len(steps)):
                band[(b - a) * m, a : a + rows] += u * steps[b] * weight
    log_det = (n - 2) * np.log(second).sum() + np.log(slope).sum() + np.log(level).sum()
    return band.reshape(2 * m + 1, n * m), float(log_det)


def _inverse_diagonal(factor: FloatArray) -> FloatArray:
    """Diagonal (N,) of ``(L L^T)^-1`` for banded L, after Takahashi, from the last row upwards."""
    width, N = factor.shape[0] - 1, factor.shape[1]
    out = np.empty(N)
    window = np.zeros((width, width))
    inverse = 1 / factor[0]
    below = -(factor[1:] * inverse).T
    for j in range(N - 1, -1, -1):
        column = window @ below[j]
        diagonal = inverse[j] ** 2 + below[j] @ column
        out[j] = diagonal
        window[1:, 1:] = window[:-1, :-1].copy()
        window[0, 0] = diagonal
        window[0, 1:] = window[1:, 0] = column[:-1]
    return out


Prior = Literal["smooth", "jumps"]

#: Number of cells that are solved at once, and by which they overlap their neighbours.
PIECE: Final = 5000
OVERLAP: Final = 250
#: Largest number of cells from which hyperparameters are estimated.
LEARNT_FROM: Final = 2500


@dataclass(frozen=True)
class FittedCourses:
    """Estimated courses, the kind of their prior, and its hyperparameters."""

    estimates: CourseEstimates
    prior: Prior
    of: Strengths | Stretches


def fitted(
    task: CascadeTask, cells: Cells, prior: Prior | None, before: FittedCourses | None = None
) -> FittedCourses:
    """Fit courses under a prior; None: the one of greater marginal likelihood.

    Raises EstimationError: the record does not determine them.
    """
    part = _part(task, cells)
    start = before.of if before is not None and isinstance(before.of, Strengths) else None
    strengths = strengths_of(part, start)
    task.tick()
    if prior == "smooth" or not task.in_time:
        return FittedCourses(_whole(task, cells, strengths), "smooth", strengths)
    stretches = stretches_of(part, strengths.noise, task.torn)
    task.tick()
    of: Strengths | Stretches = stretches
    if prior is None:
        by_jumps, by_walks = jumping(part, stretches).evidence, smooth(part, strengths).evidence
        of = stretches if by_jumps > by_walks else strengths
    return FittedCourses(_whole(task, cells, of), "jumps" if of is stretches else "smooth", of)


def _solve(cells: Cells, of: Strengths | Stretches) -> CourseEstimates:
    return smooth(cells, of) if isinstance(of, Strengths) else jumping(cells, of)


def _part(task: CascadeTask, cells: Cells) -> Cells:
    """The middle of the longest strip, from which hyperparameters are estimated."""
    lengths = np.diff(task.strips)
    longest = int(lengths.argmax())
    first, count = int(task.strips[longest]), int(lengths[longest])
    if count <= LEARNT_FROM:
        return cells.part(first, first + count)
    first += (count - LEARNT_FROM) // 2
    return cells.part(first, first + LEARNT_FROM)


def _whole(task: CascadeTask, cells: Cells, of: Strengths | Stretches) -> CourseEstimates:
    if task.cyclic:
        return _cycle(cells, of)
    parts: list[tuple[CourseEstimates, int, int]] = []
    for first, last in zip(task.strips[:-1].tolist(), task.strips[1:].tolist(), strict=True):
        pieces = max(-(-(last - first) // PIECE), 1)
        edges = np.linspace(first, last, pieces + 1).astype(int).tolist()
        for a, b in zip(edges[:-1], edges[1:], strict=True):
            low, high = max(a - OVERLAP, first), min(b + OVERLAP, last)
            parts.append((_solve(cells.part(low, high), of), a - low, b - low))
            task.tick()
    return joined(parts)


def _cycle(cells: Cells, of: Strengths | Stretches) -> CourseEstimates:
    """Solve a cycle with half a copy of itself on either side."""
    n = len(cells.rows)
    half = n // 2
    at = np.arange(-half, n + half) % n
    around = Cells(cells.width, cells.products[at], cells.rows[at])
    estimates = _solve(around, of)
    # the copies do not add information on I
    more = float(cells.rows[at].sum() / cells.rows.sum())
    return CourseEstimates(
        estimates.mean[half : half + n], estimates.variance[half : half + n], estimates.inertia,
        estimates.var_inertia * more, estimates.evidence, estimates.noise,
    )  # fmt: skip


# Fit, estimate the noise from the residual, and fit again.
#
# With a model of white noise, the courses follow a slow torque of the subject, so that the residual
# looks white and the next round changes nothing. The rounds are therefore started both from white
# and from slow noise, and the start whose final fit has the greater likelihood is taken.

ROUNDS: Final = 2
#: Corner frequency of the slow noise from which the rounds may start, Hz.
OWN_HZ: Final = 3.0
#: Gain in log likelihood by which the slow start must be better.
BETTER: Final = 5.0
_TOLD: Final = {
    "smooth": "smooth courses (integrated random walks), their strengths by marginal likelihood",
    "jumps": "courses that stay and jump, averaged over all placements of the jumps",
}


def in_rounds(
    task: CascadeTask, prior: Prior | None = None, rounds: int = ROUNDS
) -> CascadeCourses:
    """Fit courses and noise in turn under a prior; None: the one of greater likelihood.

    Raises EstimationError: the record does not determine them.
    """
    task = replace(task, noise=_first_noise(task))
    fit: FittedCourses = fitted(task, task.cells(), prior)
    for _ in range(rounds - 1):
        task = task.learnt(fit.estimates)
        fit = fitted(task, task.cells(), prior, fit)
    sharp = sharpened(task, fit.estimates) if fit.prior == "jumps" else fit.estimates
    return CascadeCourses(sharp, task, (_TOLD[fit.prior],))


def _first_noise(task: CascadeTask) -> FloatArray:
    """Start noise: white, or slow if smooth courses then explain the record's beginning better."""
    short = beginning(task)
    slow = np.array([1.0, -np.exp(-2 * np.pi * OWN_HZ / task.rows.rate_hz)])
    white = np.ones(1)
    return slow if _end(short, slow) > _end(short, white) + BETTER else white


def _end(task: CascadeTask, noise: FloatArray) -> float:
    """Log likelihood in the second round of smooth courses, from a start noise."""
    task = replace(task, noise=noise)
    first = fitted(task, task.cells(), "smooth")
    task = task.learnt(first.estimates)
    return fitted(task, task.cells(), "smooth", first).estimates.evidence


# Least squares over realizations (trials of one course): each cell or segment separately.


def over_realizations(task: CascadeTask, segment_s: float) -> CascadeCourses:
    """I, B, K and gain by least squares over all trials, in a segment about every cell.

    `task`: aligned trials.
    `segment_s`: length of the segments, s; 0: one cell.
    """
    cells = task.cells()
    n, m = len(cells.rows), cells.courses
    half = round(segment_s / cells.width / 2)
    sums = np.concatenate([np.zeros((1, m + 2, m + 2)), cells.products]).cumsum(axis=0)
    count = np.concatenate([[0], np.cumsum(cells.rows)])
    at = np.arange(n)
    low, high = np.maximum(at - half, 0), np.minimum(at + half + 1, n)
    total, rows = sums[high] - sums[low], count[high] - count[low]
    values, variances = _least_squares(total, rows)
    determined = np.asarray(np.isfinite(values).all(axis=1))
    weight = 1 / variances[determined, m]
    # neighbouring segments share their rows
    shared = max(float(rows[determined].sum() / max(cells.rows.sum(), 1)), 1.0)
    estimates = CourseEstimates(
        mean=_filled(values[:, :m], determined),
        variance=_filled(variances[:, :m], determined),
        inertia=float(weight @ values[determined, m] / weight.sum()),
        var_inertia=float(shared / weight.sum()),
        evidence=0.0,
        noise=0.0,
    )
    length = segment_s or cells.width
    trials = len(task.data.trials)
    note = f"least squares over {trials} realizations in segments of {1e3 * length:.3g} ms"
    return CascadeCourses(estimates, task, (note,))


def _least_squares(total: FloatArray, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values and variances (n, p) from sums of products (n, p + 1, p + 1); NaN if too few rows."""
    p = total.shape[1] - 1
    A, b = total[:, :p, :p], total[:, :p, p]
    d = 1 / np.sqrt(np.maximum(np.einsum("nii->ni", A), 1e-300))
    good = rows > 2 * p
    values, variances = (np.full((len(total), p), np.nan) for _ in range(2))
    inverse = np.linalg.pinv(A[good] * d[good][:, :, None] * d[good][:, None, :], hermitian=True)
    inverse *= d[good][:, :, None] * d[good][:, None, :]
    values[good] = (inverse @ b[good][..., None])[..., 0]
    loss = total[good, p, p] - np.einsum("ni,ni->n", values[good], b[good])
    noise = np.maximum(loss, 0) / (rows[good] - p)
    variances[good] = np.einsum("nii->ni", inverse) * noise[:, None]
    return values, variances


def _filled(values: FloatArray, determined: BoolArray) -> FloatArray:
    """Fill cells without rows, at the ends, with their nearest neighbours."""
    at = np.flatnonzero(determined)
    nearest = at[np.abs(np.arange(len(values))[:, None] - at).argmin(axis=1)]
    return np.asarray(values[nearest])
