"""The torque that the subject adds unasked, read off the residuals of the equation of motion.

``tau = I theta'' + B theta' + K theta - v``: the residual about a course holds v beside the
sensors' noise, whose spectrum is known. The spectrum of v is fitted as that of an autoregression by
P. Whittle's likelihood (Ark. Mat. 2 (1953) 423-434), its order by Schwarz's criterion; order 0, no
torque at all, is one of the candidates. Weights that know v make least squares consistent though
the device answers the motion that v causes: the innovations of v are new to the motion before them
(the direct method for closed loops, L. Ljung, System Identification, 1999, 13.4).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import minimize

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.joint.elbow.varying.autoregression import (
    Autoregression,
    by_reflection,
    from_reflections,
    phases,
    reflections_of,
)
from armimpedance.joint.elbow.varying.course import Course
from armimpedance.joint.elbow.varying.data import VaryingData
from armimpedance.joint.elbow.varying.equation import WIDTH, Linearised, linearise

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

    Attributes
    ----------
    frequency : (F,)
        Cycles per sample.
    power, floor : (F,)
        Seen, and expected of the sensors' noise alone; N m^2.
    count : (F,)
        Independent values in each bin.
    """

    frequency: FloatArray
    power: FloatArray
    floor: FloatArray
    count: FloatArray


def own_torque(residual: Residual, near: Autoregression | None = None) -> Autoregression:
    """The process v that, beside the sensors' noise, explains the residuals.

    Parameters
    ----------
    residual : Residual
    near : Autoregression or None
        A process that is near, whose order is kept.
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

    Parameters
    ----------
    data : VaryingData
    course : Course
    doubt : (R, M) or None
        Draws of the torque by which the course may be wrong: their power is what the course
        took from the residuals.
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
        own, slope = process.spectrum_at(phase), process.slope_at(phase)
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
