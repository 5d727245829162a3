"""Coherence: the share of the force that a linear system driven by the motion can explain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError

#: Length of the segments whose spectra are averaged (s).
SEGMENT_S = 1.0
#: Segments that are processed together.
TOGETHER = 512


@dataclass(frozen=True)
class Coherence:
    """Multiple coherence between all motion axes and each force axis.

    `frequency_hz` (f,).
    `coherence` (f, d): 0..1; 1 = everything is explained.
    `segments`: number of averaged segments; with few, coherence is biased towards 1.
    """

    frequency_hz: FloatArray
    coherence: FloatArray
    segments: int

    def mean(self, low_hz: float, high_hz: float) -> float:
        """Mean over axes and a frequency band."""
        band = (self.frequency_hz >= low_hz) & (self.frequency_hz <= high_hz)
        return float(self.coherence[band].mean())


def multiple_coherence(
    motion: FloatArray, force: FloatArray, sample_rate_hz: float, *, segment_s: float = SEGMENT_S
) -> Coherence:
    """Multiple coherence from averaged, half-overlapping Hann segments.

    ``gamma^2_i = S_xi^H S_xx^-1 S_xi / S_ii`` at each frequency.

    Parameters
    ----------
    motion, force : (S, d)
        Motion and force of one long trial.
    sample_rate_hz : float
        Sample rate, Hz.
    segment_s : float
        Length of a segment, s.

    Returns
    -------
    Coherence
        Frequencies (Hz), the coherence of each force axis at them (0 to 1), number of segments.

    Raises
    ------
    InputError
        If the trial holds fewer than four segments.
    """
    length = round(segment_s * sample_rate_hz)
    if len(motion) < 2.5 * length:
        raise InputError(
            f"a trial of {len(motion) / sample_rate_hz:.2f} s",
            expected=f"at least {2.5 * segment_s:.1f} s for a coherence",
        )
    starts = np.arange(0, len(motion) - length + 1, length // 2)
    s_xx, s_xf, s_ff = _spectra(motion, force, starts[:TOGETHER], length)
    for first in range(TOGETHER, len(starts), TOGETHER):
        more = _spectra(motion, force, starts[first : first + TOGETHER], length)
        s_xx, s_xf, s_ff = s_xx + more[0], s_xf + more[1], s_ff + more[2]
    # (f, d, d) (f, d, d): S_xx H = S_xf, the best linear system at each frequency
    response = np.linalg.solve(s_xx + _tiny(s_xx), s_xf)
    explained = np.einsum("fij,fij->fj", s_xf.conj(), response).real
    with np.errstate(invalid="ignore", divide="ignore"):
        gamma = np.where(s_ff > 0, explained / s_ff, 0.0)
    frequency = np.arange(len(gamma), dtype=np.float64) * (sample_rate_hz / length)
    return Coherence(frequency, np.asarray(np.clip(gamma, 0.0, 1.0), float), len(starts))


def _spectra(
    motion: FloatArray, force: FloatArray, starts: np.ndarray, length: int
) -> tuple[np.ndarray, np.ndarray, FloatArray]:
    """Sums over segments of S_xx, S_xf (f, d, d) and S_ff (f, d)."""
    index = starts[:, None] + np.arange(length)
    window = np.hanning(length)[:, None]

    def transform(signal: FloatArray) -> np.ndarray:
        segments = signal[index]
        return np.fft.rfft((segments - segments.mean(axis=1, keepdims=True)) * window, axis=1)

    x, f = transform(motion), transform(force)
    return (
        np.einsum("nfi,nfj->fij", x.conj(), x),
        np.einsum("nfi,nfj->fij", x.conj(), f),
        np.einsum("nfj,nfj->fj", f.conj(), f).real,
    )


def _tiny(s_xx: np.ndarray) -> np.ndarray:
    """Ridge at rounding level, so that frequencies without motion do not divide by zero."""
    trace = np.trace(s_xx, axis1=1, axis2=2).real
    floor = np.finfo(float).eps * max(float(trace.max()), np.finfo(float).tiny)
    return floor * np.eye(s_xx.shape[1])[None]
