"""Filters: zero-phase and causal, and the low-passed sign of a velocity."""

from __future__ import annotations

from typing import Final, Literal

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
    """Filter forward and backward: a low-pass for one edge, a band-pass for two."""
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
    # the default padding assumes long records; a short one is padded by at most its length
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
    """Zero-phase Butterworth low-pass along `axis`: forward and backward, so twice the order.

    With a cut-off of None the signal is not filtered.

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


# Causal Butterworth low-pass, as in a controller, and its delay.


def causal_lowpass(
    signal: FloatArray, cutoff_hz: float, sample_rate_hz: float, *, order: int, axis: int = 0
) -> FloatArray:
    """Butterworth low-pass along `axis`, forward only.

    It starts in the steady state for the mean over the first half period of the cut-off. A single
    first sample of a rectified signal would be a random start.

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
    rows = np.moveaxis(np.asarray(signal, dtype=np.float64), axis, -1)
    level = rows[..., :first].mean(axis=-1)
    # state (sections, ..., 2) = unit state (sections, 2) times level (...)
    state = np.stack([level[..., None] * section for section in sosfilt_zi(sos)])
    smooth, _ = sosfilt(sos, rows, axis=-1, zi=state)
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
    """Shift a delayed signal (N, ...) forward by its delay, with interpolation between samples.

    The last `delay_s` repeat the last value, since the filter never produced values for them.
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


# The sign of a velocity, for dry friction, after the same filter as the torque.

#: Rate at which the sign is computed before it is filtered, Hz; at least `_LEAST` per sample.
_FINE_HZ: Final = 480.0
_LEAST: Final = 4


def filtered_sign(
    velocity: FloatArray, cutoff_hz: float | None, sample_rate_hz: float
) -> FloatArray:
    """Sign of a velocity (S,) of one trial after a zero-phase low-pass; None: no low-pass.

    At 30 frames/s the sign locates a reversal only to a frame. It is therefore computed between the
    frames, from a spline through the velocity, and resampled to the frames without aliasing.

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


# The last rows of a stream, in a block of memory of fixed size.


class LastRows:
    """A buffer of the last rows, which lie one after another in memory."""

    def __init__(self, length: int, width: int) -> None:
        # every row is stored twice, so that any `length` successive rows are one block
        self._rows = np.zeros((2 * length, width))
        self._length = length
        self._next = 0

    def push(self, row: FloatArray) -> None:
        """Add a row (width,) and drop the oldest."""
        self._rows[self._next] = self._rows[self._next + self._length] = row
        self._next = (self._next + 1) % self._length

    def last(self, count: int) -> FloatArray:
        """Return the last rows (count, width), oldest first: a view that the next push changes."""
        end = self._next + self._length
        return self._rows[end - count : end]
