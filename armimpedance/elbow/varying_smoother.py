"""B(t) and K(t) as integrated random walks: smoother with noise levels chosen by likelihood.

State of sample t: the angle without noise, B and K. Given the last linearisation all of it is one
linear Gaussian model,

    tau side:  y~_t = L theta + x1 B_t + x0 K_t + U u + n1,      n1 ~ (lambda s1)^2
    angle:     theta_m = theta + n2,                             n2 ~ s2^2
    prior:     B_(t+1) - 2 B_t + B_(t-1) ~ q_B,   K likewise ~ q_K

whose information matrix is banded: `varying_chain` filters and smooths it. The marginal likelihood
of (q_B, q_K, lambda) comes from the same matrix by a banded Cholesky factor. I and the offsets u
are constant and eliminated by their Schur complement.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.optimize import minimize

from armimpedance.elbow.varying_chain import smooth_chain
from armimpedance.elbow.varying_data import VaryingData
from armimpedance.elbow.varying_equation import (
    Course,
    Step,
    linearise,
    start,
    with_offsets,
)
from armimpedance.elbow.varying_found import Found, grid
from armimpedance.elbow.varying_smoother_bands import band_variance, own_error
from armimpedance.elbow.varying_smoother_model import (
    BAND,
    STATE,
    Levels,
    SmootherModel,
    smoother_model,
)
from armimpedance.errors import EstimationError
from armimpedance.records import FloatArray

#: Starting change of K and B: relative to their mean, as intensity of the second derivative's
#: white noise, s^-1.5.
START_INTENSITY: Final = 3.0
#: Range of that intensity: constant within what 10 s can show; a step within one sample.
INTENSITY_RANGE: Final = (1e-3, 1e4)
#: Range of the torque noise over the floor that was read: never less than the channel shows.
NOISE_RANGE: Final = (1.0, 100.0)
#: +-30 % at 2 Hz asks for about so much; at 3 Hz, twice, bands of 95 % cover some 60 %.
FAST: Final = 12.0
#: Residuals above this many times the sensor's noise are told.
MUCH_NOISE: Final = 3.0
ROUNDS: Final = 12
#: A course that moves by less than this part of its standard error has settled.
SETTLED: Final = 0.05
#: One that still moves by more has not: no result.
UNSETTLED: Final = 0.5
#: Times that the levels are chosen, each about the course that the ones before gave.
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


def smoother(data: VaryingData, *, every_s: float | None = None) -> Found:
    """Integrated random walks with noise levels of maximum likelihood."""
    made = smooth(data, free_course(data))
    at, course = grid(data, every_s), made.course
    levels = made.levels
    warnings = []
    if levels.torque > MUCH_NOISE:
        warnings.append(
            f"residuals are {levels.torque:.1f} times the torque sensor's noise: voluntary torque, "
            "or a joint that is not of second order; the bands take it in"
        )
    for name, level in (("B", levels.B), ("K", levels.K)):
        if level > FAST:
            warnings.append(
                f"{name} varies so fast (intensity {level:.3g} s^-1.5) that its band is too narrow"
            )
    return Found(
        trial=data.trial_of[at],
        time_s=data.time_s[at],
        B=course.B[at],
        K=course.K[at],
        sd_B=made.sd_B[at],
        sd_K=made.sd_K[at],
        inertia=course.inertia,
        sd_inertia=made.sd_inertia,
        notes=(
            "integrated random walks, by likelihood: relative second derivatives of intensity "
            f"{levels.B:.3g} (B) and {levels.K:.3g} (K) s^-1.5, torque noise {levels.torque:.3g} "
            "times the channel's floor",
        ),
        warnings=tuple(warnings),
        details={
            "intensity": {"B": levels.B, "K": levels.K},
            "torque_noise_over_floor": levels.torque,
            "log_likelihood": made.log_likelihood,
        },
    )


def smooth(data: VaryingData, first: Course, levels: Levels | None = None) -> SmoothedCourse:
    """B(t), K(t) and I of all trials.

    Parameters
    ----------
    data : VaryingData
    first : Course
        Where to start.
    levels : Levels or None
        None: by maximum likelihood.

    Raises
    ------
    EstimationError
        The likelihood has no maximum that could be found, or the course does not settle.
    """
    scale = np.array([np.abs(first.B).mean(), np.abs(first.K).mean()])
    course, now = first, levels or Levels(START_INTENSITY, START_INTENSITY, 1.0)
    for turn in range(CHOICES if levels is None else 1):
        if levels is None:
            model = smoother_model(data, linearise(data, course), scale)
            now = _likeliest(model, now, coarse=turn == 0)
        course = _settle(data, course, now, scale)
    model = smoother_model(data, linearise(data, course), scale)
    course, variance, sd_inertia = _solve(course, model, now)
    variance = band_variance(variance, *own_error(course, model, now), data)
    sd = np.sqrt(variance)
    return SmoothedCourse(course, sd[:, 0], sd[:, 1], sd_inertia, now, -negative_log(model, now))


def free_course(data: VaryingData) -> Course:
    """A course that is free to vary, without its own noise levels: where other methods start."""
    course = start(data)
    scale = np.array([np.abs(course.B).mean(), np.abs(course.K).mean()])
    return _settle(data, course, Levels(START_INTENSITY, START_INTENSITY, 1.0), scale, strict=False)


def _settle(
    data: VaryingData,
    course: Course,
    levels: Levels,
    scale: FloatArray,
    *,
    strict: bool = True,
) -> Course:
    """Linearise and solve until B and K stay where they are."""
    step = Step()
    for _ in range(ROUNDS):
        model = smoother_model(data, linearise(data, course), scale)
        new, variance, _ = _solve(course, model, levels)
        course, step = step.taken(course, new)
        if step.moved < SETTLED * np.sqrt(variance[:, 1].mean()):
            return course
    if strict and not step.moved < UNSETTLED * np.sqrt(variance[:, 1].mean()):
        raise EstimationError(f"B(t) and K(t) do not settle within {ROUNDS} rounds")
    return course


def _likeliest(model: SmootherModel, levels: Levels, *, coarse: bool) -> Levels:
    """Maximise the marginal likelihood over the three levels."""
    low = np.log([INTENSITY_RANGE[0], INTENSITY_RANGE[0], NOISE_RANGE[0]])
    high = np.log([INTENSITY_RANGE[1], INTENSITY_RANGE[1], NOISE_RANGE[1]])

    def objective(x: FloatArray) -> float:
        beyond = float(np.maximum(low - x, 0).sum() + np.maximum(x - high, 0).sum())
        return negative_log(model, _levels(np.clip(x, low, high))) + 10 * beyond

    spread = 1.5 if coarse else 0.4
    at = np.clip(levels.logs, low, high)
    simplex = np.vstack([at, at + np.diag([spread, spread, 0.3 if coarse else 0.05])])
    found = minimize(
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
    return _levels(np.clip(found.x, low, high))


def _levels(logs: FloatArray) -> Levels:
    return Levels(*(float(v) for v in np.exp(logs)))


def negative_log(model: SmootherModel, levels: Levels) -> float:
    """Minus the marginal log likelihood, but for a constant.

    ``2 NLL = y^2/s^2 - g^T H^-1 g + log det H + 2 R log lambda + S (log q_B + log q_K)`` with the
    shared parameters eliminated from both terms.
    """
    try:
        factor = cholesky_banded(model.information(levels), lower=True)
    except np.linalg.LinAlgError:
        return 1e30
    right = model.right(levels)
    solved = cho_solve_banded((factor, True), right)
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


def _solve(
    course: Course, model: SmootherModel, levels: Levels
) -> tuple[Course, FloatArray, float]:
    """Filter and smooth: the course, variances of B and K (N, 2), standard error of I."""
    made = smooth_chain(model.information(levels), model.right(levels), BAND)
    weight = levels.torque**-2
    V, state = made.mean[:, 1:], made.mean[:, 0]
    coupling = model.coupling * weight
    # S (s, s) = H_uu - C^T H^-1 C: what the samples say of I and the offsets
    inverse = np.linalg.inv(model.shared * weight + np.diag(model.shared_prior) - coupling.T @ V)
    # u (s,) = S^-1 (g_u - C^T x), then x - H^-1 C u
    shared = inverse @ (model.shared_right * weight - coupling.T @ state)
    state = state - V @ shared
    variance = made.variance + ((V @ inverse) * V).sum(axis=1)
    if not (np.isfinite(state).all() and (variance > 0).all() and inverse[0, 0] > 0):
        raise EstimationError("the smoother lost its precision: a noise level is out of range")
    new = replace(course, inertia=float(shared[0]), B=state[1::STATE], K=state[2::STATE])
    both = variance.reshape(-1, STATE)[:, 1:]
    return with_offsets(new, shared[1:]), both, float(np.sqrt(inverse[0, 0]))
