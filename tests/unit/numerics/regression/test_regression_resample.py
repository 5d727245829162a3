"""Leave-one-out and bootstrap on factors against refits on the samples."""

import numpy as np
import pytest
import regression_oracle as oracle

from armimpedance.core.errors import EstimationError, InputError, NotIdentifiableError
from armimpedance.numerics.regression.covariance import bootstrap, draw_counts, leave_one_out
from armimpedance.numerics.regression.diagnose import solve_positive
from armimpedance.numerics.regression.factors import ragged_factors, trial_factors
from armimpedance.numerics.regression.solve import fit


def problem(seed, trials=12, nearly_dependent=0.0):
    rng = np.random.default_rng(seed)
    W, Y = [], []
    for _ in range(trials):
        w = rng.standard_normal((int(rng.integers(3, 40)), 4)) * [1e3, 1.0, 1e-3, 1.0]
        if nearly_dependent:
            w[:, 3] = w[:, 1] + nearly_dependent * w[:, 3]
        W.append(w)
        Y.append(w @ rng.standard_normal((4, 2)) + rng.standard_normal((len(w), 2)))
    return W, Y


def factors_of(W, Y):
    return ragged_factors(W, Y, regressors=list("abcd"), outputs=["u", "v"])


def test_leave_one_out_is_the_refits():
    W, Y = problem(0)
    np.testing.assert_allclose(
        leave_one_out(factors_of(W, Y)), oracle.leave_one_out(W, Y), rtol=1e-9
    )


@pytest.mark.parametrize("strata", [None, [0, 1, 2] * 4])
def test_bootstrap_is_the_refits(strata):
    W, Y = problem(1)
    draws = bootstrap(factors_of(W, Y), 50, 7, strata)
    for counts, draw in zip(draw_counts(12, 50, 7, strata), draws, strict=True):
        np.testing.assert_allclose(draw, oracle.weighted_refit(W, Y, counts), rtol=1e-9)


def test_resampling_keeps_its_digits_where_columns_are_nearly_dependent():
    """Scaled condition near 1e6: Gram matrices of the raw columns would be left with 4 digits."""
    W, Y = problem(2, nearly_dependent=2e-6)
    factors = factors_of(W, Y)
    assert 5e5 < fit(factors).cond_scaled < 5e6
    np.testing.assert_allclose(leave_one_out(factors), oracle.leave_one_out(W, Y), rtol=1e-7)
    counts = draw_counts(12, 20, 3)
    refits = np.stack([oracle.weighted_refit(W, Y, c) for c in counts])
    np.testing.assert_allclose(bootstrap(factors, 20, 3), refits, rtol=1e-7)


def test_many_regressors_in_small_batches():
    rng = np.random.default_rng(3)
    W = rng.standard_normal((80, 5, 30))
    Y = W @ rng.standard_normal((30, 1)) + rng.standard_normal((80, 5, 1))
    factors = trial_factors(W, Y, regressors=[f"p{j}" for j in range(30)], outputs=["y"])
    draws = bootstrap(factors, 150, 4)
    for i in (0, 63, 64, 149):
        counts = draw_counts(80, 150, 4)[i]
        np.testing.assert_allclose(draws[i], oracle.weighted_refit(W, Y, counts), rtol=1e-8)


def test_counts_are_draws_with_replacement_within_strata():
    strata = np.array(["e", "n", "n", "e", "n"])
    counts = draw_counts(5, 4000, 0, strata)
    assert (counts[:, strata == "e"].sum(axis=1) == 2).all()
    assert (counts[:, strata == "n"].sum(axis=1) == 3).all()
    # A count is binomial with mean 1 and variance 1 - 1/n.
    for label, n in (("e", 2), ("n", 3)):
        own = counts[:, strata == label]
        assert np.abs(own.mean(axis=0) - 1).max() < 4 * np.sqrt((1 - 1 / n) / 4000)


def test_same_seed_same_bits_and_no_dependence_on_how_many():
    factors = factors_of(*problem(4))
    long, short = bootstrap(factors, 60, 5), bootstrap(factors, 20, 5)
    np.testing.assert_array_equal(draw_counts(12, 60, 5)[:20], draw_counts(12, 20, 5))
    np.testing.assert_allclose(long[:20], short, rtol=1e-12)
    np.testing.assert_array_equal(long, bootstrap(factors, 60, 5))
    assert not np.allclose(long, bootstrap(factors, 60, 6))


def test_a_seed_sequence_is_left_as_it_was():
    factors, seed = factors_of(*problem(5)), np.random.SeedSequence(1, spawn_key=(2, 3))
    first = bootstrap(factors, 10, seed)
    np.testing.assert_array_equal(first, bootstrap(factors, 10, seed))
    assert seed.n_children_spawned == 0
    other = np.random.SeedSequence(1, spawn_key=(2, 4))
    assert not np.allclose(first, bootstrap(factors, 10, other))


def test_bootstrap_covariance_agrees_with_the_clustered_one():
    """Both estimate one matrix; 4,000 draws give its standard errors within 1/sqrt(8000)."""
    rng = np.random.default_rng(6)
    W = rng.standard_normal((300, 20, 2))
    Y = W @ np.ones((2, 2)) + rng.standard_normal((300, 20, 2)) + rng.standard_normal((300, 1, 2))
    factors = trial_factors(W, Y, regressors=["a", "b"], outputs=["u", "v"])
    sd = np.sqrt(
        np.diag(
            np.cov(bootstrap(factors, 4000, 1).transpose(0, 2, 1).reshape(4000, -1), rowvar=False)
        )
    )
    # Between the two estimators themselves differences of order 1/300 remain.
    np.testing.assert_allclose(sd, fit(factors).sd, rtol=4 / np.sqrt(8000) + 2 / 300)


def rarely_informed(n_informing, trials=12):
    W, Y = problem(7, trials=trials)
    for w in W[n_informing:]:
        w[:, 3] = 0
    return W, Y


def test_resamples_that_lose_rank_are_drawn_again():
    W, Y = rarely_informed(3)
    first = draw_counts(12, 1000, 0)
    lost = first[:, :3].sum(axis=1) == 0
    draws = bootstrap(factors_of(W, Y), 1000, 0)
    assert 10 < lost.sum() < 100
    assert draws.shape == (1000, 4, 2)
    again = draw_counts(12, 1000, 0, attempt=1)
    whole = lost & (again[:, :3].sum(axis=1) > 0)
    for i in (*np.flatnonzero(whole)[:5], *np.flatnonzero(~lost)[:5]):
        counts = again[i] if lost[i] else first[i]
        np.testing.assert_allclose(draws[i], oracle.weighted_refit(W, Y, counts), rtol=1e-8)


@pytest.mark.parametrize("dead", [0, 1, 3])
def test_elimination_sees_rank_loss_wherever_it_is(dead):
    rng = np.random.default_rng(9)
    A = rng.standard_normal((3, 6, 4))
    A[1, :, dead] = 0
    gram, b = A.transpose(0, 2, 1) @ A, rng.standard_normal((3, 4, 2))
    x, pivot = solve_positive(np.moveaxis(gram, 0, -1), np.moveaxis(b, 0, -1))
    np.testing.assert_array_equal(pivot < 1e-10, [False, True, False])
    assert np.isfinite(x).all()
    for n in (0, 2):
        np.testing.assert_allclose(x[..., n], np.linalg.solve(gram[n], b[n]), rtol=1e-9)


def test_too_many_lost_resamples_are_an_error():
    with pytest.raises(EstimationError, match="lose rank"):
        bootstrap(factors_of(*rarely_informed(1)), 100, 0)
    with pytest.raises(NotIdentifiableError, match="without cluster 0"):
        leave_one_out(factors_of(*rarely_informed(1)))


def test_bad_calls():
    factors = factors_of(*problem(8))
    with pytest.raises(InputError, match="strata"):
        bootstrap(factors, 10, 0, strata=[1, 2])
    with pytest.raises(InputError, match="repeats"):
        bootstrap(factors, 0, 0)
