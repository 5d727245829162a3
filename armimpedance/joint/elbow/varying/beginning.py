"""Where every time-varying method begins: the subject's own torque, and a free course."""

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

# The torque that the subject adds unasked, read off the residuals of the equation of motion.
#
# ``tau = I theta'' + B theta' + K theta - v``: the residual about a course holds v beside the
# sensors' noise, whose spectrum is known. The spectrum of v is fitted as that of an autoregression
# by P. Whittle's likelihood (Ark. Mat. 2 (1953) 423-434), its order by Schwarz's criterion; order
# 0, no torque at all, is one of the candidates. Weights that know v make least squares consistent
# though the device answers the motion that v causes: the innovations of v are new to the motion
# before them (the direct method for closed loops, L. Ljung, System Identification, 1999, 13.4).

#: Orders that are compared beside none.
ORDERS: Final = (1, 2, 3, 4, 6)
#: Part of the rate up to which residuals are compared: above, the decimating filter falls off.
HIGHEST: Final = 0.4
#: Lowest bins of a tapered spectrum that the trial's offset reaches.
LOWEST_BIN: Final = 2
#: Neighbouring bins of a Hann taper agree: so many bins are worth one.
BINS_PER_ONE: Final = 1.9
#: Bins after averaging; spaced equally below `FINEST` (cycles per sample), then by ratio.
BINS: Final = 160
FINEST: Final = 0.01
#: No reflection coefficient nearer to 1.
MOST: Final = 0.9995


@dataclass(frozen=True)
class Residual:
    """Power of the equation's residuals over frequency, F bins of neighbours together.

    `frequency` (F,): cycles per sample.
    `power`, `floor` (F,): seen, and expected of the sensors' noise alone; N m^2.
    `count` (F,): independent values in each bin.
    """

    frequency: FloatArray
    power: FloatArray
    floor: FloatArray
    count: FloatArray


def own_torque(residual: Residual, near: Autoregression | None = None) -> Autoregression:
    """The process v that, beside the sensors' noise, explains the residuals.

    `near`: a process that is near, whose order is kept.
    """
    if near is not None and near.order:
        return _fitted(near.order, residual, near)
    best = Autoregression()
    least = _score(best, residual)
    for order in ORDERS:
        made = _fitted(order, residual)
        score = _score(made, residual)
        score += 0.5 * (order + 1) * float(np.log(residual.count.sum()))
        if score < least:
            best, least = made, score
    return best


def residual_of(data: VaryingData, course: Course, doubt: FloatArray | None = None) -> Residual:
    """Spectrum of the residuals about a course.

    `doubt` (R, M) or None: draws of the torque by which the course may be wrong: their power is
    what the course took from the residuals.
    """
    eq = linearise(data, course)
    sums = np.zeros((4, BINS))
    edges = np.geomspace(1, 1 + HIGHEST / FINEST, BINS + 1)
    for t in range(len(data.trials)):
        here = np.flatnonzero(eq.trial == t)
        power = _tapered(eq.e[here, None])[:, 0]
        if doubt is not None:
            power = power + _tapered(doubt[here]).mean(axis=1)
        f = np.arange(len(power)) / len(here)
        use = (np.arange(len(f)) >= LOWEST_BIN) & (f < HIGHEST)
        floor = data.sd_torque[t] ** 2 + data.sd_angle[t] ** 2 * _gain(eq, here, f[use])
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
    """Mean over a trial's rows of ``|L(f)|^2``, (f,)."""
    L = eq.L[rows]
    # mean of L L^T (9, 9) between the phases of its nine samples
    mean = L.T @ L / len(L)
    phase = np.exp(2j * np.pi * frequency[:, None] * np.arange(WIDTH))
    return np.asarray(((phase.conj() @ mean) * phase).sum(axis=1).real)


def _score(process: Autoregression, residual: Residual) -> float:
    """Minus Whittle's log likelihood, but for a constant."""
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
        """Minus the log likelihood but for a constant, and its gradient (p + 1,)."""
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
    """Autocovariance (p + 1,) of what the residuals hold beside the sensors' noise."""
    excess = np.maximum(residual.power - residual.floor, 0.0)
    lags = np.cos(2 * np.pi * residual.frequency[:, None] * np.arange(order + 1))
    # less of what noise leaves by chance at high frequencies
    share = excess / (excess + residual.floor)
    return np.asarray((residual.count * excess * share) @ lags / residual.count.sum())


def _process(x: FloatArray) -> Autoregression:
    return from_reflections(MOST * np.tanh(x[:-1]), float(np.exp(x[-1])))


#: Rounds of the first courses: near enough to see what their residuals hold.
FIRST_ROUNDS: Final = 4
#: Freer than any course that can be told: +-30 % at 3 Hz asks for less, s^-1.5.
FREE_INTENSITY: Final = 30.0
#: The torque may change the inertia of a constant joint by this part.
INERTIA_KEPT: Final = 0.3
#: Rounds that look for the subject's own torque, the draws of each, and the change of its rms and
#: its innovation that ends them.
OWN_ROUNDS: Final = 12
OWN_DRAWS: Final = 8
#: Rounds in which the order may change.
ORDER_ROUNDS: Final = 3
OWN_SETTLED: Final = 0.01


@dataclass(frozen=True)
class Beginning:
    """Data with the subject's own torque, a course that is free to vary, levels that are near.

    `unexplained` is a sentence where the residuals hold much, and no such torque describes it.
    """

    data: VaryingData
    course: Course
    levels: Levels
    unexplained: str = ""


def begin(data: VaryingData, tick: Callable[[], None] = lambda: None) -> Beginning:
    """The data with the torque that the subject adds unasked, and a free course under it.

    A fast course must not be mistaken for such a torque: the torque has to show in the residuals of
    a course that is free to vary as fast as can be resolved. It is then estimated by expectation
    and maximisation: the uncertainty of the course is added to the power of the residuals.

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
    """The torque that the subject adds, found from above: all that a constant course leaves.

    None where the weights that it gives change the inertia: it is no such torque.

    `intensity`: of B and K, from which the rounds start, s^-1.5.
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
    """Inertia is what fast motion says most surely: weights that change it are wrong, or it was."""
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
    """Rounds from above: what a constant course leaves, all taken for the subject's own."""
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
    # torque x1 dB + x0 dK by which the course may be wrong, (R, M)
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
    """Levels that the second differences of the course and its draws have."""
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
