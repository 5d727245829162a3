"""The exoskeleton's perturbation: low-passed white noise, or a binary sequence."""

from __future__ import annotations

from typing import Final, Literal, get_args

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from manipulandum_sim.elbow.device import RATE_HZ

Perturbation = Literal["white", "prbs"]

#: Low-pass of the white noise (section 4 of Ruiz 2011), Hz; order.
CUTOFF_HZ: Final = 10.0
ORDER: Final = 4
#: Clock of the binary sequence, Hz, and the bits of its shift register: a period of 10.2 s.
CLOCK_HZ: Final = 25.0
REGISTER: Final = 8
#: Root mean square of either, N m: the elbow moves by a few degrees.
RMS_Nm: Final = 2.0


def perturbation(kind: Perturbation, rng: np.random.Generator, samples: int) -> FloatArray:
    """One trial's perturbation, (samples,), N m at 1 kHz.

    Raises
    ------
    InputError
        An unknown kind.
    """
    if kind == "white":
        return _low_passed(rng, samples)
    if kind == "prbs":
        return _binary(rng, samples)
    raise InputError(f"no perturbation {kind!r}", expected=" or ".join(get_args(Perturbation)))


def _low_passed(rng: np.random.Generator, samples: int) -> FloatArray:
    """White noise behind a Butterworth low-pass; of rms `RMS_Nm` in the mean over draws."""
    from scipy.signal import butter, sosfilt

    sos = butter(ORDER, CUTOFF_HZ, fs=RATE_HZ, output="sos")
    impulse = np.zeros(round(RATE_HZ))
    impulse[0] = 1.0
    gain = np.sqrt((sosfilt(sos, impulse) ** 2).sum())
    run_in = len(impulse)
    white = rng.standard_normal(run_in + samples)
    return np.asarray(RMS_Nm / gain * sosfilt(sos, white)[run_in:])


def _binary(rng: np.random.Generator, samples: int) -> FloatArray:
    """A maximum-length sequence from anywhere in its period, held for a clock period a bit."""
    from scipy.signal import max_len_seq

    hold = round(RATE_HZ / CLOCK_HZ)
    bits = np.asarray(max_len_seq(REGISTER)[0], dtype=float)
    start = int(rng.integers(len(bits) * hold))
    place = (start + np.arange(samples)) // hold % len(bits)
    return np.asarray(RMS_Nm * (2 * bits[place] - 1))
