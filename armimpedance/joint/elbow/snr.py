"""Signal to noise of the raw channels, from the channels alone.

Sensors' noise is white, the motion of a limb is not: what is left high up in the spectrum is taken
as a floor that reaches down to zero frequency. An anti-alias filter in the amplifier lowers the
floor that is seen there, and noise that is not white is not seen at all: the figure is then too
good.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.joint.elbow.result import ChannelSnr
from armimpedance.joint.elbow.samples import JointSamples

#: The floor is read between these parts of the Nyquist frequency, in two halves.
FLOOR_BAND: Final = (0.5, 0.7, 0.9)
#: Above this the spectrum's top is rounding or leakage, not a sensor.
HIGHEST_DB: Final = 110.0
#: A spectrum that still falls by this factor from one half to the other shows no floor.
STILL_FALLING: Final = 2.0
SEGMENT_S: Final = 1.0


@dataclass(frozen=True, eq=False)
class ChannelSpectrum(FrozenRecord):
    """Averaged power spectrum of one channel, over all trials.

    Attributes
    ----------
    frequency_hz : (f,)
    density : (f,)
        One-sided, unit^2/Hz.
    variance : float
        Variance of the channel about each trial's mean.
    floor : float or None
        Density of the white floor; None where none is seen.
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
        """dB of power, signal over noise; None without a floor, -inf where all is noise."""
        noise = self.noise_variance
        if noise is None:
            return None
        signal = self.variance - noise
        return float(10 * np.log10(signal / noise)) if signal > 0 else -np.inf


@dataclass(frozen=True)
class Spectra:
    """The spectra of both channels.

    Attributes
    ----------
    torque, angle : ChannelSpectrum
    """

    torque: ChannelSpectrum
    angle: ChannelSpectrum

    @property
    def snr(self) -> ChannelSnr:
        """Signal to noise of torque and angle, dB of power over the whole band."""
        return ChannelSnr(self.torque.snr_db, self.angle.snr_db)


def spectra_of(samples: JointSamples) -> Spectra:
    """Spectra of torque and angle with their floors.

    Parameters
    ----------
    samples : JointSamples
        As recorded; filtered samples show no floor.
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
    """Each segment (n, S) without its mean and slope."""
    t = np.arange(segments.shape[1]) - (segments.shape[1] - 1) / 2
    centred = segments - segments.mean(axis=1, keepdims=True)
    # slope (n,) = centred (n, S) t (S,) / |t|^2
    return np.asarray(centred - np.outer(centred @ t / (t @ t), t))


def _floor(frequency: FloatArray, density: FloatArray, variance: float) -> float | None:
    """Mean density high up, lines such as hum left out; None where it is none."""
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
