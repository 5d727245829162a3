"""Hotelling's test with unequal covariances: Welch's test in one dimension, its level in three."""

import numpy as np
import pytest
from scipy import stats

from armimpedance.hand.comparison.matrix_test import hotelling


def summary(sample):
    """Mean, covariance of the mean, degrees of freedom."""
    n = len(sample)
    return sample.mean(axis=0), np.atleast_2d(np.cov(sample.T)) / n, float(n - 1)


def test_one_dimension_is_welch():
    rng = np.random.default_rng(1)
    one, two = rng.normal(0, 1, (9, 1)), rng.normal(0.5, 3, (14, 1))
    (m1, V1, f1), (m2, V2, f2) = summary(one), summary(two)
    square, p = hotelling(m2 - m1, (V1, V2), (f1, f2))
    welch = stats.ttest_ind(one[:, 0], two[:, 0], equal_var=False)
    assert square == pytest.approx(welch.statistic**2)
    assert p == pytest.approx(welch.pvalue)


def test_level_with_unequal_covariances():
    rng = np.random.default_rng(2)
    n, small = 1000, []
    for _ in range(n):
        (m1, V1, f1), (m2, V2, f2) = (
            summary(rng.normal(0, 1, (30, 3))),
            summary(rng.normal(0, 3, (10, 3)) @ np.array([[1, 0.5, 0], [0, 1, 0], [0, 0, 9]])),
        )
        small.append(hotelling(m2 - m1, (V1, V2), (f1, f2))[1] <= 0.05)
    # three standard errors of a rate of 5 %, and one point for the approximation
    assert abs(np.mean(small) - 0.05) < 3 * np.sqrt(0.05 * 0.95 / n) + 0.01


def test_known_covariances_give_chi_square_and_units_do_not_matter():
    d, V = np.array([1.0, 2.0]), np.array([[1.0, 0.3], [0.3, 2.0]])
    T2, p = hotelling(d, (V, V), (np.inf, np.inf))
    assert p == pytest.approx(stats.chi2.sf(d @ np.linalg.solve(2 * V, d), 2))
    S = np.diag([1e-4, 1e3])
    again = hotelling(S @ d, (S @ V @ S, S @ V @ S), (np.inf, np.inf))
    assert again[0] == pytest.approx(T2)


@pytest.mark.parametrize("deviations", [(1.0, 2.0, 3.0), (1.0, 0.0, 2.0)])
def test_a_direction_without_spread_has_no_test_and_others_keep_theirs(deviations):
    # the third element is the sum of the first two, or the second has no variance
    spread = np.array([[1.0, 0, 0], [0, 1, 0], [1, 1, 0]]) @ np.diag(deviations)
    singular = spread @ spread.T
    V = np.stack([np.eye(3), singular])
    T2, p = hotelling(np.ones((2, 3)), (V, V), (9.0, 9.0))
    assert T2[0] == pytest.approx(1.5)
    assert 0 < p[0] < 1
    assert np.isnan(T2[1])
    assert np.isnan(p[1])
