"""Can this raw EMG be used? Flat, saturated, folded, humming, moved electrodes: told by name.

Mains hum and movement artefact below their limits are left alone; above, `signals.emg_cleaning`
takes them out and says so; beyond, the recording is refused.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding, Verdict
from armimpedance.core.records import Recording
from armimpedance.numerics.signals.emg.activation import mvc_column
from armimpedance.numerics.signals.emg.quality import (
    ARTEFACT,
    ARTEFACT_HZ,
    HUM,
    MOVED,
    EmgQuality,
    emg_quality,
)

#: Surface EMG has most of its power below 250 Hz and some up to about 450 Hz.
LEAST_RATE_HZ: Final = 500.0
WHOLE_BAND_HZ: Final = 450.0
#: A channel that repeats one value for longer than this has come off.
LONGEST_STILL_S: Final = 0.25
#: Share of samples at an extreme: warned of, refused.
SATURATED: Final = (0.001, 0.01)
#: Hum is warned of where its rms is above the first of these parts, a reason to refuse above the
#: second.
AUDIBLE, LOUD = 0.01, 0.05
#: dB over the silent muscle that a muscle should reach in some trial.
LOW_SNR_DB: Final = 6.0


def check_emg(recording: Recording) -> tuple[Finding, ...]:
    """All checks of the raw EMG, in a fixed order; one line for the worst trial and muscle.

    Parameters
    ----------
    recording : Recording
        Recording with raw EMG, V.

    Returns
    -------
    tuple of Finding
        What was found about maximum contractions, sample rate and signal.

    Raises
    ------
    InputError
        No raw EMG.
    """
    return (*_maximum(recording), _rate(recording), *_signal(emg_quality(recording)))


def refuse_emg(recording: Recording) -> tuple[EmgQuality, tuple[str, ...]]:
    """The quality of an EMG that can be used, and what is to be warned of.

    Raises
    ------
    InputError
        It cannot be used: which muscle, in which trial, why.
    """
    quality = emg_quality(recording)
    checks = (*_maximum(recording), _rate(recording), *_signal(quality))
    for check in checks:
        if check.verdict == "unusable":
            raise InputError(f"EMG: {check.message}")
    return quality, tuple(f"EMG: {c.message}" for c in checks if c.verdict == "warning")


def check_band(low_hz: float, high_hz: float, sample_rate_hz: float) -> None:
    """Refuse a band that samples at this rate cannot hold.

    Raises
    ------
    InputError
        The band's upper edge is at or above half of the sample rate, or the band is empty.
    """
    nyquist = sample_rate_hz / 2
    if not 0 < low_hz < high_hz < nyquist:
        raise InputError(
            f"EMG band {low_hz:g} to {high_hz:g} Hz at {sample_rate_hz:g} Hz",
            expected=f"0 < low < high < {nyquist:g} Hz, half of the rate",
        )


def _maximum(recording: Recording) -> tuple[Finding, ...]:
    for muscle in recording.muscles:
        column = mvc_column(muscle)
        if column not in recording.trials:
            text = f"no maximum contraction of {muscle}: column {column} in the trial table"
            return (Finding("MVC", "unusable", text),)
        mvc = recording.trials[column].to_numpy(dtype=float)
        bad = ~(np.isfinite(mvc) & (mvc > 0))
        if bad.any():
            row = int(bad.argmax())
            text = (
                f"trial {recording.trials['trial'].iloc[row]}: maximum contraction of {muscle} is "
                f"{mvc[row]:g} V (column {column}): a positive number is needed"
            )
            return (Finding("MVC", "unusable", text),)
    return (Finding("MVC", "ok", "of every muscle"),)


def _rate(recording: Recording) -> Finding:
    rate = recording.sample_rate_hz
    text = f"{rate:g} Hz"
    if rate < LEAST_RATE_HZ:
        text += f": too slow for raw EMG, which needs {LEAST_RATE_HZ:g} Hz or more"
        return Finding("rate", "unusable", text)
    if rate / 2 < WHOLE_BAND_HZ:
        text += f": above {rate / 2:g} Hz the EMG is lost or folded"
        return Finding("rate", "warning", text)
    return Finding("rate", "ok", text)


def _signal(q: EmgQuality) -> tuple[Finding, ...]:
    """Checks of flat, saturated, humming, moving and weak channels."""
    never = np.inf
    mains = f"{{:.0f}} % of the power is hum at multiples of {q.mains_hz:g} Hz"
    moved = f"{{:.0f}} % of the power is below {ARTEFACT_HZ:g} Hz, where electrodes that move show"
    hum, loud = 100 * q.above(q.hum, AUDIBLE), 100 * q.above(q.hum, LOUD)
    artefact = 100 * q.above(q.artefact, MOVED)
    made = [
        _worst(q, "flat", q.still_s, (never, LONGEST_STILL_S), "stays at one value for {:.2f} s"),
        _worst(q, "saturated", 100 * q.saturated, _percent(SATURATED), "{:.1f} % at its extreme"),
        _worst(q, "mains", loud, (never, 100 * HUM[1]), mains),
        _worst(q, "hum", hum, (100 * HUM[0], never), mains),
        _worst(q, "artefact", artefact, (100 * ARTEFACT, never), moved),
    ]
    if q.snr_db is not None:
        made.append(_snr(q, q.snr_db))
    return tuple(made)


def _snr(q: EmgQuality, snr_db: FloatArray) -> Finding:
    """A muscle that never rises over its electrode's noise; one that rests now and then may."""
    best = snr_db.max(axis=0)
    m = int(best.argmin())
    text = f"{q.muscles[m]}: at most {best[m]:.0f} dB over the silent muscle"
    return Finding("SNR", "warning" if best[m] < LOW_SNR_DB else "ok", text)


def _percent(limits: tuple[float, float]) -> tuple[float, float]:
    return 100 * limits[0], 100 * limits[1]


def _worst(
    q: EmgQuality, name: str, values: FloatArray, limits: tuple[float, float], text: str
) -> Finding:
    """Verdict on the largest of values (T, m): a warning above limits[0], no use above [1]."""
    t, m = np.unravel_index(int(values.argmax()), values.shape)
    worst = float(values[t, m])
    verdict: Verdict = "ok"
    if worst > limits[0]:
        verdict = "warning"
    if worst > limits[1]:
        verdict = "unusable"
    return Finding(name, verdict, f"trial {q.trials[t]}, {q.muscles[m]}: {text.format(worst)}")
