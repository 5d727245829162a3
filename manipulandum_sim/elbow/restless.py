"""The subject's unintended torque: slow voluntary torque, and tremor."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from manipulandum_sim.elbow.device import RATE_HZ

#: Slow voluntary torque, an Ornstein-Uhlenbeck process: sd N m, time constant s. A few per cent of
#: the 2 to 6 N m that each muscle holds: a contraction is not steadier than that.
VOLUNTARY_Nm: Final = 0.15
VOLUNTARY_S: Final = 0.8
#: Physiological tremor: sd of its torque N m, band Hz.
TREMOR_Nm: Final = 0.05
TREMOR_HZ: Final = (8.0, 12.0)
#: Seconds that the tremor's filter runs in on.
RUN_IN_S: Final = 2.0


def restless_torque(rng: np.random.Generator, samples: int) -> FloatArray:
    """Voluntary torque and tremor of one trial, (samples,), N m at 1 kHz."""
    return _voluntary(rng, samples) + _tremor(rng, samples)


def _voluntary(rng: np.random.Generator, samples: int) -> FloatArray:
    """``x_k+1 = c x_k + sqrt(1 - c^2) w_k`` with ``c = exp(-h / tau)``: exact at the samples."""
    from scipy.signal import lfilter

    white = rng.standard_normal(samples)
    keep = np.exp(-1 / (RATE_HZ * VOLUNTARY_S))
    white[1:] *= np.sqrt(1 - keep**2)
    return np.asarray(VOLUNTARY_Nm * lfilter([1.0], [1.0, -keep], white))


def _tremor(rng: np.random.Generator, samples: int) -> FloatArray:
    from scipy.signal import butter, sosfilt

    run_in = round(RUN_IN_S * RATE_HZ)
    sos = butter(2, TREMOR_HZ, "bandpass", fs=RATE_HZ, output="sos")
    impulse = np.zeros(2 * run_in)
    impulse[0] = 1.0
    gain = np.sqrt((sosfilt(sos, impulse) ** 2).sum())
    noise = sosfilt(sos, rng.standard_normal(run_in + samples))[run_in:]
    return np.asarray(TREMOR_Nm / gain * noise)
