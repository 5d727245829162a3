"""Zero-phase filters: gain, no lag, batching changes nothing, bad cut-offs are refused."""

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.numerics.signals.filters import bandpass, lowpass

RATE = 1000.0


def _gain_and_lag(filtered, t, frequency):
    inside = slice(500, -500)
    wave = np.exp(-2j * np.pi * frequency * t[inside])
    value = 2 * (filtered[inside] * wave).mean()
    return abs(value), np.angle(value)


@pytest.mark.parametrize("frequency", [2.0, 10.0, 20.0])
def test_gain_is_the_butterworth_square_and_phase_is_zero(frequency):
    """Forward and backward: gain 1 / (1 + (f/fc)^2n), prewarping apart; no lag."""
    t = np.arange(4000) / RATE
    signal = np.cos(2 * np.pi * frequency * t)
    gain, lag = _gain_and_lag(lowpass(signal[None, :], 10.0, RATE)[0], t, frequency)
    assert gain == pytest.approx(1 / (1 + (frequency / 10.0) ** 4), rel=5e-3)
    assert abs(lag) < 1e-3


def test_batched_equals_one_by_one():
    signals = np.random.default_rng(0).normal(size=(5, 300, 2))
    batched = lowpass(signals, 15.0, RATE)
    single = lowpass(signals[3:4, :, 1:2], 15.0, RATE)
    assert np.allclose(batched[3, :, 1], single[0, :, 0], atol=1e-14)


def test_bandpass_removes_an_offset():
    signal = np.full((1, 3000), 7.0)
    assert np.abs(bandpass(signal, 5.0, 45.0, RATE)).max() < 1e-6


@pytest.mark.parametrize("cutoff", [0.0, -1.0, 500.0, 800.0, float("nan")])
def test_cutoffs_outside_the_nyquist_range_are_refused(cutoff):
    with pytest.raises(InputError, match="cut-off"):
        lowpass(np.zeros((1, 100)), cutoff, RATE)


def test_an_empty_band_is_refused():
    with pytest.raises(InputError, match="cut-off 45 to 5 Hz"):
        bandpass(np.zeros((1, 100)), 45.0, 5.0, RATE)
