"""Scatter of repetitions, and what residuals say of a fluctuating torque."""

from __future__ import annotations

import numpy as np
import pytest
from arm_bench import RATE, motion, wandering

from armimpedance.joint.therapy.arm.repeatability import (
    PRIOR_DOF,
    fluctuation_covariance,
    noise_density,
    scatter_of,
)

Q = np.linspace(0.0, np.pi / 2, 50)
NOISE = np.diag([1e-4, 1e-4])


def line(samples: int):
    _, q, _, _ = motion("elevation")
    return np.stack([q[:samples, 0], np.ones(samples)], axis=1)


def test_without_a_prior_it_is_the_covariance_of_the_repetitions():
    single = np.random.default_rng(1).normal([5, -4], 0.2, (4, 2))
    found = scatter_of(single, ["a"] * 4, NOISE, Q, prior_dof=0.0)
    assert np.allclose(found.covariance, np.cov(single, rowvar=False))
    assert found.dof == 3


def test_two_movements_scatter_about_a_mean_each():
    single = np.random.default_rng(1).normal([5, -4], 0.2, (6, 2))
    moved = single + np.repeat([[0.0, 0.0], [3.0, -7.0]], 3, axis=0)
    found, other = (scatter_of(x, list("aaabbb"), NOISE, Q) for x in (single, moved))
    assert np.allclose(found.seen, other.seen)
    assert found.dof == 4 + PRIOR_DOF


def test_alike_repetitions_keep_what_is_expected_of_them():
    single = np.tile([5.0, -4.0], (3, 1))
    found = scatter_of(single, ["a"] * 3, NOISE, Q)
    assert not found.seen.any()
    assert np.allclose(found.covariance, PRIOR_DOF / (PRIOR_DOF + 2) * found.expected)
    assert found.chance == pytest.approx(1.0)
    # the expected scatter of q_0 = -b/k is the stated one, beside the noise: not k's
    slope = np.array([4.0 / 25, 1 / 5.0])
    assert slope @ (found.expected - NOISE) @ slope == pytest.approx(0.02**2)


def test_chance_is_uniform_where_repetitions_scatter_as_expected_or_less():
    rng = np.random.default_rng(2)
    expected = scatter_of(np.tile([5.0, -4.0], (3, 1)), ["a"] * 3, NOISE, Q).expected
    root = np.linalg.cholesky(expected)
    rare = [
        scatter_of(
            [5.0, -4.0] + rng.standard_normal((3, 2)) @ root.T, ["a"] * 3, NOISE, Q
        ).chance < 0.05
        for _ in range(400)
    ]  # fmt: skip
    # never more often than stated; 3.3 standard errors of 400 draws
    assert np.mean(rare) < 0.05 + 3.3 * np.sqrt(0.05 * 0.95 / 400)


def test_disagreement_asks_for_size_and_for_significance():
    apart = np.array([[1.0, 1.0], [2.0, -1.5], [0.5, 0.5]])
    assert scatter_of(apart, ["a"] * 3, NOISE, Q).disagrees(1.0)
    # large scatter, but an arm that needs far more
    assert not scatter_of(apart, ["a"] * 3, NOISE, Q).disagrees(40.0)
    # large scatter that a strong fluctuation explains
    assert not scatter_of(apart, ["a"] * 3, np.diag([2.0, 4.0]), Q).disagrees(1.0)
    # significant, but of no size
    near = np.array([1.0, 1.0]) + 0.05 * (apart - apart.mean(axis=0))
    assert not scatter_of(near, ["a"] * 3, 1e-4 * NOISE, Q).disagrees(1.0)


@pytest.mark.parametrize("time_s", [0.2, 0.8])
def test_residuals_tell_how_much_a_fluctuation_moves_the_line(time_s):
    rng = np.random.default_rng(3)
    W = line(900)[110:-90]
    hat = np.linalg.pinv(W)
    said, lines = [], []
    for _ in range(40):
        e = [wandering(rng, len(W), 0.2, time_s) for _ in range(3)]
        fits = [hat @ x for x in e]
        left = [x - W @ f for x, f in zip(e, fits, strict=True)]
        said.append(fluctuation_covariance([W] * 3, left, RATE))
        lines += fits
    true = np.cov(np.array(lines), rowvar=False)
    # three repetitions tell a slow variance within a factor of two or so each, and not evenly to
    # both sides: their typical value is the geometric mean (its sd of 40 is .12 in the logarithm,
    # that of the true variance of 120 lines .13)
    typical = np.exp(np.mean([np.log(np.diag(v)) for v in said], axis=0))
    assert (np.abs(np.log(typical / np.diag(true))) < np.log(2.0)).all()


def test_density_of_white_noise():
    rng = np.random.default_rng(4)
    E = [0.3 * rng.standard_normal(800) for _ in range(200)]
    # cosines 3 to 9 of 200 residuals: 1400 squares
    expected = 0.3**2 / RATE
    assert noise_density(E, RATE) == pytest.approx(expected, rel=4 * np.sqrt(2 / 1400))
    # the variance of an integral over T is density T
    integrals = [e.sum() / RATE for e in E]
    assert np.var(integrals) == pytest.approx(expected * 800 / RATE, rel=4 * np.sqrt(2 / 200))


@pytest.mark.parametrize("size", [1e-3, 0.1, 10.0])
def test_what_is_the_arms_is_the_scatter_less_the_persons_own_torque(size):
    single = np.array([[5.0, -6.0], [5.2, -6.1], [4.9, -6.0]])
    noise = size * NOISE
    found = scatter_of(single, ["a"] * 3, noise, Q)
    least = np.linalg.eigvalsh(found.between)[0]
    assert least >= -1e-12 * np.trace(found.between)
    left = found.covariance - noise
    if np.linalg.eigvalsh(left)[0] > 0:
        assert found.between == pytest.approx(left)
    # never more than all of it, in any direction
    assert np.linalg.eigvalsh(found.covariance - found.between)[0] > -1e-9 * np.trace(noise)
