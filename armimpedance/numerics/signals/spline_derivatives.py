"""Smooth sampled motion and differentiate it, where samples are few per movement.

At the 30 frames/s of a motion-capture studio a central difference loses 3 % of a 2 Hz swing's
velocity. The zero-phase filter's output is therefore joined by a spline of degree 5 and the spline
is differentiated.
"""

from __future__ import annotations

from typing import Final

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.numerics.signals.differentiate import SPLINE_DEGREE
from armimpedance.numerics.signals.filters import lowpass

#: Fewer samples than this say nothing about an acceleration.
FEWEST: Final = 16


def smoothed_derivatives(
    signal: FloatArray, sample_rate_hz: float, cutoff_hz: float | None, *, order: int = 2
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A signal after a zero-phase Butterworth low-pass, with its first two time derivatives.

    Parameters
    ----------
    signal : (S, ...)
        One trial, equally spaced along the first axis.
    sample_rate_hz : float
    cutoff_hz : float or None
        None leaves the signal as it is.
    order : int
        Order of the filter, which runs forward and backward.

    Returns
    -------
    signal, first, second : (S, ...)

    Raises
    ------
    InputError
        Too few samples, or a cut-off beyond the Nyquist frequency.
    """
    import numpy as np
    from scipy.interpolate import make_interp_spline

    if len(signal) < FEWEST:
        raise InputError(f"{len(signal)} samples in a trial", expected=f"{FEWEST} or more")
    given = np.asarray(signal, dtype=np.float64)
    smooth = lowpass(given, cutoff_hz, sample_rate_hz, order=order, axis=0)
    time = np.arange(len(smooth)) / sample_rate_hz
    spline = make_interp_spline(time, smooth, k=SPLINE_DEGREE)
    return smooth, spline(time, nu=1), spline(time, nu=2)
