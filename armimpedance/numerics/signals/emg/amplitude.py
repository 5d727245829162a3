"""EMG amplitude over time and of segments, as a share of maximum contraction, with its error.

Ruiz (2011), section 6.1: rectified, fifth-order Butterworth low-pass at 10 Hz; or RMS,
``sqrt(mean x^2)`` (the source prints the root around the sum only). The maximum contraction is
stated by its mean rectified EMG (`signals.activation.mvc_column`). For Gaussian EMG
``rms = mean |x| sqrt(pi / 2)``; RMS is divided by this factor so that both give one activation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.core.errors import InputError, RecordError
from armimpedance.core.records import Recording
from armimpedance.numerics.signals.emg.activation import (
    envelope,
    mvc_column,
    rest_column,
    without_rest,
)
from armimpedance.numerics.signals.emg.cleaning import (
    carrier_correlation,
    clean_emg,
    lowpass_overlap,
    mean_overlap,
    rectified_correlation,
    relative_sd,
    squared_correlation,
)
from armimpedance.numerics.signals.filters import advanced, lowpass, lowpass_delay_s

# EMG amplitudes over time and of segments, with their standard errors.

#: The source's low-pass, Ruiz (2011), section 6.1.
CUTOFF_HZ: Final = 10.0
ORDER: Final = 5


@dataclass(frozen=True)
class EmgAmplitude(FrozenRecord):
    """Amplitude of m muscles over time; N samples of T trials, one trial after another.

    `offsets` (T + 1,) int.
    `amplitude` (N, m): activation, as a share of the maximum contraction.
    `sd` (N, m): standard error of each value, from the randomness of the carrier; errors of
    neighbouring samples are correlated over the width of the low-pass.
    `relative_noise` (m,): standard error over amplitude, of the EMG as recorded (electrode's noise
    included).
    `lag_s`: delay of the amplitude, s; 0 for a zero-phase filter or once aligned.
    """

    sample_rate_hz: float
    trials: Annotated[tuple[str, ...], "t"]
    muscles: Annotated[tuple[str, ...], "m"]
    offsets: Annotated[IntArray, "t+1"]
    amplitude: Annotated[FloatArray, "n m"]
    sd: Annotated[FloatArray, "n m"]
    relative_noise: Annotated[FloatArray, "m"]
    cutoff_hz: float = CUTOFF_HZ
    order: int = ORDER
    causal: bool = False
    lag_s: float = 0.0
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.amplitude) != self.offsets[-1]:
            raise RecordError(
                f"{len(self.amplitude)} amplitudes", expected=f"{self.offsets[-1]}, one per sample"
            )

    @property
    def noise_sd(self) -> FloatArray:
        """Root mean square of `sd` over all samples, (m,)."""
        return np.sqrt((self.sd**2).mean(axis=0))

    def samples_of(self, row: int) -> slice:
        """The samples of trial `row`, counted from 0."""
        return slice(int(self.offsets[row]), int(self.offsets[row + 1]))


@dataclass(frozen=True)
class SegmentAmplitude(FrozenRecord):
    """One amplitude of each of m muscles for each of L segments.

    `row` (L,) int: row of the trial table, from 0.
    `start_s`, `end_s` (L,): start and end of each segment, from the trial's first sample, s.
    `amplitude`, `sd` (L, m): share of the maximum contraction, and its standard error from the
    carrier.
    """

    muscles: Annotated[tuple[str, ...], "m"]
    row: Annotated[IntArray, "l"]
    start_s: Annotated[FloatArray, "l"]
    end_s: Annotated[FloatArray, "l"]
    amplitude: Annotated[FloatArray, "l m"]
    sd: Annotated[FloatArray, "l m"]
    kind: Literal["rms", "rectified"]
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


#: Cut-off of the envelope by which EMG is divided to get the carrier, for the noise of segments.
SLOW_HZ: Final = 2.0
#: Warning for EMG that was normalised before.
NOISE_UNKNOWN: Final = "EMG normalised already: its noise is not known and counts as none"
#: rms over mean |x| of Gaussian noise.
RMS_OVER_RECTIFIED: Final = float(np.sqrt(np.pi / 2))
#: Above this activation the stated maximum was not maximal; the carrier's noise may exceed 1.
HIGHEST: Final = 2.0


@dataclass(frozen=True)
class _Own:
    amplitude: FloatArray
    sd: FloatArray


def emg_amplitude(
    recording: Recording,
    *,
    cutoff_hz: float = CUTOFF_HZ,
    order: int = ORDER,
    causal: bool = False,
    align: bool = True,
    band_hz: tuple[float, float] | None = None,
) -> EmgAmplitude:
    """EMG amplitude: offset removed, checked, cleaned, rectified, low-passed, over the maximum.

    If the table states the level of the silent muscle (`rest_column`), its square is subtracted.
    EMG that was normalised before is an amplitude already: it is only low-passed, and its noise is
    not known (0).

    Parameters
    ----------
    recording : Recording
    cutoff_hz, order : float, int
        Cut-off (Hz) and order of the low-pass.
    causal : bool
        Run the low-pass forward only, as a controller would; the amplitude is delayed by `lag_s`.
        Default: zero phase.
    align : bool
        Move a causal amplitude forward by its lag (at 0 Hz).
    band_hz : (low, high), optional
        Band-pass of the raw EMG.

    Returns
    -------
    EmgAmplitude
        Amplitudes of all trials, samples and muscles as a share of the maximum, with their sd.

    Raises
    ------
    InputError
        EMG that cannot be used (`signals.emg_checks`), an amplitude far above 1, a trial shorter
        than a period of the cut-off, or a cut-off beyond half the rate.
    """
    rate, offsets = recording.sample_rate_hz, recording.offsets
    lag = lowpass_delay_s(cutoff_hz, rate, order) if causal else 0.0
    if recording.emg_unit == "normalised" and recording.emg is not None:
        if causal:
            raise InputError("a causal amplitude of normalised EMG", expected="raw EMG in V")
        return _normalised(recording, recording.emg, cutoff_hz, order)
    clean = clean_emg(recording, band_hz=band_hz)
    smooth = _envelopes(recording, clean.emg, cutoff_hz=cutoff_hz, order=order, causal=causal)
    rho = carrier_correlation(clean.emg, np.vstack(smooth), offsets, rate)
    overlap = lowpass_overlap(cutoff_hz, rate, order, len(rho), causal=causal)
    noise = relative_sd(rectified_correlation(rho), overlap)
    if causal and align:
        smooth = [advanced(part, lag, rate) for part in smooth]
    rows = np.repeat(np.arange(recording.n_trials), np.diff(offsets))
    muscle_part, rest_note = _own(recording, np.vstack(smooth), noise, rows)
    _refuse_above(muscle_part.amplitude, recording)
    phase = _phase_note(lag, align) if causal else "zero phase"
    note = f"rectified, Butterworth low-pass of order {order} at {cutoff_hz:g} Hz, {phase}"
    return EmgAmplitude(
        sample_rate_hz=rate,
        trials=tuple(str(t) for t in recording.trials["trial"]),
        muscles=recording.muscles,
        offsets=offsets,
        amplitude=muscle_part.amplitude,
        sd=muscle_part.sd,
        relative_noise=noise,
        cutoff_hz=cutoff_hz,
        order=order,
        causal=causal,
        lag_s=0.0 if align else lag,
        notes=(*clean.notes, note, *rest_note),
        warnings=clean.warnings,
    )


def segment_amplitude(
    recording: Recording,
    *,
    kind: Literal["rms", "rectified"] = "rms",
    segment_s: float | None = None,
    band_hz: tuple[float, float] | None = None,
) -> SegmentAmplitude:
    """RMS or mean rectified EMG of whole trials, or of equal segments of them.

    Parameters
    ----------
    recording : Recording
        Normalised EMG is only averaged; its noise is not known (0).
    kind : {"rms", "rectified"}
        ``sqrt(mean x^2) / (MVC sqrt(pi / 2))`` or ``mean |x| / MVC``.
    segment_s : float, optional
        Default: whole trials. A remainder at the end of a trial is dropped.
    band_hz : (low, high), optional

    Returns
    -------
    SegmentAmplitude
        Amplitudes of all segments and muscles as a share of the maximum, with their sd.

    Raises
    ------
    InputError
        EMG that cannot be used, an unknown kind, a segment longer than a trial, or an amplitude
        far above 1.
    """
    if kind not in ("rms", "rectified"):
        raise InputError(f"unknown amplitude {kind!r}", expected="rms or rectified")
    row, first, length = _segments(recording, segment_s)
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = (NOISE_UNKNOWN,)
    if recording.emg_unit == "normalised" and recording.emg is not None:
        level = np.array(
            [recording.emg[a : a + n].mean(axis=0) for a, n in zip(first, length, strict=True)]
        )
        muscle_part = _Own(level, np.zeros_like(level))
    else:
        clean = clean_emg(recording, band_hz=band_hz)
        level = _levels(clean.emg, kind, first, length)
        noise = _segment_noise(recording, clean.emg, kind, length)
        muscle_part, rest_note = _own(recording, level, noise, row)
        notes, warnings = (*clean.notes, *rest_note), clean.warnings
    _refuse_above(muscle_part.amplitude, recording)
    start = (first - recording.offsets[row]) / recording.sample_rate_hz
    return SegmentAmplitude(
        muscles=recording.muscles,
        row=row,
        start_s=start,
        end_s=start + length / recording.sample_rate_hz,
        amplitude=muscle_part.amplitude,
        sd=muscle_part.sd,
        kind=kind,
        notes=notes,
        warnings=warnings,
    )


def _levels(emg: FloatArray, kind: str, first: IntArray, length: IntArray) -> FloatArray:
    """Level of each segment on the scale of the mean rectified EMG, V, (L, m)."""
    parts = [emg[a : a + n] for a, n in zip(first, length, strict=True)]
    if kind == "rms":
        return np.array([np.sqrt((x**2).mean(axis=0)) for x in parts]) / RMS_OVER_RECTIFIED
    return np.array([np.abs(x).mean(axis=0) for x in parts])


def _segments(recording: Recording, segment_s: float | None) -> tuple[IntArray, IntArray, IntArray]:
    """Row, first sample and length of each segment, (L,) each."""
    lengths = np.diff(recording.offsets)
    rows = np.arange(recording.n_trials)
    if segment_s is None:
        return rows, np.asarray(recording.offsets[:-1]), lengths
    wide = round(segment_s * recording.sample_rate_hz)
    if not 1 < wide <= lengths.min():
        raise InputError(
            f"segments of {segment_s:g} s",
            expected=f"up to {lengths.min() / recording.sample_rate_hz:g} s, the shortest trial",
        )
    count = lengths // wide
    row = np.repeat(rows, count)
    within = np.concatenate([np.arange(c) for c in count])
    return row, recording.offsets[row] + wide * within, np.full(len(row), wide)


def _segment_noise(
    recording: Recording, emg: FloatArray, kind: str, length: IntArray
) -> FloatArray:
    """Standard error over amplitude of each segment, (L, m)."""
    rate = recording.sample_rate_hz
    slow = np.vstack(_envelopes(recording, emg, cutoff_hz=SLOW_HZ))
    rho = carrier_correlation(emg, slow, recording.offsets, rate)
    correlation = squared_correlation(rho) if kind == "rms" else rectified_correlation(rho)
    by_length = {
        n: relative_sd(correlation, mean_overlap(n, len(rho))) for n in set(length.tolist())
    }
    return np.array([by_length[n] for n in length.tolist()])


def _normalised(
    recording: Recording, normalised: FloatArray, cutoff_hz: float, order: int
) -> EmgAmplitude:
    """Low-pass EMG that is an amplitude already."""
    emg = np.array(normalised)
    for t in range(recording.n_trials):
        part = recording.samples_of(t)
        smooth = lowpass(emg[part], cutoff_hz, recording.sample_rate_hz, order=order, axis=0)
        emg[part] = np.clip(smooth, 0.0, None)
    _refuse_above(emg, recording)
    return EmgAmplitude(
        sample_rate_hz=recording.sample_rate_hz,
        trials=tuple(str(t) for t in recording.trials["trial"]),
        muscles=recording.muscles,
        offsets=recording.offsets,
        amplitude=emg,
        sd=np.zeros_like(emg),
        relative_noise=np.zeros(emg.shape[1]),
        cutoff_hz=cutoff_hz,
        order=order,
        notes=(f"EMG normalised already: low-pass at {cutoff_hz:g} Hz, zero phase",),
        warnings=(NOISE_UNKNOWN,),
    )


def _envelopes(recording: Recording, emg: FloatArray, **options: Any) -> list[FloatArray]:
    """The envelope of each trial, (S, m) each."""
    envelopes = []
    for t in range(recording.n_trials):
        try:
            part = emg[recording.samples_of(t)]
            envelopes.append(envelope(part, recording.sample_rate_hz, **options))
        except InputError as error:
            number = recording.trials["trial"].iloc[t]
            raise InputError(f"trial {number}: {error.problem}", expected=error.expected) from error
    return envelopes


def _table(recording: Recording, column_of: Callable[[str], str], rows: IntArray) -> FloatArray:
    """Level of each muscle in these rows of the trial table, (., m)."""
    columns = [column_of(muscle) for muscle in recording.muscles]
    return np.asarray(recording.trials[columns].to_numpy(dtype=np.float64)[rows])


def _own(
    recording: Recording, level: FloatArray, noise: FloatArray, rows: IntArray
) -> tuple[_Own, tuple[str, ...]]:
    """Muscles' own share of levels (., m) in V, over the maximum, and notes on it."""
    mvc = _table(recording, mvc_column, rows)
    level = level / mvc
    lacking = [m for m in recording.muscles if rest_column(m) not in recording.trials]
    rest = np.full(1, np.nan) if lacking else _table(recording, rest_column, rows) / mvc
    if not np.isfinite(rest).all():
        columns = ", ".join(rest_column(m) for m in lacking or recording.muscles)
        note = f"noise of the electrodes not taken off: no {columns} in the trial table"
        return _Own(level, level * noise), (note,)
    note = "noise of the silent muscle taken off in squares"
    return _Own(*without_rest(level, level * noise, rest)), (note,)


def _refuse_above(amplitude: FloatArray, recording: Recording) -> None:
    if amplitude.size and amplitude.max() > HIGHEST:
        sample, m = np.unravel_index(int(amplitude.argmax()), amplitude.shape)
        raise InputError(
            f"amplitude {amplitude.max():.1f} of {recording.muscles[int(m)]}",
            expected="0..1; is the MVC that of this muscle and in the same unit?",
        )


def _phase_note(lag_s: float, align: bool) -> str:
    late = f"causal, {1e3 * lag_s:.1f} ms late at 0 Hz"
    return f"{late}, moved forward by as much" if align else late
