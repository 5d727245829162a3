"""Modes: orthonormal, and sums against them replace derivatives of the signal."""

from __future__ import annotations

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.numerics.signals.modes import FEWEST, spline_modes


def test_white_noise_stays_white():
    modes = spline_modes(621, 1000.0)
    np.testing.assert_allclose(modes.smooth @ modes.smooth.T, np.eye(modes.count), atol=1e-12)


@pytest.mark.parametrize("rate", [250.0, 1000.0, 2000.0])
def test_derivatives_move_to_the_test_functions_whatever_the_ends_do(rate):
    t = np.arange(round(0.6 * rate) + 1) / rate
    modes = spline_modes(len(t), rate)
    # neither the signal nor its derivatives vanish at the ends
    w = 2 * np.pi * 3.0
    x, v, a = np.cos(w * t + 1), -w * np.sin(w * t + 1), -(w**2) * np.cos(w * t + 1)
    for operator, derivative in ((modes.first, v), (modes.second, a)):
        expected = modes.smooth @ derivative
        np.testing.assert_allclose(operator @ x, expected, atol=2e-4 * np.abs(expected).max())


def test_polynomials_of_degree_three_are_differentiated_exactly():
    t = np.linspace(0.0, 0.5, 501)
    modes = spline_modes(len(t), 1000.0)
    x = 3 - 2 * t + 4 * t**2 - 5 * t**3
    np.testing.assert_allclose(modes.first @ x, modes.smooth @ (-2 + 8 * t - 15 * t**2), rtol=1e-9)
    np.testing.assert_allclose(modes.second @ x, modes.smooth @ (8 - 30 * t), rtol=1e-8)


def test_short_windows_get_narrower_splines_and_too_short_ones_are_refused():
    assert spline_modes(101, 1000.0).count >= FEWEST
    with pytest.raises(InputError, match="at least 31 samples"):
        spline_modes(25, 1000.0)


def test_modes_are_remembered():
    assert spline_modes(621, 1000.0) is spline_modes(621, 1000.0)
