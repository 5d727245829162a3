"""Removal of offset, hum and artefact from raw EMG, and standard errors of its amplitude."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.core.records import Recording
from armimpedance.core.trials import trial_slices
from armimpedance.numerics.signals.emg.checks import (
    ARTEFACT_HZ,
    check_band,
    emg_quality,
    refuse_emg,
)
from armimpedance.numerics.signals.filters import bandpass

#: Order of the zero-phase high-pass against movement artefact.
HIGHPASS_ORDER: Final = 4
#: Largest deviation of the mains from their nominal frequency (Hz), and points of the search.
_MAINS_ERROR_HZ, _SCAN = 0.3, 61
#: Length of the sections in which amplitude and phase of hum are fitted separately (s).
_STRETCH_S: Final = 5.0
#: Share of power in the remaining hum above which there is a warning.
_LEFT: Final = 0.05


@dataclass(frozen=True)
class CleanEmg(FrozenRecord):
    """EMG of N samples and m muscles, ready to be rectified.

    `emg` (N, m): V, without offset.
    `notes`: sentences on what was removed.
    """

    emg: Annotated[FloatArray, "n m"]
    notes: tuple[str, ...]
    warnings: tuple[str, ...]


def clean_emg(recording: Recording, *, band_hz: tuple[float, float] | None = None) -> CleanEmg:
    """Check the EMG, remove each trial's offset, and hum and movement artefact if there are any.

    Hum is fitted as sinusoids at the multiples of the mains and subtracted, section by section.
    This is a very narrow notch without the transients that a filter has at its ends, and removes at
    most 0.4 % of the EMG's power. Artefact of moving electrodes is removed by a zero-phase
    high-pass at 20 Hz in all trials of that muscle, so that they stay comparable.

    `recording`: recording with raw EMG and its maximum contraction.
    `band_hz` (low, high): band of a further zero-phase band-pass.
    Raises InputError: EMG that cannot be used (`signals.emg_checks.refuse_emg`), or a band beyond
    half the rate.
    """
    if band_hz is not None:
        check_band(*band_hz, recording.sample_rate_hz)
    quality, warnings = refuse_emg(recording)
    rate = recording.sample_rate_hz
    emg = np.array(recording.emg)
    notes: list[str] = []
    for t in range(recording.n_trials):
        part = recording.samples_of(t)
        emg[part] -= emg[part].mean(axis=0)
        for m in np.flatnonzero(quality.humming[t]):
            emg[part, m] = without_hum(emg[part, m], quality.mains_hz, rate)
    for m in np.flatnonzero(quality.moving):
        emg[:, m] = _per_trial_highpass(recording, emg[:, m])
        notes.append(
            f"{quality.muscles[m]}: zero-phase high-pass at {ARTEFACT_HZ:g} Hz in all trials, "
            f"against {100 * quality.artefact[:, m].max():.0f} % of power below it"
        )
    if quality.humming.any():
        worst = np.unravel_index(int(quality.hum.argmax()), quality.hum.shape)
        notes.append(
            f"hum at multiples of {quality.mains_hz:g} Hz taken out of "
            f"{int(quality.humming.sum())} channels (at most {100 * quality.hum[worst]:.0f} % "
            f"of the power, trial {quality.trials[worst[0]]}, {quality.muscles[worst[1]]})"
        )
        warnings = (*warnings, *_hum_left(recording, emg))
    if band_hz is not None:
        for t in range(recording.n_trials):
            part = recording.samples_of(t)
            emg[part] = bandpass(emg[part], *band_hz, rate, axis=0)
        notes.append(f"zero-phase band-pass {band_hz[0]:g} to {band_hz[1]:g} Hz")
    return CleanEmg(emg, tuple(notes), warnings)


def without_hum(emg: FloatArray, mains_hz: float, sample_rate_hz: float) -> FloatArray:
    """Subtract from a channel (S,) the best-fitting sinusoids at the multiples of the mains.

    The mains' true frequency is estimated first, from the power of all multiples together.
    """
    time = np.arange(len(emg)) / sample_rate_hz
    multiples = np.arange(1, int((sample_rate_hz / 2 - 1e-9) // mains_hz) + 1)
    mains = _mains_frequency(emg, time, mains_hz, multiples)
    residual = np.array(emg)
    pieces = max(round(time[-1] / _STRETCH_S), 1)
    for index in np.array_split(np.arange(len(emg)), pieces):
        phase = 2 * np.pi * mains * np.outer(time[index], multiples)
        X = np.hstack([np.cos(phase), np.sin(phase)])
        # X (S, 2 h) c (2 h,) = emg (S,), least squares
        residual[index] -= X @ np.linalg.lstsq(X, emg[index], rcond=None)[0]
    return residual


def _mains_frequency(
    emg: FloatArray, time: FloatArray, mains_hz: float, multiples: np.ndarray
) -> float:
    """Frequency near the nominal one whose multiples have most power, Hz."""
    # a longer record would resolve frequencies between the points of the scan
    n = min(len(emg), int(len(emg) / time[-1] * _STRETCH_S) if time[-1] > 0 else 1)
    scan = mains_hz + np.linspace(-_MAINS_ERROR_HZ, _MAINS_ERROR_HZ, _SCAN)
    # power (F,) = sum over multiples h of |sum_t emg_t exp(-2 pi i h f t)|^2, by powers of one wave
    wave = np.exp(-2j * np.pi * np.outer(scan, time[:n]))
    harmonic, power = wave.copy(), np.zeros(_SCAN)
    for _ in multiples:
        power += np.abs(harmonic @ emg[:n]) ** 2
        harmonic *= wave
    return float(scan[int(power.argmax())])


def _per_trial_highpass(recording: Recording, channel: FloatArray) -> FloatArray:
    from scipy.signal import butter, sosfiltfilt

    sos = butter(
        HIGHPASS_ORDER, ARTEFACT_HZ, btype="high", fs=recording.sample_rate_hz, output="sos"
    )
    clean = np.empty_like(channel)
    for t in range(recording.n_trials):
        part = recording.samples_of(t)
        pad = min(round(3 * recording.sample_rate_hz / ARTEFACT_HZ), part.stop - part.start - 1)
        clean[part] = sosfiltfilt(sos, channel[part], padlen=pad)
    return clean


def _hum_left(recording: Recording, emg: FloatArray) -> tuple[str, ...]:
    """Warn of remaining hum, whose frequency or amplitude drifts."""
    after = emg_quality(recording.with_step("cleaned", emg=emg))
    if not (after.hum > _LEFT).any():
        return ()
    t, m = np.unravel_index(int(after.hum.argmax()), after.hum.shape)
    share = 100 * float(after.hum[t, m])
    return (
        f"EMG: trial {after.trials[t]}, {after.muscles[m]}: {share:.0f} % of the power is still "
        f"{after.mains_hz:g} Hz hum: its amplitude or frequency drifts",
    )


# Standard error of an EMG amplitude, which is the average of a random carrier.
#
# Surface EMG is modelled as ``x(t) = s(t) n(t)``: a slow amplitude times stationary Gaussian noise
# of unit variance and autocorrelation rho. For such noise (an elementary integral of the bivariate
# normal density)
#
#     cov(|n(0)|, |n(k)|) / E|n|^2 = sqrt(1 - rho_k^2) + rho_k asin(rho_k) - 1,
#
# pi/2 - 1 at lag 0, and ``cov(n^2, n'^2) = 2 rho^2``. Averaging with weights h leaves ``var /
# mean^2 = sum_k c_k (h * h)_k``. For a flat band of W Hz smoothed over T seconds this is about
# ``1 / (4 W T)``: the standard error is proportional to the amplitude itself.

#: Longest lag of the autocorrelation: an EMG above 20 Hz is uncorrelated beyond it.
LONGEST_LAG_S: Final = 0.06


def carrier_correlation(
    emg: FloatArray, level: FloatArray, offsets: IntArray, sample_rate_hz: float
) -> FloatArray:
    """Autocorrelation of each muscle's carrier, (L, m), from all trials together.

    `offsets` (T + 1,).
    `emg` (N, m): without offset.
    `level` (N, m): amplitude by which the EMG is divided first; samples where it is 0 are not used.
    """
    from scipy.signal import fftconvolve

    lags = max(int(LONGEST_LAG_S * sample_rate_hz), 1)
    carrier = np.divide(emg, level, out=np.zeros_like(emg), where=level > 0)
    products = np.zeros((lags + 1, emg.shape[1]))
    count = np.zeros((lags + 1, 1))
    for samples in trial_slices(offsets):
        part = carrier[samples]
        correlation = fftconvolve(part, part[::-1], axes=0)[len(part) - 1 :][: lags + 1]
        products[: len(correlation)] += correlation
        count[: len(correlation), 0] += len(part) - np.arange(len(correlation))
    covariance = products / np.maximum(count, 1)
    scale = np.where(covariance[0] > 0, covariance[0], 1.0)
    rho = covariance / scale
    return np.asarray(np.clip(rho, -1.0, 1.0))


def rectified_correlation(rho: FloatArray) -> FloatArray:
    """Compute ``cov(|n|, |n'|) / E|n|^2`` of unit Gaussian noise with correlation rho."""
    return np.asarray(np.sqrt(1 - rho**2) + rho * np.arcsin(rho) - 1)


def squared_correlation(rho: FloatArray) -> FloatArray:
    """Compute ``var(rms) / rms^2`` per unit of averaging: a quarter of ``cov(n^2, n'^2)``."""
    return np.asarray(rho**2 / 2)


def lowpass_overlap(
    cutoff_hz: float, sample_rate_hz: float, order: int, lags: int, *, causal: bool
) -> FloatArray:
    """Autocorrelation ``(h * h)_k`` of a Butterworth low-pass's response at lags 0..lags-1.

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
    """Autocorrelation ``(h * h)_k`` of the mean over `samples`, at lags 0..lags-1."""
    k = np.arange(lags)
    return np.asarray(np.maximum(1 - k / samples, 0.0) / samples)


def relative_sd(correlation: FloatArray, overlap: FloatArray) -> FloatArray:
    """Relative error ``sqrt(sum over all lags of c_k (h * h)_k)`` (m,); c (L, m), h * h (L,)."""
    variance = overlap[0] * correlation[0] + 2 * overlap[1:] @ correlation[1:]
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))
