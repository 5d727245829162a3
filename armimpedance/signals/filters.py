"""Zero-phase Butterworth filters, batched along an axis (one call for all trials and axes)."""

from __future__ import annotations

import numpy as np

from armimpedance.errors import InputError
from armimpedance.records import FloatArray


def _zero_phase(
    signal: FloatArray,
    cutoff_hz: float | list[float],
    sample_rate_hz: float,
    order: int,
    kind: str,
    axis: int,
) -> FloatArray:
    from scipy.signal import butter, sosfiltfilt

    edges = np.atleast_1d(cutoff_hz)
    nyquist = sample_rate_hz / 2
    if not ((edges > 0).all() and (edges < nyquist).all() and (np.diff(edges) > 0).all()):
        raise InputError(
            f"cut-off {cutoff_hz} Hz at {sample_rate_hz:g} Hz", expected=f"0 < … < {nyquist:g} Hz"
        )
    sos = butter(order, cutoff_hz, btype=kind, fs=sample_rate_hz, output="sos")
    # The default padding assumes long records; a short one is padded by what it has.
    pad = min(3 * (2 * len(sos) + 1), signal.shape[axis] - 1)
    return np.asarray(sosfiltfilt(sos, signal, axis=axis, padlen=pad))


def lowpass(
    signal: FloatArray, cutoff_hz: float, sample_rate_hz: float, *, order: int = 2, axis: int = 1
) -> FloatArray:
    """Zero-phase Butterworth low-pass along `axis`; forward and backward, so twice the order.

    Raises
    ------
    InputError
        If the cut-off is not between 0 and the Nyquist frequency.
    """
    return _zero_phase(signal, cutoff_hz, sample_rate_hz, order, "low", axis)


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

    Raises
    ------
    InputError
        If the band is empty or reaches beyond the Nyquist frequency.
    """
    return _zero_phase(signal, [low_hz, high_hz], sample_rate_hz, order, "band", axis)
