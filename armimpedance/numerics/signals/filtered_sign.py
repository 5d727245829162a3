"""The sign of a velocity, as dry friction has it, through the filter of the torque."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.numerics.signals.filters import lowpass

#: The sign is taken this often per second before it is filtered, per sample at least `_LEAST`.
_FINE_HZ: Final = 480.0
_LEAST: Final = 4


def filtered_sign(
    velocity: FloatArray, cutoff_hz: float | None, sample_rate_hz: float
) -> FloatArray:
    """Sign of a velocity (S,) of one trial after a zero-phase low-pass; None: as it is.

    A sign sampled at 30 frames/s knows the reversal to a frame only. It is taken between the
    frames, from the spline through the velocity, and brought down to the frames without aliasing.

    Parameters
    ----------
    velocity : (S,)
    cutoff_hz : float or None
    sample_rate_hz : float

    Returns
    -------
    (S,)
        Values from -1 to 1.

    Raises
    ------
    InputError
        A cut-off beyond the Nyquist frequency.
    """
    from scipy.interpolate import make_interp_spline
    from scipy.signal import resample_poly

    if cutoff_hz is None:
        return np.sign(velocity)
    finer = max(_LEAST, round(_FINE_HZ / sample_rate_hz))
    frames = np.arange(len(velocity))
    points = np.arange(finer * (len(velocity) - 1) + 1) / finer
    sign = np.sign(make_interp_spline(frames, velocity, k=3)(points))
    at_frames = resample_poly(sign, 1, finer, padtype="edge")[: len(velocity)]
    return lowpass(at_frames, cutoff_hz, sample_rate_hz, axis=0)
