"""Torque and angle at the rate that their motion needs, and the torque's autoregression.

A product with a varying factor must not be filtered: ``F[K theta] != K F[theta]``. So only the two
measured channels pass an anti-aliasing filter, whose edge lies far above the motion. Later weights
over frequency are part of the noise covariance of the equation.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, Final, NamedTuple

import numpy as np
from scipy.linalg import toeplitz

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.core.errors import InputError
from armimpedance.joint.elbow.checks import check_samples, spectra_of
from armimpedance.joint.elbow.elbow_result import ChannelSnr
from armimpedance.joint.elbow.samples import JointSamples

# The subject's own torque as an autoregression, and the operator that makes it white.
#
#     v_t = a_1 v_(t-1) + ... + a_p v_(t-p) + w_t,      w ~ sd^2
#
# One pole near 1 is an Ornstein-Uhlenbeck process (slow voluntary torque); a pair of poles near the
# unit circle is a tremor. The operator A with ``A Cov(v) A^T = sd^2 1`` is banded: row t is ``(1,
# -a_1, ..., -a_p)``; the first p rows of a trial, which lack their past, follow from the stationary
# covariance.


@dataclass(frozen=True, eq=False)
class Autoregression:
    """A stationary process of order p; order 0 with `sd` 0 means no torque at all.

    `coefficients` (p,).
    `sd`: standard deviation of the innovation, N m.
    """

    coefficients: FloatArray = field(default_factory=lambda: np.zeros(0))
    sd: float = 0.0

    @property
    def order(self) -> int:
        """Number p of coefficients."""
        return len(self.coefficients)

    @cached_property
    def covariance(self) -> FloatArray:
        """Autocovariance at lags 0 to p, (p + 1,), N m^2, from the Yule-Walker equations."""
        p = self.order
        # M (p + 1, p + 1) r = (sd^2, 0, ...)
        M = np.zeros((p + 1, p + 1))
        row = np.concatenate([[1.0], -self.coefficients])
        for i in range(p + 1):
            for j in range(p + 1):
                M[i, abs(i - j)] += row[j]
        right = np.zeros(p + 1)
        right[0] = self.sd**2
        return np.asarray(np.linalg.solve(M, right))

    @property
    def rms(self) -> float:
        """Root mean square of the torque, N m."""
        return float(np.sqrt(self.covariance[0]))

    def slower(self, factor: float) -> Autoregression:
        """Process with the same innovation, but the longest real time constant times `factor`."""
        # poles z (p,) of z^p = a_1 z^(p - 1) + ... + a_p
        poles = np.roots(np.append(1.0, -self.coefficients)).astype(complex)
        real = np.flatnonzero((np.abs(poles.imag) < 1e-9) & (poles.real > 0))
        if not len(real):
            return self
        slowest = real[poles[real].real.argmax()]
        poles[slowest] = poles[slowest].real ** (1 / factor)
        return Autoregression(np.asarray(-np.poly(poles).real[1:], dtype=np.float64), self.sd)

    def spectrum(self, frequency: FloatArray) -> FloatArray:
        """Power per sample at frequencies (f,) in cycles per sample; its mean is the variance."""
        return self.spectrum_at(phases(frequency, self.order))

    def spectrum_at(self, phase: Phases) -> FloatArray:
        """Power per sample at `phases` of p lags."""
        return self.with_slope_at(phase)[0]

    def with_slope_at(self, phase: Phases) -> tuple[FloatArray, FloatArray]:
        """Power at `phases` (f,), and its derivative by the coefficients (f, p)."""
        # S = sd^2 / |e|^2 with e = 1 - phase a (f,):  dS/da_k = 2 S Re(e* phase_k) / |e|^2
        real, imaginary = 1 - phase.cosine @ self.coefficients, phase.sine @ self.coefficients
        square = real**2 + imaginary**2
        power = self.sd**2 / square
        turned = real[:, None] * phase.cosine - imaginary[:, None] * phase.sine
        return power, 2 * (power / square)[:, None] * turned

    def operator(self, lengths: IntArray) -> FloatArray:
        """Operator A of trials with these numbers of rows, lower banded: ``A[i, i - k]`` at [k, i],
        (p + 1, R).
        """
        p, R = self.order, int(np.sum(lengths))
        A = np.zeros((p + 1, R))
        A[0], A[1:] = 1.0, -self.coefficients[:, None]
        first = self._first
        start = 0
        for length in lengths:
            for i in range(min(p, int(length))):
                A[:, start + i] = 0.0
                A[: i + 1, start + i] = first[i, i::-1]
            start += int(length)
        return A

    @cached_property
    def _first(self) -> FloatArray:
        """The first p rows of A, (p, p): sd times the inverse Cholesky factor of Cov(v)."""
        if not self.order:
            return np.zeros((0, 0))
        lower = np.linalg.cholesky(toeplitz(self.covariance[:-1]))
        return np.asarray(self.sd * np.linalg.inv(lower))


class Phases(NamedTuple):
    """Phases ``exp(-2 pi i f k)`` of lags k = 1 to p: real part, and minus the imaginary part, (f,
    p).
    """

    cosine: FloatArray
    sine: FloatArray


def phases(frequency: FloatArray, order: int) -> Phases:
    """Phases at frequencies (f,) in cycles per sample."""
    angle = 2 * np.pi * frequency[:, None] * np.arange(1, order + 1)
    return Phases(np.cos(angle), np.sin(angle))


def applied(operator: FloatArray, columns: FloatArray) -> FloatArray:
    """Product ``A columns`` for A of `Autoregression.operator` and columns (R, q)."""
    out = operator[0][:, None] * columns
    for k in range(1, len(operator)):
        out[k:] += operator[k, k:, None] * columns[: len(columns) - k]
    return np.asarray(out)


def transposed(operator: FloatArray, columns: FloatArray) -> FloatArray:
    """Product ``A^T columns`` for A of `Autoregression.operator` and columns (R, q)."""
    out = operator[0][:, None] * columns
    for k in range(1, len(operator)):
        out[: len(columns) - k] += operator[k, k:, None] * columns[k:]
    return np.asarray(out)


def from_reflections(reflections: FloatArray, sd: float) -> Autoregression:
    """Stable process with reflection coefficients (p,) within -1..1 (Levinson's recursion)."""
    a = np.zeros(0)
    for r in reflections:
        a = np.append(a - r * a[::-1], r)
    return Autoregression(a, sd)


def by_reflection(reflections: FloatArray) -> FloatArray:
    """Derivative (p, p) of the coefficients of `from_reflections` by the reflection
    coefficients."""
    a, slope = np.zeros(0), np.zeros((0, len(reflections)))
    for k, r in enumerate(reflections):
        own = np.eye(1, len(reflections), k)
        slope = np.vstack([slope - r * slope[::-1] - a[::-1, None] * own, own])
        a = np.append(a - r * a[::-1], r)
    return slope


def reflections_of(covariance: FloatArray) -> tuple[FloatArray, float]:
    """Reflection coefficients (p,) and innovation variance from autocovariances (p + 1,)."""
    a, variance = np.zeros(0), float(covariance[0])
    out = []
    for k in range(1, len(covariance)):
        r = (covariance[k] - a @ covariance[k - 1 : 0 : -1]) / variance
        r = float(np.clip(r, -0.999, 0.999))
        out.append(r)
        a = np.append(a - r * a[::-1], r)
        variance *= 1 - r**2
    return np.array(out), variance


#: Samples per period of the perturbation's highest frequency that the differences need.
SAMPLES_PER_PERIOD: Final = 8.0
#: Share of the torque's power in the band.
BAND_POWER: Final = 0.995
#: Default upper end of the band: above it a limb in a device is not a single inertia (soft tissue,
#: straps, the device's own resonance), and B and K have little effect.
HIGHEST_HZ: Final = 20.0
#: Lowest rate, Hz: high enough for the resonance of a stiff elbow.
LOWEST_RATE_HZ: Final = 60.0
#: Below this the first linearisation may lead to a wrong minimum, dB (10 dB was tested as safe).
LOWEST_SNR_DB: Final = 9.0
#: Width over which the spectrum is averaged to find its edge, Hz.
SPECTRUM_HZ: Final = 1.0
#: Band in which the floor of white noise is measured, as shares of the Nyquist frequency.
FLOOR_BAND: Final = (0.5, 0.95)
#: Least noise as a share of a signal's rms: the error of the differences.
LEAST_NOISE: Final = 3e-4
#: Decimated samples at each end of a trial that the anti-aliasing filter spoils.
EDGE: Final = 4


@dataclass(frozen=True, eq=False)
class VaryingData(FrozenRecord):
    """Decimated torque and angle of T trials without their means, and their noise.

    `trials` (T,) tuple of str, `offsets` (T + 1,) int.
    `torque`, `angle` (N,): N m on the limb, rad.
    `sd_torque`, `sd_angle` (T,): standard deviation of white noise at this rate with the density of
    the raw channel's noise.
    `snr`: signal to noise of the raw channels.
    `every`: raw samples per decimated sample.
    `own`: process of the subject's own torque; at first none.
    """

    rate_hz: float
    trials: Annotated[tuple[str, ...], "t"]
    offsets: Annotated[IntArray, "t+1"]
    torque: Annotated[FloatArray, "n"]
    angle: Annotated[FloatArray, "n"]
    sd_torque: Annotated[FloatArray, "t"]
    sd_angle: Annotated[FloatArray, "t"]
    snr: ChannelSnr
    every: int
    notes: tuple[str, ...] = ()
    own: Autoregression = field(default_factory=Autoregression)

    @property
    def trial_of(self) -> IntArray:
        """Number of the trial of each sample, from 0, (N,)."""
        return np.repeat(np.arange(len(self.trials)), np.diff(self.offsets))

    @property
    def time_s(self) -> FloatArray:
        """Time from each trial's first sample, s, (N,)."""
        start = np.repeat(self.offsets[:-1], np.diff(self.offsets))
        return np.asarray((np.arange(len(self.torque)) - start) / self.rate_hz)


def varying_data(samples: JointSamples, cutoff_hz: float | None = None) -> VaryingData:
    """Decimate, remove the operating point, and measure the noise of the raw channels.

    `cutoff_hz`: highest frequency of the motion that is used; None: from the torque's spectrum, at
    most `HIGHEST_HZ`.
    Raises InputError: samples that no method can use (`checks.check_samples`), too much noise, or a
    cut-off not below half of the rate.
    """
    rate = samples.sample_rate_hz
    rows = [samples.samples_of(t) for t in range(samples.n_trials)]
    check_samples(samples)
    snr = spectra_of(samples).snr
    _refuse_noise(snr)
    torque_band = _band(samples, rows)
    band = min(torque_band, HIGHEST_HZ) if cutoff_hz is None else cutoff_hz
    if not 0 < band < rate / 2:
        raise InputError(
            f"band edge {band:g} Hz of samples at {rate:g} Hz",
            expected=f"between 0 and {rate / 2:g} Hz, half of the rate",
        )
    every = max(int(rate / max(SAMPLES_PER_PERIOD * band, LOWEST_RATE_HZ)), 1)
    torque = [decimated(samples.torque[r] - samples.torque[r].mean(), every) for r in rows]
    angle = [decimated(samples.angle[r] - samples.angle[r].mean(), every) for r in rows]
    noise = np.array([[_floor(samples.torque[r]), _floor(samples.angle[r])] for r in rows])
    power = np.array([[samples.torque[r].var(), samples.angle[r].var()] for r in rows])
    least = LEAST_NOISE**2 * power
    at_rate = np.sqrt(np.maximum(noise / every, least))
    return VaryingData(
        rate_hz=rate / every,
        trials=samples.trials,
        offsets=np.concatenate([[0], np.cumsum([len(x) for x in torque])]),
        torque=np.concatenate(torque),
        angle=np.concatenate(angle),
        sd_torque=at_rate[:, 0],
        sd_angle=at_rate[:, 1],
        snr=snr,
        every=every,
        notes=(
            f"each trial's mean torque and angle taken off; band to {band:.3g} Hz, decimated from "
            f"{rate:g} to {rate / every:.4g} Hz behind a zero-phase filter",
            *_above(band, torque_band),
        ),
    )


def decimated(signal: FloatArray, every: int) -> FloatArray:
    """Every n-th sample of a trial (S,) after a zero-phase anti-aliasing filter.

    The ends are continued by point reflection.
    """
    from scipy.signal import resample_poly

    if every == 1:
        return np.array(signal)
    pad = every * min(12, (len(signal) - 1) // every)
    longer = np.concatenate(
        [
            2 * signal[0] - signal[pad:0:-1],
            signal,
            2 * signal[-1] - signal[-2 : -2 - pad : -1],
        ]
    )
    count = -(-len(signal) // every)
    first = pad // every
    return np.asarray(resample_poly(longer, 1, every)[first : first + count])


def decimated_amplitudes(
    samples: JointSamples,
    every: int,
    amplitude: FloatArray | None,
    sd: FloatArray | None,
) -> tuple[FloatArray, FloatArray | None]:
    """Amplitudes (N, m) at the decimated rate, (N', m), and their standard errors.

    Raises InputError: no amplitudes, amplitudes of other samples, or impossible standard errors.
    """
    if amplitude is None:
        raise InputError("method 'emg' without EMG amplitudes", expected="amplitude (N, m)")
    values = np.asarray(amplitude, dtype=np.float64)
    if values.ndim != 2 or len(values) != len(samples.torque) or not np.isfinite(values).all():
        raise InputError(
            f"EMG amplitudes of shape {values.shape}",
            expected=f"({len(samples.torque)}, muscles), finite",
        )
    rows = [samples.samples_of(t) for t in range(samples.n_trials)]
    columns = [
        np.concatenate([decimated(values[r, j], every) for r in rows])
        for j in range(values.shape[1])
    ]
    if sd is None:
        return np.stack(columns, axis=1), None
    errors = np.asarray(sd, dtype=np.float64)
    if errors.shape != (values.shape[1],) or not (np.isfinite(errors) & (errors >= 0)).all():
        raise InputError(
            f"standard errors {errors} of the amplitudes",
            expected=f"{values.shape[1]} numbers, 0 or more",
        )
    return np.stack(columns, axis=1), errors


def _spectrum(signal: FloatArray) -> FloatArray:
    """Periodogram of a Hann-tapered signal whose mean over all frequencies is its variance."""
    taper = np.hanning(len(signal))
    power = np.abs(np.fft.rfft((signal - signal.mean()) * taper)) ** 2
    return np.asarray(power / (taper**2).sum())


def _floor(signal: FloatArray) -> float:
    """Variance of white noise with the density measured near the Nyquist frequency.

    This is a number for each trial, even if `snr` detects no floor because the spectrum still
    falls: the covariance of the equation needs one.
    """
    power = _spectrum(signal)
    low, high = (int(part * len(power)) for part in FLOOR_BAND)
    return float(power[low:high].mean())


def _band(samples: JointSamples, rows: list[slice]) -> float:
    """Frequency below which `BAND_POWER` of the torque's power above the floor lies, Hz."""
    edges = []
    for row in rows:
        torque = samples.torque[row]
        width = max(round(SPECTRUM_HZ * len(torque) / samples.sample_rate_hz), 1)
        power = np.convolve(_spectrum(torque), np.full(width, 1 / width), "same")
        floor = _floor(torque)
        seen = np.where(power > 2 * floor, power - floor, 0.0)
        share = np.cumsum(seen) / max(seen.sum(), np.finfo(float).tiny)
        edge = max(int(np.searchsorted(share, BAND_POWER)), 1)
        edges.append(edge * samples.sample_rate_hz / len(torque))
    return float(min(max(edges), samples.sample_rate_hz / 2 * 0.99))


def _above(band_hz: float, torque_hz: float) -> tuple[str, ...]:
    """Note if the torque's spectrum reaches far beyond the band."""
    if torque_hz < 1.2 * band_hz:
        return ()
    return (f"the torque reaches up to {torque_hz:.3g} Hz: what is above the band is left out",)


def _refuse_noise(snr: ChannelSnr) -> None:
    for name, db in (("torque", snr.torque_db), ("angle", snr.angle_db)):
        if db is not None and db < LOWEST_SNR_DB:
            raise InputError(
                f"signal to noise of the {name} is {db:.1f} dB",
                expected=f"{LOWEST_SNR_DB:g} dB or more for a course over time; a stronger "
                "perturbation, or a method for a constant joint",
            )
