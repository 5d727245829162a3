"""Variance components: known sizes come back, each step is a proper covariance."""

from __future__ import annotations

import numpy as np
import pytest

from armimpedance.errors import InputError
from armimpedance.impedance.weighing.components import (
    _root_of_two,
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
            for s in range(30)
        ]
    )
    error = found.std(axis=0) / np.sqrt(30)
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


def test_roots_of_two_axes_are_those_of_any_number():
    rng = np.random.default_rng(2)
    factors = rng.normal(size=(50, 2, 2))
    stack = factors @ factors.transpose(0, 2, 1)
    roots = _root_of_two(stack)
    np.testing.assert_allclose(roots @ roots, stack, atol=1e-10 * np.abs(stack).max())
    np.testing.assert_allclose(roots, roots.transpose(0, 2, 1), atol=1e-14)
    singular = np.outer([1.0, 2.0], [1.0, 2.0])[None]
    np.testing.assert_allclose(_root_of_two(singular) @ _root_of_two(singular), singular, atol=1e-9)
