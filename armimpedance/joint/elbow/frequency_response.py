"""Compliance of a joint over frequency, without a model: fits are compared with it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import InputError
from armimpedance.joint.elbow.samples import JointSamples
from armimpedance.joint.elbow.stationary.band import source_of

#: Length of the segments that spectra are averaged over (s). Leakage flattens a resonance: 2 s cost
#: a lightly damped elbow (2.7 Hz, damping ratio .25) 15 % of its peak, 4 s 7 %.
SEGMENT_S: Final = 4.0


@dataclass(frozen=True, eq=False)
class FrequencyResponse(FrozenRecord):
    """Angle over torque at each of f frequencies.

    `frequency_hz` (f,).
    `compliance` (f,) complex: rad/N m.
    `coherence` (f,): 0..1, of torque and angle.
    """

    frequency_hz: Annotated[FloatArray, "f"]
    compliance: NDArray[np.complex128]
    coherence: Annotated[FloatArray, "f"]
    segments: int


def frequency_response(samples: JointSamples, segment_s: float = SEGMENT_S) -> FrequencyResponse:
    """Averaged cross-spectra of half-overlapping Hann segments of all trials.

    ``H = S_r,theta / S_r,tau``. The reference r is the device's perturbation or command if the
    recording has it (it is free of voluntary torque), the angle if that is stated to be imposed,
    else the torque itself. Frequencies at which the reference has no power are left out.

    `samples`: torque and angle as recorded.
    `segment_s`: length of a segment, s.
    Returns: the compliance, rad/N m, and the coherence at each frequency, Hz.
    Raises InputError: every trial is shorter than a segment.
    """
    length = round(segment_s * samples.sample_rate_hz)
    reference = _reference(samples)
    segments = _segments(samples, length)
    if len(segments) == 0:
        raise InputError("no trial is long enough", expected=f"at least {segment_s:g} s")
    window = np.hanning(length)

    def transform(signal: FloatArray) -> np.ndarray:
        cut = signal[segments]
        return np.fft.rfft((cut - cut.mean(axis=1, keepdims=True)) * window, axis=1)

    r, tau, theta = transform(reference), transform(samples.torque), transform(samples.angle)
    power = (np.abs(r) ** 2).mean(axis=0)
    cross = (r.conj() * tau).mean(axis=0)
    both = (tau.conj() * theta).mean(axis=0)
    total = (np.abs(tau) ** 2).mean(axis=0) * (np.abs(theta) ** 2).mean(axis=0)
    # six decades below its peak, a low-passed perturbation is only rounding or converter noise
    seen = (power > 1e-6 * power.max()) & (np.arange(len(power)) > 0) & (total > 0)
    return FrequencyResponse(
        frequency_hz=np.flatnonzero(seen) / segment_s,
        compliance=((r.conj() * theta).mean(axis=0)[seen]) / cross[seen],
        coherence=np.abs(both[seen]) ** 2 / total[seen],
        segments=len(segments),
    )


def model_compliance(frequency_hz: FloatArray, parameters: FloatArray) -> np.ndarray:
    """``1 / (I s^2 + B s + K)`` at ``s = 2 pi i f``; parameters I, B, K.

    `frequency_hz` (f,): frequencies, Hz.
    `parameters` (3,): inertia I, kg m^2; viscosity B, N m s/rad; stiffness K, N m/rad.
    Returns: (f,) complex ndarray: the compliance at each frequency, rad/N m.
    """
    s = 2j * np.pi * np.asarray(frequency_hz)
    inertia, viscosity, stiffness = parameters
    return np.asarray(1 / (inertia * s**2 + viscosity * s + stiffness))


def _reference(samples: JointSamples) -> FloatArray:
    """Reference signal: stated or recorded as free of the subject's torque, else the torque."""
    signals = {
        "perturbation": samples.perturbation,
        "command": samples.command,
        "angle": samples.angle,
    }
    signal = signals.get(source_of(samples) or "torque")
    return samples.torque if signal is None else signal


def _segments(samples: JointSamples, length: int) -> np.ndarray:
    """Sample numbers (n, length) of half-overlapping segments that lie within one trial."""
    starts = [
        np.arange(first, last - length + 1, max(length // 2, 1))
        for first, last in zip(samples.offsets[:-1], samples.offsets[1:], strict=True)
    ]
    return np.concatenate(starts)[:, None] + np.arange(length)
