"""Laws of a least-squares fit on factors, and hostile input to them."""

import numpy as np
import pytest
import regression_oracle as oracle

from armimpedance.core.errors import InputError
from armimpedance.numerics.regression import (
    TrialFactors,
    ragged_factors,
    split_blocks,
    trial_factors,
)
from armimpedance.numerics.regression.solve import fit

NAMES = {"regressors": ["xdd", "xd", "x"], "outputs": ["fx", "fy"]}


def problem(seed=0, trials=7, samples=50):
    rng = np.random.default_rng(seed)
    W = rng.standard_normal((trials, samples, 3))
    Y = W @ rng.standard_normal((3, 2)) + 0.3 * rng.standard_normal((trials, samples, 2))
    return W, Y


def same_fit(one, other, rtol=1e-10):
    np.testing.assert_allclose(one.coefficients, other.coefficients, rtol=rtol)
    np.testing.assert_allclose(one.sd, other.sd, rtol=rtol)
    assert one.r2 == pytest.approx(other.r2, rel=rtol)
    assert one.cond_scaled == pytest.approx(other.cond_scaled, rel=1e-8)


@pytest.mark.parametrize("kind", ["cr1", "cr3", "classical"])
def test_units_of_the_columns_do_not_matter(kind):
    W, Y = problem()
    units, out = np.array([1e-7, 3.0, 4e5]), np.array([1e3, 1e-3])
    plain = fit(trial_factors(W, Y, **NAMES), covariance=kind)
    scaled = fit(trial_factors(W * units, Y * out, **NAMES), covariance=kind)
    factor = out / units[:, None]
    np.testing.assert_allclose(scaled.coefficients, plain.coefficients * factor, rtol=1e-10)
    np.testing.assert_allclose(scaled.sd, plain.sd * factor.T.ravel(), rtol=1e-9)
    assert scaled.cond_scaled == pytest.approx(plain.cond_scaled, rel=1e-9)
    assert scaled.cond_raw > 1e11


def test_order_of_rows_inside_a_trial_does_not_matter():
    W, Y = problem(1)
    order = np.random.default_rng(0).permutation(50)
    same_fit(
        fit(trial_factors(W, Y, **NAMES)), fit(trial_factors(W[:, order], Y[:, order], **NAMES))
    )


def test_rotating_the_rows_of_a_trial_does_not_matter():
    W, Y = problem(2)
    Q = np.linalg.qr(np.random.default_rng(1).standard_normal((7, 50, 50)))[0]
    same_fit(fit(trial_factors(W, Y, **NAMES)), fit(trial_factors(Q @ W, Q @ Y, **NAMES)))


def test_order_of_trials_does_not_matter():
    factors = trial_factors(*problem(3), **NAMES)
    same_fit(fit(factors), fit(factors.subset([3, 1, 6, 0, 2, 5, 4])))


def test_zero_rows_add_nothing():
    W, Y = problem(4)
    padded = fit(
        trial_factors(
            np.pad(W, ((0, 0), (0, 9), (0, 0))), np.pad(Y, ((0, 0), (0, 9), (0, 0))), **NAMES
        )
    )
    np.testing.assert_allclose(
        padded.coefficients, fit(trial_factors(W, Y, **NAMES)).coefficients, rtol=1e-11
    )


def test_equal_and_ragged_trials_give_the_same():
    W, Y = problem(5)
    same_fit(fit(trial_factors(W, Y, **NAMES)), fit(ragged_factors(list(W), list(Y), **NAMES)))


def test_subset_and_usable_are_the_same_trials():
    W, Y = problem(6)
    keep = np.array([1, 1, 0, 1, 0, 1, 1], dtype=bool)
    W_hole = W.copy()
    W_hole[2] = np.nan
    kept = trial_factors(W_hole, Y, usable=keep, **NAMES)
    assert kept.n_clusters == 5
    np.testing.assert_array_equal(kept.r, trial_factors(W, Y, **NAMES).subset(keep).r)


@pytest.mark.parametrize("samples", [1, 2, 4])
def test_trials_shorter_than_the_number_of_columns(samples):
    W, Y = problem(7, trials=30, samples=samples)
    result = fit(trial_factors(W, Y, **NAMES))
    np.testing.assert_allclose(result.coefficients, oracle.solve(list(W), list(Y)), rtol=1e-10)
    assert result.n_rows == 30 * samples
    same_fit(result, fit(ragged_factors(list(W), list(Y), **NAMES)))


def test_more_trials_than_one_batch_holds():
    W, Y = problem(8, trials=500, samples=50)
    r = trial_factors(W, Y, **NAMES).r
    table = np.concatenate([W, Y], axis=2)
    np.testing.assert_allclose(
        r.transpose(0, 2, 1) @ r, table.transpose(0, 2, 1) @ table, atol=1e-11 * 500
    )
    assert (np.tril(r, -1) == 0).all()


def test_factors_keep_what_normal_equations_lose():
    """Two columns that differ by 1e-6 (scaled condition 7e5), no noise: the truth is exact."""
    rng = np.random.default_rng(9)
    W = rng.standard_normal((40, 100, 3))
    W[..., 2] = W[..., 0] + 2.9e-6 * W[..., 2]
    truth = np.array([[1.7, 0.3], [8.6, -6.4], [105.0, -74.0]])
    result = fit(trial_factors(W, W @ truth, **NAMES))
    stacked, y = W.reshape(-1, 3), (W @ truth).reshape(-1, 2)
    normal = np.linalg.solve(stacked.T @ stacked, stacked.T @ y)
    assert 5e5 < result.cond_scaled < 1e6
    ours = np.abs(result.coefficients / truth - 1).max()
    assert ours < 1e-8
    assert np.abs(normal / truth - 1).max() > 100 * ours


def test_the_constant_is_found_in_any_unit_and_place():
    W, Y = problem(10)
    W = np.concatenate([W[..., :1], np.full((7, 50, 1), -2.5), W[..., 1:]], axis=2)
    names = {"regressors": ["a", "offset", "b", "c"], "outputs": ["u", "v"]}
    Y = Y + [100.0, -3.0]
    for factors in (trial_factors(W, Y, **names), ragged_factors(list(W), list(Y), **names)):
        assert factors.intercept == "offset"
        result = fit(factors)
        E = Y - result.predict(W)
        about_mean = ((Y - Y.mean(axis=(0, 1))) ** 2).sum()
        assert result.centred
        assert result.r2 == pytest.approx(1 - (E**2).sum() / about_mean, rel=1e-9)


def test_a_constant_per_trial_is_not_the_constant():
    W, Y = problem(11)
    W[..., 0] = np.arange(1, 8)[:, None]
    assert trial_factors(W, Y, **NAMES).intercept is None
    assert ragged_factors(list(W), list(Y), **NAMES).intercept is None


def test_a_column_that_returns_to_where_it_was_is_not_the_constant():
    W, Y = problem(15)
    W[0, 0, 2] = W[-1, -1, 2] = 3.0
    assert trial_factors(W, Y, **NAMES).intercept is None


def test_blocks_cover_every_row_once():
    for n, size in ((100, 10), (109, 10), (20, 10), (7, 3)):
        blocks = split_blocks(n, size)
        assert np.array_equal(np.concatenate([np.arange(n)[b] for b in blocks]), np.arange(n))
        assert all(size <= b.stop - b.start < 2 * size for b in blocks)
    for n, size in ((19, 10), (5, 0), (5, -1)):
        with pytest.raises(InputError, match="blocks"):
            split_blocks(n, size)


def test_hostile_input_is_told_where_it_is():
    W, Y = problem(12)
    for bad in (np.nan, np.inf):
        broken = W.copy()
        broken[3, 7, 1] = bad
        with pytest.raises(InputError, match="column xd: not finite in cluster 3, sample 7"):
            trial_factors(broken, Y, **NAMES)
        with pytest.raises(InputError, match="column xd: not finite in cluster 3, sample 7"):
            ragged_factors(list(broken), list(Y), **NAMES)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"regressors": ["a", "b"]}, "columns"),
        ({"outputs": ["a"]}, "columns"),
        ({"regressors": ["a", "b", "b"]}, "different names"),
        ({"regressor_units": ["m"]}, "units"),
        ({"usable": np.zeros(7, bool)}, "nothing to fit"),
        ({"usable": np.ones(3, bool)}, "usable"),
    ],
)
def test_calls_that_do_not_fit_are_refused(change, match):
    W, Y = problem(13)
    with pytest.raises(InputError, match=match):
        trial_factors(W, Y, **(NAMES | change))


def test_shapes_that_do_not_fit_are_refused():
    W, Y = problem(14)
    for w, y in ((W, Y[:, :-1]), (W[0], Y[0]), (W, Y[..., 0])):
        with pytest.raises(InputError, match="shape"):
            trial_factors(w, y, **NAMES)
    with pytest.raises(InputError, match="blocks"):
        ragged_factors(list(W), list(Y)[:-1], **NAMES)
    with pytest.raises(InputError, match="intercept"):
        TrialFactors(np.eye(2)[None], [3], ("a",), ("y",), intercept="b")
