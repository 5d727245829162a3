"""B-splines on whole numbers against SciPy's general ones."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BSpline

from armimpedance.numerics.signals.differentiate import cardinal_spline


@pytest.mark.parametrize("degree", [3, 5])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_values_and_derivatives_are_those_of_scipy(degree, order):
    places = np.linspace(-2, degree + 3, 1001)
    spline = BSpline.basis_element(np.arange(degree + 2.0), extrapolate=False).derivative(order)
    expected = np.nan_to_num(spline(places))
    np.testing.assert_allclose(cardinal_spline(places, degree, order), expected, atol=2e-15)


def test_splines_add_up_to_one_and_their_derivatives_to_nothing():
    places = 6.0 + np.linspace(0, 1, 50)
    values = [[cardinal_spline(places - k, 5, order) for k in range(8)] for order in range(3)]
    np.testing.assert_allclose(np.sum(values, axis=1)[0], 1, atol=1e-14)
    np.testing.assert_allclose(np.sum(values, axis=1)[1:], 0, atol=1e-14)
