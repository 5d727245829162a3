"""B(t) and K(t) as integrated random walks: a smoother with noise levels of greatest likelihood.

The state of sample t is the angle without noise, B and K. With the last linearisation this is a
linear Gaussian model,

    tau side:  y~_t = L theta + x1 B_t + x0 K_t + U u + n1,      n1 ~ (lambda s1)^2
    angle:     theta_m = theta + n2,                             n2 ~ s2^2
    prior:     B_(t+1) - 2 B_t + B_(t-1) ~ q_B,   K likewise ~ q_K

whose information matrix is banded; `smooth_chain` filters and smooths it. The marginal likelihood
of (q_B, q_K, lambda) comes from the banded Cholesky factor of the same matrix. I and the offsets u
are constant and eliminated by their Schur complement.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.optimize import minimize

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError
from armimpedance.joint.elbow.varying.data import VaryingData
from armimpedance.joint.elbow.varying.equation import Course, Step, linearise, with_offsets
from armimpedance.joint.elbow.varying.smoother_model import (
    DIFFERENCE,
    Levels,
    SmootherModel,
    smooth_chain,
    smoother_model,
)

# The smoother's bands: a mean of the posterior variance and the estimator's own error.

#: Number of draws that give the prior's share of the variance.
DRAWS: Final = 64
#: Seconds over which the noise variance and the square of the shrinkage are averaged.
VARIANCE_S: Final = 0.3
SHRINKAGE_S: Final = 0.7
#: Weight of the posterior variance in that of the bands (see `band_variance`).
POSTERIOR_WEIGHT: Final = 0.25


def own_error(
    course: Course, model: SmootherModel, levels: Levels
) -> tuple[FloatArray, FloatArray]:
    """Prior's share of the variances, and shrinkage of the course itself, (N, 2) each.

    With information H = F + Q of samples and prior, the estimator's error has two parts: noise of
    covariance ``H^-1 F H^-1 = H^-1 - H^-1 Q H^-1``, and the shrinkage ``-H^-1 Q x``. The diagonal
    of ``H^-1 Q H^-1`` is the mean square of H^-1 times draws of covariance Q.
    """
    q = model.unit * np.array([levels.B, levels.K]) ** 2
    n, N = model.torque.shape[1], len(course.B)
    right = np.zeros((n, 1 + DRAWS))
    state = np.zeros(n)
    state[1 :: model.state], state[2 :: model.state] = course.B, course.K
    for rough, level in ((model.rough_B, q[0]), (model.rough_K, q[1])):
        right[:, 0] += _times(rough, state) / level
    rng = np.random.default_rng(0)
    differences = model.differences
    for which, level in enumerate(q, start=1):
        draws = rng.standard_normal((len(differences), DRAWS)) / np.sqrt(level)
        for j, w in enumerate(DIFFERENCE):
            right[model.state * (differences + j) + which, 1:] += w * draws
    factor = cholesky_banded(model.information(levels), lower=True)
    coupling = model.coupling * levels.torque**-2
    solved = np.asarray(cho_solve_banded((factor, True), np.column_stack([right, coupling])))
    V = solved[:, 1 + DRAWS :]
    schur = model.shared * levels.torque**-2 + np.diag(model.shared_prior) - coupling.T @ V
    solved = solved[:, : 1 + DRAWS] + V @ np.linalg.solve(schur, V.T @ right)
    share = (solved[:, 1:] ** 2).mean(axis=1)
    shrunk = solved[:, 0].reshape(N, model.state)
    return share.reshape(N, model.state)[:, 1:3], shrunk[:, 1:3]


def band_variance(
    posterior: FloatArray, share: FloatArray, shrinkage: FloatArray, data: VaryingData
) -> FloatArray:
    """Variances for the bands (N, 2): a geometric mean of two estimates.

    The posterior variance is too large if the course is smoother than draws of the prior: it allows
    for changes that do not occur. The estimator's own error (noise, and the shrinkage computed from
    the smoothed course) is a little too small where there is little information, because the
    smoothed course cannot show what it missed. The weights are `POSTERIOR_WEIGHT` and the rest; the
    coverage is measured in benchmarks/elbow/varying.py.
    """
    passed = np.maximum(posterior - share, 0.01 * posterior)
    own = np.empty_like(posterior)
    for a, b in zip(data.offsets[:-1], data.offsets[1:], strict=True):
        for k, seconds in ((0, VARIANCE_S), (1, SHRINKAGE_S)):
            width = min(2 * round(seconds * data.rate_hz / 2) + 1, (b - a) // 2 * 2 - 1)
            part = (passed if k == 0 else shrinkage**2)[a:b]
            mean = _moving_mean(part, width)
            own[a:b] = mean if k == 0 else own[a:b] + mean
    return np.asarray(posterior**POSTERIOR_WEIGHT * own ** (1 - POSTERIOR_WEIGHT))


def _moving_mean(values: FloatArray, width: int) -> FloatArray:
    """Hann-weighted mean over `width` (odd) rows of (S, q), reflected at the ends."""
    kernel = np.hanning(width + 2)[1:-1]
    padded = np.pad(values, ((width // 2, width // 2), (0, 0)), mode="reflect")
    columns = [np.convolve(c, kernel / kernel.sum(), "valid") for c in padded.T]
    return np.stack(columns, axis=1)


def _times(banded: FloatArray, x: FloatArray) -> FloatArray:
    """Product of a symmetric lower banded matrix (w, n) and x (n,)."""
    out = banded[0] * x
    for k in range(1, len(banded)):
        out[k:] += banded[k, :-k] * x[:-k]
        out[:-k] += banded[k, :-k] * x[k:]
    return np.asarray(out)


#: Start value of the variation of K and B: intensity of the second derivative's white noise,
#: relative to their mean, s^-1.5.
START_INTENSITY: Final = 3.0
#: Range of that intensity: from practically constant over 10 s to a step within one sample.
INTENSITY_RANGE: Final = (1e-3, 1e4)
#: Range of the torque noise over the measured floor: never below the floor.
NOISE_RANGE: Final = (1.0, 100.0)
ROUNDS: Final = 12
#: A course that changes by less than this share of its standard error has converged.
SETTLED: Final = 0.05
#: If it still changes by more than this share, the fit fails.
UNSETTLED: Final = 0.5
#: Number of times that the levels are optimised, each about the course of the previous ones.
CHOICES: Final = 2


@dataclass(frozen=True)
class SmoothedCourse:
    """Course, standard errors of B, K (N,) and I, levels, and the log likelihood."""

    course: Course
    sd_B: FloatArray
    sd_K: FloatArray
    sd_inertia: float
    levels: Levels
    log_likelihood: float


def smooth(
    data: VaryingData,
    first: Course,
    levels: Levels | None = None,
    near: Levels | None = None,
    tick: Callable[[], None] = lambda: None,
) -> SmoothedCourse:
    """Estimate B(t), K(t) and I of all trials.

    `first`: course to start from.
    `levels`: noise levels; None: those of maximum likelihood.
    `near`: levels from which their search starts.
    `tick`: called after each step.
    Raises EstimationError: the likelihood has no maximum in the range, or the course does not
    converge.
    """
    scale = np.array([np.abs(first.B).mean(), np.abs(first.K).mean()])
    course, current = first, levels or near or Levels(START_INTENSITY, START_INTENSITY, 1.0)
    for turn in range(CHOICES if levels is None else 1):
        if levels is None:
            model = smoother_model(data, linearise(data, course), scale)
            current = likeliest(model, current, coarse=turn == 0 and near is None)
            tick()
        course = settle(data, course, current, scale)
        tick()
    model = smoother_model(data, linearise(data, course), scale)
    course, variance, sd_inertia = solve_course(course, model, current)
    variance = band_variance(variance, *own_error(course, model, current), data)
    sd = np.sqrt(variance)
    return SmoothedCourse(
        course, sd[:, 0], sd[:, 1], sd_inertia, current, -negative_log(model, current)
    )


def settle(
    data: VaryingData,
    course: Course,
    levels: Levels,
    scale: FloatArray,
    *,
    strict: bool = True,
    rounds: int = ROUNDS,
) -> Course:
    """Linearise and solve until B and K converge."""
    step, sd = Step(), 0.0
    for turn in range(rounds):
        model = smoother_model(data, linearise(data, course), scale)
        if turn == 0:
            # variances cost far more than the course; the first round's set the tolerance
            new, variance, _ = solve_course(course, model, levels)
            sd = float(np.sqrt(variance[:, 1].mean()))
        else:
            new = course_of(course, model, levels, factor_of(model, levels))
        course, step = step.taken(course, new)
        if step.moved < SETTLED * sd:
            return course
    if strict and not step.moved < UNSETTLED * sd:
        raise EstimationError(f"B(t) and K(t) do not settle within {ROUNDS} rounds")
    return course


def likeliest(model: SmootherModel, levels: Levels, *, coarse: bool) -> Levels:
    """Maximise the marginal likelihood over the three levels."""
    low = np.log([INTENSITY_RANGE[0], INTENSITY_RANGE[0], NOISE_RANGE[0]])
    high = np.log([INTENSITY_RANGE[1], INTENSITY_RANGE[1], NOISE_RANGE[1]])

    def objective(x: FloatArray) -> float:
        beyond = float(np.maximum(low - x, 0).sum() + np.maximum(x - high, 0).sum())
        return negative_log(model, _levels(np.clip(x, low, high))) + 10 * beyond

    spread = 1.5 if coarse else 0.4
    at = np.clip(levels.logs, low, high)
    simplex = np.vstack([at, at + np.diag([spread, spread, 0.3 if coarse else 0.05])])
    optimum = minimize(
        objective,
        at,
        method="Nelder-Mead",
        options={
            "initial_simplex": simplex,
            "xatol": 0.05,
            "fatol": 0.05,
            "maxfev": 80 if coarse else 40,
        },
    )
    return _levels(np.clip(optimum.x, low, high))


def _levels(logs: FloatArray) -> Levels:
    return Levels(*(float(v) for v in np.exp(logs)))


def negative_log(model: SmootherModel, levels: Levels) -> float:
    """Minus the marginal log likelihood, up to a constant.

    ``2 NLL = y^2/s^2 - g^T H^-1 g + log det H + 2 R log lambda + S (log q_B + log q_K)`` with the
    shared parameters eliminated from both terms.
    """
    try:
        factor = cholesky_banded(
            model.information(levels), overwrite_ab=True, lower=True, check_finite=False
        )
    except np.linalg.LinAlgError:
        return 1e30
    right = model.right(levels)
    solved = cho_solve_banded((factor, True), right, check_finite=False)
    cross = right.T @ solved
    weight = levels.torque**-2
    # S (s, s) = H_uu - V^T H^-1 V
    schur = model.shared * weight + np.diag(model.shared_prior) - cross[1:, 1:]
    reduced = model.shared_right * weight - cross[1:, 0]
    sign, log_schur = np.linalg.slogdet(schur)
    if not sign > 0:
        return 1e30
    square = model.square_torque * weight + model.square_angle
    square -= cross[0, 0] + reduced @ np.linalg.solve(schur, reduced)
    logs = 2 * np.log(factor[0]).sum() + log_schur + 2 * model.rows * np.log(levels.torque)
    logs += 2 * len(model.differences) * (np.log(levels.B) + np.log(levels.K))
    return float(square + logs) / 2


def factor_of(model: SmootherModel, levels: Levels) -> FloatArray:
    """Banded Cholesky factor of the information."""
    try:
        return np.asarray(
            cholesky_banded(
                model.information(levels), overwrite_ab=True, lower=True, check_finite=False
            )
        )
    except np.linalg.LinAlgError as error:
        raise EstimationError("the smoother's information matrix is not positive definite") from (
            error
        )


def course_of(course: Course, model: SmootherModel, levels: Levels, factor: FloatArray) -> Course:
    """Smoothed course without variances, from the factor of the information."""
    mean = np.asarray(cho_solve_banded((factor, True), model.right(levels)))
    return _eliminated(course, model, levels, mean)[0]


def solve_course(
    course: Course, model: SmootherModel, levels: Levels
) -> tuple[Course, FloatArray, float]:
    """Filter and smooth: the course, variances of B and K (N, 2), standard error of I."""
    smoothed = smooth_chain(model.information(levels), model.right(levels), model.block)
    new, V, inverse = _eliminated(course, model, levels, smoothed.mean)
    variance = smoothed.variance + ((V @ inverse) * V).sum(axis=1)
    if not (np.isfinite(new.K).all() and (variance > 0).all() and inverse[0, 0] > 0):
        raise EstimationError("the smoother lost its precision: a noise level is out of range")
    both = variance.reshape(-1, model.state)[:, 1:3]
    return new, both, float(np.sqrt(inverse[0, 0]))


def _eliminated(
    course: Course, model: SmootherModel, levels: Levels, mean: FloatArray
) -> tuple[Course, FloatArray, FloatArray]:
    """Course with I and the offsets, H^-1 C, and their covariance, from ``H^-1 [g, C]`` (n, 1 +
    s)."""
    weight = levels.torque**-2
    V, state = mean[:, 1:], mean[:, 0]
    coupling = model.coupling * weight
    # S (s, s) = H_uu - C^T H^-1 C: information of the samples on I and the offsets
    schur = model.shared * weight + np.diag(model.shared_prior) - coupling.T @ V
    inverse = np.asarray(np.linalg.inv(schur), dtype=np.float64)
    # u (s,) = S^-1 (g_u - C^T x), then x - H^-1 C u
    shared = inverse @ (model.shared_right * weight - coupling.T @ state)
    state = state - V @ shared
    new = replace(
        course,
        inertia=float(shared[0]),
        B=state[1 :: model.state],
        K=state[2 :: model.state],
    )
    return with_offsets(new, shared[1:]), V, inverse
