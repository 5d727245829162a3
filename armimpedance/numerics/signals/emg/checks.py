"""Checks of raw EMG: flat, saturated or humming channels, aliasing, moving electrodes.

Mains hum and movement artefact below a first limit are ignored; above it, `signals.emg_cleaning`
removes them and reports it; above a second limit, the recording is refused.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, FrozenRecord
from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding, Verdict
from armimpedance.core.records import Recording
from armimpedance.core.trials import trial_slices
from armimpedance.numerics.signals.emg.activation import mvc_column, rest_column

# Properties of raw EMG.

#: Most samples at an extreme without saturation: noise reaches its extreme only once or twice.
LEAST_AT_EXTREME: Final = 5
MAINS_HZ: Final = (50.0, 60.0)
#: Share of the power in lines of the mains: removed above the first, refused above the second.
HUM: Final = (0.05, 0.8)
#: Share of the power below 20 Hz above which electrodes are moving.
ARTEFACT_HZ: Final = 20.0
ARTEFACT: Final = 0.05
#: Artefact is reported if its rms is above this share of the maximum contraction's: in a silent
#: muscle a large share of hum and artefact does not matter.
MOVED: Final = 0.003
#: Segments of the spectrum (s), and half-widths of a line and of the floor around it (Hz).
_SEGMENT_S, _LINE_HZ, _FLOOR_HZ = 2.0, 1.5, 6.0


@dataclass(frozen=True)
class EmgQuality(FrozenRecord):
    """Quality of the raw EMG of T trials and m muscles.

    `still_s` (T, m): longest time at one value.
    `saturated` (T, m): share of samples piled up at an extreme.
    `mains_hz`: 50 or 60, whichever has more power.
    `hum` (T, m): share of power in the lines at multiples of it, over the floor beside them.
    `artefact` (T, m): share of power below 20 Hz.
    `level` (T, m): rms as a share of the maximum contraction's; 1 if that is not known.
    `snr_db` (T, m) or None: power of the muscle over power of the silent muscle's electrode; None
    without rest.
    """

    trials: Annotated[tuple[str, ...], "t"]
    muscles: Annotated[tuple[str, ...], "m"]
    still_s: Annotated[FloatArray, "t m"]
    saturated: Annotated[FloatArray, "t m"]
    mains_hz: float
    hum: Annotated[FloatArray, "t m"]
    artefact: Annotated[FloatArray, "t m"]
    level: Annotated[FloatArray, "t m"]
    snr_db: Annotated[FloatArray, "t m"] | None

    @property
    def humming(self) -> BoolArray:
        """True where there is enough hum to remove it, (T, m)."""
        return np.asarray(self.hum > HUM[0])

    @property
    def moving(self) -> BoolArray:
        """True for electrodes that move in any trial, (m,)."""
        return np.asarray((self.above(self.artefact, MOVED) > ARTEFACT).any(axis=0))

    def above(self, share: FloatArray, part: float) -> FloatArray:
        """Shares of power (T, m) where their rms exceeds `part` of the maximum's, else 0."""
        return np.where(np.sqrt(share) * self.level > part, share, 0.0)


def emg_quality(recording: Recording) -> EmgQuality:
    """Measure the quality of the raw EMG of a recording.

    Raises InputError: no EMG, or EMG that is normalised already.
    """
    rate, raw = recording.sample_rate_hz, _raw_emg(recording)
    spectra = [_spectrum(emg - emg.mean(axis=0), rate) for emg in raw]
    lines = np.array([[_line_share(f, p, hz) for f, p in spectra] for hz in MAINS_HZ])
    mains = int(lines.sum(axis=(1, 2)).argmax())
    rms = np.array([emg.std(axis=0) for emg in raw])
    return EmgQuality(
        trials=tuple(str(t) for t in recording.trials["trial"]),
        muscles=recording.muscles,
        still_s=np.array([_longest_still(emg) for emg in raw]) / rate,
        saturated=np.array([_saturated(emg) for emg in raw]),
        mains_hz=MAINS_HZ[mains],
        hum=lines[mains],
        artefact=np.array([_below(f, p, ARTEFACT_HZ) for f, p in spectra]),
        level=_over_maximum(rms, recording),
        snr_db=_over_rest_db(rms, recording),
    )


def _raw_emg(recording: Recording) -> list[FloatArray]:
    """The raw EMG of each trial, (S_t, m)."""
    if recording.emg is None or not recording.muscles:
        raise InputError("the recording holds no EMG", expected="columns emg_<muscle>")
    if recording.emg_unit != "V":
        raise InputError("the EMG is normalised: an envelope", expected="raw EMG in V")
    return [recording.emg[samples] for samples in trial_slices(recording.offsets)]


def _levels(recording: Recording, column_of: Callable[[str], str]) -> FloatArray | None:
    """Level of each trial and muscle, (T, m); None if one is missing or not positive."""
    columns = [column_of(muscle) for muscle in recording.muscles]
    if any(column not in recording.trials for column in columns):
        return None
    table = recording.trials[columns].to_numpy(dtype=np.float64)
    return table if np.isfinite(table).all() and (table > 0).all() else None


def _over_maximum(rms: FloatArray, recording: Recording) -> FloatArray:
    """Rms (T, m) as a share of the maximum contraction's; 1 if that is not known."""
    mvc = _levels(recording, mvc_column)
    return np.ones_like(rms) if mvc is None else rms / (mvc * np.sqrt(np.pi / 2))


def _over_rest_db(rms: FloatArray, recording: Recording) -> FloatArray | None:
    """Muscle's own power over that of the silent electrode, dB, -30 at the least; None without."""
    rest = _levels(recording, rest_column)
    if rest is None:
        return None
    power_ratio = np.maximum((rms / (rest * np.sqrt(np.pi / 2))) ** 2 - 1, 1e-3)
    return np.asarray(10 * np.log10(power_ratio))


def _spectrum(emg: FloatArray, rate_hz: float) -> tuple[FloatArray, FloatArray]:
    """Power (f, m) over frequency (f,), from half overlapping Hann segments."""
    from scipy.signal import welch

    length = min(round(_SEGMENT_S * rate_hz), len(emg))
    frequency, power = welch(emg, fs=rate_hz, nperseg=length, axis=0, detrend=False)
    return np.asarray(frequency), np.asarray(power)


def _below(frequency: FloatArray, power: FloatArray, edge_hz: float) -> FloatArray:
    total = power.sum(axis=0)
    low = power[frequency < edge_hz].sum(axis=0)
    return np.divide(low, total, out=np.zeros_like(total), where=total > 0)


def _line_share(frequency: FloatArray, power: FloatArray, mains_hz: float) -> FloatArray:
    """Share (m,) of power in lines at multiples of the mains, above the floor beside them."""
    lines = np.zeros(power.shape[1])
    for line in np.arange(mains_hz, frequency[-1] - _FLOOR_HZ, mains_hz):
        away = np.abs(frequency - line)
        near, beside = away <= _LINE_HZ, (away > _LINE_HZ) & (away <= _FLOOR_HZ)
        if near.any() and beside.any():
            lines += power[near].sum(axis=0) - near.sum() * power[beside].mean(axis=0)
    total = power.sum(axis=0)
    share = np.divide(lines, total, out=np.zeros_like(total), where=total > 0)
    return np.clip(share, 0.0, 1.0)


def _longest_still(emg: FloatArray) -> FloatArray:
    """Most samples in a row with one value, of each muscle (m,)."""
    longest = np.zeros(emg.shape[1])
    for m, channel in enumerate(emg.T):
        edges = np.flatnonzero(np.diff(channel))
        longest[m] = np.diff(np.concatenate([[-1], edges, [len(channel) - 1]])).max()
    return longest


def _saturated(emg: FloatArray) -> FloatArray:
    """Share of samples (m,) piled up at the highest or lowest value, far more than next to it."""
    share = np.zeros(emg.shape[1])
    for m, channel in enumerate(emg.T):
        _, counts = np.unique(channel, return_counts=True)
        for end, beside in ((counts[0], counts[1:2]), (counts[-1], counts[-2:-1])):
            if end > LEAST_AT_EXTREME and end > 3 * beside.max(initial=0):
                share[m] += end / len(channel)
    return share


#: Surface EMG has most of its power below 250 Hz and some up to about 450 Hz.
LEAST_RATE_HZ: Final = 500.0
WHOLE_BAND_HZ: Final = 450.0
#: An electrode whose channel repeats one value for longer than this has come off.
LONGEST_STILL_S: Final = 0.25
#: Share of samples at an extreme: limits for a warning and for a refusal.
SATURATED: Final = (0.001, 0.01)
#: Rms of hum as a share of the maximum: limits for a warning and for a refusal.
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
        Findings on maximum contractions, sample rate and signal.

    Raises
    ------
    InputError
        No raw EMG.
    """
    return (*_maximum(recording), _rate(recording), *_signal(emg_quality(recording)))


def refuse_emg(recording: Recording) -> tuple[EmgQuality, tuple[str, ...]]:
    """Return the quality of usable EMG, and warnings; refuse EMG that cannot be used.

    Raises InputError: it cannot be used; the message names trial, muscle and reason.
    """
    quality = emg_quality(recording)
    checks = (*_maximum(recording), _rate(recording), *_signal(quality))
    for check in checks:
        if check.verdict == "unusable":
            raise InputError(f"EMG: {check.message}")
    return quality, tuple(f"EMG: {c.message}" for c in checks if c.verdict == "warning")


def check_band(low_hz: float, high_hz: float, sample_rate_hz: float) -> None:
    """Refuse a band that samples at this rate cannot hold.

    Raises InputError: the band's upper edge is at or above half of the sample rate, or the band is
    empty.
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
    findings = [
        _worst(q, "flat", q.still_s, (never, LONGEST_STILL_S), "stays at one value for {:.2f} s"),
        _worst(q, "saturated", 100 * q.saturated, _percent(SATURATED), "{:.1f} % at its extreme"),
        _worst(q, "mains", loud, (never, 100 * HUM[1]), mains),
        _worst(q, "hum", hum, (100 * HUM[0], never), mains),
        _worst(q, "artefact", artefact, (100 * ARTEFACT, never), moved),
    ]
    if q.snr_db is not None:
        findings.append(_snr(q, q.snr_db))
    return tuple(findings)


def _snr(q: EmgQuality, snr_db: FloatArray) -> Finding:
    """Check that every muscle rises above its electrode's noise in at least one trial."""
    best = snr_db.max(axis=0)
    m = int(best.argmin())
    text = f"{q.muscles[m]}: at most {best[m]:.0f} dB over the silent muscle"
    return Finding("SNR", "warning" if best[m] < LOW_SNR_DB else "ok", text)


def _percent(limits: tuple[float, float]) -> tuple[float, float]:
    return 100 * limits[0], 100 * limits[1]


def _worst(
    q: EmgQuality, name: str, values: FloatArray, limits: tuple[float, float], text: str
) -> Finding:
    """Finding on the largest of values (T, m): a warning above limits[0], unusable above [1]."""
    t, m = np.unravel_index(int(values.argmax()), values.shape)
    worst = float(values[t, m])
    verdict: Verdict = "ok"
    if worst > limits[0]:
        verdict = "warning"
    if worst > limits[1]:
        verdict = "unusable"
    return Finding(name, verdict, f"trial {q.trials[t]}, {q.muscles[m]}: {text.format(worst)}")
