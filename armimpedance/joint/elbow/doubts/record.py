"""The record as the doubts see it: its band without the first moments, angles of before, bends.

``tau = (I s^2 + B s + K) theta + K_r theta(t - d) + sum c_j phi_j(theta, theta') + noise``: the
angle of a while ago is taken from the samples themselves, so the first `LATEST_S` of every trial
serve as its past alone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.elbow.samples import JointSamples
from armimpedance.joint.elbow.stationary.band import Band, Bins, Complex, band_of
from armimpedance.joint.elbow.stationary.preparation import Prepared, without_ramp

#: From a short-latency reflex to a voluntary answer, s.
DELAYS_S: Final = np.arange(7, 25) / 200
LATEST_S: Final = float(DELAYS_S[-1])
#: The terms of amplitude: two of stiffness, two of friction.
BENDS: Final = ("theta^2", "theta^3", "sign theta'", "theta' |theta'|")
#: Below this part of its rms a velocity has no sign.
_SLOW: Final = 0.1


@dataclass(frozen=True, eq=False)
class Past:
    """One trial's coefficients beside those of its `Bins`.

    Attributes
    ----------
    late : (n, D)
        The angle of each delay ago, as measured.
    bends : (n, C)
        Terms of amplitude of the measured motion.
    """

    late: Complex
    bends: Complex


@dataclass(frozen=True, eq=False)
class Doubted:
    """A band of the record from `LATEST_S` on, with what the doubts ask of it.

    Attributes
    ----------
    band : Band
        Weighed by the sensors' floors.
    trials : tuple of Past
    delays_s : (D,)
        Whole samples.
    samples : tuple of int
        Of each trial.
    """

    band: Band
    trials: tuple[Past, ...]
    delays_s: FloatArray
    samples: tuple[int, ...]


def doubted(prepared: Prepared, whole_band: Band) -> Doubted:
    """The record without its first moments, and their part in what follows.

    Raises
    ------
    InputError
        The band holds too few coefficients.
    """
    whole = prepared.source
    rate = whole.sample_rate_hz
    delays = np.unique(np.round(DELAYS_S * rate).astype(int))
    cut = without_beginning(whole, int(delays[-1]))
    band = band_of(replace(prepared, source=cut), whole_band.source)
    trials = []
    for row, bins in enumerate(band.trials):
        angle = whole.angle[whole.samples_of(row)]
        start, count = int(delays[-1]), len(angle) - int(delays[-1])
        late = np.stack([angle[start - d : start - d + count] for d in delays])
        trials.append(Past(coefficients(late, bins), bends_of(bins.angle, bins, count)))
    lengths = tuple(int(n) for n in np.diff(cut.offsets))
    return Doubted(band, tuple(trials), delays / rate, lengths)


def without_beginning(samples: JointSamples, start: int) -> JointSamples:
    """Every trial from its sample `start` on."""
    kept = np.ones(len(samples.angle), dtype=bool)
    for first in samples.offsets[:-1]:
        kept[first : first + start] = False
    lengths = np.diff(samples.offsets) - start
    changed = {
        name: getattr(samples, name)[kept]
        for name in ("torque", "angle", "perturbation", "command")
        if getattr(samples, name) is not None
    }
    return replace(samples, offsets=np.concatenate([[0], np.cumsum(lengths)]), **changed)


def coefficients(series: FloatArray, bins: Bins) -> Complex:
    """Unitary coefficients (n, m) of series (m, S) at the lines of `bins`."""
    count = series.shape[-1]
    first = round(float(bins.frequency_hz[0]) * bins.seconds)
    whole = np.fft.rfft(without_ramp(series), axis=-1) / np.sqrt(count)
    return np.asarray(whole[:, first : first + len(bins.s)].T, dtype=np.complex128)


def bends_of(angle: Complex, bins: Bins, count: int) -> Complex:
    """Coefficients (n, C) of the terms of amplitude of a motion with coefficients (n,)."""
    return coefficients(bends_in_time(angle, bins, count), bins)


def bends_in_time(angle: Complex, bins: Bins, count: int) -> FloatArray:
    """The terms of amplitude of a motion over time, (C, S), each of unit rms."""
    first = round(float(bins.frequency_hz[0]) * bins.seconds)
    spectrum = np.zeros((2, count // 2 + 1), dtype=np.complex128)
    spectrum[:, first : first + len(bins.s)] = np.stack([angle, bins.s * angle]) * np.sqrt(count)
    q, v = np.fft.irfft(spectrum, count, axis=1)
    return np.stack([q**2, q**3, v / np.sqrt(v**2 + _SLOW**2 * (v**2).mean()), v * np.abs(v)])
