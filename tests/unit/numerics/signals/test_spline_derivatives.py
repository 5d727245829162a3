"""Motion at a camera's rate, smoothed and differentiated."""

from __future__ import annotations

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.numerics.signals.differentiate import smoothed_derivatives


def test_a_swing_at_thirty_frames_keeps_its_acceleration():
    rate, w = 30.0, 2 * np.pi * 2.0
    t = np.arange(300) / rate
    swing = np.stack([np.sin(w * t), np.cos(w * t)], axis=1)
    same, first, second = smoothed_derivatives(swing, rate, None)
    inside = slice(15, -15)
    assert np.array_equal(same, swing)
    exact = w * np.stack([np.cos(w * t), -np.sin(w * t)], axis=1)
    assert np.abs(first - exact)[inside].max() < 1e-3 * w
    assert np.abs(second + w**2 * swing)[inside].max() < 3e-3 * w**2
    # the central difference that a script would take
    assert np.abs(np.gradient(swing, 1 / rate, axis=0) - exact)[inside].max() > 0.025 * w


def test_polynomials_of_the_spline_s_degree_are_exact():
    t = np.arange(60) / 30.0
    x = 1 + t - 2 * t**3 + 0.3 * t**5
    _, first, second = smoothed_derivatives(x, 30.0, None)
    np.testing.assert_allclose(first, 1 - 6 * t**2 + 1.5 * t**4, rtol=1e-9, atol=1e-8)
    np.testing.assert_allclose(second, -12 * t + 6 * t**3, rtol=1e-8, atol=1e-7)


def test_the_filter_passes_what_is_slow_and_is_refused_beyond_nyquist():
    t = np.arange(600) / 30.0
    slow, fast = np.sin(2 * np.pi * 0.5 * t), np.sin(2 * np.pi * 12 * t)
    smooth, _, _ = smoothed_derivatives(slow + fast, 30.0, 4.0)
    assert np.abs(smooth - slow)[60:-60].max() < 0.02
    with pytest.raises(InputError, match="cut-off"):
        smoothed_derivatives(slow, 30.0, 15.0)
    with pytest.raises(InputError, match="16 or more"):
        smoothed_derivatives(slow[:15], 30.0, 4.0)
