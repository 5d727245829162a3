"""Refuse samples that no method can use, and estimate the channels' signal to noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import InputError
from armimpedance.joint.elbow.elbow_result import ChannelSnr
from armimpedance.joint.elbow.samples import JointSamples

SHORTEST_S: Final = 2.0
#: A channel that stays at its extreme for longer than this is clipped (s) ...
CLIPPED_S: Final = 0.01
#: ... if this value is also so many times as frequent as the next one. A smooth peak of a quantised
#: signal stays at its top level about 2.4 times as long as at the level below.
HEAPED: Final = 8.0
#: A sensor whose value does not change for longer than this is stuck (s).
STUCK_S: Final = 0.5
#: Largest motion of a joint about its operating point (rad, rms); angles in degrees exceed it.
LARGEST_RMS_RAD: Final = 1.0
#: Uncertainty of the signal to noise of a record of a few seconds (dB).
SNR_SLACK_DB: Final = 0.5


def check_samples(samples: JointSamples) -> None:
    """Refuse samples that no method can use.

    Raises InputError: a trial that is too short, a constant channel, a stuck or a clipped sensor,
    angles that cannot be radians.
    """
    rate = samples.sample_rate_hz
    seconds = np.diff(samples.offsets) / rate
    if seconds.min() < SHORTEST_S:
        row = int(seconds.argmin())
        raise InputError(
            f"trial {samples.trials[row]} lasts {seconds[row]:.2f} s",
            expected=f"{SHORTEST_S:g} s or more",
        )
    for row, trial in enumerate(samples.trials):
        inside = samples.samples_of(row)
        _check_channel(samples.torque[inside], rate, f"torque of trial {trial}")
        _check_channel(samples.angle[inside], rate, f"angle of trial {trial}")
        _check_radians(samples.angle[inside], trial)
        if samples.perturbation is not None and np.ptp(samples.perturbation[inside]) == 0:
            raise InputError(
                f"the perturbation of trial {trial} does not vary",
                expected="one that does, or none",
            )


def _check_radians(angle: FloatArray, trial: str) -> None:
    rms = float(angle.std())
    if rms > LARGEST_RMS_RAD:
        raise InputError(
            f"units: the angle of trial {trial} moves by {rms:.3g} rad rms",
            expected=f"radians, less than {LARGEST_RMS_RAD:g} rms; are these degrees?",
        )


def check_snr(snr: ChannelSnr, lowest_db: float, method: str) -> None:
    """Refuse a channel whose signal to noise is below a method's limit.

    Raises InputError: a channel is below the limit; the message has its dB, the limit and advice.
    """
    for name, level in (("torque", snr.torque_db), ("angle", snr.angle_db)):
        if level is None or level >= lowest_db - SNR_SLACK_DB:
            continue
        if not np.isfinite(level):
            raise InputError(
                f"the {name} holds noise alone", expected="a joint that is perturbed and moves"
            )
        helps = "a stronger perturbation"
        if lowest_db > 5 and level >= 5 - SNR_SLACK_DB:
            helps = f"method iv or output-error, or {helps}"
        raise InputError(
            f"signal to noise of the {name} is {level:.1f} dB, below what method {method} needs",
            expected=f"{lowest_db:g} dB or more; {helps} would help",
        )


def _check_channel(values: FloatArray, rate: float, where: str) -> None:
    low, high = float(values.min()), float(values.max())
    if low == high:
        hint = "the joint does not move" if where.startswith("angle") else "no perturbation"
        raise InputError(f"{where} is {low:g} throughout: {hint}", expected="a varying channel")
    for extreme in (low, high):
        at = values == extreme
        # The cheap test first: a continuous signal reaches its extreme only once.
        if at.sum() <= CLIPPED_S * rate or longest_run(at) <= CLIPPED_S * rate:
            continue
        if at.sum() > HEAPED * _neighbours(values, extreme):
            raise InputError(
                f"{where} stays at its extreme, {extreme:g}, for "
                f"{1e3 * longest_run(at) / rate:.0f} ms: the sensor is clipped",
                expected="samples within the sensor's range",
            )
    still = longest_run(np.diff(values) == 0) / rate
    if still > STUCK_S:
        raise InputError(
            f"{where} does not change for {still:.2f} s: the sensor is stuck",
            expected="a channel that moves throughout",
        )


def longest_run(equal: np.ndarray) -> int:
    """Length of the longest run of True in (S,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], equal.astype(np.int8), [0]])))
    return int((edges[1::2] - edges[::2]).max()) if len(edges) else 0


def _neighbours(values: FloatArray, extreme: float) -> int:
    """Number of samples that have the value next to the extreme."""
    others = values[values != extreme]
    nearest = others[np.abs(others - extreme).argmin()]
    return int((values == nearest).sum())


# Signal to noise of the raw channels, from the channels alone.
#
# Sensor noise is white, the motion of a limb is not: the level at high frequencies is taken as a
# noise floor at all frequencies. The signal to noise is too high if an anti-alias filter in the
# amplifier lowers the floor at high frequencies, or if the noise is not white.

#: Edges of the two bands in which the floor is measured, as shares of the Nyquist frequency.
FLOOR_BAND: Final = (0.5, 0.7, 0.9)
#: Above this signal to noise the floor is rounding or leakage, not sensor noise.
HIGHEST_DB: Final = 110.0
#: A spectrum that falls by more than this factor between the two bands has no visible floor.
STILL_FALLING: Final = 2.0
SEGMENT_S: Final = 1.0


@dataclass(frozen=True, eq=False)
class ChannelSpectrum(FrozenRecord):
    """Averaged power spectrum of one channel, over all trials.

    `frequency_hz` (f,).
    `density` (f,): one-sided, unit^2/Hz.
    `variance`: variance of the channel about each trial's mean.
    `floor`: density of the white noise floor; None if no floor is visible.
    """

    frequency_hz: Annotated[FloatArray, "f"]
    density: Annotated[FloatArray, "f"]
    variance: float
    floor: float | None

    @property
    def noise_variance(self) -> float | None:
        """Variance of the white noise over the whole band."""
        nyquist = float(self.frequency_hz[-1])
        return None if self.floor is None else self.floor * nyquist

    @property
    def snr_db(self) -> float | None:
        """Signal to noise, dB of power; None without a floor, -inf if all is noise."""
        noise = self.noise_variance
        if noise is None:
            return None
        signal = self.variance - noise
        return float(10 * np.log10(signal / noise)) if signal > 0 else -np.inf


@dataclass(frozen=True)
class Spectra:
    """The spectra of both channels."""

    torque: ChannelSpectrum
    angle: ChannelSpectrum

    @property
    def snr(self) -> ChannelSnr:
        """Signal to noise of torque and angle, dB of power over the whole band."""
        return ChannelSnr(self.torque.snr_db, self.angle.snr_db)


def spectra_of(samples: JointSamples) -> Spectra:
    """Spectra of torque and angle with their noise floors.

    `samples`: as recorded; filtered samples have no visible floor.
    """
    channels = (samples.torque, samples.angle)
    return Spectra(*(channel_spectrum(samples, channel) for channel in channels))


def channel_spectrum(samples: JointSamples, channel: FloatArray) -> ChannelSpectrum:
    """Spectrum of a channel (N,) by half-overlapping Hann segments, and its floor."""
    length = min(round(SEGMENT_S * samples.sample_rate_hz), int(np.diff(samples.offsets).min()))
    total, count, squares = np.zeros(length // 2 + 1), 0, 0.0
    window = np.hanning(length)
    for row in range(samples.n_trials):
        trial = channel[samples.samples_of(row)]
        trial = trial - trial.mean()
        squares += float(trial @ trial)
        starts = np.arange(0, len(trial) - length + 1, max(length // 2, 1))
        segments = trial[starts[:, None] + np.arange(length)]
        segments = _without_line(segments)
        total += (np.abs(np.fft.rfft(segments * window, axis=1)) ** 2).sum(axis=0)
        count += len(starts)
    rate = samples.sample_rate_hz
    density = 2 * total / (count * rate * float(window @ window))
    frequency = np.arange(len(density)) * rate / length
    variance = squares / int(samples.offsets[-1])
    return ChannelSpectrum(frequency, density, variance, _floor(frequency, density, variance))


def _without_line(segments: FloatArray) -> FloatArray:
    """Return each segment (n, S) without its mean and slope."""
    t = np.arange(segments.shape[1]) - (segments.shape[1] - 1) / 2
    centred = segments - segments.mean(axis=1, keepdims=True)
    # slope (n,) = centred (n, S) t (S,) / |t|^2
    return np.asarray(centred - np.outer(centred @ t / (t @ t), t))


def _floor(frequency: FloatArray, density: FloatArray, variance: float) -> float | None:
    """Mean density at high frequencies, lines such as hum left out; None if no floor is visible."""
    nyquist = frequency[-1]
    levels = []
    for low, high in zip(FLOOR_BAND[:-1], FLOOR_BAND[1:], strict=True):
        part = density[(frequency >= low * nyquist) & (frequency < high * nyquist)]
        if len(part) == 0:
            return None
        levels.append(float(part[part <= 5 * np.median(part)].mean()))
    floor = float(np.mean(levels))
    if floor * nyquist <= variance * 10 ** (-HIGHEST_DB / 10):
        return None
    return None if levels[0] > STILL_FALLING * levels[1] else floor
