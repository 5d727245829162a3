"""Start of every time-varying method: the subject's own torque, and a free course."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.linalg.lapack import dtbtrs
from scipy.optimize import minimize

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.errors import EstimationError
from armimpedance.joint.elbow.varying.data import (
    Autoregression,
    VaryingData,
    by_reflection,
    from_reflections,
    phases,
    reflections_of,
)
from armimpedance.joint.elbow.varying.equation import WIDTH, Course, Linearised, linearise, start
from armimpedance.joint.elbow.varying.smoother import (
    INTENSITY_RANGE,
    START_INTENSITY,
    course_of,
    factor_of,
    settle,
)
from armimpedance.joint.elbow.varying.smoother_model import (
    DIFFERENCE,
    Levels,
    SmootherModel,
    smoother_model,
)

# The subject's own torque, estimated from the residuals of the equation of motion.
#
# ``tau = I theta'' + B theta' + K theta - v``: the residual about a course is v plus the sensors'
# noise, whose spectrum is known. The spectrum of v is fitted as that of an autoregression
# by P. Whittle's likelihood (Ark. Mat. 2 (1953) 423-434), its order by Schwarz's criterion; order
# 0, no torque at all, is one of the candidates. With weights that include v, least squares is
# consistent although the device reacts to the motion that v causes, because the innovations of v
# are independent of earlier motion (the direct method for closed loops, L. Ljung, System
# Identification, 1999, 13.4).

#: Orders that are compared, besides 0.
ORDERS: Final = (1, 2, 3, 4, 6)
#: Share of the rate up to which residuals are used: above, the decimating filter falls off.
HIGHEST: Final = 0.4
#: Number of lowest bins of a tapered spectrum that the trial's offset affects.
LOWEST_BIN: Final = 2
#: Neighbouring bins of a Hann taper are correlated: number of bins that count as one.
BINS_PER_ONE: Final = 1.9
#: Bins after averaging; spaced equally below `FINEST` (cycles per sample), then by ratio.
BINS: Final = 160
FINEST: Final = 0.01
#: Largest absolute reflection coefficient.
MOST: Final = 0.9995


@dataclass(frozen=True)
class Residual:
    """Power of the equation's residuals over frequency, averaged in F bins.

    `frequency` (F,): cycles per sample.
    `power`, `floor` (F,): measured, and expected from the sensors' noise only; N m^2.
    `count` (F,): independent values in each bin.
    """

    frequency: FloatArray
    power: FloatArray
    floor: FloatArray
    count: FloatArray


def own_torque(residual: Residual, near: Autoregression | None = None) -> Autoregression:
    """Process v that, with the sensors' noise, explains the residuals.

    `near`: a start value, whose order is kept.
    """
    if near is not None and near.order:
        return _fitted(near.order, residual, near)
    best = Autoregression()
    least = _score(best, residual)
    for order in ORDERS:
        candidate = _fitted(order, residual)
        score = _score(candidate, residual)
        score += 0.5 * (order + 1) * float(np.log(residual.count.sum()))
        if score < least:
            best, least = candidate, score
    return best


def residual_of(data: VaryingData, course: Course, doubt: FloatArray | None = None) -> Residual:
    """Spectrum of the residuals about a course.

    `doubt` (R, M) or None: draws of the torque error of an uncertain course; their power is added,
    because the course removed it from the residuals.
    """
    eq = linearise(data, course)
    sums = np.zeros((4, BINS))
    edges = np.geomspace(1, 1 + HIGHEST / FINEST, BINS + 1)
    for t in range(len(data.trials)):
        rows = np.flatnonzero(eq.trial == t)
        power = _tapered(eq.e[rows, None])[:, 0]
        if doubt is not None:
            power = power + _tapered(doubt[rows]).mean(axis=1)
        f = np.arange(len(power)) / len(rows)
        use = (np.arange(len(f)) >= LOWEST_BIN) & (f < HIGHEST)
        floor = data.sd_torque[t] ** 2 + data.sd_angle[t] ** 2 * _gain(eq, rows, f[use])
        at = np.clip(np.searchsorted(edges, 1 + f[use] / FINEST, "right") - 1, 0, BINS - 1)
        for row, values in zip(sums, (f[use], power[use], floor, np.ones(use.sum())), strict=True):
            np.add.at(row, at, values)
    frequency, power, floor, count = sums[:, sums[3] > 0]
    return Residual(frequency / count, power / count, floor / count, count / BINS_PER_ONE)


def _tapered(e: FloatArray) -> FloatArray:
    """Hann-tapered power of (S, q) about its mean, (S / 2 + 1, q); its mean is the variance."""
    taper = np.hanning(len(e) + 2)[1:-1, None]
    about = e - (taper * e).sum(axis=0) / taper.sum()
    return np.asarray(np.abs(np.fft.rfft(taper * about, axis=0)) ** 2 / (taper**2).sum())


def _gain(eq: Linearised, rows: IntArray, frequency: FloatArray) -> FloatArray:
    """Mean of ``|L(f)|^2`` over a trial's rows, (f,)."""
    L = eq.L[rows]
    # mean of L^T L (9, 9), applied to the phases of its nine samples
    mean = L.T @ L / len(L)
    phase = np.exp(2j * np.pi * frequency[:, None] * np.arange(WIDTH))
    return np.asarray(((phase.conj() @ mean) * phase).sum(axis=1).real)


def _score(process: Autoregression, residual: Residual) -> float:
    """Minus Whittle's log likelihood, up to a constant."""
    expected = residual.floor + process.spectrum(residual.frequency)
    return float(residual.count @ (np.log(expected) + residual.power / expected))


def _fitted(order: int, residual: Residual, near: Autoregression | None = None) -> Autoregression:
    covariance = _excess_covariance(order, residual) if near is None else near.covariance
    if not covariance[0] > 0:
        return Autoregression()
    reflections, variance = reflections_of(covariance)
    first = np.append(np.arctanh(reflections / 1.001), 0.5 * np.log(variance))

    phase = phases(residual.frequency, order)

    def objective(x: FloatArray) -> tuple[float, FloatArray]:
        """Minus the log likelihood up to a constant, and its gradient (p + 1,)."""
        process = _process(x)
        # expected = floor + sd^2 / |1 - phase a|^2
        own, slope = process.with_slope_at(phase)
        expected = residual.floor + own
        value = residual.count @ (np.log(expected) + residual.power / expected)
        by_expected = residual.count * (1 - residual.power / expected) / expected
        # by a (p,), then by x: a of r, r = MOST tanh x
        reflections = MOST * np.tanh(x[:-1])
        by_reflections = (by_expected @ slope) @ by_reflection(reflections)
        by_shape = by_reflections * (MOST - reflections**2 / MOST)
        return float(value), np.append(by_shape, 2 * by_expected @ own)

    bounds = [(-4.2, 4.2)] * order + [(first[-1] - 12, first[-1] + 12)]
    at = np.clip(first, *np.array(bounds).T)
    return _process(minimize(objective, at, jac=True, method="L-BFGS-B", bounds=bounds).x)


def _excess_covariance(order: int, residual: Residual) -> FloatArray:
    """Autocovariance (p + 1,) of the residuals beyond the sensors' noise."""
    excess = np.maximum(residual.power - residual.floor, 0.0)
    lags = np.cos(2 * np.pi * residual.frequency[:, None] * np.arange(order + 1))
    # reduces the excess that noise gives by chance at high frequencies
    share = excess / (excess + residual.floor)
    return np.asarray((residual.count * excess * share) @ lags / residual.count.sum())


def _process(x: FloatArray) -> Autoregression:
    return from_reflections(MOST * np.tanh(x[:-1]), float(np.exp(x[-1])))


#: Rounds of the first courses, enough for their residuals to be used.
FIRST_ROUNDS: Final = 4
#: Intensity above that of any course that can be resolved (+-30 % at 3 Hz needs less), s^-1.5.
FREE_INTENSITY: Final = 30.0
#: Largest relative change of a constant joint's inertia due to the subject's torque.
INERTIA_KEPT: Final = 0.3
#: Rounds of the search for the subject's own torque, draws in each round, and (`OWN_SETTLED`) the
#: relative change of its rms and innovation that ends them.
OWN_ROUNDS: Final = 12
OWN_DRAWS: Final = 8
#: Rounds in which the order may change.
ORDER_ROUNDS: Final = 3
OWN_SETTLED: Final = 0.01


@dataclass(frozen=True)
class Beginning:
    """Data with the subject's own torque, a course that is free to vary, and levels near the
    optimum.

    `unexplained`: a warning if the residuals are large and no torque of this kind describes them.
    """

    data: VaryingData
    course: Course
    levels: Levels
    unexplained: str = ""


def begin(data: VaryingData, tick: Callable[[], None] = lambda: None) -> Beginning:
    """Estimate the subject's own torque, and a free course with it.

    A fast course must not be mistaken for such a torque. The torque must therefore be visible in
    the residuals of a course that may vary as fast as can be resolved. It is then estimated by
    expectation and maximisation: the uncertainty of the course is added to the residuals' power.

    `tick`: called after each step.
    """
    constant = start(data)
    scale = np.array([np.abs(constant.B).mean(), np.abs(constant.K).mean()])
    usual = Levels(START_INTENSITY, START_INTENSITY, 1.0)
    course = settle(data, constant, usual, scale, strict=False, rounds=FIRST_ROUNDS)
    tick()
    if not _own_torque_again(data, course, usual, scale).data.own.order:
        return Beginning(data, course, usual)
    tick()
    free = Levels(FREE_INTENSITY, FREE_INTENSITY, 1.0)
    course = settle(data, course, free, scale, strict=False, rounds=FIRST_ROUNDS)
    tick()
    if not _own_torque_again(data, course, free, scale).data.own.order:
        return Beginning(data, course, free)
    begun = _maximised(data, constant, usual, scale, tick)
    if abs(begun.course.inertia / constant.inertia - 1) > INERTIA_KEPT:
        return Beginning(data, course, free, _no_torque(begun, constant))
    return begun


def with_own_torque(
    data: VaryingData, constant: Course, intensity: float, tick: Callable[[], None]
) -> Beginning | None:
    """Estimate the subject's own torque, starting from the whole residual of a constant course.

    None if the resulting weights change the inertia: then it is not such a torque.

    `intensity`: start value for B and K, s^-1.5.
    `tick`: called after each step.
    """
    scale = np.array([np.abs(constant.B).mean(), np.abs(constant.K).mean()])
    try:
        begun = _maximised(data, constant, Levels(intensity, intensity, 1.0), scale, tick)
    except EstimationError:
        return None
    kept = abs(begun.course.inertia / constant.inertia - 1) <= INERTIA_KEPT
    return begun if kept else None


def _no_torque(begun: Beginning, constant: Course) -> str:
    """Warning that the residuals are not the subject's torque, since the inertia would change."""
    return (
        "the residuals hold far more than the sensors' noise; weighed as a torque of the subject's "
        f"own, I would be {begun.course.inertia:.2g}, not {constant.inertia:.2g} kg m^2: such a "
        "torque that is large, or an equation that does not hold up to the band's edge (give a "
        "lower cut-off); B and K are not to be trusted, their bands rest on white noise; ask the "
        "subject to relax, or average over trials"
    )


def _maximised(
    data: VaryingData,
    constant: Course,
    levels: Levels,
    scale: FloatArray,
    tick: Callable[[], None],
) -> Beginning:
    """Rounds that start with the whole residual of a constant course as the subject's torque."""
    begun = Beginning(replace(data, own=own_torque(residual_of(data, constant))), constant, levels)
    for turn in range(OWN_ROUNDS):
        before = begun.data.own
        near = before if turn >= ORDER_ROUNDS else None
        tick()
        begun = _own_torque_again(begun.data, begun.course, begun.levels, scale, near)
        own = begun.data.own
        moved = np.abs([own.rms - before.rms, own.sd - before.sd])
        if (moved <= OWN_SETTLED * np.array([own.rms, own.sd])).all():
            break
    return begun


def _own_torque_again(
    data: VaryingData,
    course: Course,
    levels: Levels,
    scale: FloatArray,
    near: Autoregression | None = None,
) -> Beginning:
    """One round of expectation and maximisation over v and the levels of B and K."""
    eq = linearise(data, course)
    model = smoother_model(data, eq, scale)
    factor = factor_of(model, levels)
    course = course_of(course, model, levels, factor)
    drawn = _draws(model, factor)
    at = eq.centre
    # torque error x1 dB + x0 dK of the uncertain course, (R, M)
    doubt = eq.x1[:, None] * drawn[at, 1] + eq.x0[:, None] * drawn[at, 2]
    own = own_torque(residual_of(data, course, doubt), near)
    if own.order:
        levels = _expected_levels(model, course, drawn)
    return Beginning(replace(data, own=own), course, levels)


def _draws(model: SmootherModel, factor: FloatArray) -> FloatArray:
    """Draws (N, state, M) of the smoothed states about their mean."""
    white = np.random.default_rng(0).standard_normal((factor.shape[1], OWN_DRAWS))
    # C^T x = z: x has the covariance (C C^T)^-1
    x, info = dtbtrs(factor, white, uplo="L", trans="T")
    if info != 0:
        raise EstimationError("the smoother's information matrix is not positive definite")
    return np.asarray(x).reshape(-1, model.state, OWN_DRAWS)


def _expected_levels(model: SmootherModel, course: Course, drawn: FloatArray) -> Levels:
    """Levels from the second differences of the course and its draws."""
    intensities = []
    for which, values in ((1, course.B), (2, course.K)):
        both = np.concatenate([values[:, None], values[:, None] + drawn[:, which]], axis=1)
        steps = sum(w * both[model.differences + j] for j, w in enumerate(DIFFERENCE))
        # E[(D x)^2] = (D mean)^2 + mean over draws of (D draw)^2, of draws about the mean
        mean, draws = np.asarray(steps)[:, :1], np.asarray(steps)[:, 1:]
        square = (mean**2).mean() + ((draws - mean) ** 2).mean()
        intensities.append(float(np.sqrt(square / model.unit[which - 1])))
    B, K = np.clip(intensities, *INTENSITY_RANGE)
    return Levels(float(B), float(K), 1.0)
