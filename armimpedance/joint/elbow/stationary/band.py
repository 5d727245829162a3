"""Torque and angle as Fourier coefficients of the band that holds signal.

At the frequencies of a record of length T the equation of motion is exact in continuous time,
``(K - I w^2 + i w B) Theta - Tau = boundary terms``: no hold, no bilinear warping. The boundary
terms come from the two ends of the record. They are a polynomial in i w with real coefficients, and
are fitted for each trial: degree one from the equation itself, higher ones from sampling; degree -1
is a slope of the torque.

The noise of the two channels has the power ``s_theta^2 |Z|^2 + s_tau^2`` and is independent
from one coefficient to the next (R. Pintelon, J. Schoukens, System Identification, 2nd ed. 2012,
chapter 9). Both variances may depend on the frequency, as that of a subject's torque does (see
`weights`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.core.errors import InputError
from armimpedance.joint.elbow.samples import JointSamples
from armimpedance.joint.elbow.stationary.estimate import without
from armimpedance.joint.elbow.stationary.preparation import PreparedSamples, without_ramp

Complex = NDArray[np.complex128]

#: Source of the instruments: a recorded perturbation or command, or the imposed quantity.
Source = Literal["perturbation", "command", "torque", "angle"]

#: Degree of the polynomial that describes the record's ends.
END_DEGREE: Final = 4
#: Least number of coefficients per trial, given the ends' polynomial.
FEWEST: Final = 10


@dataclass(frozen=True, eq=False)
class Bins:
    """Fourier coefficients of one trial, unitary: white noise of variance s^2 has ``E|N|^2 = s^2``.

    `torque`, `angle` (n,) complex.
    `s` (n,) complex: i w of each.
    `ends` (n, 6) complex: columns of the ends' polynomial, degrees -1 to 4.
    `torque_noise`, `angle_noise` (n,): variances s_tau^2, s_theta^2 for the weights.
    `perturbation` (n,) complex or None: the torque that the device was commanded to add.
    `command` (n,) complex or None: the angle that it was commanded to take.
    """

    s: Complex
    torque: Complex
    angle: Complex
    ends: Complex
    seconds: float
    torque_noise: FloatArray
    angle_noise: FloatArray
    perturbation: Complex | None = None
    command: Complex | None = None

    @property
    def frequency_hz(self) -> FloatArray:
        """Frequencies (n,)."""
        return np.asarray(self.s.imag / (2 * np.pi))

    def of_lines(self, chosen: BoolArray) -> Bins:
        """Coefficients at selected frequencies, without the perturbation."""
        return Bins(
            self.s[chosen],
            self.torque[chosen],
            self.angle[chosen],
            self.ends[chosen],
            self.seconds,
            self.torque_noise[chosen],
            self.angle_noise[chosen],
        )

    @cached_property
    def powers(self) -> Complex:
        """Powers s^2, s, 1: the factors of I, B and K, (n, 3)."""
        return np.stack([self.s**2, self.s, np.ones_like(self.s)], axis=1)

    def impedance(self, values: FloatArray) -> Complex:
        """Impedance ``Z = I s^2 + B s + K`` (n,) from I, B, K (3,)."""
        return np.asarray(self.powers @ values)

    def noise_power(self, impedance: Complex) -> FloatArray:
        """Noise power of the equation for an impedance Z (n,)."""
        return np.asarray(self.angle_noise * np.abs(impedance) ** 2 + self.torque_noise)

    def weight(self, impedance: Complex) -> FloatArray:
        """One over the standard deviation of real and imaginary part of that noise, (n,)."""
        return np.asarray(np.sqrt(2 / self.noise_power(impedance)))

    def free(self, weight: FloatArray, columns: Complex) -> FloatArray:
        """Weighted columns (n, ...) as real rows (2 n, ...), without the ends' polynomial."""
        weighed = columns * (weight if columns.ndim == 1 else weight[:, None])
        return without(real_rows(self.ends * weight[:, None]), real_rows(weighed))[0]

    def residual(self, values: FloatArray) -> FloatArray:
        """Weighted residual ``(Z Theta - Tau) / sd`` at I, B, K (3,), real rows (2 n,) of unit
        variance.
        """
        Z = self.impedance(values)
        return self.free(self.weight(Z), Z * self.angle - self.torque)


@dataclass(frozen=True, eq=False)
class Band:
    """Coefficients of all trials, and the variances of the channels' white noise (0 = not
    detected).

    `source`: source of the instruments. "torque": the torque is imposed, and the subject's torque
    moves the joint. "angle": the angle is imposed, and the subject's torque is part of the measured
    torque only.
    """

    trials: tuple[Bins, ...]
    torque_noise: float
    angle_noise: float
    source: Source = "torque"

    @property
    def rows(self) -> int:
        """Number of real rows of all trials, less those for the ends' polynomials."""
        return sum(2 * len(b.s) - b.ends.shape[1] for b in self.trials)

    @property
    def under_perturbation(self) -> Band | None:
        """Band with the perturbation as torque, known exactly; weights are those of the angle's
        error.

        None if it was not recorded.
        """
        trials = []
        for bins in self.trials:
            if bins.perturbation is None:
                return None
            zero, one = np.zeros(len(bins.s)), np.ones(len(bins.s))
            exact = replace(bins, torque=bins.perturbation, torque_noise=zero, angle_noise=one)
            trials.append(exact)
        return Band(tuple(trials), 0.0, self.angle_noise)


def source_of(samples: JointSamples) -> Source | None:
    """Source of the instruments; None if it must be inferred from the record."""
    if samples.imposed == "position":
        return "angle" if samples.command is None else "command"
    if samples.perturbation is not None:
        return "perturbation"
    if samples.imposed == "torque":
        return "torque"
    return None if samples.command is None else "command"


def band_of(prepared: PreparedSamples, source: Source | None = None) -> Band:
    """Coefficients of the unfiltered samples from `prepared.lowest_hz` to `band_hz`.

    `source`: of the instruments; by default what was recorded or stated, else the torque.
    Raises InputError: the band holds too few coefficients.
    """
    source = source or source_of(prepared.source) or "torque"
    spectra = prepared.spectra
    noises = (spectra.torque.noise_variance or 0.0, spectra.angle.noise_variance or 0.0)
    # Without a noise floor: weights for an error of the channel that is not imposed.
    unseen = (1.0, 0.0) if source == "angle" else (0.0, 1.0)
    weigh = noises if any(noises) else unseen
    trials = tuple(_bins(prepared, row, *weigh) for row in range(prepared.n_trials))
    return Band(trials, *noises, source)


def _bins(prepared: PreparedSamples, row: int, torque_noise: float, angle_noise: float) -> Bins:
    samples, inside = prepared.source, prepared.source.samples_of(row)
    count, rate = inside.stop - inside.start, samples.sample_rate_hz
    n = int(prepared.band_hz * count / rate)
    first = max(int(np.ceil(prepared.lowest_hz * count / rate - 1e-9)), 1)
    if n - first + 1 < FEWEST:
        raise InputError(
            f"{max(n - first + 1, 0)} frequencies from {prepared.lowest_hz:g} to "
            f"{prepared.band_hz:.3g} Hz in a trial",
            expected=f"{FEWEST} or more: a longer record or a wider band",
        )

    def pair(torque: FloatArray) -> Complex:
        """Coefficients of a torque and the angle, (2, n)."""
        both = without_ramp(np.stack([torque[inside], samples.angle[inside]]))
        whole: Complex = np.fft.rfft(both, axis=1).astype(np.complex128) / np.sqrt(count)
        return whole[:, first : n + 1]

    torque, angle = pair(samples.torque)
    lines = np.arange(first, n + 1)
    relative = 1j * lines / n
    return Bins(
        s=2j * np.pi * rate / count * lines,
        torque=torque,
        angle=angle,
        ends=(relative[:, None] ** np.arange(-1, END_DEGREE + 1)).astype(np.complex128),
        seconds=count / rate,
        torque_noise=np.full(len(lines), torque_noise),
        angle_noise=np.full(len(lines), angle_noise),
        perturbation=None if samples.perturbation is None else pair(samples.perturbation)[0],
        command=None if samples.command is None else pair(samples.command)[0],
    )


def real_rows(columns: Complex) -> FloatArray:
    """Real parts above imaginary parts, (2 n, ...)."""
    return np.concatenate([columns.real, columns.imag])


def in_time(rows: FloatArray) -> FloatArray:
    """Weighted rows (2 n, ...) as a time series (2 n + 2, ...) with the same inner products."""
    n = len(rows) // 2
    padded = np.zeros((n + 2, *rows.shape[1:]), dtype=complex)
    padded[1:-1] = rows[:n] + 1j * rows[n:]
    return np.asarray(np.fft.irfft(padded, axis=0) * np.sqrt(n + 1))


# Share of the motion that I, B and K explain.


def explained(band: Band, values: FloatArray) -> float:
    """Share of the angle's power in the band that the torque explains by I, B and K (3,)."""
    unexplained = whole = 0.0
    for bins in band.trials:
        Z = bins.impedance(values)
        ends, columns = bins.ends / Z[:, None], (bins.angle - bins.torque / Z, bins.angle)
        error, angle = without(real_rows(ends), *map(real_rows, columns))
        unexplained, whole = unexplained + float(error @ error), whole + float(angle @ angle)
    return 1 - unexplained / whole
