"""Torque and angle at the rate that their motion needs, with the noise of each.

What varies must not be filtered after it was multiplied: ``F[K theta] != K F[theta]``. So the two
measured channels alone go through one anti-aliasing filter whose edge lies far above the motion,
and whatever weighs frequencies afterwards does so through the noise covariance of the equation.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.core.errors import InputError
from armimpedance.joint.elbow.checks import check_samples
from armimpedance.joint.elbow.result import ChannelSnr
from armimpedance.joint.elbow.samples import JointSamples
from armimpedance.joint.elbow.snr import spectra_of
from armimpedance.joint.elbow.varying.autoregression import Autoregression

#: Samples per period of the highest frequency of the perturbation: what the differences need.
SAMPLES_PER_PERIOD: Final = 8.0
#: The band holds this part of the torque's power.
BAND_POWER: Final = 0.995
#: Unless told otherwise the band ends here: above, a limb in a device is no longer one inertia
#: (soft tissue, straps, the device's own resonance), and little of B and K shows there.
HIGHEST_HZ: Final = 20.0
#: Lowest rate, Hz: two thirds of it below the resonance of a stiff elbow.
LOWEST_RATE_HZ: Final = 60.0
#: Below this the first linearisation may lead to another minimum, dB (10 dB is measured sound).
LOWEST_SNR_DB: Final = 9.0
#: The spectrum is averaged over this band before its edge is read, Hz.
SPECTRUM_HZ: Final = 1.0
#: Part of the Nyquist band that is read as the floor of white noise.
FLOOR_BAND: Final = (0.5, 0.95)
#: Noise below this part of a signal's rms is set to it: the differences err as much.
LEAST_NOISE: Final = 3e-4
#: Decimated samples that the ends of a trial lose to the anti-aliasing filter.
EDGE: Final = 4


@dataclass(frozen=True, eq=False)
class VaryingData(FrozenRecord):
    """Decimated torque and angle of T trials, means taken off, with their noise.

    Attributes
    ----------
    rate_hz : float
    trials : (T,) tuple of str
    offsets : (T + 1,) int
    torque, angle : (N,)
        N m on the limb, rad.
    sd_torque, sd_angle : (T,)
        Standard deviation of white noise at this rate with the density that the raw channel shows.
    snr : ChannelSnr
        Signal to noise of the raw channels.
    every : int
        Raw samples per sample.
    notes : tuple of str
    own : Autoregression
        The torque that the subject adds unasked, one draw per trial; none at first.
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
        """From each trial's first sample, (N,)."""
        start = np.repeat(self.offsets[:-1], np.diff(self.offsets))
        return np.asarray((np.arange(len(self.torque)) - start) / self.rate_hz)


def varying_data(samples: JointSamples, cutoff_hz: float | None = None) -> VaryingData:
    """Decimate, take the operating point off, and read the noise off the raw channels.

    Parameters
    ----------
    samples : JointSamples
    cutoff_hz : float or None
        Highest frequency of the motion that counts; None: from the torque's spectrum, at most
        `HIGHEST_HZ`.

    Raises
    ------
    InputError
        Samples that no method can use (`checks.check_samples`), too much noise, or a cut-off beyond
        what the rate holds.
    """
    rate = samples.sample_rate_hz
    rows = [samples.samples_of(t) for t in range(samples.n_trials)]
    check_samples(samples)
    snr = spectra_of(samples).snr
    _refuse_noise(snr)
    held = _band(samples, rows)
    band = min(held, HIGHEST_HZ) if cutoff_hz is None else cutoff_hz
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
            *_above(band, held),
        ),
    )


def decimated(signal: FloatArray, every: int) -> FloatArray:
    """Every n-th sample of a trial (S,) behind a zero-phase anti-aliasing filter.

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

    Raises
    ------
    InputError
        No amplitudes, others than of these samples, or standard errors that cannot be.
    """
    if amplitude is None:
        raise InputError("method 'emg' without EMG amplitudes", expected="amplitude (N, m)")
    given = np.asarray(amplitude, dtype=np.float64)
    if given.ndim != 2 or len(given) != len(samples.torque) or not np.isfinite(given).all():
        raise InputError(
            f"EMG amplitudes of shape {given.shape}",
            expected=f"({len(samples.torque)}, muscles), finite",
        )
    rows = [samples.samples_of(t) for t in range(samples.n_trials)]
    columns = [
        np.concatenate([decimated(given[r, j], every) for r in rows]) for j in range(given.shape[1])
    ]
    if sd is None:
        return np.stack(columns, axis=1), None
    errors = np.asarray(sd, dtype=np.float64)
    if errors.shape != (given.shape[1],) or not (np.isfinite(errors) & (errors >= 0)).all():
        raise InputError(
            f"standard errors {errors} of the amplitudes",
            expected=f"{given.shape[1]} numbers, 0 or more",
        )
    return np.stack(columns, axis=1), errors


def _spectrum(signal: FloatArray) -> FloatArray:
    """Periodogram of a Hann-tapered signal whose mean over all frequencies is its variance."""
    taper = np.hanning(len(signal))
    power = np.abs(np.fft.rfft((signal - signal.mean()) * taper)) ** 2
    return np.asarray(power / (taper**2).sum())


def _floor(signal: FloatArray) -> float:
    """Variance of white noise with the density seen near the Nyquist frequency.

    Always a number, of each trial: the covariance of the equation needs one, also where `snr` sees
    no floor because the spectrum still falls.
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


def _above(band_hz: float, held_hz: float) -> tuple[str, ...]:
    """A sentence where the torque reaches far beyond the band."""
    if held_hz < 1.2 * band_hz:
        return ()
    return (f"the torque reaches up to {held_hz:.3g} Hz: what is above the band is left out",)


def _refuse_noise(snr: ChannelSnr) -> None:
    for name, db in (("torque", snr.torque_db), ("angle", snr.angle_db)):
        if db is not None and db < LOWEST_SNR_DB:
            raise InputError(
                f"signal to noise of the {name} is {db:.1f} dB",
                expected=f"{LOWEST_SNR_DB:g} dB or more for a course over time; a stronger "
                "perturbation, or a method for a constant joint",
            )
