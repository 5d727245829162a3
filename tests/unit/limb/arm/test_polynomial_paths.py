"""Polynomial muscle paths: moment arms are the gradient, curvature the second derivative."""

import numpy as np
import pytest

from armimpedance.core.errors import ArmImpedanceError, InputError, NotIdentifiableError
from armimpedance.limb.arm.polynomial_paths import (
    PolynomialPaths,
    constant_paths,
    fit_paths,
    monomial_exponents,
)

BOX = np.array([[0.2, 1.9], [0.5, 2.2]])
SPANS = np.array([[True, False], [False, True], [True, True]])
MUSCLES = ("one", "two", "both")


def some_paths(order=2, seed=0, n=2):
    """Human-sized arms, each muscle over the joints that it spans."""
    rng = np.random.default_rng(seed)
    exponents = monomial_exponents(n, order + 1)
    coefficients = 0.03 * rng.standard_normal((3, len(exponents))) / 2 ** exponents.sum(axis=1)
    if n == 2:
        for row, spanned in zip(coefficients, SPANS, strict=True):
            row[exponents[:, ~spanned].any(axis=1)] = 0
    box = BOX if n == 2 else np.tile([0.1, 1.7], (n, 1))
    return PolynomialPaths(MUSCLES, exponents, coefficients, box)


def differences(function, q, step=1e-4):
    """Five-point differences along each angle, on a new last axis."""
    columns = []
    for unit in np.eye(q.shape[-1]) * step:
        near = function(q + unit) - function(q - unit)
        far = function(q + 2 * unit) - function(q - 2 * unit)
        columns.append((8 * near - far) / (12 * step))
    return np.stack(columns, axis=-1)


def postures(count=40, seed=1, n=2):
    low, high = BOX.T if n == 2 else (np.full(n, 0.1), np.full(n, 1.7))
    return np.random.default_rng(seed).uniform(low, high, (count, n))


@pytest.mark.parametrize("n", [1, 2, 3])
def test_moment_arms_and_curvature_are_derivatives_of_the_length(n):
    paths, q = some_paths(n=n), postures(n=n)
    np.testing.assert_allclose(paths.moment_arms(q), differences(paths.lengths, q), atol=1e-11)
    curvature = paths.curvature(q)
    np.testing.assert_allclose(curvature, differences(paths.moment_arms, q), atol=1e-11)
    np.testing.assert_array_equal(curvature, np.swapaxes(curvature, -1, -2))
    assert curvature.shape == (40, 3, n, n)


def test_the_fit_recovers_paths_of_its_order():
    truth, q = some_paths(), postures()
    found = fit_paths(MUSCLES, q, truth.moment_arms(q), 2, SPANS)
    elsewhere = postures(seed=5)
    np.testing.assert_allclose(
        found.paths.moment_arms(elsewhere), truth.moment_arms(elsewhere), atol=1e-12
    )
    np.testing.assert_allclose(
        found.paths.curvature(elsewhere), truth.curvature(elsewhere), atol=1e-11
    )
    assert found.rms.max() < 1e-13


def test_the_fit_of_noisy_arms_leaves_the_noise():
    truth, q, noise = some_paths(), postures(400), 1e-3
    noisy = truth.moment_arms(q)
    noisy = noisy + np.where(SPANS, np.random.default_rng(3).normal(0, noise, noisy.shape), 0)
    rms = fit_paths(MUSCLES, q, noisy, 2, SPANS).rms
    # relative standard error of an rms of 400 values: 1 / sqrt(800)
    assert np.abs(rms[SPANS] / noise - 1).max() < 4 / np.sqrt(800)
    assert (rms[~SPANS] == 0).all()


def test_higher_orders_fit_no_worse_and_lower_ones_say_by_how_much_they_miss():
    truth, q = some_paths(order=3), postures(100)
    rms = [fit_paths(MUSCLES, q, truth.moment_arms(q), L, SPANS).rms for L in (0, 1, 2, 3)]
    for coarse, fine in zip(rms, rms[1:], strict=False):
        total = (coarse**2).sum(axis=1), (fine**2).sum(axis=1)
        assert (total[1] <= total[0] * (1 + 1e-12)).all()
    assert rms[2][SPANS].min() > 1e-4
    assert rms[3].max() < 1e-13


def test_single_joint_muscles_know_nothing_of_the_other_joint():
    truth, q = some_paths(), postures()
    paths = fit_paths(MUSCLES, q, truth.moment_arms(q), 2, SPANS).paths
    arms = paths.moment_arms(q)
    assert (arms[:, 0, 1] == 0).all()
    assert (arms[:, 1, 0] == 0).all()
    moved = q + [0.0, 0.3]
    np.testing.assert_array_equal(paths.moment_arms(moved)[:, 0], arms[:, 0])


def test_arms_that_no_length_has_are_not_matched():
    # d/dq2 of the first arm is 0.03, d/dq1 of the second -0.03: a circulation
    q = postures(60)
    arms = 0.03 * np.stack([q[:, 1], -q[:, 0]], axis=-1)[:, None]
    rms = fit_paths(("whirl",), q, arms, 2, np.array([[True, True]])).rms
    assert rms.min() > 5e-3


def test_constant_paths_are_the_same_everywhere():
    G = np.array([[-0.05, 0.0], [0.03, 0.04]])
    paths, q = constant_paths(("a", "b"), G), postures(6).reshape(2, 3, 2)
    np.testing.assert_allclose(paths.moment_arms(q), np.broadcast_to(G, (2, 3, 2, 2)), atol=1e-16)
    assert (paths.curvature(q) == 0).all()
    assert paths.curvature(q).shape == (2, 3, 2, 2, 2)


@pytest.mark.parametrize(
    ("q", "muscle"),
    [
        (np.array([[0.5, 1.0], [0.6, 1.1], [0.9, 1.2]]), "both"),
        (np.linspace([0.2, 0.5], [1.9, 2.2], 30), "both"),
        (np.tile([1.0, 1.5], (30, 1)), "one"),
    ],
    ids=["three postures", "on a line", "one posture"],
)
def test_postures_that_do_not_determine_a_length_are_refused(q, muscle):
    with pytest.raises(NotIdentifiableError, match=f"muscle {muscle}") as told:
        fit_paths(MUSCLES, q, np.zeros((len(q), 3, 2)), 2, SPANS, box=BOX)
    assert "coefficients" in str(told.value)


@pytest.mark.parametrize("q", [[1.0], [np.nan, 1.0], [1.0, np.inf], [1.0, 2.0, 3.0], 1.0])
def test_angles_that_cannot_be_are_refused(q):
    with pytest.raises(InputError):
        some_paths().moment_arms(q)


@pytest.mark.parametrize(
    "change",
    [
        {"muscles": ("a", "a", "b")},
        {"exponents": np.array([[-1, 0]]), "coefficients": np.zeros((3, 1))},
        {"coefficients": np.zeros((3, 4))},
        {"box": np.array([[1.0, 1.0], [0.0, 1.0]])},
    ],
)
def test_paths_that_cannot_be_are_refused(change):
    given = some_paths()
    fields = {n: getattr(given, n) for n in ("muscles", "exponents", "coefficients", "box")}
    with pytest.raises(ArmImpedanceError):
        PolynomialPaths(**(fields | change))
