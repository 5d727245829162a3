"""Symmetric and antisymmetric parts, with their errors."""

import numpy as np
import pytest
from scipy import stats

from armimpedance.core.records import ImpedanceEstimate, Quality
from armimpedance.hand.levels.symmetry import antisymmetric_part, symmetric_part


def estimate(k, covariance=None, seed=4, dof=39.0):
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((3 * k * k, 3 * k * k))
    matrices = rng.standard_normal((3, k, k))
    covariance = root @ root.T if covariance is None else covariance
    quality = Quality(40, 1000, 0.98, 0.96, 10.0, 3.0, 12, 0.1)
    return ImpedanceEstimate("hand", "test", *matrices, covariance, dof, quality)


@pytest.mark.parametrize("k", [1, 2, 3])
def test_the_parts_add_up(k):
    whole = estimate(k)
    symmetric, anti = symmetric_part(whole), antisymmetric_part(whole)
    rows, columns = np.triu_indices(k, 1)
    for index, name in enumerate(("inertia", "viscosity", "stiffness")):
        rebuilt = np.array(getattr(symmetric, name))
        np.testing.assert_array_equal(rebuilt, rebuilt.T)
        rebuilt[rows, columns] += anti.value[index]
        rebuilt[columns, rows] -= anti.value[index]
        np.testing.assert_allclose(rebuilt, getattr(whole, name), atol=1e-15)


def test_taking_the_symmetric_part_twice_changes_nothing():
    once = symmetric_part(estimate(2))
    twice = symmetric_part(once)
    np.testing.assert_array_equal(once.parameters, twice.parameters)
    np.testing.assert_allclose(once.covariance, twice.covariance, rtol=1e-14, atol=1e-14)


def test_errors_follow_from_the_variance_of_sums_and_differences():
    whole = estimate(2)
    S = whole.covariance[8:, 8:]  # K_11, K_12, K_21, K_22
    anti = antisymmetric_part(whole)
    assert anti.names[2] == ("K_12",)
    assert anti.sd[2, 0] == pytest.approx(np.sqrt(S[1, 1] + S[2, 2] - 2 * S[1, 2]) / 2)
    mean = symmetric_part(whole).sd[2, 0, 1]
    assert mean == pytest.approx(np.sqrt(S[1, 1] + S[2, 2] + 2 * S[1, 2]) / 2)
    assert symmetric_part(whole).sd[2, 0, 0] == pytest.approx(np.sqrt(S[0, 0]))


@pytest.mark.study
def test_a_symmetric_arm_is_rejected_as_often_as_promised():
    rng = np.random.default_rng(8)
    draws, hits = 4000, 0
    for _ in range(draws):
        noise = 2.0 * rng.standard_normal(12)
        scale = rng.chisquare(39) / 39
        quality = Quality(40, 1000, 0.98, 0.96, 10.0, 3.0, 12, 0.1)
        matrices = noise.reshape(3, 2, 2) + np.array([[5.0, 1.0], [1.0, 3.0]])
        covariance = 4.0 * scale * np.eye(12)
        anti = antisymmetric_part(
            ImpedanceEstimate("hand", "test", *matrices, covariance, 39, quality)
        )
        rejected = anti.p[2, 0] < 0.05
        low, high = anti.interval()[2, 0]
        assert rejected == (not low <= 0 <= high)
        hits += rejected
    # 4 standard errors of a proportion of .05
    assert abs(hits / draws - 0.05) < 4 * np.sqrt(0.05 * 0.95 / draws)


def test_t_and_interval():
    anti = antisymmetric_part(estimate(2, dof=np.inf))
    np.testing.assert_allclose(anti.t, anti.value / anti.sd)
    reach = (anti.interval(0.9)[..., 1] - anti.value) / anti.sd
    np.testing.assert_allclose(reach, stats.norm.ppf(0.95), rtol=1e-9)


def test_without_noise_there_is_no_test():
    anti = antisymmetric_part(estimate(2, covariance=np.zeros((12, 12))))
    assert np.isnan(anti.t).all()
    assert np.isnan(anti.p).all()
    assert antisymmetric_part(estimate(1)).value.shape == (3, 0)
