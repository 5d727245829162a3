"""Torque and angle as Fourier coefficients of the band that holds signal.

At the frequencies of a record of length T the equation of motion is exact in continuous time,
``(K - I w^2 + i w B) Theta - Tau = boundary terms``: no hold, no bilinear warping. What the record
owes to its two ends is a polynomial in i w with real coefficients and is fitted along, per trial:
degree one from the equation itself, higher ones from sampling; degree -1 is a slope of the torque.

Noise of the two channels enters with the power ``s_theta^2 |Z|^2 + s_tau^2`` and is independent
from one coefficient to the next (R. Pintelon, J. Schoukens, System Identification, 2nd ed. 2012,
chapter 9). Both variances may depend on the frequency: what a subject adds to the torque does
(see `residual_spectrum`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from armimpedance.arrays import FloatArray
from armimpedance.elbow.snr import channel_spectrum
from armimpedance.elbow.stationary.estimate import without
from armimpedance.elbow.stationary.preparation import Prepared, without_ramp
from armimpedance.errors import EstimationError, InputError

Complex = NDArray[np.complex128]

#: Degree of the polynomial of the record's ends.
END_DEGREE: Final = 4
#: Fewer coefficients than this per trial say nothing beside the ends' polynomial.
FEWEST: Final = 10
_STARTS: Final = 6


@dataclass(frozen=True)
class Bins:
    """One trial's coefficients, unitary: white noise of variance s^2 has ``E|N|^2 = s^2``.

    Attributes
    ----------
    s : (n,) complex
        i w of each.
    torque, angle : (n,) complex
    ends : (n, 6) complex
        Columns of the ends' polynomial, degrees -1 to 4.
    seconds : float
    torque_noise, angle_noise : (n,)
        Variances s_tau^2, s_theta^2 to weigh by.
    """

    s: Complex
    torque: Complex
    angle: Complex
    ends: Complex
    seconds: float
    torque_noise: FloatArray
    angle_noise: FloatArray

    @property
    def frequency_hz(self) -> FloatArray:
        """(n,)."""
        return np.asarray(self.s.imag / (2 * np.pi))

    def of_lines(self, chosen: NDArray[np.bool_]) -> Bins:
        """Some of the n frequencies."""
        return Bins(
            self.s[chosen],
            self.torque[chosen],
            self.angle[chosen],
            self.ends[chosen],
            self.seconds,
            self.torque_noise[chosen],
            self.angle_noise[chosen],
        )

    def noise_power(self, impedance: Complex) -> FloatArray:
        """Power of the equation's noise where the impedance is Z (n,)."""
        return np.asarray(self.angle_noise * np.abs(impedance) ** 2 + self.torque_noise)

    @property
    def powers(self) -> Complex:
        """s^2, s, 1: what I, B and K multiply, (n, 3)."""
        return np.stack([self.s**2, self.s, np.ones_like(self.s)], axis=1)


@dataclass(frozen=True)
class Band:
    """All trials' coefficients and the variances of the channels' white noise (0 = not seen)."""

    trials: tuple[Bins, ...]
    torque_noise: float
    angle_noise: float


def band_of(prepared: Prepared) -> Band:
    """Coefficients of the unfiltered samples from `prepared.lowest_hz` to `band_hz`.

    Raises
    ------
    InputError
        The band holds too few coefficients.
    """
    samples = prepared.source
    rate, trials = samples.sample_rate_hz, []
    torque_noise, angle_noise = (
        channel_spectrum(samples, c).noise_variance or 0.0 for c in (samples.torque, samples.angle)
    )
    # Without noise to weigh by: the error of the angle.
    weigh_angle = 1.0 if angle_noise == 0 == torque_noise else angle_noise
    for row in range(samples.n_trials):
        inside = samples.samples_of(row)
        pair = without_ramp(np.stack([samples.torque[inside], samples.angle[inside]]))
        count = pair.shape[1]
        n = int(prepared.band_hz * count / rate)
        first = max(int(np.ceil(prepared.lowest_hz * count / rate - 1e-9)), 1)
        if n - first + 1 < FEWEST:
            raise InputError(
                f"{max(n - first + 1, 0)} frequencies from {prepared.lowest_hz:g} to "
                f"{prepared.band_hz:.3g} Hz in a trial",
                expected=f"{FEWEST} or more: a longer record or a wider band",
            )
        whole: Complex = np.fft.rfft(pair, axis=1).astype(np.complex128) / np.sqrt(count)
        torque, angle = whole[:, first : n + 1]
        lines = np.arange(first, n + 1)
        relative = 1j * lines / n
        ends = (relative[:, None] ** np.arange(-1, END_DEGREE + 1)).astype(np.complex128)
        s = 2j * np.pi * rate / count * lines
        floors = np.full(len(s), torque_noise), np.full(len(s), weigh_angle)
        trials.append(Bins(s, torque, angle, ends, count / rate, *floors))
    return Band(tuple(trials), torque_noise, angle_noise)


def without_torque_noise(band: Band) -> Band:
    """The same where the torque is known exactly: weights of the angle's error."""
    trials = [
        replace(b, torque_noise=np.zeros(len(b.s)), angle_noise=np.ones(len(b.s)))
        for b in band.trials
    ]
    return Band(tuple(trials), 0.0, band.angle_noise)


def impedance(bins: Bins, values: FloatArray) -> Complex:
    """``Z = I s^2 + B s + K`` (n,)."""
    return np.asarray(bins.powers @ values)


def real_rows(columns: Complex) -> FloatArray:
    """Real above imaginary parts, (2 n, ...)."""
    return np.concatenate([columns.real, columns.imag])


def in_time(rows: FloatArray) -> FloatArray:
    """Weighted rows (2 n, ...) as a series in time (2 n + 2, ...) with the same inner products."""
    n = len(rows) // 2
    padded = np.zeros((n + 2, *rows.shape[1:]), dtype=complex)
    padded[1:-1] = rows[:n] + 1j * rows[n:]
    return np.asarray(np.fft.irfft(padded, axis=0) * np.sqrt(n + 1))


def residual_rows(bins: Bins, values: FloatArray) -> FloatArray:
    """``(Z Theta - Tau) / sd`` less the ends' polynomial, real rows (2 n,): unit variance."""
    Z = impedance(bins, values)
    weight = np.sqrt(2 / bins.noise_power(Z))
    ends = real_rows(bins.ends * weight[:, None])
    return without(ends, real_rows((Z * bins.angle - bins.torque) * weight))[0]


def explained(band: Band, values: FloatArray) -> float:
    """Part of the angle's power in the band that the torque explains by I, B and K."""
    left = whole = 0.0
    for bins in band.trials:
        Z = impedance(bins, values)
        ends = real_rows(bins.ends / Z[:, None])
        error, angle = without(ends, real_rows(bins.angle - bins.torque / Z), real_rows(bins.angle))
        left, whole = left + float(error @ error), whole + float(angle @ angle)
    return 1 - left / whole


def start_values(band: Band) -> FloatArray:
    """Rough positive I, B, K (3,) by linear least squares, weights from the fit before.

    Raises
    ------
    EstimationError
        The torque takes energy from the joint at all frequencies together: its sign is wrong.
    """
    _refuse_wrong_sign(band)
    weights = [np.sqrt(2 / b.noise_power(_rough(b))) for b in band.trials]
    values = np.ones(3)
    for _ in range(_STARTS):
        tables = []
        for bins, w in zip(band.trials, weights, strict=True):
            columns = np.column_stack([bins.powers * bins.angle[:, None], bins.torque])
            ends = real_rows(bins.ends * w[:, None])
            tables.append(without(ends, real_rows(columns * w[:, None]))[0])
        table = np.concatenate(tables)
        scale = np.linalg.norm(table[:, :3], axis=0)
        # X (n, 3) [I B K] (3,) = Tau (n,)
        values = np.linalg.lstsq(table[:, :3] / scale, table[:, 3], rcond=None)[0] / scale
        # A parameter lost in the noise starts small, at a tenth of what would be seen.
        values = np.maximum(values, 0.1 * np.linalg.norm(table[:, 3]) / scale / 10)
        weights = [np.sqrt(2 / b.noise_power(impedance(b, values))) for b in band.trials]
    return np.asarray(values)


def _rough(bins: Bins) -> Complex:
    """|Z| from smoothed powers, (n,)."""
    kernel = np.ones(5) / 5
    torque = np.convolve(np.abs(bins.torque) ** 2, kernel, mode="same")
    angle = np.convolve(np.abs(bins.angle) ** 2, kernel, mode="same")
    return np.sqrt(torque / np.maximum(angle, np.finfo(float).tiny)).astype(complex)


def _refuse_wrong_sign(band: Band) -> None:
    work = sum(float((b.torque * np.conj(b.s * b.angle)).real.sum()) for b in band.trials)
    size = sum(float(np.abs(b.torque * b.s * b.angle).sum()) for b in band.trials)
    if work < -0.1 * size:
        raise EstimationError(
            "B comes out negative: the torque takes energy from the joint; it seems to have the "
            "wrong sign (force_by), or the subject drives the motion"
        )
