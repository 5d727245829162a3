"""Weights from the spectrum of the torque's residual, for subjects who push too.

Voluntary torque has low frequencies, tremor is in a narrow band; the sensors' noise floors show
neither. A first pass of instruments gives a residual, whose power relative to the floors is fitted
as ``g(f) = exp(sum_j c_j h_j(ln f))``, hats h_j between knots, by Whittle's likelihood of a
periodogram (P. Whittle, Ark. Mat. 2, 1953): ``sum_k nu_k / 2 (ln g_k + r_k / g_k)``. Power above
the floors then counts as noise of the torque.

There are `LINES` frequencies or more, of all trials together, between two knots. Each value of the
spectrum comes from about 16 squares; its relative error of about a third costs a few per cent
of efficiency. The weights depend only on the squares of the residual, not on its sign, so they do
not bias the estimate.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.elbow.stationary.band import Band, Bins, explained, real_rows
from armimpedance.joint.elbow.stationary.instruments import (
    driver_of,
    positive,
    round_of,
    start_values,
)

#: Number of times the residual's spectrum is estimated, and of instrument rounds before each.
SPECTRA: Final = 2
_FIRST_ROUNDS: Final = 6
#: Least number of frequencies between two knots, of all trials together ...
LINES: Final = 8
#: ... and their least ratio of frequencies: half an octave.
RATIO: Final = float(np.sqrt(2))
#: The noise floors are used alone unless the p value of the power above them is below this.
UNLIKELY: Final = 1e-3
#: A residual below this share of the motion's power is rounding.
ENOUGH: Final = 1e-6
_ROUNDS: Final = 50
_LONGEST: Final = 1.0
_SETTLED: Final = 1e-6


def weighed_band(floors: Band) -> Band:
    """Return the band weighted by the sensors' noise and by the residual of a first pass.

    `floors`, from `band.band_of`, is returned itself if the residual is not significant.

    Raises EstimationError: the torque has the wrong sign.
    Raises NotIdentifiableError: the motion does not allow I, B and K to be separated.
    """
    band, driver, values = floors, driver_of(floors), start_values(floors)
    for _ in range(SPECTRA):
        for _ in range(_FIRST_ROUNDS):
            values = positive(round_of(band, driver, values), values)
        if explained(floors, values) > 1 - ENOUGH:
            return floors
        band = _with_residual(band, values, floors)
        if band is floors:
            break
    return band


def _with_residual(band: Band, values: FloatArray, floors: Band) -> Band:
    """Return the floors with weights from the residual at I, B, K (3,), if that is significant.

    The present weights are those of `band`; those of `floors`, from the sensors' noise only, are
    the lower limit of the noise.
    """
    power, squares = _relative_power(band, values, floors)
    frequency = np.concatenate([b.frequency_hz for b in floors.trials])
    seen = floors.torque_noise > 0 or floors.angle_noise > 0
    # Without floors the scale is unknown: the test is against a constant spectrum.
    level = 0.0 if seen else float(np.log(squares @ power / squares.sum()))
    knots = np.log(knots_of(frequency))
    H, power = hats(np.log(frequency), knots), power * np.exp(-level)
    logs = _smooth(H, power, squares)
    if _chance(H @ logs, power, squares, len(knots)) > UNLIKELY:
        return floors
    trials = []
    for floor in floors.trials:
        g = np.exp(hats(np.log(floor.frequency_hz), knots) @ logs)
        trials.append(_noisier(floor, g, values) if seen else _scaled(floor, g))
    return replace(floors, trials=tuple(trials))


def knots_of(frequency_hz: FloatArray) -> FloatArray:
    """Knots (k,) from the lowest to the highest frequency, `LINES` and `RATIO` apart or more."""
    ordered = np.sort(frequency_hz)
    knots = [ordered[0]]
    while True:
        above = ordered[ordered > knots[-1]]
        if len(above) < 2 * LINES or above[-1] < knots[-1] * RATIO**2:
            break
        knots.append(max(above[LINES - 1], knots[-1] * RATIO))
    return np.array([*knots, ordered[-1]])


def hats(x: FloatArray, knots: FloatArray) -> FloatArray:
    """Piecewise linear functions (n, k), one for each of k knots, at x (n,)."""
    return np.stack([np.interp(x, knots, row) for row in np.eye(len(knots))], axis=1)


def _relative_power(band: Band, values: FloatArray, floors: Band) -> tuple[FloatArray, FloatArray]:
    """Power of the residual over that of the floors, and number of squares per line, both (n,).

    The ends' polynomial takes the share ``h`` of a line; the rest has the mean ``(1 - h) P``.
    """
    power, squares = [], []
    for bins, floor in zip(band.trials, floors.trials, strict=True):
        Z = bins.impedance(values)
        total, weight = bins.noise_power(Z), bins.weight(Z)
        # Q (2 n, 6) spans the ends, weighed; e (2 n,) = (1 - Q Q^T) residual
        Q = np.linalg.qr(real_rows(bins.ends * weight[:, None]))[0]
        e = bins.residual(values)
        remaining = _per_line(1 - (Q**2).sum(axis=1)).clip(1e-3)
        power.append(_per_line(e**2) / remaining * total / floor.noise_power(Z))
        squares.append(remaining)
    return np.concatenate(power), np.concatenate(squares)


def _per_line(rows: FloatArray) -> FloatArray:
    """Sum over real and imaginary parts, (2 n,) to (n,)."""
    n = len(rows) // 2
    return np.asarray(rows[:n] + rows[n:])


def _smooth(H: FloatArray, power: FloatArray, squares: FloatArray) -> FloatArray:
    """Logarithms (k,) of the spectrum at the knots: Fisher's scoring of Whittle's likelihood."""
    weight = H * squares[:, None]
    tiny = np.finfo(float).tiny
    logs = np.log((weight.T @ power) / np.maximum(weight.sum(axis=0), tiny) + tiny)
    information = weight.T @ H
    for _ in range(_ROUNDS):
        # H^T nu H (k, k) step (k,) = H^T nu (r / g - 1)
        step = np.linalg.solve(information, weight.T @ (power * np.exp(-(H @ logs)) - 1))
        logs = logs + np.clip(step, -_LONGEST, _LONGEST)
        if np.abs(step).max() < _SETTLED:
            break
    return logs


def _chance(eta: FloatArray, power: FloatArray, squares: FloatArray, count: int) -> float:
    """p value of the likelihood ratio under g = 1."""
    from scipy.stats import chi2

    ratio = float((squares * (power - eta - power * np.exp(-eta))).sum())
    return float(chi2.sf(ratio, count))


def _scaled(floor: Bins, g: FloatArray) -> Bins:
    """Noise of one channel and unknown size, with the shape of the residual's spectrum."""
    return replace(floor, angle_noise=g * floor.angle_noise, torque_noise=g * floor.torque_noise)


def _noisier(floor: Bins, g: FloatArray, values: FloatArray) -> Bins:
    """Add the power above the floors to the noise of the torque."""
    more = np.maximum(g - 1, 0.0) * floor.noise_power(floor.impedance(values))
    return replace(floor, torque_noise=floor.torque_noise + more)
