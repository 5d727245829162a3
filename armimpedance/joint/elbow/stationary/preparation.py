"""Prepare the samples for a fit: remove drift, filter all channels alike, decimate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.core.errors import InputError, RecordError
from armimpedance.joint.elbow.checks import ChannelSpectrum, Spectra
from armimpedance.joint.elbow.samples import JointSamples
from armimpedance.numerics.signals import lowpass, ramp_basis

Cutoff = float | None | Literal["auto"]
Decimation = int | Literal["auto"]

#: Lowest end of a band that is chosen automatically (Hz).
LOWEST_CUTOFF_HZ: Final = 2.0
#: A channel's band ends where its signal's density falls below this multiple of its noise floor.
ABOVE_FLOOR: Final = 2.0
#: The band ends where all but this share of the torque's power lies below.
OUTSIDE: Final = 0.02
#: Least samples per period of the cut-off after decimation: with 50 the error of the bilinear
#: transform at the cut-off is 0.13 %, within the interval of a good record; with 20 it is 0.8 %.
SAMPLES_PER_PERIOD: Final = 50
#: A decimated signal is always filtered below this share of its new rate.
ANTI_ALIAS: Final = 0.4


@dataclass(frozen=True, eq=False)
class PreparedSamples(FrozenRecord):
    """Samples of T trials after drift removal, filter and decimation.

    `offsets` (T + 1,) int, `torque`, `angle` (N,).
    `sample_rate_hz`: after decimation.
    `perturbation` (N,) or None: after the same filter.
    `cutoff_hz`: edge of the zero-phase low-pass; None if there was none.
    `edge`: number of samples at each end of each trial in which the filter rings; a fit must not
    use them.
    `band_hz`: highest frequency with signal in both channels; upper end of a fit in the frequency
    domain.
    `source`: the original samples.
    `spectra`: of the source's torque and angle.
    `notes`: the choices and their reasons, one sentence each.
    `lowest_hz`: lower end of a fit in the frequency domain.
    `band_why`: reason for `band_hz`.
    """

    sample_rate_hz: float
    offsets: IntArray
    torque: Annotated[FloatArray, "n"]
    angle: Annotated[FloatArray, "n"]
    perturbation: Annotated[FloatArray, "n"] | None
    cutoff_hz: float | None
    decimation: int
    edge: int
    band_hz: float
    source: JointSamples
    spectra: Spectra
    notes: tuple[str, ...] = ()
    lowest_hz: float = 0.0
    band_why: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        if (np.diff(self.offsets) <= 2 * self.edge + 16).any():
            raise RecordError("a trial is too short for its filter", expected="a longer trial")

    @property
    def n_trials(self) -> int:
        """Number of trials T."""
        return len(self.offsets) - 1

    def samples_of(self, row: int) -> slice:
        """The samples of trial `row`, counted from 0."""
        return slice(int(self.offsets[row]), int(self.offsets[row + 1]))

    def inside(self, row: int) -> slice:
        """Samples of trial `row` without the ends in which the filter rings."""
        whole = self.samples_of(row)
        return slice(whole.start + self.edge, whole.stop - self.edge)


def prepare(
    samples: JointSamples,
    spectra: Spectra,
    cutoff_hz: Cutoff = "auto",
    decimation: Decimation = "auto",
    lowest_hz: float | None = None,
) -> PreparedSamples:
    """Remove offset and drift from each trial, filter all channels alike, decimate.

    `spectra`: of the samples' channels.
    `cutoff_hz`: edge in Hz of the zero-phase low-pass (second order, forward and backward: four
    poles). "auto": the highest frequency at which both channels exceed their noise; None: no filter
    except against aliases.
    `decimation`: keep every so many-th sample. "auto": 50 samples per period of the cut-off.
    `lowest_hz`: lower end of the fit, above the subject's reflexes and voluntary responses. The
    samples themselves are not changed.
    Raises InputError: a cut-off at or above half of the rate, a decimation that is not a whole
    number from 1, a lowest frequency that is not positive or not below the band's end.
    """
    band, why = _band(spectra, samples.sample_rate_hz)
    cutoff, notes = _cutoff(samples, cutoff_hz, decimation, band, why)
    keep, sentence = _decimation(samples, decimation, cutoff)
    notes = [*notes, sentence]
    if keep > 1 and (cutoff is None or cutoff > ANTI_ALIAS * samples.sample_rate_hz / keep):
        cutoff = ANTI_ALIAS * samples.sample_rate_hz / keep
        notes.append(f"low-pass {cutoff:g} Hz against aliases")
    upper = band if cutoff is None else min(band, cutoff)
    lowest = _lowest(lowest_hz, upper)
    rows = [_channels(samples, r, cutoff, keep) for r in range(samples.n_trials)]
    table = np.concatenate(rows, axis=1)
    rate = samples.sample_rate_hz / keep
    return PreparedSamples(
        sample_rate_hz=rate,
        offsets=np.concatenate([[0], np.cumsum([r.shape[1] for r in rows])]),
        torque=table[0],
        angle=table[1],
        perturbation=None if samples.perturbation is None else table[2],
        cutoff_hz=cutoff,
        decimation=keep,
        edge=0 if cutoff is None else int(np.ceil(rate / cutoff)),
        band_hz=upper,
        source=samples,
        spectra=spectra,
        notes=("offset and slope taken off each trial", *notes),
        lowest_hz=lowest,
        band_why=why if upper == band else "as the low-pass asks",
    )


def without_ramp(signal: FloatArray) -> FloatArray:
    """Return signals (..., S) without offset and slope."""
    Q = ramp_basis(np.arange(signal.shape[-1], dtype=np.float64))
    # s (..., S) - s Q (..., 2) Q^T (2, S)
    return np.asarray(signal - (signal @ Q) @ Q.T)


def _channels(samples: JointSamples, row: int, cutoff_hz: float | None, keep: int) -> FloatArray:
    """Torque, angle and, if recorded, perturbation of one trial, prepared, (2 or 3, S)."""
    inside = samples.samples_of(row)
    channels = [samples.torque, samples.angle]
    if samples.perturbation is not None:
        channels.append(samples.perturbation)
    table = without_ramp(np.stack([c[inside] for c in channels]))
    return lowpass(table, cutoff_hz, samples.sample_rate_hz, axis=1)[:, ::keep]


def _lowest(requested: float | None, band_hz: float) -> float:
    if requested is None:
        return 0.0
    if not (np.isfinite(requested) and 0 < requested < band_hz):
        raise InputError(
            f"a lowest frequency of {requested:g} Hz",
            expected=f"more than 0 and below the band's end, {band_hz:.3g} Hz",
        )
    return float(requested)


def _cutoff(
    samples: JointSamples, requested: Cutoff, decimation: Decimation, band: float, why: str
) -> tuple[float | None, list[str]]:
    if requested == "auto":
        # a whole number may be longer than any float
        keep = 1 if decimation == "auto" else min(max(decimation, 1), 10**9)
        if decimation != "auto" and band > ANTI_ALIAS * samples.sample_rate_hz / keep:
            return None, []
        return band, [f"zero-phase low-pass {band:.3g} Hz on all channels: {why}"]
    if requested is None:
        return None, ["no low-pass, as asked"]
    if isinstance(requested, str) or not np.isfinite(requested):
        raise InputError(f"a cut-off of {requested!r}", expected="a number of Hz, None or 'auto'")
    return float(requested), [f"zero-phase low-pass {requested:g} Hz on all channels, as asked"]


def _decimation(
    samples: JointSamples, requested: Decimation, cutoff_hz: float | None
) -> tuple[int, str]:
    if requested == "auto":
        if cutoff_hz is None:
            return 1, "no decimation"
        keep = max(int(samples.sample_rate_hz / (SAMPLES_PER_PERIOD * cutoff_hz)), 1)
        if keep == 1:
            per = samples.sample_rate_hz / cutoff_hz
            return 1, f"no decimation: {per:.3g} samples per period of the cut-off"
        return keep, (
            f"every {keep}. sample kept, {samples.sample_rate_hz / keep:g} Hz: "
            f"{SAMPLES_PER_PERIOD} or more per period of the cut-off"
        )
    if not isinstance(requested, int | np.integer) or not 1 <= requested <= 10**9:
        expected = "a whole number from 1 to 1e9, or 'auto'"
        raise InputError(f"a decimation of {requested!r:.40}", expected=expected)
    return int(
        requested
    ), f"every {requested}. sample kept, as asked" if requested > 1 else "no decimation"


def _band(spectra: Spectra, rate_hz: float) -> tuple[float, str]:
    """Highest frequency with signal in torque and angle, Hz, and the reason."""
    highest = ANTI_ALIAS * rate_hz
    ends = [
        (_power_end(spectra.torque), f"{100 * (1 - OUTSIDE):g} % of the torque's power lie below"),
        (_floor_end(spectra.torque), "above it the torque drowns in its noise"),
        (_floor_end(spectra.angle), "above it the angle drowns in its noise"),
        (highest, "little below half of the rate"),
    ]
    candidates = [(float(end), why) for end, why in ends if end is not None]
    end, why = min(candidates, key=lambda e: e[0])
    return float(np.clip(end, min(LOWEST_CUTOFF_HZ, highest), highest)), why


def _floor_end(spectrum: ChannelSpectrum) -> float | None:
    """First frequency above the peak at which the signal meets its noise floor."""
    if spectrum.floor is None:
        return None
    smooth = np.convolve(spectrum.density, np.ones(3) / 3, mode="same")
    peak = int(smooth.argmax())
    below = np.flatnonzero(smooth[peak:] < (1 + ABOVE_FLOOR) * spectrum.floor)
    return float(spectrum.frequency_hz[peak + below[0]]) if len(below) else None


def _power_end(spectrum: ChannelSpectrum) -> float:
    """Frequency below which all but a small share of the signal's power lies."""
    signal = np.clip(spectrum.density - (spectrum.floor or 0.0), 0, None)
    if spectrum.floor is not None:
        # Otherwise noise, clipped at zero, would add up over a wide band.
        signal[signal < ABOVE_FLOOR * spectrum.floor] = 0
    share = np.cumsum(signal) / max(float(signal.sum()), np.finfo(float).tiny)
    return float(
        spectrum.frequency_hz[min(int(np.searchsorted(share, 1 - OUTSIDE)), len(share) - 1)]
    )
