"""The filtered sign of a velocity against the exact sign, filtered on a far finer clock."""

from __future__ import annotations

import numpy as np
import pytest

from armimpedance.numerics.signals.filters import filtered_sign, lowpass

RATE, CUTOFF_HZ, FINER = 30.0, 6.0, 64


def velocity(t):
    return np.sin(2 * np.pi * 0.9 * t + 0.3) + 0.4 * np.sin(2 * np.pi * 1.7 * t)


@pytest.fixture(scope="module")
def clocks():
    coarse = np.arange(300) / RATE
    fine = np.arange(300 * FINER) / (RATE * FINER)
    exact = lowpass(np.sign(velocity(fine)), CUTOFF_HZ, RATE * FINER, axis=0)[::FINER]
    return velocity(coarse), exact


def test_reversals_between_frames_are_seen(clocks):
    v, exact = clocks
    inside = slice(30, -30)
    error = np.abs(filtered_sign(v, CUTOFF_HZ, RATE) - exact)[inside].max()
    sampled = np.abs(lowpass(np.sign(v), CUTOFF_HZ, RATE, axis=0) - exact)[inside].max()
    # the two Butterworth filters of 30 and 1920 Hz differ by some hundredths near the cut-off
    assert error < 0.1
    assert sampled > 2 * error


def test_it_is_odd_and_without_a_filter_the_sign_itself(clocks):
    v, _ = clocks
    there, back = (filtered_sign(x, CUTOFF_HZ, RATE) for x in (v, -v))
    np.testing.assert_allclose(back, -there, atol=1e-12)
    assert np.array_equal(filtered_sign(v, None, RATE), np.sign(v))
