"""Noise of the measured position, from the record itself.

Two kinds of sensor: an analogue one is noisy at rest and in motion alike; an encoder stands still
at rest and, once the hand crosses its steps, errs by up to half a step. Then the error at rest,
which referencing removes from the rest, stays in the motion as a constant: each stretch of motion
carries a pulse of the same variance beside white noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armimpedance.records import FloatArray
from armimpedance.signals.modes import Modes

#: A reading counts as in motion if it changes within this time before or after (s).
NEAR_S = 0.010
#: A fourth difference of white noise has this many times its variance: 1 + 16 + 36 + 16 + 1.
_FOURTH_DIFFERENCE = 70.0
#: Fourth differences below this part of their rms are none.
_STILL = 0.05


@dataclass(frozen=True)
class PositionNoise:
    """What the position sensor adds.

    Attributes
    ----------
    variance : float
        Of single samples while the reading changes, m^2 (rad^2).
    covariance : (d, 3 n, 3 n)
        Per axis, of what the modes make of the noise in x'', x', x; mean over trials.
    """

    variance: float
    covariance: FloatArray


def position_noise(position: FloatArray, sample_rate_hz: float, modes: Modes) -> PositionNoise:
    """Noise of positions (T, S, d), from differences that no limb can make.

    The fourth difference of a limb's motion at 1 kHz is nanometres; what it shows is noise.
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
    """True within `reach` samples of a true one, along axis 1."""
    padded = np.pad(flags.astype(np.int32), ((0, 0), (reach + 1, reach), (0, 0)))
    running = np.cumsum(padded, axis=1)
    return np.asarray(running[:, 2 * reach + 1 :] - running[:, : -2 * reach - 1] > 0)


def _pulse_covariance(moving: np.ndarray, operators: FloatArray) -> FloatArray:
    """Mean over trials of ``Q (diag m + m m^T) Q^T`` for stretches of motion m (T, S)."""
    m = moving.astype(np.float64)
    pulse = m @ operators.T
    return np.asarray((operators * m.mean(axis=0)) @ operators.T + pulse.T @ pulse / len(m))
