"""Estimating equations: the same answers as the factors, as refits and as repeated trials."""

from __future__ import annotations

import numpy as np
import pytest

from armimpedance.core.errors import EstimationError, InputError, NotIdentifiableError
from armimpedance.numerics.regression.equations import (
    TrialEquations,
    leave_one_out_shift,
    solve_equations,
    solve_total,
)
from armimpedance.numerics.regression.factors import trial_factors
from armimpedance.numerics.regression.solve import fit

T, S, P, Q = 14, 30, 3, 2
STRATA = np.arange(T) % 4


@pytest.fixture
def factors():
    rng = np.random.default_rng(5)
    W = rng.normal(size=(T, S, P)) * [1.0, 30.0, 1e-3]
    noise = rng.normal(size=(T, 1, Q)) + rng.normal(size=(T, S, Q))
    Y = W @ rng.normal(size=(P, Q)) * 10 + noise
    return trial_factors(W, Y, regressors=("a", "b", "c"), outputs=("u", "v"))


def as_equations(factors):
    names = tuple(f"p{i}" for i in range(P * Q))
    return TrialEquations.of(factors, names, ("",) * (P * Q))


@pytest.mark.parametrize("kind", ["cr3", "replicates"])
def test_least_squares_comes_out_as_from_the_factors(factors, kind):
    plain = fit(factors, covariance=kind, strata=STRATA)
    found = solve_equations(as_equations(factors), covariance=kind, strata=STRATA)
    np.testing.assert_allclose(found.parameters, plain.parameters, rtol=1e-9)
    scale = np.sqrt(np.outer(np.diag(plain.covariance), np.diag(plain.covariance)))
    np.testing.assert_allclose(found.covariance / scale, plain.covariance / scale, atol=1e-8)
    assert found.dof == plain.dof


def test_leaving_out_is_solving_without(factors):
    equations = as_equations(factors)
    theta = solve_total(equations)
    shift = leave_one_out_shift(equations, theta)
    for t in (0, 5, T - 1):
        without = solve_total(equations.subset(np.arange(T) != t))
        np.testing.assert_allclose(theta - shift[t], without, rtol=1e-9)


def test_instruments_need_no_symmetry():
    rng = np.random.default_rng(9)
    A = rng.normal(size=(T, 2, 2)) + 4 * np.eye(2)
    theta = np.array([1.5, -2.0])
    equations = TrialEquations(A, A @ theta, ("a", "b"), ("", ""))
    np.testing.assert_allclose(solve_total(equations), theta, rtol=1e-12)
    assert np.abs(solve_equations(equations).covariance).max() < 1e-25


def test_what_cannot_be_solved_is_said():
    A = np.ones((T, 2, 2))
    equations = TrialEquations(A, np.ones((T, 2)), ("a", "b"), ("", ""))
    with pytest.raises(NotIdentifiableError, match="do not determine"):
        solve_total(equations)
    with pytest.raises(InputError, match="one cluster"):
        solve_equations(equations.subset([0]))
    good = TrialEquations(np.tile(np.eye(2), (T, 1, 1)), np.ones((T, 2)), ("a", "b"), ("", ""))
    with pytest.raises(InputError, match="no covariance"):
        solve_equations(good, covariance="hac")
    with pytest.raises(InputError, match="strata"):
        solve_equations(good, covariance="replicates")


def test_bootstrap_spread_is_near_the_clustered_one(factors):
    equations = as_equations(factors)
    drawn = solve_equations(equations, covariance="bootstrap", seed=1)
    jackknife = solve_equations(equations, covariance="cr3")
    ratio = np.diag(drawn.covariance) / np.diag(jackknife.covariance)
    # with 14 clusters the two differ by terms of order 1/14 and the draws by 5 %
    assert (ratio > 0.6).all()
    assert (ratio < 1.3).all()
    again = solve_equations(equations, covariance="bootstrap", seed=1)
    np.testing.assert_array_equal(again.covariance, drawn.covariance)


def test_bootstrap_of_too_few_clusters_is_refused():
    A = np.array([np.diag([1.0, 0.0]), np.diag([0.0, 1.0]), np.diag([1.0, 0.0])])
    equations = TrialEquations(A, np.ones((3, 2)), ("a", "b"), ("", ""))
    with pytest.raises(EstimationError, match="too few clusters"):
        solve_equations(equations, covariance="bootstrap")
