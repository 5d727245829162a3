"""Raw EMG without offset, mains hum and movement artefact; what was taken out is said."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.records import Recording
from armimpedance.numerics.signals.emg.checks import check_band, refuse_emg
from armimpedance.numerics.signals.emg.quality import ARTEFACT_HZ, emg_quality
from armimpedance.numerics.signals.filters import bandpass

#: Order of the zero-phase high-pass against movement artefact.
HIGHPASS_ORDER: Final = 4
#: Mains are within this of their nominal frequency (Hz), and looked for on so many points.
_MAINS_ERROR_HZ, _SCAN = 0.3, 61
#: Amplitude and phase of hum may differ from one stretch of this length to the next (s).
_STRETCH_S: Final = 5.0
#: Share of hum left that is worth a warning.
_LEFT: Final = 0.05


@dataclass(frozen=True)
class CleanEmg(FrozenRecord):
    """EMG of N samples and m muscles, ready to be rectified.

    Attributes
    ----------
    emg : (N, m)
        V, without offset.
    notes : tuple of str
        Sentences on what was taken out.
    warnings : tuple of str
    """

    emg: Annotated[FloatArray, "n m"]
    notes: tuple[str, ...]
    warnings: tuple[str, ...]


def clean_emg(recording: Recording, *, band_hz: tuple[float, float] | None = None) -> CleanEmg:
    """Check the EMG, take off each trial's offset, hum where there is some, moving electrodes.

    Hum is fitted as sinusoids at the multiples of the mains and subtracted, stretch by stretch: a
    notch as narrow as the record is long, without the transients that a filter has at its ends,
    and 0.4 % of the EMG's power at most goes with it. Movement is taken out by a zero-phase
    high-pass at 20 Hz in all trials of that muscle, so that they stay comparable.

    Parameters
    ----------
    recording : Recording
        Recording with raw EMG and its maximum contraction.
    band_hz : (low, high), optional
        A zero-phase band-pass on top.

    Raises
    ------
    InputError
        EMG that cannot be used (`signals.emg_checks.refuse_emg`), or a band beyond half the rate.
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
    """One channel (S,) less the sinusoids at the multiples of the mains that fit it best.

    The mains' true frequency is looked for first, in the power of all multiples together.
    """
    time = np.arange(len(emg)) / sample_rate_hz
    multiples = np.arange(1, int((sample_rate_hz / 2 - 1e-9) // mains_hz) + 1)
    mains = _mains_frequency(emg, time, mains_hz, multiples)
    left = np.array(emg)
    pieces = max(round(time[-1] / _STRETCH_S), 1)
    for index in np.array_split(np.arange(len(emg)), pieces):
        phase = 2 * np.pi * mains * np.outer(time[index], multiples)
        X = np.hstack([np.cos(phase), np.sin(phase)])
        # X (S, 2 h) c (2 h,) = emg (S,), least squares
        left[index] -= X @ np.linalg.lstsq(X, emg[index], rcond=None)[0]
    return left


def _mains_frequency(
    emg: FloatArray, time: FloatArray, mains_hz: float, multiples: np.ndarray
) -> float:
    """The frequency near the nominal one at whose multiples there is most power, Hz."""
    # a longer record tells frequencies apart that are closer together than the scan's points
    n = min(len(emg), int(len(emg) / time[-1] * _STRETCH_S) if time[-1] > 0 else 1)
    scan = mains_hz + np.linspace(-_MAINS_ERROR_HZ, _MAINS_ERROR_HZ, _SCAN)
    # power (F,) = sum over multiples h of |sum_t emg_t exp(-2 pi i h f t)|^2, by powers of one wave
    wave = np.exp(-2j * np.pi * np.outer(scan, time[:n]))
    one, power = wave.copy(), np.zeros(_SCAN)
    for _ in multiples:
        power += np.abs(one @ emg[:n]) ** 2
        one *= wave
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
    """Hum whose frequency or amplitude drifts is not gone."""
    after = emg_quality(recording.with_step("cleaned", emg=emg))
    if not (after.hum > _LEFT).any():
        return ()
    t, m = np.unravel_index(int(after.hum.argmax()), after.hum.shape)
    share = 100 * float(after.hum[t, m])
    return (
        f"EMG: trial {after.trials[t]}, {after.muscles[m]}: {share:.0f} % of the power is still "
        f"{after.mains_hz:g} Hz hum: its amplitude or frequency drifts",
    )
