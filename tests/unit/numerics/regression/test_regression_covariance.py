"""Covariances against their definitions and against statsmodels, and their coverage."""

import numpy as np
import pytest
import regression_oracle as oracle
from hac_covariance import hac_covariance

from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.numerics.regression import ragged_factors, split_blocks, trial_factors
from armimpedance.numerics.regression.solve import fit

REGRESSORS, OUTPUTS = ("xdd", "xd", "x"), ("fx", "fy")


@pytest.fixture(scope="module")
def sm():
    """Loaded by the process that asks it alone."""
    import statsmodels.api

    return statsmodels.api


def problem(seed=0, trials=9, lengths=(30, 45), q=2):
    """Trials of different length with residuals that are correlated in time and over outputs."""
    rng = np.random.default_rng(seed)
    W, Y = [], []
    mix = np.array([[1.0, 0.6], [0.0, 0.8]])[:q, :q]
    for _ in range(trials):
        n = int(rng.integers(*lengths))
        w = rng.standard_normal((n, 3)) * [3.0, 0.2, 0.01] + rng.standard_normal(3) * 0.005
        e = np.cumsum(rng.standard_normal((n, q)), axis=0) @ mix * 0.1
        W.append(w)
        Y.append(w @ rng.standard_normal((3, q)).round(0) + e)
    return W, Y


def fitted(W, Y, kind):
    outputs = OUTPUTS[: Y[0].shape[1]]
    return fit(ragged_factors(W, Y, regressors=REGRESSORS, outputs=outputs), covariance=kind)


@pytest.mark.parametrize(
    ("kind", "slow"),
    [
        ("classical", oracle.classical),
        ("cr1", oracle.cluster_cr1),
        ("cr3", oracle.cluster_cr3),
    ],
)
@pytest.mark.parametrize("seed", [0, 1])
def test_covariance_is_its_definition(kind, slow, seed):
    W, Y = problem(seed)
    result = fitted(W, Y, kind)
    expected = slow(W, Y)
    np.testing.assert_allclose(result.coefficients, oracle.solve(W, Y), rtol=1e-10)
    sd = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(result.covariance, expected, atol=1e-9 * np.outer(sd, sd).max())
    np.testing.assert_allclose(result.sd, sd, rtol=1e-9)


def test_replicate_covariance_is_its_definition():
    W, Y = problem(6, trials=11)
    strata = [0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1]
    factors = ragged_factors(W, Y, regressors=REGRESSORS, outputs=OUTPUTS)
    result = fit(factors, covariance="replicates", strata=strata)
    expected = oracle.replicates(W, Y, strata)
    sd = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(result.sd, sd, rtol=1e-9)
    np.testing.assert_allclose(result.covariance, expected, atol=1e-9 * np.outer(sd, sd).max())
    assert result.dof == 8


def test_what_all_replicates_share_is_no_chance_to_replicates_and_is_to_cr3():
    """Equal trials within a stratum, a misfit that differs between strata: no variance at all."""
    rng = np.random.default_rng(7)
    w = rng.standard_normal((3, 40, 3))
    y = w @ rng.standard_normal((3, 2)) + rng.standard_normal((3, 40, 2))
    strata = np.tile([0, 1, 2], 4)
    factors = trial_factors(w[strata], y[strata], regressors=REGRESSORS, outputs=OUTPUTS)
    within = fit(factors, covariance="replicates", strata=strata)
    across = fit(factors, covariance="cr3")
    assert within.sd.max() < 1e-9 * across.sd.min()


@pytest.mark.parametrize("strata", [None, [0, 0, 1], [0] * 8 + [1]])
def test_replicates_need_a_label_for_each_cluster_and_two_of_each(strata):
    W, Y = problem(8)
    factors = ragged_factors(W, Y, regressors=REGRESSORS, outputs=OUTPUTS)
    with pytest.raises(InputError, match="strat"):
        fit(factors, covariance="replicates", strata=strata)


@pytest.mark.parametrize("lag", [0, 1, 7, 60])
def test_hac_is_its_definition_and_stays_inside_trials(lag):
    W, Y = problem(3)
    result = fitted(W, Y, "classical")
    E = [y - result.predict(w) for w, y in zip(W, Y, strict=True)]
    found = hac_covariance(W, E, result.triangle, lag)
    expected = oracle.hac(W, Y, lag)
    sd = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(found / np.outer(sd, sd), expected / np.outer(sd, sd), atol=1e-9)


def test_cr1_is_that_of_statsmodels(sm):
    W, Y = problem(4)
    groups = np.repeat(np.arange(len(W)), [len(w) for w in W])
    result = fitted(W, Y, "cr1")
    for output in range(2):
        theirs = sm.OLS(np.concatenate(Y)[:, output], np.concatenate(W)).fit(
            cov_type="cluster", cov_kwds={"groups": groups}, use_t=True
        )
        block = slice(3 * output, 3 * output + 3)
        np.testing.assert_allclose(result.covariance[block, block], theirs.cov_params(), rtol=1e-8)
        np.testing.assert_allclose(result.interval()[block], theirs.conf_int(), rtol=1e-7)


def test_classical_is_that_of_statsmodels(sm):
    W, Y = problem(5, q=1)
    theirs = sm.OLS(np.concatenate(Y)[:, 0], np.concatenate(W)).fit()
    result = fitted(W, Y, "classical")
    assert result.names == REGRESSORS
    np.testing.assert_allclose(result.interval(0.9), theirs.conf_int(0.1), rtol=1e-8)
    assert result.r2 == pytest.approx(theirs.rsquared, rel=1e-10)


@pytest.mark.parametrize("lag", [1, 5])
def test_hac_is_that_of_statsmodels(lag, sm):
    W, Y = problem(6, q=1)
    groups = np.repeat(np.arange(len(W)), [len(w) for w in W])
    result = fitted(W, Y, "classical")
    E = [y - result.predict(w) for w, y in zip(W, Y, strict=True)]
    panel = sm.OLS(np.concatenate(Y)[:, 0], np.concatenate(W)).fit(
        cov_type="hac-panel",
        cov_kwds={
            "groups": groups,
            "maxlags": lag,
            "use_correction": False,
            "df_correction": False,
        },
    )
    np.testing.assert_allclose(
        hac_covariance(W, E, result.triangle, lag), panel.cov_params(), rtol=1e-8
    )
    single = sm.OLS(np.concatenate(Y)[:, 0], np.concatenate(W)).fit(
        cov_type="HAC", cov_kwds={"maxlags": lag, "use_correction": False}
    )
    as_one = hac_covariance([np.concatenate(W)], [np.concatenate(E)], result.triangle, lag)
    np.testing.assert_allclose(as_one, single.cov_params(), rtol=1e-8)


def test_with_covariance_changes_only_the_covariance():
    W, Y = problem(7)
    result = fitted(W, Y, "cr1")
    other = result.with_covariance(4 * result.covariance, "hac", np.inf)
    np.testing.assert_allclose(other.sd, 2 * result.sd)
    np.testing.assert_array_equal(other.coefficients, result.coefficients)
    assert (other.covariance_kind, other.dof) == ("hac", np.inf)
    half = other.interval()[:, 1] - other.parameters
    np.testing.assert_allclose(half, 1.959963984540054 * other.sd, rtol=1e-9)


def test_projected_out_parameters_cost_degrees_of_freedom():
    """An offset and a ramp per trial, projected out or fitted as regressors, say the same."""
    rng = np.random.default_rng(8)
    T, S = 5, 40
    s = np.linspace(-1, 1, S)
    basis = np.linalg.qr(np.stack([np.ones(S), s], axis=1))[0]
    W, Y = rng.standard_normal((T, S, 2)), rng.standard_normal((T, S, 1))
    dummies = np.zeros((T, S, 2 * T))
    for t in range(T):
        dummies[t, :, 2 * t : 2 * t + 2] = basis
    outside = lambda a: a - basis @ (basis.T @ a)  # noqa: E731
    names = [f"w{j}" for j in range(2 + 2 * T)]
    full = fit(
        trial_factors(np.concatenate([W, dummies], axis=2), Y, regressors=names, outputs=["y"]),
        covariance="classical",
    )
    short = fit(
        trial_factors(
            outside(W), outside(Y), regressors=names[:2], outputs=["y"], nuisance_per_trial=2
        ),
        covariance="classical",
    )
    assert short.dof == full.dof
    np.testing.assert_allclose(short.coefficients, full.coefficients[:2], rtol=1e-9)
    np.testing.assert_allclose(short.covariance, full.covariance[:2, :2], rtol=1e-8)


def test_one_cluster_is_refused_with_the_way_out():
    W, Y = problem(9, trials=1, lengths=(100, 101))
    with pytest.raises(InputError, match="split_blocks"):
        fitted(W, Y, "cr1")
    blocks = split_blocks(100, 10)
    result = fitted([W[0][b] for b in blocks], [Y[0][b] for b in blocks], "cr1")
    assert result.dof == 9
    whole = fitted(W, Y, "classical")
    np.testing.assert_allclose(result.coefficients, whole.coefficients, rtol=1e-10)


def test_unknown_kind_and_too_few_rows_are_refused():
    W, Y = problem(10)
    with pytest.raises(InputError, match="cr1, cr3, replicates or classical"):
        fitted(W, Y, "hac")
    with pytest.raises(InputError, match="more rows"):
        fitted([W[0][:2], W[1][:1]], [Y[0][:2], Y[1][:1]], "cr1")


def test_cr3_says_when_one_trial_alone_informs_a_parameter():
    W, Y = problem(11)
    for w in W[1:]:
        w[:, 2] = 0
    with pytest.raises(NotIdentifiableError, match="without cluster 0"):
        fitted(W, Y, "cr3")


def autocorrelated_study(repeats=600, trials=40, samples=60, seed=20):
    """Which 95 % intervals hold the truth, (repeats, p) per kind, under AR(1) with rho = 0.95."""
    rng = np.random.default_rng(seed)
    truth = np.array([[1.0], [-2.0], [0.5]])
    s = np.linspace(0, 1, samples)
    shapes = np.stack([np.sin(np.pi * s), np.sin(2 * np.pi * s), np.cos(np.pi * s)], axis=1)
    held = {"classical": [], "cr1": [], "cr3": []}
    for _ in range(repeats):
        W = shapes * rng.choice([-1.0, 1.0, 0.5], size=(trials, 1, 3))
        e = rng.standard_normal((trials, samples, 1)) / np.sqrt(1 - 0.95**2)
        for i in range(1, samples):
            e[:, i] = 0.95 * e[:, i - 1] + e[:, i] * np.sqrt(1 - 0.95**2)
        factors = trial_factors(W, W @ truth + e, regressors=REGRESSORS, outputs=["f"])
        for kind, hits in held.items():
            low, high = fit(factors, covariance=kind).interval().T
            hits.append((low < truth[:, 0]) & (truth[:, 0] < high))
    return {kind: np.array(hits) for kind, hits in held.items()}


def test_coverage_clustered_holds_where_classical_fails():
    held = autocorrelated_study()
    standard_error = np.sqrt(0.95 * 0.05 / len(held["cr1"]))
    assert held["classical"].mean(axis=0).max() < 0.6
    for kind in ("cr1", "cr3"):
        error = held[kind].mean(axis=0) - 0.95
        assert np.abs(error).max() < 3.5 * standard_error, (kind, error / standard_error)
