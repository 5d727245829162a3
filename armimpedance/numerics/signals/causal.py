"""Butterworth low-pass as a controller runs it, forward only, and how late it is."""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError


def causal_lowpass(
    signal: FloatArray, cutoff_hz: float, sample_rate_hz: float, *, order: int, axis: int = 0
) -> FloatArray:
    """Butterworth low-pass along `axis`, forward only.

    It starts in the steady state of the mean over the first half period of the cut-off: the first
    sample alone, of a rectified signal, would start it anywhere.

    Parameters
    ----------
    signal : array
        Time along `axis`.
    cutoff_hz, sample_rate_hz : float
    order : int
    axis : int

    Returns
    -------
    array of the same shape
        The filtered signal, in the signal's unit.

    Raises
    ------
    InputError
        If the cut-off is not between 0 and the Nyquist frequency.
    """
    from scipy.signal import sosfilt, sosfilt_zi

    sos = _sections(cutoff_hz, sample_rate_hz, order)
    first = max(round(sample_rate_hz / (2 * cutoff_hz)), 1)
    moved = np.moveaxis(np.asarray(signal, dtype=np.float64), axis, -1)
    level = moved[..., :first].mean(axis=-1)
    # state (sections, ..., 2) = unit state (sections, 2) times level (...)
    state = np.stack([level[..., None] * one for one in sosfilt_zi(sos)])
    smooth, _ = sosfilt(sos, moved, axis=-1, zi=state)
    return np.moveaxis(np.asarray(smooth), -1, axis)


def lowpass_delay_s(cutoff_hz: float, sample_rate_hz: float, order: int) -> float:
    """Group delay of `causal_lowpass` for slow changes (at 0 Hz), s.

    For ``H(z) = b(z) / a(z)`` it is ``sum n b_n / sum b_n - sum n a_n / sum a_n`` samples, added
    up over its sections. Fifth order at 10 Hz: 51.5 ms.

    Parameters
    ----------
    cutoff_hz, sample_rate_hz : float
    order : int

    Returns
    -------
    float
        The group delay in s.

    Raises
    ------
    InputError
        If the cut-off is not between 0 and the Nyquist frequency.
    """
    sos = _sections(cutoff_hz, sample_rate_hz, order)
    n = np.arange(3)
    b, a = sos[:, :3], sos[:, 3:]
    samples = (b @ n / b.sum(axis=1) - a @ n / a.sum(axis=1)).sum()
    return float(samples / sample_rate_hz)


def advanced(signal: FloatArray, delay_s: float, sample_rate_hz: float) -> FloatArray:
    """A late signal (N, ...) moved forward by its delay, between samples if need be.

    The last `delay_s` hold the last value: what belongs there was never filtered.
    """
    at = np.arange(len(signal)) + delay_s * sample_rate_hz
    at = np.minimum(at, len(signal) - 1)
    before = np.floor(at).astype(int)
    after = np.minimum(before + 1, len(signal) - 1)
    part = (at - before).reshape((-1,) + (1,) * (signal.ndim - 1))
    return np.asarray((1 - part) * signal[before] + part * signal[after])


def _sections(cutoff_hz: float, sample_rate_hz: float, order: int) -> FloatArray:
    from scipy.signal import butter

    nyquist = sample_rate_hz / 2
    if not 0 < cutoff_hz < nyquist:
        raise InputError(
            f"cut-off {cutoff_hz:g} Hz of samples at {sample_rate_hz:g} Hz",
            expected=f"between 0 and {nyquist:g} Hz, half of the rate",
        )
    return np.asarray(butter(order, cutoff_hz, fs=sample_rate_hz, output="sos"))
