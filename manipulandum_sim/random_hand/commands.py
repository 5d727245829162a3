"""Random courses on every axis: filtered noise, its derivatives, and the person's own force."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.signal import lfilter

from armimpedance.core.arrays import FloatArray
from manipulandum_sim.hand import NoiseLevel
from manipulandum_sim.random_hand.rig import CORNER_HZ, RATE_HZ, TREMOR_WIDTH_HZ, Driver

#: A command rises and falls over this time (s) at a trial's ends.
RISE_S: Final = 0.5
#: Commands are known at every half sample.
FINE: Final = 2


def random_command(rig: Driver, rng: np.random.Generator) -> FloatArray:
    """Course of one trial and its first two derivatives at every half sample, (3, 2 S - 1, d)."""
    count, rate = FINE * (rig.samples - 1) + 1, FINE * RATE_HZ
    frequency = np.fft.rfftfreq(count, 1 / rate)[:, None]
    low, high = rig.band_hz
    inside = (frequency >= low) & (frequency <= high)
    shape = inside / (1 + (frequency / CORNER_HZ) ** 2) if rig.imposed == "position" else inside
    parts = rng.standard_normal((2, len(frequency), rig.axes))
    spectrum = shape * (parts[0] + 1j * parts[1])
    # sum of squares of a real course is twice that of its half spectrum
    expected = np.sqrt(2 * 2 * (shape**2).sum()) / count
    s = 2j * np.pi * frequency
    p, v, a = (np.fft.irfft(spectrum * s**n, count, axis=0) / expected for n in range(3))
    w, dw, ddw = _rise(np.arange(count)[:, None] / rate, (count - 1) / rate)
    course = np.stack([w * p, w * v + dw * p, w * a + 2 * dw * v + ddw * p])
    return np.asarray(rig.size * course)


def _rise(t: FloatArray, end: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """0 to 1 and back, a quintic at both ends, with derivatives."""
    first, last = np.clip(t / RISE_S, 0, 1), np.clip((end - t) / RISE_S, 0, 1)

    def step(u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        return (
            u**3 * (10 - 15 * u + 6 * u**2),
            30 * u**2 * (1 - u) ** 2 / RISE_S,
            60 * u * (1 - u) * (1 - 2 * u) / RISE_S**2,
        )

    up, down = step(first), step(last)
    # one of the two is constant wherever the other moves
    return up[0] * down[0], up[1] - down[1], up[2] + down[2]


def own_force(level: NoiseLevel, samples: int, axes: int, rng: np.random.Generator) -> FloatArray:
    """The person's own force (or torque) at the samples, (S, d): slow, and a tremor with width."""
    white = rng.standard_normal((2, samples, axes))
    keep = np.exp(-1 / (level.voluntary_time * RATE_HZ))
    start = keep * white[0, :1]
    slow = lfilter([np.sqrt(1 - keep**2)], [1, -keep], white[0], axis=0, zi=start)[0]
    return np.asarray(level.voluntary_sd * slow + level.tremor * tremor(white[1], level.tremor_hz))


def tremor(white: FloatArray, hz: float) -> FloatArray:
    """White noise (S, d) through a resonance, of rms 1."""
    b, a = tremor_filter(hz)
    response = lfilter(b, a, np.eye(1, 20_000)[0])
    return np.asarray(lfilter(b, a, white, axis=0) / np.sqrt((response**2).sum()))


def tremor_filter(hz: float) -> tuple[FloatArray, FloatArray]:
    """Coefficients of the resonance."""
    r = np.exp(-np.pi * TREMOR_WIDTH_HZ / RATE_HZ)
    return np.array([1.0, 0.0, -1.0]), np.array(
        [1.0, -2 * r * np.cos(2 * np.pi * hz / RATE_HZ), r**2]
    )
