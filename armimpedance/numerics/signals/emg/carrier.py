"""How uncertain an EMG amplitude is: it is the average of a random carrier.

Surface EMG is modelled as ``x(t) = s(t) n(t)``: a slow amplitude times stationary Gaussian noise of
unit variance and autocorrelation rho. For such noise (an elementary integral of the bivariate
normal density)

    cov(|n(0)|, |n(k)|) / E|n|^2 = sqrt(1 - rho_k^2) + rho_k asin(rho_k) - 1,

pi/2 - 1 at lag 0, and ``cov(n^2, n'^2) = 2 rho^2``. Averaging with weights h leaves
``var / mean^2 = sum_k c_k (h * h)_k``. Of a flat band of W Hz smoothed over T seconds this is about
``1 / (4 W T)``: the standard error is in proportion to the amplitude itself.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.trials import trial_slices

#: Lags of the autocorrelation that are used: an EMG above 20 Hz has forgotten itself by then.
LONGEST_LAG_S: Final = 0.06


def carrier_correlation(
    emg: FloatArray, level: FloatArray, offsets: IntArray, sample_rate_hz: float
) -> FloatArray:
    """Autocorrelation of the carrier of each muscle, (L, m), from all trials together.

    Parameters
    ----------
    emg : (N, m)
        Without offset.
    level : (N, m)
        Amplitude by which the EMG is divided first; samples where it is 0 are not used.
    offsets : (T + 1,)
    """
    from scipy.signal import fftconvolve

    lags = max(int(LONGEST_LAG_S * sample_rate_hz), 1)
    carrier = np.divide(emg, level, out=np.zeros_like(emg), where=level > 0)
    products = np.zeros((lags + 1, emg.shape[1]))
    count = np.zeros((lags + 1, 1))
    for samples in trial_slices(offsets):
        one = carrier[samples]
        both = fftconvolve(one, one[::-1], axes=0)[len(one) - 1 :][: lags + 1]
        products[: len(both)] += both
        count[: len(both), 0] += len(one) - np.arange(len(both))
    covariance = products / np.maximum(count, 1)
    scale = np.where(covariance[0] > 0, covariance[0], 1.0)
    rho = covariance / scale
    return np.asarray(np.clip(rho, -1.0, 1.0))


def rectified_correlation(rho: FloatArray) -> FloatArray:
    """``cov(|n|, |n'|) / E|n|^2`` of unit Gaussian noise with correlation rho."""
    return np.asarray(np.sqrt(1 - rho**2) + rho * np.arcsin(rho) - 1)


def squared_correlation(rho: FloatArray) -> FloatArray:
    """``var(rms) / rms^2`` per unit of averaging: a quarter of ``cov(n^2, n'^2)``."""
    return np.asarray(rho**2 / 2)


def lowpass_overlap(
    cutoff_hz: float, sample_rate_hz: float, order: int, lags: int, *, causal: bool
) -> FloatArray:
    """``(h * h)_k`` of a Butterworth low-pass at lags 0..lags-1.

    Its spectrum is ``|H|^2``, or ``|H|^4`` forward and backward.
    """
    from scipy.signal import butter, sosfreqz

    # fine enough that the response has died out within the period of the transform
    points = int(2 ** np.ceil(np.log2(40 * sample_rate_hz / cutoff_hz + 2 * lags)))
    sos = butter(order, cutoff_hz, fs=sample_rate_hz, output="sos")
    _, H = sosfreqz(sos, worN=points, whole=True)
    power = np.abs(H) ** (2 if causal else 4)
    return np.asarray(np.fft.ifft(power).real[:lags])


def mean_overlap(samples: int, lags: int) -> FloatArray:
    """``(h * h)_k`` of the mean over some samples, at lags 0..lags-1."""
    k = np.arange(lags)
    return np.asarray(np.maximum(1 - k / samples, 0.0) / samples)


def relative_sd(correlation: FloatArray, overlap: FloatArray) -> FloatArray:
    """``sqrt(sum over all lags of c_k (h * h)_k)``, of each muscle (m,); c (L, m), h * h (L,)."""
    variance = overlap[0] * correlation[0] + 2 * overlap[1:] @ correlation[1:]
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))
