"""Laws of the differentiator: exact on polynomials, linear, the same smoothing on every order."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from armimpedance.core.errors import InputError
from armimpedance.numerics.signals.differentiate import derivatives, operator, spline_kernels

RATE = 1000.0


def _apply(signal, weights):
    half = len(weights) // 2
    centres = np.arange(half, len(signal) - half)
    return operator(weights, centres, len(signal)) @ signal


@given(
    width=st.floats(0.02, 0.2),
    rate=st.sampled_from([500.0, 1000.0, 2000.0]),
    coefficients=st.lists(st.floats(-2, 2), min_size=3, max_size=3),
)
def test_quadratics_are_differentiated_without_error(width, rate, coefficients):
    kernels = spline_kernels(width, rate)
    t = np.arange(kernels.half * 2 + 20) / rate
    a, b, c = coefficients
    signal = a + b * t + c * t**2
    inside = t[kernels.half : len(t) - kernels.half]
    assert _apply(signal, kernels.first) == pytest.approx(b + 2 * c * inside, abs=1e-7)
    assert _apply(signal, kernels.second) == pytest.approx(2 * c, abs=1e-4)


def test_smoothing_keeps_straight_lines():
    kernels = spline_kernels(0.1, RATE)
    t = np.arange(200) / RATE
    inside = t[kernels.half : len(t) - kernels.half]
    assert _apply(3.0 - 2.0 * t, kernels.smooth) == pytest.approx(3.0 - 2.0 * inside, abs=1e-12)


@pytest.mark.parametrize("frequency", [1.0, 5.0, 12.0])
def test_derivatives_of_a_sine_share_one_attenuation(frequency):
    """phi * X'' = -omega^2 phi * X: kinematics and force are smoothed alike, to 1e-6."""
    kernels = spline_kernels(0.12, RATE)
    omega = 2 * np.pi * frequency
    t = np.arange(600) / RATE
    inside = t[kernels.half : len(t) - kernels.half]
    sine, cosine = np.sin(omega * t), np.cos(omega * t)
    smooth, smooth_cosine = _apply(sine, kernels.smooth), _apply(cosine, kernels.smooth)
    assert np.abs(_apply(sine, kernels.second) + omega**2 * smooth).max() < 1e-6 * omega**2
    assert np.abs(_apply(sine, kernels.first) - omega * smooth_cosine).max() < 1e-6 * omega
    assert len(inside) == len(smooth)


def test_central_differences_are_exact_on_quadratics_inside():
    t = np.arange(50) / RATE
    first, second = derivatives((t**2)[None, :, None], RATE)
    assert first[0, 1:-1, 0] == pytest.approx(2 * t[1:-1])
    assert second[0, 2:-2, 0] == pytest.approx(2.0)


def test_an_empty_kernel_is_refused():
    with pytest.raises(InputError, match="kernel width"):
        spline_kernels(0.0, RATE)
