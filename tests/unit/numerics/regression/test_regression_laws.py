"""Laws of the regression's room: what least squares, components and intervals must keep."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.numerics.regression import (
    ErrorMoments,
    Parameters,
    bootstrap,
    fit,
    leave_one_out,
    long_run_covariance,
    refuse_unreliable,
    t_factor,
    trial_factors,
)

T, S, P, Q = 9, 40, 3, 2
NAMES = {"regressors": ("a", "b", "c"), "outputs": ("u", "v")}


@pytest.fixture(scope="module")
def problem():
    rng = np.random.default_rng(11)
    W = rng.normal(size=(T, S, P)) * [1.0, 20.0, 1e-2]
    noise = rng.normal(size=(T, 1, Q)) + rng.normal(size=(T, S, Q)) * [1.0, 3.0]
    return W, W @ rng.normal(size=(P, Q)) + noise


def stacked(problem):
    W, Y = problem
    return W.reshape(-1, P), Y.reshape(-1, Q)


# Least squares


def test_the_textbook_s_classical_covariance(problem):
    """s_ij (W'W)^-1 with s = E'E / (n - p), for all pairs of outputs."""
    W, Y = stacked(problem)
    made = fit(trial_factors(*problem, **NAMES), covariance="classical")
    theta, *_ = np.linalg.lstsq(W, Y, rcond=None)
    E = Y - W @ theta
    s = E.T @ E / (len(W) - P)
    expected = np.kron(s, np.linalg.inv(W.T @ W))
    np.testing.assert_allclose(made.coefficients, theta, rtol=1e-9)
    np.testing.assert_allclose(made.covariance, expected, rtol=1e-8)


def test_the_share_explained_is_one_less_what_is_left(problem):
    W, Y = stacked(problem)
    made = fit(trial_factors(*problem, **NAMES))
    E = Y - W @ made.coefficients
    assert made.vaf == pytest.approx(1 - (E**2).sum() / (Y**2).sum(), rel=1e-9)


def test_validation_on_other_trials_is_what_their_residuals_say(problem):
    W, Y = problem
    made = fit(trial_factors(W[:6], Y[:6], **NAMES))
    told = made.validate(W[6:].reshape(-1, P), Y[6:].reshape(-1, Q))
    y = Y[6:].reshape(-1, Q)
    E = y - W[6:].reshape(-1, P) @ made.coefficients
    assert told.r2 == pytest.approx(1 - (E**2).sum() / (y**2).sum(), rel=1e-9)


def test_leaving_a_trial_out_is_fitting_the_others(problem):
    W, Y = problem
    made = leave_one_out(trial_factors(W, Y, **NAMES))
    for t in (0, 4, T - 1):
        rest = np.arange(T) != t
        theta, *_ = np.linalg.lstsq(W[rest].reshape(-1, P), Y[rest].reshape(-1, Q), rcond=None)
        np.testing.assert_allclose(made[t].reshape(theta.shape), theta, rtol=1e-8)


def test_the_bootstrap_scatters_as_the_trials_do(problem):
    """Whole trials drawn anew: the sd of their fits is that between clusters, within its noise."""
    factors = trial_factors(*problem, **NAMES)
    drawn, again = (bootstrap(factors, 400, seed=5) for _ in range(2))
    np.testing.assert_array_equal(drawn, again)
    assert len(np.unique(drawn[:, 0, 0])) > 350
    ratio = drawn.std(axis=0).T.ravel() / fit(factors, covariance="cr3").sd
    assert (ratio > 0.5).all()
    assert (ratio < 1.3).all()


def test_one_row_is_a_table_too():
    """A constant is found in a table of a single row, and kept as the intercept."""
    made = trial_factors(np.ones((1, 1, 1)), np.full((1, 1, 1), 2.0), regressors="c", outputs="u")
    assert made.intercept == "c"
    for last in (1.0, 2.0):
        W = np.ones((2, 3, 2))
        W[..., 1] = np.arange(6.0).reshape(2, 3)
        W[-1, -1, 0] = last
        made = trial_factors(W, W[..., :1], regressors="cx", outputs="u")
        assert made.intercept == ("c" if last == 1 else None)


@pytest.mark.parametrize("cosines", [3, 8])
def test_the_long_run_covariance_is_right_on_average_for_independent_residuals(cosines):
    """Its mean over residuals (I - H) e is (W'W)^-1, however slow the regressors are.

    It is quadratic in e, so that its values at all unit vectors e add up to that mean.
    """
    n = 60
    t = (np.arange(n) + 0.5) / n
    W = np.stack([np.ones(n), 50.0 * np.sin(7 * t), 1e-3 * t**2], axis=1)
    Q, R = np.linalg.qr(W)
    left = np.eye(n) - Q @ Q.T
    made = sum(long_run_covariance(R, W, left[:, [i]], cosines) for i in range(n))
    expected = np.linalg.inv(W.T @ W)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    np.testing.assert_allclose(made / scale, expected / scale, atol=1e-9)


def test_the_long_run_covariance_counts_slow_residuals_and_not_quick_ones():
    """Residuals of one frequency count where it is slow; the parameters' units do not matter."""
    n = 400
    t = np.arange(n) + 0.5
    W = np.stack([np.ones(n), 50.0 * np.sin(2 * np.pi * t / n)], axis=1)
    slow, quick = (np.cos(np.pi * j * t / n)[:, None] for j in (4, 90))
    R = np.linalg.qr(W, mode="r")
    ratio = long_run_covariance(R, W, slow, 8) / long_run_covariance(R, W, quick, 8)
    assert (np.diag(ratio) > 1e3).all()


@pytest.mark.parametrize("size", [1e-4, 1.0, 1e3])
def test_reliability_knows_no_units(size):
    """One regressor with a fifth of its length from errors; an exact one beside it."""
    rng = np.random.default_rng(9)
    W = size * rng.normal(size=(30, 2))
    gram = W[:, :, None] * W[:, None, :]
    total = gram[:, 0, 0].sum()
    error = np.zeros((30, 2, 2))
    error[:, 0, 0] = 0.2 * total / 30
    names = {"names": ("a", "b"), "units": ("", "")}
    alone = ErrorMoments(gram[:, :1, :1], W[:, :1], error[:, :1, :1], ("a",), ("",))
    assert refuse_unreliable(alone) == (pytest.approx(0.8), ("a",))
    both, least = refuse_unreliable(ErrorMoments(gram, W, error, **names))
    assert both == pytest.approx(0.8, abs=0.05)
    assert least == ("a",)
    with pytest.raises(NotIdentifiableError, match="nothing but zeros"):
        refuse_unreliable(ErrorMoments(gram * [[1, 0], [0, 0]], W, error, **names))


# Parameters and their intervals


@pytest.mark.parametrize("dof", [1.0, 4.5, 39.0, np.inf])
@pytest.mark.parametrize("level", [0.5, 0.9, 0.95, 0.999])
def test_the_factor_of_an_interval_is_student_s_quantile(dof, level):
    assert t_factor(dof, level) == pytest.approx(stats.t.ppf(0.5 + level / 2, dof), rel=1e-9)


@pytest.mark.parametrize("level", [-0.5, 0.0, 1.0, 1.5, 95])
def test_levels_that_are_none(level):
    with pytest.raises(InputError, match="level"):
        t_factor(10, level)


def test_functions_of_parameters_take_the_error_of_their_slopes():
    """Delta method against derivatives on paper: product, quotient and exponential."""
    root = np.random.default_rng(2).normal(size=(3, 3)) * 0.01
    values = np.array([2.0, -0.5, 3.0])
    given = Parameters(
        names=("a", "b", "c"),
        units=("m", "s", ""),
        values=values,
        covariance=root @ root.T,
        dof=12.0,
    )
    made = given.transform(
        lambda x: np.array([x[0] * x[1], x[2] / x[0], np.exp(x[1]), x[2] ** 4]),
        ("ab", "c/a", "exp b", "c4"),
    )
    a, b, c = values
    slopes = np.array([[b, a, 0], [-c / a**2, 0, 1 / a], [0, np.exp(b), 0], [0, 0, 4 * c**3]])
    np.testing.assert_allclose(made.values, [a * b, c / a, np.exp(b), c**4])
    expected = slopes @ root @ root.T @ slopes.T
    np.testing.assert_allclose(made.covariance, expected, rtol=1e-7, atol=1e-14)
    assert made.dof == 12.0
