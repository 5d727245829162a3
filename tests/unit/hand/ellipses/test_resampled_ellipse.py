"""Ellipses from resamples: the delta method's answer where both hold, and axes that wrap round."""

from __future__ import annotations

import numpy as np
import pytest

from armimpedance.core.errors import EstimationError, InputError
from armimpedance.hand.ellipses import ellipse, resampled_ellipse

K = np.array([[104.8, -74.4], [-74.4, 179.3]])


def draws(matrix, covariance, count, seed=0):
    rng = np.random.default_rng(seed)
    return rng.multivariate_normal(np.ravel(matrix), covariance, count).reshape(-1, 2, 2)


def test_agrees_with_the_delta_method_where_errors_are_small():
    covariance = np.diag([4.0, 3.0, 3.0, 5.0])
    of = ellipse(K, covariance=covariance, dof=39)
    found = resampled_ellipse(of, draws(K, covariance, 20_000), 39).interval()
    by_derivative = of.interval()
    # half-widths from 20,000 draws: 0.5 %; second-order terms of errors of 3 % more
    widths = [np.diff(limits)[:, 0] for limits in (found, by_derivative)]
    np.testing.assert_allclose(widths[0], widths[1], rtol=0.06)
    np.testing.assert_allclose(found.mean(axis=1), by_derivative.mean(axis=1), rtol=0.02)


def test_turning_the_matrix_turns_the_axis_and_nothing_else():
    covariance = np.diag([4.0, 3.0, 3.0, 5.0])
    some = draws(K, covariance, 500)
    of = ellipse(K)
    plain = resampled_ellipse(of, some, 39)
    c, s = np.cos(0.6), np.sin(0.6)
    R = np.array([[c, -s], [s, c]])
    turned = resampled_ellipse(ellipse(R @ K @ R.T), R @ some @ R.T, 39)
    for name in ("sd_log_size", "sd_orientation_rad", "sd_log_shape", "correlation_of_axes"):
        assert getattr(turned, name) == pytest.approx(getattr(plain, name), rel=1e-9)


def test_an_axis_near_the_wrap_is_not_torn_apart():
    vertical = np.diag([50.0, 200.0])
    found = resampled_ellipse(ellipse(vertical), draws(vertical, 9 * np.eye(4), 2000), 39)
    # the elements' noise turns the axis by some 3 / (sqrt(2) 150) rad
    assert found.sd_orientation_rad == pytest.approx(3 / np.sqrt(2) / 150, rel=0.1)


def test_a_circle_has_no_orientation():
    circle = 100 * np.eye(2)
    found = resampled_ellipse(ellipse(circle), draws(circle, 9 * np.eye(4), 2000), 39)
    assert found.correlation_of_axes < 0.1
    np.testing.assert_allclose(found.interval()[1], [-np.pi / 2, np.pi / 2])


def test_hostile_resamples():
    of = ellipse(K)
    with pytest.raises(InputError, match="resamples"):
        resampled_ellipse(of, np.ones((5, 2, 2)), 10)
    with pytest.raises(EstimationError, match="no ellipse"):
        resampled_ellipse(of, -draws(K, np.eye(4), 50), 10)
    with pytest.raises(InputError, match="level"):
        resampled_ellipse(of, draws(K, np.eye(4), 50), 10).interval(1.5)
