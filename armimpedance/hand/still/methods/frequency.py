"""Method `frequency`: all axes at once, line by line of the spectrum, weighted by replicates.

At each frequency w up to 15 Hz the taper v(t), one during the disturbance and falling smoothly to
zero over the rest on either side, makes of the impedance equation

    M sum (v e)'' x - B sum (v e)' x + K sum v e x = - sum v e f,    e = exp(-i w t)

which for a hand that is still wherever v falls is the familiar (-w^2 M + i w B + K) X = -F. With
the derivatives on the taper it holds for any motion, so that there is no leakage if the hand ends
elsewhere than it began. An offset and a ramp per trial are free.

Noise is the difference between trials of one direction. Its covariance over the axes at each line,
from the scatter about the mean of the direction, gives the weights: tremor reduces those at its
frequency, slow force those of the lowest lines. Noise of the position causes no bias: the mean
motion of the other replicates is the instrument of each trial.

The multiple-input multiple-output estimate of the frequency response literature, e.g. E. J.
Perreault, R. F. Kirsch and A. M. Acosta, Biological Cybernetics 80 (1999), 327-337, with M, B and K
in place of free spectra.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import Polynomial

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.conventions import Kind
from armimpedance.core.errors import InputError
from armimpedance.core.records import Window
from armimpedance.hand.still.methods import exact
from armimpedance.hand.still.modal import (
    ModalEquation,
    mean_of_others,
    modal_equation,
    weighted_equations,
)
from armimpedance.hand.still.prepared import NO_LINEAR_LIMB, Method, Prepared
from armimpedance.numerics.regression import solve_total
from armimpedance.numerics.signals import Modes

HIGHEST_HZ = 15.0
#: The taper rises and falls over the rest, within these limits (s). It may reach into the
#: disturbance if there is less rest: the equation still holds.
SHORTEST_TAPER_S, LONGEST_TAPER_S = 0.08, 0.16
#: Lines are this much closer than one over the taper's length, so that nothing between the lines of
#: a plain Fourier series is lost (K's RMSE falls by 0.1-0.4 points of percent).
OVERSAMPLING = 1.5
#: Replicates beyond one per direction, per axis: with fewer there is no covariance of the noise...
FEWEST_REPLICATES = 2
#: ... and below this many neighbouring lines are averaged.
REPLICATES_FOR_ONE_LINE = 8
#: Noise is at least this share of the force's power: without noise there would be no weights.
LEAST_NOISE = 1e-10

_STEP = Polynomial([0, 0, 0, 0, 35, -84, 70, -20])


@dataclass(frozen=True, eq=False)
class FrequencyLines:
    """Real and imaginary parts of the tapered lines as modes, and the line of each.

    `line` (n,) int.
    `modes`: n rows of unit length.
    `drift` (n, 2): coefficients of an offset and of a ramp in the modes.
    """

    modes: Modes
    line: IntArray
    drift: FloatArray


def prepare(window: Window, kind: Kind) -> Prepared:
    """Weighted equations of one group of trials.

    Raises InputError: if there are too few repeats of the same disturbance to see noise, or the
    window is short.
    """
    plain = exact.prepare(window, kind)
    labels = _replicates(window)
    lines = _lines_for(window)
    equation = modal_equation(window, lines.modes)
    first = solve_total(weighted_equations(equation, _unweighted(lines, window.axes), kind))
    noise = replicate_noise(equation, lines, labels, first)
    equations = weighted_equations(
        equation, line_weight(noise, lines), kind, instruments=_shared_motion(equation, labels)
    )
    count = int(lines.line.max()) + 1
    note = f"{count} lines up to {HIGHEST_HZ:g} Hz, weighted by the scatter within directions"
    return Prepared(plain.factors, equations, notes=(note,))


def _replicates(window: Window) -> IntArray:
    """Labels of the usable trials' disturbances."""
    if window.disturbance is None:
        raise InputError(
            "the noise of each line needs repeats of the same disturbance",
            column="direction_deg",
            expected="it in trials.csv for every trial",
        )
    labels = np.unique(window.disturbance[window.usable], return_inverse=True)[1].astype(np.int64)
    spare, needed = len(labels) - int(labels.max()) - 1, FEWEST_REPLICATES * window.axes
    if spare < needed:
        raise InputError(
            f"{len(labels)} trials of {labels.max() + 1} directions: too few repeats to see the "
            "noise of each line",
            expected=f"at least {needed} trials more than directions",
        )
    return labels


def _shared_motion(equation: ModalEquation, labels: IntArray) -> FloatArray:
    """Regressors of every trial from the other replicates, free of its position noise.

    A trial that is alone in its direction keeps its own regressors.
    """
    own = equation.regressors
    alone = np.bincount(labels)[labels] == 1
    return np.where(alone[:, None, None], own, mean_of_others(own, labels))


def _lines_for(window: Window) -> FrequencyLines:
    lag, rate = window.lag_s, window.sample_rate_hz
    rest = min(-lag[0], lag[-1] - float(window.duration_s[window.usable].max()))
    edge = float(np.clip(rest, SHORTEST_TAPER_S, LONGEST_TAPER_S))
    length = (len(lag) - 1) / rate
    if length < 2.5 * edge:
        raise InputError(
            f"a window of {length:.3f} s", expected=f"at least {2.5 * edge:.3f} s for a spectrum"
        )
    return tapered_lines(len(lag), rate, round(edge * rate))


@lru_cache(maxsize=64)
def tapered_lines(samples: int, sample_rate_hz: float, edge: int) -> FrequencyLines:
    """Lines of a window whose taper rises and falls over `edge` samples."""
    t = np.arange(samples) / sample_rate_hz
    v = _taper(t, edge / sample_rate_hz)
    length = t[-1] - edge / sample_rate_hz
    count = int(HIGHEST_HZ * OVERSAMPLING * length) + 1
    w = 2 * np.pi * np.arange(count)[:, None] / (OVERSAMPLING * length)
    e = np.exp(-1j * w * (t - t[-1] / 2))
    # (v e)' = (v' - i w v) e, (v e)'' = (v'' - 2 i w v' - w^2 v) e; by parts: x' -> -(v e)'
    smooth, first, second = (
        _parts(row * e)
        for row in (v[0], -(v[1] - 1j * w * v[0]), v[2] - 2j * w * v[1] - w**2 * v[0])
    )
    size = np.linalg.norm(smooth, axis=1, keepdims=True)
    modes = Modes(smooth / size, first / size, second / size)
    line = np.concatenate([np.arange(count), np.arange(1, count)])
    drift = modes.smooth @ np.column_stack([np.ones_like(t), t - t.mean()])
    return FrequencyLines(modes, line, drift)


def _taper(t: FloatArray, edge_s: float) -> FloatArray:
    """Taper and its first two derivatives (3, S): three derivatives vanish at its corners."""
    rows = []
    for order in range(3):
        step = _STEP.deriv(order) if order else _STEP
        rise = step(np.clip(t / edge_s, 0, 1)) / edge_s**order
        fall = step(np.clip((t[-1] - t) / edge_s, 0, 1)) / (-edge_s) ** order
        rows.append(np.where(t < t[-1] / 2, rise, fall))
    return np.stack(rows)


def _parts(rows: np.ndarray) -> FloatArray:
    """Real parts, then imaginary parts; line 0 has none."""
    return np.concatenate([rows.real, rows.imag[1:]])


def _free_of_drift(lines: FrequencyLines) -> FloatArray:
    """Projection (n, n) that removes an offset and a ramp."""
    Q = np.linalg.qr(lines.drift)[0]
    return np.asarray(np.eye(len(Q)) - Q @ Q.T, np.float64)


def _unweighted(lines: FrequencyLines, d: int) -> FloatArray:
    return np.asarray(np.kron(np.eye(d), _free_of_drift(lines)), np.float64)


def replicate_noise(
    equation: ModalEquation, lines: FrequencyLines, labels: IntArray, parameters: FloatArray
) -> FloatArray:
    """Covariance (lines, d, d) of the differences between trials of the same direction.

    `labels` (T,) int: direction of every trial, consecutive numbers from 0.
    `parameters` (3 d^2,): parameters of a first fit; they remove the effect of differences in
    motion between replicates.
    """
    d, n = equation.axes, equation.modes.count
    residual = equation.residual(parameters).reshape(-1, d, n) @ _free_of_drift(lines)
    count = np.bincount(labels)
    sums = np.zeros((len(count), d, n))
    np.add.at(sums, labels, residual)
    scatter = residual - (sums / count[:, None, None])[labels]
    spare = len(labels) - len(count)
    by_mode = np.einsum("tin,tjn->nij", scatter, scatter) / spare
    L = int(lines.line.max()) + 1
    noise = np.stack([by_mode[lines.line == line].mean(axis=0) for line in range(L)])
    if spare < REPLICATES_FOR_ONE_LINE * d:
        near = np.maximum(1 - np.abs(np.subtract.outer(np.arange(L), np.arange(L))) / 2, 0)
        noise = np.tensordot(near / near.sum(axis=1, keepdims=True), noise, axes=1)
    floor = LEAST_NOISE * float((equation.force**2).mean())
    return np.asarray(noise + max(floor, float(np.finfo(float).tiny)) * np.eye(d), np.float64)


def line_weight(noise: FloatArray, lines: FrequencyLines) -> FloatArray:
    """V (d n, d n): inverse noise of every line, without an offset and a ramp of each axis."""
    d, n = noise.shape[1], len(lines.line)
    inverse = np.linalg.inv(noise)[lines.line]
    blocks = np.zeros((d, n, d, n))
    at = np.arange(n)
    blocks[:, at, :, at] = inverse
    V = blocks.reshape(d * n, d * n)
    # V - V N (N^T V N)^-1 N^T V, N (d n, 2 d) the drift of all axes: as if it were fitted too
    N = np.kron(np.eye(d), lines.drift)
    VN = V @ N
    return np.asarray(V - VN @ np.linalg.solve(N.T @ VN, VN.T))


METHOD = Method(
    assumes="several trials of each direction, alike but for noise; nothing needed above 15 Hz",
    reference="E. J. Perreault, R. F. Kirsch and A. M. Acosta, Biol. Cybern. 80 (1999), 327-337",
    prepare=prepare,
    differs=NO_LINEAR_LIMB,
)
