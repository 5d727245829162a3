"""What the packages for discrete models need before and after: samples, and I, B, K of a model."""

from __future__ import annotations

import numpy as np
from record import Joint
from scipy.signal import butter, detrend, filtfilt

#: Both channels' low-pass: the band of the torque that the experimenter chose; samples per period
#: of it that are kept. At 1 kHz a plain ARX of these records ends at no joint at all.
CUTOFF_HZ, KEPT = 10.0, 5


def decimated(record: Joint, trial: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Angle and torque behind the low-pass, the ends cut off, and their rate."""
    b, a = butter(4, CUTOFF_HZ, fs=record.rate_hz)
    keep = round(record.rate_hz / (KEPT * CUTOFF_HZ))
    inner = slice(round(record.rate_hz / CUTOFF_HZ), -round(record.rate_hz / CUTOFF_HZ), keep)
    y, u = (filtfilt(b, a, detrend(x[trial]))[inner] for x in (record.angle, record.torque))
    return y, u, record.rate_hz / keep


def continuous(a: np.ndarray, b: np.ndarray, rate_hz: float) -> np.ndarray:
    """I, B, K of ``A(q) y = B(q) u``: poles by their logarithm, stiffness by the gain at 0 Hz."""
    poles = np.roots([1.0, *a])
    if (np.abs(poles.imag) < 1e-12).all() and (poles.real <= 0).any():
        return np.full(3, np.nan)
    s = np.log(poles.astype(complex)) * rate_hz
    stiffness = (1 + a.sum()) / b.sum()
    inertia = stiffness / (s[0] * s[1]).real
    return np.array([inertia, -inertia * s.sum().real, stiffness])
