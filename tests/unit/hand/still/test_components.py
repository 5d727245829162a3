"""Variance components: known sizes come back, each step is a proper covariance."""

from __future__ import annotations

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.hand.still.variance_components import (
    _inverse,
    _middle,
    _middle_of_two,
    fit_components,
    total_covariance,
)

N = 12
LAG = np.abs(np.subtract.outer(np.arange(N), np.arange(N)))
SHAPES = np.stack([np.eye(N), np.ones((N, N)), 0.8**LAG])
SIZES = np.array([[[0.5, 0.1], [0.1, 0.3]], [[2.0, -0.5], [-0.5, 1.0]], [[1.0, 0.3], [0.3, 0.6]]])
NONE = np.zeros((2 * N, 2 * N))
FREE = np.zeros(3, dtype=bool)


def moment_of(sizes, draws, seed):
    covariance = total_covariance(sizes, SHAPES, NONE)
    rows = np.random.default_rng(seed).multivariate_normal(np.zeros(2 * N), covariance, draws)
    return rows.T @ rows / draws


def loss(sizes, moment):
    """-2 log likelihood of one trial."""
    covariance = total_covariance(sizes, SHAPES, NONE)
    return np.linalg.slogdet(covariance)[1] + np.trace(np.linalg.solve(covariance, moment))


def test_kronecker_structure():
    found = total_covariance(SIZES, SHAPES, NONE)
    expected = sum(np.kron(s, c) for s, c in zip(SIZES, SHAPES, strict=True))
    np.testing.assert_allclose(found, expected, atol=1e-14)


def test_exact_moment_gives_back_its_sizes():
    exact = total_covariance(SIZES, SHAPES, NONE)
    found = fit_components(exact, SHAPES, NONE, isotropic=FREE, steps=2000)
    np.testing.assert_allclose(found, SIZES, atol=2e-3)


def test_sizes_from_samples_lie_within_their_standard_errors():
    found = np.array(
        [
            fit_components(moment_of(SIZES, 300, s), SHAPES, NONE, isotropic=FREE, steps=200)
            for s in range(16)
        ]
    )
    error = found.std(axis=0) / np.sqrt(16)
    # t of 15 degrees of freedom beyond 4: once in a thousand
    assert (np.abs(found.mean(axis=0) - SIZES) < 4 * error).all()


def test_steps_raise_the_likelihood_and_keep_sizes_semidefinite():
    moment = moment_of(SIZES, 60, 7)
    losses, sizes = [], None
    for _ in range(25):
        sizes = fit_components(moment, SHAPES, NONE, isotropic=FREE, start=sizes, steps=1)
        assert np.linalg.eigvalsh(sizes).min() > -1e-12
        losses.append(loss(sizes, moment))
    assert (np.diff(losses) < 1e-9).all()
    assert losses[-1] <= loss(SIZES, moment)


def test_an_isotropic_component_stays_a_multiple_of_the_identity():
    isotropic = np.array([False, False, True])
    moment = moment_of(SIZES, 60, 3)
    found = fit_components(moment, SHAPES, NONE, isotropic=isotropic, steps=30)
    np.testing.assert_allclose(found[2], found[2, 0, 0] * np.eye(2), atol=1e-12 * found.max())


def test_a_component_that_is_not_there_vanishes():
    sizes = SIZES.copy()
    sizes[2] = 0
    exact = total_covariance(sizes, SHAPES, NONE)
    found = fit_components(exact, SHAPES, NONE, isotropic=FREE, steps=2000)
    assert np.abs(found[2]).max() < 1e-2


def test_shapes_that_do_not_belong_together_are_refused():
    with pytest.raises(InputError, match="moment"):
        fit_components(np.eye(5), SHAPES, NONE, isotropic=FREE)


def test_the_middle_of_two_axes_is_that_of_any_number():
    rng = np.random.default_rng(2)
    first, second = rng.normal(size=(2, 50, 2, 2))
    first, second = first @ first.transpose(0, 2, 1), second @ second.transpose(0, 2, 1)
    found = _middle_of_two(first, second)
    np.testing.assert_allclose(found @ first @ found, second, atol=1e-9 * np.abs(second).max())
    np.testing.assert_allclose(found, found.transpose(0, 2, 1), atol=1e-12 * np.abs(found).max())
    assert (np.linalg.eigvalsh(found) > 0).all()
    np.testing.assert_allclose(found, _middle(first, second), rtol=1e-5, atol=1e-9)


def test_the_middle_of_a_singular_target_is_singular():
    target = np.outer([1.0, 2.0], [1.0, 2.0])[None]
    expected = np.array([[[3.0, 1.0], [1.0, 2.0]]])
    found = _middle_of_two(expected, target)
    np.testing.assert_allclose(found @ expected @ found, target, atol=1e-9)


def test_a_start_for_axes_that_are_alike_is_nearly_the_maximum():
    """Noise alike in both axes: what is left to the full steps is next to nothing."""
    sizes = np.array([0.5, 2.0, 1.0])[:, None, None] * np.eye(2)
    moment = total_covariance(sizes, SHAPES, NONE)
    found = fit_components(moment, SHAPES, NONE, isotropic=FREE, steps=0)
    assert loss(found, moment) - loss(sizes, moment) < 1e-2


def test_a_covariance_that_rounding_leaves_indefinite_has_an_inverse():
    singular = np.diag([1.0, 1e-3, -1e-19])
    found, _ = _inverse(singular)
    np.testing.assert_allclose(found @ singular, np.eye(3), atol=1e-12)
