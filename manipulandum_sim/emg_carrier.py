"""The carrier of surface EMG: noise of unit variance in the band of the electrodes."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray

BAND_HZ: Final = (20.0, 450.0)
ORDER: Final = 2
#: Samples that the filter runs in on.
RUN_IN: Final = 200
RATE_HZ: Final = 1000.0


def carrier(rng: np.random.Generator, samples: int, muscles: int) -> FloatArray:
    """Gaussian noise (S, m) of unit variance in the band, at 1 kHz."""
    return in_band(rng.standard_normal((RUN_IN + samples, muscles)), axis=0)


def in_band(white: FloatArray, axis: int, rate_hz: float = RATE_HZ) -> FloatArray:
    """White noise through the band-pass, its run-in of `RUN_IN` samples cut off, unit variance."""
    from scipy.signal import butter, sosfilt

    sos = butter(ORDER, BAND_HZ, "bandpass", fs=rate_hz, output="sos")
    impulse = np.zeros(4 * RUN_IN)
    impulse[0] = 1.0
    gain = np.sqrt((sosfilt(sos, impulse) ** 2).sum())
    noise = sosfilt(sos, white, axis=axis)
    kept = noise.swapaxes(0, axis)[RUN_IN:].swapaxes(0, axis)
    return np.asarray(kept / gain)
