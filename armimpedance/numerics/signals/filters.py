"""Zero-phase Butterworth filters, batched along an axis (one call for all trials and axes)."""

from __future__ import annotations

from typing import Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError


def _zero_phase(
    signal: FloatArray,
    edges_hz: tuple[float, ...],
    sample_rate_hz: float,
    order: int,
    axis: int,
) -> FloatArray:
    """One edge: low-pass; two: band-pass."""
    from scipy.signal import butter, sosfiltfilt

    nyquist = sample_rate_hz / 2
    rising = all(a < b for a, b in zip((0.0, *edges_hz), (*edges_hz, nyquist), strict=True))
    if not rising:
        shown = " to ".join(f"{edge:g}" for edge in edges_hz)
        raise InputError(
            f"cut-off {shown} Hz of samples at {sample_rate_hz:g} Hz",
            expected=f"between 0 and {nyquist:g} Hz, half of the rate",
        )
    kind: Literal["low", "band"] = "low" if len(edges_hz) == 1 else "band"
    edges = edges_hz[0] if len(edges_hz) == 1 else np.asarray(edges_hz)
    sos = butter(order, edges, btype=kind, fs=sample_rate_hz, output="sos")
    # The default padding assumes long records; a short one is padded by what it has.
    pad = min(3 * (2 * len(sos) + 1), signal.shape[axis] - 1)
    return np.asarray(sosfiltfilt(sos, signal, axis=axis, padlen=pad))


def lowpass(
    signal: FloatArray,
    cutoff_hz: float | None,
    sample_rate_hz: float,
    *,
    order: int = 2,
    axis: int = 1,
) -> FloatArray:
    """Zero-phase Butterworth low-pass along `axis`; forward and backward, so twice the order.

    A cut-off of None leaves the signal as it is.

    Parameters
    ----------
    signal : array
        Time along `axis`.
    cutoff_hz : float or None
    sample_rate_hz : float
    order : int
    axis : int

    Returns
    -------
    array of the same shape

    Raises
    ------
    InputError
        If the cut-off is not between 0 and the Nyquist frequency.
    """
    if cutoff_hz is None:
        return signal
    return _zero_phase(signal, (cutoff_hz,), sample_rate_hz, order, axis)


def bandpass(
    signal: FloatArray,
    low_hz: float,
    high_hz: float,
    sample_rate_hz: float,
    *,
    order: int = 2,
    axis: int = 1,
) -> FloatArray:
    """Zero-phase Butterworth band-pass along `axis`.

    Parameters
    ----------
    signal : array
        Time along `axis`.
    low_hz, high_hz, sample_rate_hz : float
    order : int
    axis : int

    Returns
    -------
    array of the same shape

    Raises
    ------
    InputError
        If the band is empty or reaches beyond the Nyquist frequency.
    """
    return _zero_phase(signal, (low_hz, high_hz), sample_rate_hz, order, axis)
