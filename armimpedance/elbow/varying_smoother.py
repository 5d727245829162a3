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
    HALF,
    WIDTH,
    Course,
    Linearised,
    Step,
    linearise,
    start,
    with_offsets,
)
from armimpedance.elbow.varying_found import Found, grid
from armimpedance.errors import EstimationError
from armimpedance.records import FloatArray, IntArray

#: Unknowns per sample: angle, B, K.
STATE: Final = 3
#: Rows of the banded information matrix.
BAND: Final = STATE * 2 * HALF + STATE
#: The difference that is white noise, and its order.
DIFFERENCE: Final = (1.0, -2.0, 1.0)
ORDER: Final = len(DIFFERENCE) - 1
#: Starting change of K and B: relative to their mean, as intensity of the second derivative's
#: white noise, s^-1.5.
START_INTENSITY: Final = 3.0
#: Range of that intensity: constant within what 10 s can show; a step within one sample.
INTENSITY_RANGE: Final = (1e-3, 1e4)
#: Range of the torque noise over the floor that was read: never less than the channel shows.
NOISE_RANGE: Final = (1.0, 100.0)
#: Residuals above this many times the sensor's noise are told.
MUCH_NOISE: Final = 3.0
#: Draws that carry the prior's share of the variance.
DRAWS: Final = 64
#: Seconds over which the noise let through and the square of the shrinkage are averaged.
VARIANCE_S: Final = 0.3
SHRINKAGE_S: Final = 0.7
#: Share of the posterior variance in the bands' (see `_between`).
POSTERIOR_WEIGHT: Final = 0.25
ROUNDS: Final = 12
#: A course that moves by less than this part of its standard error has settled.
SETTLED: Final = 0.05
#: One that still moves by more has not: no result.
UNSETTLED: Final = 0.5
#: Times that the levels are chosen, each about the course that the ones before gave.
CHOICES: Final = 2


@dataclass(frozen=True)
class Levels:
    """Noise levels of the smoother.

    Attributes
    ----------
    B, K : float
        Intensity of the second derivative's white noise over the parameter's mean, s^-1.5.
    torque : float
        Torque noise over the floor that was read from the channel.
    """

    B: float
    K: float
    torque: float

    @property
    def logs(self) -> FloatArray:
        """Natural logarithms, (3,)."""
        return np.log([self.B, self.K, self.torque])


@dataclass(frozen=True)
class SmoothedCourse:
    """Course, standard errors of B, K (N,) and I, levels, and the log likelihood."""

    course: Course
    sd_B: FloatArray
    sd_K: FloatArray
    sd_inertia: float
    levels: Levels
    log_likelihood: float


@dataclass(frozen=True)
class _Model:
    """The linear Gaussian model of one linearisation, split by noise level.

    H = ``torque / lambda^2 + angle + rough_B / q_B + rough_K / q_K``, all lower banded; likewise
    the right-hand sides.
    """

    torque: FloatArray
    angle: FloatArray
    rough_B: FloatArray
    rough_K: FloatArray
    right_torque: FloatArray
    right_angle: FloatArray
    coupling: FloatArray
    shared: FloatArray
    shared_right: FloatArray
    shared_prior: FloatArray
    square_torque: float
    square_angle: float
    rows: int
    differences: IntArray
    unit: FloatArray

    def information(self, levels: Levels) -> FloatArray:
        """H (w, n), lower banded."""
        q = self.unit * np.array([levels.B, levels.K]) ** 2
        return np.asarray(
            self.torque / levels.torque**2 + self.angle + self.rough_B / q[0] + self.rough_K / q[1]
        )

    def right(self, levels: Levels) -> FloatArray:
        """[g, coupling to the shared parameters], (n, 1 + s)."""
        weight = levels.torque**-2
        g = self.right_torque * weight + self.right_angle
        return np.column_stack([g, self.coupling * weight])


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
        if level > 0.5 * INTENSITY_RANGE[1]:
            warnings.append(f"{name} changes from sample to sample: faster than can be shown")
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
            model = _model(data, linearise(data, course), scale)
            now = _likeliest(model, now, coarse=turn == 0)
        course = _settle(data, course, now, scale)
    model = _model(data, linearise(data, course), scale)
    course, variance, sd_inertia = _solve(course, model, now)
    variance = _between(variance, *_own_error(course, model, now), data)
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
        model = _model(data, linearise(data, course), scale)
        new, variance, _ = _solve(course, model, levels)
        course, step = step.taken(course, new)
        if step.moved < SETTLED * np.sqrt(variance[:, 1].mean()):
            return course
    if strict and not step.moved < UNSETTLED * np.sqrt(variance[:, 1].mean()):
        raise EstimationError(f"B(t) and K(t) do not settle within {ROUNDS} rounds")
    return course


def _likeliest(model: _Model, levels: Levels, *, coarse: bool) -> Levels:
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


def negative_log(model: _Model, levels: Levels) -> float:
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


def _solve(course: Course, model: _Model, levels: Levels) -> tuple[Course, FloatArray, float]:
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


def _own_error(course: Course, model: _Model, levels: Levels) -> tuple[FloatArray, FloatArray]:
    """The prior's share of the variances, and the shrinkage of the course itself, (N, 2) each.

    With information H = F + Q of samples and prior the estimator errs by the noise that it lets
    through, ``H^-1 F H^-1 = H^-1 - H^-1 Q H^-1``, and by ``-H^-1 Q x``. The diagonal of
    ``H^-1 Q H^-1`` is the mean square of H^-1 times draws of covariance Q.
    """
    q = model.unit * np.array([levels.B, levels.K]) ** 2
    n, N = model.torque.shape[1], len(course.B)
    right = np.zeros((n, 1 + DRAWS))
    state = np.zeros(n)
    state[1::STATE], state[2::STATE] = course.B, course.K
    for rough, level in ((model.rough_B, q[0]), (model.rough_K, q[1])):
        right[:, 0] += _times(rough, state) / level
    rng = np.random.default_rng(0)
    differences = model.differences
    for which, level in enumerate(q, start=1):
        draws = rng.standard_normal((len(differences), DRAWS)) / np.sqrt(level)
        for j, w in enumerate(DIFFERENCE):
            right[STATE * (differences + j) + which, 1:] += w * draws
    factor = cholesky_banded(model.information(levels), lower=True)
    coupling = model.coupling * levels.torque**-2
    solved = np.asarray(cho_solve_banded((factor, True), np.column_stack([right, coupling])))
    V = solved[:, 1 + DRAWS :]
    schur = model.shared * levels.torque**-2 + np.diag(model.shared_prior) - coupling.T @ V
    solved = solved[:, : 1 + DRAWS] + V @ np.linalg.solve(schur, V.T @ right)
    share = (solved[:, 1:] ** 2).mean(axis=1)
    return share.reshape(N, STATE)[:, 1:], solved[:, 0].reshape(N, STATE)[:, 1:]


def _between(
    posterior: FloatArray, share: FloatArray, shrinkage: FloatArray, data: VaryingData
) -> FloatArray:
    """Variances for the bands, (N, 2): a geometric mean of two that err on either side.

    The posterior variance is too wide where the course is smoother than the prior's draws: it
    holds room for changes that are not there. The estimator's own error, noise let through and
    shrinkage as the smoothed course shows it, is a little too narrow where few samples speak and
    the smoothed course cannot show what it missed. Weights: `POSTERIOR_WEIGHT` and the rest; the
    coverage is measured in benchmarks/elbow_varying.py.
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
    """Symmetric lower banded (w, n) times x (n,)."""
    out = banded[0] * x
    for k in range(1, len(banded)):
        out[k:] += banded[k, :-k] * x[:-k]
        out[:-k] += banded[k, :-k] * x[k:]
    return np.asarray(out)


def _model(data: VaryingData, eq: Linearised, scale: FloatArray) -> _Model:
    N = len(data.angle)
    n, c = STATE * N, eq.centre
    s1, s2 = eq.sd_torque, eq.sd_angle
    L, y = eq.L / s1[:, None], eq.torque_side / s1
    x1, x0 = eq.x1 / s1, eq.x0 / s1
    U = np.column_stack([eq.x2, eq.nuisance]) / s1[:, None]
    torque = _torque_information(n, c, L, x1, x0)
    angle = np.zeros((BAND, n))
    angle[0, ::STATE] = s2**-2
    right_angle = np.zeros(n)
    right_angle[::STATE] = data.angle / s2**2

    def transposed(v: FloatArray) -> FloatArray:
        """``A^T v`` of the torque rows, (n, q) of (R, q)."""
        out = np.zeros((n, v.shape[1]))
        for a in range(WIDTH):
            out[STATE * (c + a - HALF)] += L[:, a, None] * v
        out[STATE * c + 1] += x1[:, None] * v
        out[STATE * c + 2] += x0[:, None] * v
        return out

    return _Model(
        torque=torque,
        angle=angle,
        rough_B=_roughness(data, 1),
        rough_K=_roughness(data, 2),
        right_torque=transposed(y[:, None])[:, 0],
        right_angle=right_angle,
        coupling=transposed(U),
        shared=U.T @ U,
        shared_right=U.T @ y,
        shared_prior=np.concatenate([[0.0], eq.prior_sd**-2]),
        square_torque=float(y @ y),
        square_angle=float(((data.angle / s2) ** 2).sum()),
        rows=len(c),
        differences=_starts(data),
        unit=scale**2 / data.rate_hz ** (2 * ORDER - 1),
    )


def _torque_information(
    n: int, c: IntArray, L: FloatArray, x1: FloatArray, x0: FloatArray
) -> FloatArray:
    """``A^T A`` of the torque rows ``L theta + x1 B + x0 K``, lower banded."""
    H = np.zeros((BAND, n))

    def put(i: IntArray, j: IntArray, values: FloatArray) -> None:
        H[(i - j)[0], j] += values

    theta = [STATE * (c + a - HALF) for a in range(WIDTH)]
    for a in range(WIDTH):
        for b in range(a, WIDTH):
            put(theta[b], theta[a], L[:, a] * L[:, b])
        for k, x in ((1, x1), (2, x0)):
            own = STATE * c + k
            if a <= HALF:
                put(own, theta[a], L[:, a] * x)
            else:
                put(theta[a], own, L[:, a] * x)
    put(STATE * c + 1, STATE * c + 1, x1 * x1)
    put(STATE * c + 2, STATE * c + 2, x0 * x0)
    put(STATE * c + 2, STATE * c + 1, x1 * x0)
    return H


def _starts(data: VaryingData) -> IntArray:
    """First sample of each difference that lies within a trial."""
    ends = zip(data.offsets[:-1], data.offsets[1:], strict=True)
    return np.concatenate([np.arange(a, b - ORDER) for a, b in ends])


def _roughness(data: VaryingData, which: int) -> FloatArray:
    """``D^T D`` of the second differences within trials, of unknown `which` of a sample."""
    H = np.zeros((BAND, STATE * len(data.angle)))
    first = _starts(data)
    for i, wi in enumerate(DIFFERENCE):
        for j, wj in enumerate(DIFFERENCE[: i + 1]):
            H[STATE * (i - j), STATE * (first + j) + which] += wi * wj
    return H
