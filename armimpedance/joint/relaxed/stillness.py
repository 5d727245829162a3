"""Coordinates no livelier than they show: what is held still is taken as still.

Noise of the coordinates about a joint pushes it in a simulation, at its own resonance too, where
no cut-off can take it away from motion. But a limb that somebody holds moves by less than its
markers' noise, and its mean is then the better guess (generalised cross-validation: P. Craven, G.
Wahba, Numer. Math. 31 (1979) 377-403).
"""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.numerics.signals import lowpass


def as_still_as_shown(
    coordinates: FloatArray, sample_rate_hz: float, cutoff_hz: float | None
) -> FloatArray:
    """One trial's coordinates (S, n) after the low-pass, or their mean where it predicts better.

    Motion of less than about three quarters of its noise counts as none.

    Parameters
    ----------
    coordinates : (S, n)
    sample_rate_hz : float
    cutoff_hz : float or None
        Of the zero-phase second-order Butterworth low-pass; None: the coordinates have no noise
        and stay as they are.
    """
    if cutoff_hz is None:
        return coordinates
    S = len(coordinates)
    still = np.repeat(coordinates.mean(axis=0, keepdims=True), S, axis=0)
    smooth = lowpass(coordinates, cutoff_hz, sample_rate_hz, axis=0)
    moves = _score(coordinates, smooth, _freedom(S, cutoff_hz, sample_rate_hz))
    return np.where(_score(coordinates, still, 1.0) <= moves, still, smooth)


def _score(signal: FloatArray, smooth: FloatArray, freedom: float) -> FloatArray:
    """Mean square (n,) that would be left of samples that the smooth (S, n) had not seen."""
    left = ((signal - smooth) ** 2).mean(axis=0)
    return np.asarray(left / (1 - freedom / len(signal)) ** 2)


def _freedom(samples: int, cutoff_hz: float, rate_hz: float) -> float:
    """Trace of the low-pass: its mean gain ``1 / (1 + r^4)``, r the ratio of warped frequencies."""
    frequency = (np.arange(512) + 0.5) / 1024
    ratio = np.tan(np.pi * frequency) / np.tan(np.pi * cutoff_hz / rate_hz)
    return samples * float(np.mean(1 / (1 + ratio**4)))
