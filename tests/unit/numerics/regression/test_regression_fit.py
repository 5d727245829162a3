"""What a Fit says: order and names, intervals, quality, prediction, transform."""

import dataclasses

import numpy as np
import pytest

from armimpedance.core.errors import EstimationError, InputError
from armimpedance.numerics.regression import t_interval
from armimpedance.numerics.regression.factors import trial_factors
from armimpedance.numerics.regression.solve import fit

TRUTH = np.array([[1.7, -0.6], [8.6, -6.4], [105.0, -74.0]])


def problem(seed=0, noise=0.5, constant=False):
    rng = np.random.default_rng(seed)
    W = rng.standard_normal((20, 30, 3))
    if constant:
        W[..., 2] = 1.0
    return W, W @ TRUTH + noise * rng.standard_normal((20, 30, 2))


def fitted(W, Y, **more):
    factors = trial_factors(
        W,
        Y,
        regressors=["xdd", "xd", "x"],
        outputs=["fx", "fy"],
        regressor_units=["m/s^2", "m/s", "m"],
        output_units=["N", "N"],
    )
    return fit(factors, **more)


def test_parameters_run_over_regressors_then_outputs():
    result = fitted(*problem(noise=0.0))
    np.testing.assert_allclose(result.coefficients, TRUTH, rtol=1e-12)
    by_name = dict(zip(result.names, result.parameters, strict=True))
    assert by_name["fx:x"] == pytest.approx(105)
    assert by_name["fy:xd"] == pytest.approx(-6.4)
    assert result.names[3] == "fy:xdd"
    assert result.units[:3] == ("N/(m/s^2)", "N/(m/s)", "N/m")
    named = fitted(*problem(), parameter_names=list("abcdef"), parameter_units=["kg"] * 6)
    assert named.names == tuple("abcdef")
    assert named.units == ("kg",) * 6


def test_sd_is_the_spread_over_repetitions():
    """400 repetitions give a standard deviation within 1/sqrt(800) of itself (4 of those)."""
    rng = np.random.default_rng(1)
    W, _ = problem()
    found, told = [], []
    for _ in range(400):
        result = fitted(
            W, W @ TRUTH + 0.5 * rng.standard_normal((20, 30, 2)), covariance="classical"
        )
        found.append(result.parameters)
        told.append(result.sd)
    np.testing.assert_allclose(np.std(found, axis=0), np.mean(told, axis=0), rtol=4 / np.sqrt(800))
    bias = np.mean(found, axis=0) - TRUTH.T.ravel()
    assert np.abs(bias / np.mean(told, axis=0)).max() < 4 / np.sqrt(400)


def test_a_fit_cannot_be_changed():
    result = fitted(*problem())
    with pytest.raises(dataclasses.FrozenInstanceError):
        result.dof = 3
    with pytest.raises(ValueError, match="read-only"):
        result.coefficients[0, 0] = 0


def test_known_quantiles():
    values, sd = np.array([10.0]), np.array([2.0])
    # Two-sided 95 % points of the t distribution with 3 and 39 degrees of freedom, and normal.
    for dof, quantile in ((3, 3.182446), (39, 2.022691), (np.inf, 1.959964)):
        np.testing.assert_allclose(
            t_interval(values, sd, dof)[0], [10 - 2 * quantile, 10 + 2 * quantile], rtol=1e-6
        )
    with pytest.raises(InputError, match="level"):
        t_interval(values, sd, 3, 95)


def test_well_identified_is_the_two_sd_rule():
    result = fitted(*problem(noise=5.0))
    percent = 200 * result.sd / np.abs(result.parameters)
    np.testing.assert_array_equal(result.well_identified(), percent < 10)
    assert 0 < result.well_identified().sum() < 6
    assert result.well_identified(1e9).all()


def test_residual_spread_is_recovered():
    W, _ = problem(2)
    rng = np.random.default_rng(2)
    mix = np.array([[1.0, 0.7], [0.0, 0.4]])
    E = rng.standard_normal((20, 30, 2)) @ mix
    result = fitted(W, W @ TRUTH + E)
    remaining = (
        E.reshape(-1, 2)
        - W.reshape(-1, 3) @ np.linalg.lstsq(W.reshape(-1, 3), E.reshape(-1, 2), rcond=None)[0]
    )
    np.testing.assert_allclose(
        result.residual_covariance, remaining.T @ remaining / (600 - 3), rtol=1e-10
    )
    mean_square = np.trace(result.residual_covariance) / 2
    assert result.residual_sd == pytest.approx(np.sqrt(mean_square))


@pytest.mark.parametrize("constant", [False, True])
def test_correlation_is_that_of_the_series(constant):
    W, Y = problem(3, noise=30.0, constant=constant)
    result = fitted(W, Y)
    y, yhat = Y.reshape(-1, 2), result.predict(W).reshape(-1, 2)
    if constant:
        y, yhat = y - y.mean(axis=0), yhat - yhat.mean(axis=0)
    expected = (y * yhat).sum() / np.sqrt((y**2).sum() * (yhat**2).sum())
    assert 0.1 < expected < 0.99
    assert result.correlation == pytest.approx(expected, rel=1e-9)
    seen = result.validate(W, Y)
    assert seen.correlation == pytest.approx(expected, rel=1e-9)
    assert seen.r2 == pytest.approx(result.r2, rel=1e-9)


def test_validation_on_new_data():
    result = fitted(*problem(4, noise=0.1))
    W, Y = problem(5, noise=0.0)
    seen = result.validate(W, Y + [3.0, 0.0])
    assert seen.vaf > 0.9999
    np.testing.assert_allclose(seen.rms, [3.0, 0.0], atol=0.05)
    assert seen.r2 == pytest.approx(1 - 9 * 600 / ((Y + [3.0, 0.0]) ** 2).sum(), abs=1e-3)
    # A prediction of the wrong sign is worse than none.
    assert result.validate(W, -Y).r2 < -2
    assert result.validate(W, -Y).correlation == pytest.approx(-1, abs=1e-3)
    with pytest.raises(InputError, match="same rows"):
        result.validate(W[..., :2], Y)


def functions(x):
    return np.array([x[0] * x[4], np.sqrt(x[2]) / x[1], np.log(x[0]), np.sin(x[3])])


def jacobian(x):
    D = np.zeros((4, 6))
    D[0, 0], D[0, 4] = x[4], x[0]
    D[1, 2], D[1, 1] = 0.5 / np.sqrt(x[2]) / x[1], -np.sqrt(x[2]) / x[1] ** 2
    D[2, 0] = 1 / x[0]
    D[3, 3] = np.cos(x[3])
    return D


def test_transform_is_the_delta_method():
    result = fitted(*problem(6))
    names = ("product", "ratio", "log", "sine")
    found = result.transform(functions, names, units=("a", "b", "c", "d"))
    D = jacobian(result.parameters)
    np.testing.assert_allclose(found.covariance, D @ result.covariance @ D.T, rtol=1e-8)
    exact = result.transform(functions, names, jacobian=jacobian)
    np.testing.assert_allclose(found.sd, exact.sd, rtol=1e-9)
    assert (found.names, found.units, found.dof) == (names, ("a", "b", "c", "d"), 19)
    np.testing.assert_allclose(found.interval().mean(axis=1), functions(result.parameters))


def test_transform_of_linear_functions_is_exact_and_composes():
    result = fitted(*problem(7))
    A = np.random.default_rng(0).standard_normal((2, 6))
    found = result.transform(lambda x: A @ x, ("u", "v"))
    np.testing.assert_allclose(found.covariance, A @ result.covariance @ A.T, rtol=1e-9)
    same = result.transform(lambda x: x, result.names, result.units)
    np.testing.assert_allclose(same.covariance, result.covariance, rtol=1e-9, atol=1e-15)


def test_transform_refuses_what_it_cannot_do():
    result = fitted(*problem(8))
    with pytest.raises(InputError, match="names"):
        result.transform(lambda x: x[:2], ("one",))
    with pytest.raises(EstimationError, match="not finite"):
        result.transform(lambda x: [np.nan * x[0]], ("nothing",))


def test_outputs_of_zeros_are_refused():
    W, Y = problem(9)
    with pytest.raises(InputError, match="do not vary"):
        fitted(W, 0 * Y)


def test_warnings_are_added_to_a_copy():
    result = fitted(*problem(10))
    assert result.warnings == ()
    assert result.with_warning("one", "two").warnings == ("one", "two")
