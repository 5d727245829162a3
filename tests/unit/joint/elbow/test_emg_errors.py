"""Errors in regressors: the moments that take them out."""

import numpy as np
import pytest

from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.numerics.regression.errors_in_regressors import (
    ErrorMoments,
    small_sample_term,
    solve_corrected,
)


def point_moments(rng, x, sd, beta, noise):
    W = x + rng.standard_normal(x.shape) * sd
    y = x @ beta + noise * rng.standard_normal(len(x))
    S = np.broadcast_to(np.diag(np.square(sd)), (len(x), len(sd), len(sd)))
    gram = np.einsum("li,lj->lij", W, W)
    return ErrorMoments(gram, W * y[:, None], S, ("a", "b"), ("", ""))


@pytest.mark.study
def test_small_samples_are_unbiased_to_second_order():
    """One error-free and one erroneous column, 30 points, a fifth errors: without the small-sample
    term the mean of 1,500 runs is off by more than three standard errors, with it by less."""
    rng = np.random.default_rng(40)
    x = np.column_stack([np.ones(30), np.linspace(-1, 1, 30)])
    sd = np.array([0.0, 0.5 * x[:, 1].std()])
    beta = np.array([1.0, 2.0])
    made = [point_moments(rng, x, sd, beta, 0.1) for _ in range(1500)]
    with_term = np.array([solve_corrected(m, small_sample_term(m)).coefficients for m in made])
    without = np.array([solve_corrected(m).coefficients for m in made])
    error = with_term.std(axis=0) / np.sqrt(len(made))
    assert (np.abs(with_term.mean(axis=0) - beta) < 3 * error).all()
    assert without[:, 1].mean() - beta[1] > 3 * error[1]


def test_the_small_sample_term_is_of_the_size_of_one_points_errors():
    """(p + 1) S / C of regressors with equal errors, here one: 2 S per sum of C points."""
    rng = np.random.default_rng(41)
    x = rng.normal(size=(4000, 1))
    W = x + 0.1 * rng.normal(size=x.shape)
    S = np.full((4000, 1, 1), 0.01)
    moments = ErrorMoments(W[:, :, None] * W[:, None], W, S, ("a",), ("",))
    assert small_sample_term(moments)[0, 0] == pytest.approx(2 * 0.01, rel=0.05)


def test_no_errors_no_correction():
    rng = np.random.default_rng(42)
    x = rng.normal(size=(20, 2))
    moments = point_moments(rng, x, np.zeros(2), np.array([1.0, 2.0]), 0.3)
    found = solve_corrected(moments, small_sample_term(moments))
    assert found.coefficients == pytest.approx(found.naive, rel=1e-12)
    assert found.reliability == 1


def test_zeros_and_too_few_clusters_are_refused():
    zero = ErrorMoments(np.zeros((5, 1, 1)), np.zeros((5, 1)), np.zeros((5, 1, 1)), ("s",), ("",))
    with pytest.raises(NotIdentifiableError, match="s: nothing but zeros"):
        solve_corrected(zero)
    two = ErrorMoments(
        np.ones((2, 2, 2)), np.ones((2, 2)), np.zeros((2, 2, 2)), ("a", "b"), ("", "")
    )
    with pytest.raises(InputError, match="2 points for 2 coefficients"):
        solve_corrected(two)
