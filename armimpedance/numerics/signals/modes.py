"""Smooth test functions over a window, and the noise of the measured position in them.

B-splines of degree 5 with uniform knots, each inside the window, so that they and their first four
derivatives vanish at its ends. Sums of a signal against them need no derivative of the signal:
``sum phi x'' = sum phi'' x`` and ``sum phi x' = -sum phi' x``, whatever the signal does at the
window's ends. They pass frequencies below about one over twice the spacing of the knots (25 Hz at
20 ms). Higher frequencies add no information, because of the arm's inertia and the noise of encoder
and force.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Annotated

import numpy as np
from scipy.linalg import solve_triangular

from armimpedance.core.arrays import FloatArray, FrozenRecord, frozen
from armimpedance.core.errors import InputError
from armimpedance.numerics.signals.differentiate import SPLINE_DEGREE, cardinal_spline

#: Distance between knots (s) (docs/explanation/estimators.md).
SPACING_S = 0.020
#: Fewest test functions over a window; the spacing is narrowed if necessary.
FEWEST = 10


@dataclass(frozen=True, eq=False)
class Modes(FrozenRecord):
    """Orthonormal combinations of test functions, and operators for derivatives of the signal.

    Attributes
    ----------
    smooth : (n, S)
        ``smooth @ smooth.T = I``: white noise of the samples stays white.
    first, second : (n, S)
        ``first @ x`` equals ``smooth @ x'``, and ``second @ x`` equals ``smooth @ x''``.
    """

    smooth: Annotated[FloatArray, "n s"]
    first: Annotated[FloatArray, "n s"]
    second: Annotated[FloatArray, "n s"]

    @property
    def count(self) -> int:
        """Number of modes n."""
        return len(self.smooth)

    @cached_property
    def stacked(self) -> FloatArray:
        """Operators for x'', x', x on top of each other, (3 n, S)."""
        return frozen(np.concatenate([self.second, self.first, self.smooth]))

    @property
    def gaps(self) -> FloatArray:
        """Projection of a constant of one onto `smooth`, (n,)."""
        return np.asarray(self.smooth.sum(axis=1))


def delayed(signal: FloatArray, samples: float) -> FloatArray:
    """Delay a signal (..., S) by `samples`, linear between samples; at rest before its start.

    Parameters
    ----------
    signal : (..., S)
    samples : float
        Delay in samples, not necessarily whole.

    Returns
    -------
    array of the same shape
        The delayed signal, in the signal's unit.
    """
    whole_samples = int(np.floor(samples))
    part = samples - whole_samples
    rest = np.repeat(signal[..., :1], whole_samples + 1, axis=-1)
    padded, count = np.concatenate([rest, signal], axis=-1), signal.shape[-1]
    return np.asarray((1 - part) * padded[..., 1 : count + 1] + part * padded[..., :count])


@lru_cache(maxsize=64)
def spline_modes(samples: int, sample_rate_hz: float, spacing_s: float = SPACING_S) -> Modes:
    """Modes of a window of `samples` samples.

    Parameters
    ----------
    samples : int
    sample_rate_hz : float
    spacing_s : float
        Distance between knots; narrowed if the window would hold fewer than ten splines.

    Raises
    ------
    InputError
        If the window has too few samples for ten splines with knots two samples apart.
    """
    widest = (samples - 1) // (FEWEST + SPLINE_DEGREE)
    if widest < 2:
        raise InputError(
            f"a window of {samples} samples at {sample_rate_hz:g} Hz",
            expected=f"at least {2 * (FEWEST + SPLINE_DEGREE) + 1} samples",
        )
    spacing = min(max(2, round(spacing_s * sample_rate_hz)), widest)
    count = (samples - 1) // spacing - SPLINE_DEGREE
    first_knot = ((samples - 1) - (count + SPLINE_DEGREE) * spacing) // 2
    at = np.arange(samples)
    places = (at - first_knot) / spacing - np.arange(count)[:, None]
    # integration by parts: (-1)^order
    per = -sample_rate_hz / spacing
    rows = [per**order * cardinal_spline(places, SPLINE_DEGREE, order) for order in range(3)]
    # P (n, S) = L Q: L^-1 P has orthonormal rows
    L = np.linalg.cholesky(rows[0] @ rows[0].T)
    smooth, first, second = (solve_triangular(L, row, lower=True) for row in rows)
    return Modes(smooth, first, second)


# Noise of the measured position, from the record itself.
#
# Three kinds of sensor:
#
# - readings on a grid, such as an encoder's. The error depends on the motion: constant at rest
#   (where referencing removes it), a saw-tooth in slow motion, nearly white in fast motion. The
#   smoothed motion is quantised again with shifted grids; the spread of the results is the noise;
# - readings that are constant at rest and noisy in motion without a grid, such as positions
#   computed from encoders of joint angles: white noise in motion, and a pulse of the same variance,
#   since the constant error at rest remains in the motion;
# - an analogue sensor, noisy at rest and in motion alike: white noise.

#: A reading counts as in motion if it changes within this time before or after (s).
NEAR_S = 0.010
#: A fourth difference of white noise has this many times its variance: 1 + 16 + 36 + 16 + 1.
_FOURTH_DIFFERENCE = 70.0
#: Fourth differences below this share of their rms count as zero.
_STILL = 0.05
#: Least number of quantisations of the smoothed motions in all, with shifted grids.
_READINGS = 160
#: Steps within this of an integer multiple of the smallest step are on a grid.
_ON_GRID = 0.01


@dataclass(frozen=True)
class PositionNoise:
    """Noise of the position sensor.

    `variance`: noise variance of single samples while the reading changes, m^2 (rad^2).
    `covariance` (d, 3 n, 3 n): per axis, covariance of the noise in the modes of x'', x', x; mean
    over trials.
    `step`: spacing of the grid of the readings, m (rad); 0: no grid.
    """

    variance: float
    covariance: FloatArray
    step: float = 0.0


def position_noise(position: FloatArray, sample_rate_hz: float, modes: Modes) -> PositionNoise:
    """Estimate the noise of displacements from rest (T, S, d).

    Parameters
    ----------
    position : (T, S, d)
        Displacements as recorded, m (rad); trials start at rest.
    sample_rate_hz : float
    modes : Modes
        Modes of the window.

    Returns
    -------
    PositionNoise
        Variance of single samples, covariance in the modes, and the step of the readings' grid.
    """
    step = grid_step(position)
    if step > 0:
        reach = max(1, round(NEAR_S * sample_rate_hz))
        return PositionNoise(step**2 / 12, _read_again(position, modes, step, reach), step)
    return _from_differences(position, sample_rate_hz, modes)


def grid_step(position: FloatArray) -> float:
    """Step of the grid on which positions (T, S, d) lie within each trial; 0 if on no grid."""
    steps = np.diff(position, axis=1)
    np.abs(steps, out=steps)
    # rounding of positions of a metre is 1e-16
    distinct = steps > 1e-13 + 1e-9 * steps.max(initial=0.0)
    if not distinct.any():
        return 0.0
    smallest = float(np.where(distinct, steps, np.inf).min())
    # zero steps count as on the grid
    steps *= distinct
    steps /= smallest
    off = np.abs(np.subtract(steps, np.round(steps), out=steps), out=steps).max()
    # the tolerance holds for the largest multiple too
    return smallest if off < _ON_GRID else 0.0


def _read_again(position: FloatArray, modes: Modes, step: float, reach: int) -> FloatArray:
    """Covariance (d, 3 n, 3 n) of the quantisation error of the smoothed motion."""
    T, S, d = position.shape
    padded = np.empty((T, d, S + 2 * reach))
    motion = padded[:, :, reach : reach + S]
    np.subtract(position.transpose(0, 2, 1), position[:, 0, :, None], out=motion)
    padded[:, :, :reach] = motion[:, :, :1]
    padded[:, :, reach + S :] = motion[:, :, -1:]
    # a moving average: a motion at rest stays at rest
    smooth = _sums(padded.reshape(T * d, -1), 2 * reach + 1)
    smooth /= (2 * reach + 1) * step
    readings = -(-_READINGS // (T * d))
    # shifts of the grid, spread evenly over a step and different in every trial
    place = (np.arange(readings)[:, None] + np.linspace(0, 1, T * d, endpoint=False)) / readings
    grid = smooth + place[:, :, None]
    error = np.subtract(np.round(grid), grid, out=grid).reshape(-1, S)
    projected = error @ modes.stacked.T
    # referencing removes the error at rest
    projected -= error[:, :1] * modes.stacked.sum(axis=1)
    projected = projected.reshape(readings, T, d, -1)
    per_axis = projected.transpose(2, 0, 1, 3).reshape(d, readings * T, -1)
    spread = per_axis.transpose(0, 2, 1) @ per_axis
    return np.asarray(step**2 * spread / (readings * T))


def _sums(rows: FloatArray, width: int) -> FloatArray:
    """Moving sums over `width` samples (..., N - width + 1), built from sums of 1, 2, 4, ..."""
    count, covered, length = rows.shape[-1] - width + 1, 0, 1
    total = np.zeros((*rows.shape[:-1], count))
    while length <= width:
        if width & length:
            total += rows[..., covered : covered + count]
            covered += length
        rows = rows[..., length:] + rows[..., :-length]
        length *= 2
    return total


def _from_differences(position: FloatArray, sample_rate_hz: float, modes: Modes) -> PositionNoise:
    """Estimate white noise and pulses from differences that no limb can make.

    The fourth difference of a limb's motion at 1 kHz is nanometres; anything larger is noise.
    """
    fourth = np.diff(position, 4, axis=1)
    level = np.sqrt((fourth**2).mean())
    changing = np.zeros(position.shape, dtype=bool)
    changing[:, 2:-2] = np.abs(fourth) > _STILL * level
    moving = _dilate(changing, max(1, round(NEAR_S * sample_rate_hz)))
    inside = moving[:, 2:-2]
    variance = float((fourth[inside] ** 2).mean()) / _FOURTH_DIFFERENCE if inside.any() else 0.0
    still = ~inside
    at_rest = float((fourth[still] ** 2).mean()) / _FOURTH_DIFFERENCE if still.any() else variance
    operators = modes.stacked
    covariances = [
        at_rest * operators @ operators.T
        + (variance - at_rest) * _pulse_covariance(moving[:, :, axis], operators)
        for axis in range(position.shape[2])
    ]
    return PositionNoise(variance, np.stack(covariances))


def _dilate(flags: np.ndarray, reach: int) -> np.ndarray:
    """True within `reach` samples of a true value, along axis 1."""
    padded = np.pad(flags.astype(np.int32), ((0, 0), (reach + 1, reach), (0, 0)))
    running = np.cumsum(padded, axis=1)
    return np.asarray(running[:, 2 * reach + 1 :] - running[:, : -2 * reach - 1] > 0)


def _pulse_covariance(moving: np.ndarray, operators: FloatArray) -> FloatArray:
    """Mean over trials of ``Q (diag m + m m^T) Q^T`` for samples in motion m (T, S)."""
    m = moving.astype(np.float64)
    pulse = m @ operators.T
    return np.asarray((operators * m.mean(axis=0)) @ operators.T + pulse.T @ pulse / len(m))
