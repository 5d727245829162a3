"""Bernstein polynomials: what bounds on their coefficients say of the curve."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from armimpedance.muscles.models.activation.fit import (
    bernstein_basis,
    bernstein_slopes,
    increments,
    to_powers,
)

S = np.linspace(0, 1, 101)


@pytest.mark.parametrize("order", range(6))
def test_basis_adds_up_to_one_and_starts_and_ends_at_the_coefficients(order):
    basis = bernstein_basis(S, order)
    assert basis.sum(axis=-1) == pytest.approx(1.0)
    assert (basis >= 0).all()
    assert basis[0] == pytest.approx(np.eye(order + 1)[0])
    assert basis[-1] == pytest.approx(np.eye(order + 1)[-1])


@pytest.mark.parametrize("order", range(6))
def test_slopes_are_the_derivative(order):
    h = 1e-6
    numeric = (bernstein_basis(S + h, order) - bernstein_basis(S - h, order)) / (2 * h)
    assert bernstein_slopes(S, order) == pytest.approx(numeric, abs=1e-7)


@given(
    st.integers(1, 5),
    st.floats(0, 0.5),
    st.floats(0.01, 0.5),
    st.lists(st.floats(0, 1e4), min_size=6, max_size=6),
)
def test_powers_are_the_same_curve(order, low, width, numbers):
    beta = np.array(numbers[: order + 1])
    alpha = low + width * S
    powers = to_powers(low, low + width, order) @ beta
    size = np.abs(powers).max() + 1
    curve = np.polynomial.polynomial.polyval(alpha, powers)
    assert np.abs(curve - bernstein_basis(S, order) @ beta).max() <= 1e-9 * size


@given(st.integers(0, 5), st.lists(st.floats(0, 1e4), min_size=6, max_size=6))
def test_nonnegative_increments_make_a_curve_that_never_falls(order, numbers):
    gamma = np.array(numbers[: order + 1])
    rising = bernstein_basis(S, order) @ increments(order, increasing=True) @ gamma
    assert (np.diff(rising) >= -1e-9 * (1 + gamma.sum())).all()
    assert rising[0] == pytest.approx(gamma[0])
    plain = increments(order, increasing=False)
    assert np.array_equal(plain, np.eye(order + 1))
