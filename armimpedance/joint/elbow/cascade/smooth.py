"""Smooth courses: integrated random walks over the cells, by one banded solution.

The prior of course j: its second differences are independent, of variance
``(intensity_j scale_j)^2 width^3``; the first two cells have wide priors. With the sums of products
the posterior's information is a banded matrix, so that time grows with the number of cells, and
the marginal likelihood is its determinant and a quadratic form. I is eliminated exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError
from armimpedance.joint.elbow.cascade.rows import Cells, FoundCourses

#: Limits of the intensity, s^-1.5: below, a course is a straight line for this purpose.
INTENSITY: Final = (0.01, 1000.0)
#: Spread of the first value, and of the first slope per unit of the variable, over the scale.
LEVEL, SLOPE = 3.0, 10.0
#: More cells than this are merged while intensities are looked for.
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
    """Sizes of the courses (m,) by the fit of constants."""
    total = cells.products.sum(axis=0)
    m = cells.courses
    A, b = total[:-1, :-1], total[:-1, -1]
    d = 1 / np.sqrt(np.maximum(np.diag(A), 1e-300))
    solution = d * (np.linalg.pinv(A * d[:, None] * d, rcond=1e-10) @ (d * b))
    n = max(int(cells.rows.sum()), 1)
    rms = np.sqrt(total[-1, -1] / n)
    # no course is taken for smaller than what explains a hundredth of the torque
    least = 0.02 * rms / np.sqrt(np.maximum(np.diag(A)[:m] / n, 1e-300))
    return np.maximum(np.abs(solution[:m]), least)


def smooth(cells: Cells, strengths: Strengths) -> FoundCourses:
    """Courses and their variances under given strengths.

    Raises EstimationError: the record does not determine them.
    """
    s = _solved(cells, strengths)
    n, m = len(cells.rows), cells.courses
    variance = _inverse_diagonal(s.factor).reshape(n, m)
    var_I = 1 / s.information
    carried = s.of_inertia.reshape(n, m) ** 2 * var_I
    mean = (s.course - s.inertia * s.of_inertia).reshape(n, m)
    return FoundCourses(mean, variance + carried, s.inertia, var_I, s.evidence, strengths.noise)


def smooth_means(cells: Cells, of: Strengths) -> tuple[float, FloatArray]:
    """Logarithm of the marginal likelihood, and means (m,) of the courses over the cells.

    Raises EstimationError: the record does not determine them.
    """
    s = _solved(cells, of)
    course = (s.course - s.inertia * s.of_inertia).reshape(-1, cells.courses)
    return s.evidence, course.mean(axis=0)


def strengths_of(cells: Cells, start: Strengths | None = None) -> Strengths:
    """The strengths of greatest marginal likelihood, by Nelder and Mead's search.

    Raises EstimationError: the record does not determine the courses.
    """
    from scipy.optimize import minimize

    cells = cells.merged(-(-len(cells.rows) // MOST_CELLS))
    first = start or Strengths(np.ones(cells.courses), scales_of(cells), _noise_of(cells))
    m, low, high = cells.courses, *np.log(INTENSITY)

    def made(x: FloatArray) -> Strengths:
        return Strengths(np.exp(np.clip(x[:m], low, high)), first.scale, first.noise * np.exp(x[m]))

    def loss(x: Any) -> float:
        beyond = np.maximum(x[:m] - high, 0) + np.maximum(low - x[:m], 0)
        return float(beyond @ beyond) - _solved(cells, made(x)).evidence

    x0 = np.append(np.log(first.intensity), 0.0)
    simplex = np.vstack([x0, x0 + 1.5 * np.diag(np.append(np.ones(m), -0.3))])
    search: Any = {"initial_simplex": simplex, "maxfev": 60 * (m + 1), "fatol": 0.2, "xatol": 0.05}
    end: Any = minimize(loss, x0, method="Nelder-Mead", options=search)
    return made(end.x)


def _noise_of(cells: Cells) -> float:
    """Variance of what the fit of constants leaves."""
    total = cells.products.sum(axis=0)
    A, b = total[:-1, :-1], total[:-1, -1]
    left = total[-1, -1] - b @ np.linalg.pinv(A, rcond=1e-12) @ b
    return float(max(left, 1e-9 * total[-1, -1]) / max(cells.rows.sum(), 1))


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
    left = P[:, m:, m:].sum(axis=0) - b.T @ x
    information = float(left[0, 0])
    if not information > 0:
        raise EstimationError(_NEVER)
    inertia = float(left[0, 1] / information)
    loss = left[1, 1] - left[0, 1] ** 2 / information
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
    """Diagonal (N,) of ``(L L^T)^-1`` for banded L, after Takahashi: from the last row upwards."""
    width, N = factor.shape[0] - 1, factor.shape[1]
    out = np.empty(N)
    window = np.zeros((width, width))
    inverse = 1 / factor[0]
    below = -(factor[1:] * inverse).T
    for j in range(N - 1, -1, -1):
        column = window @ below[j]
        own = inverse[j] ** 2 + below[j] @ column
        out[j] = own
        window[1:, 1:] = window[:-1, :-1].copy()
        window[0, 0] = own
        window[0, 1:] = window[1:, 0] = column[:-1]
    return out
