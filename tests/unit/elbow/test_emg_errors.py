"""Errors in regressors: the moments that take them out, in points and in products with motion."""

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from armimpedance.elbow.emg_errors import ErrorMoments, small_sample_term, solve_corrected
from armimpedance.elbow.emg_products import (
    amplitude_noise,
    moments_of_products,
    small_sample_of_products,
)
from armimpedance.errors import InputError, NotIdentifiableError
from armimpedance.signals.filters import lowpass

RATE = 100.0
#: k0, kF, kE of the varying joint; I and viscosity are left out: one kind of product is enough.
TRUE = np.array([5.0, 30.0, 20.0])
NAMES, UNITS = ("k0", "kF", "kE"), ("Nm/rad",) * 3


# --- points --------------------------------------------------------------------------------------


def point_moments(rng, x, sd, beta, noise):
    W = x + rng.standard_normal(x.shape) * sd
    y = x @ beta + noise * rng.standard_normal(len(x))
    S = np.broadcast_to(np.diag(np.square(sd)), (len(x), len(sd), len(sd)))
    gram = np.einsum("li,lj->lij", W, W)
    return ErrorMoments(gram, W * y[:, None], S, ("a", "b"), ("", ""))


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


def test_the_term_from_draws_is_the_term_of_points():
    """Mean over 4,000 draws of products that each scatter by as much as their mean: 2 % a standard
    error, and as much again from the errors in W themselves, 300 points: 8 %."""
    rng = np.random.default_rng(44)
    x = rng.normal(size=(300, 2))
    sd = np.array([0.3, 0.2])
    U = sd * rng.standard_normal((4000, 300, 2))
    W = x + sd * rng.standard_normal((300, 2))
    S = np.broadcast_to(np.diag(sd**2), (300, 2, 2))
    moments = ErrorMoments(W[:, :, None] * W[:, None], W, S, ("a", "b"), ("", ""))
    drawn = small_sample_of_products(W, U, moments)
    assert np.diag(drawn) == pytest.approx(np.diag(small_sample_term(moments)), rel=0.12)


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


# --- noise of an amplitude -----------------------------------------------------------------------


def test_drawn_noise_has_the_stated_size_and_band():
    """1,000 s of about 20 independent values a second: a standard deviation to 0.5 %."""
    offsets = np.array([0, 500, 1000])
    sd = np.array([0.02, 0.05])
    options = {"cutoff_hz": 10.0, "order": 5, "seed": 1}
    noise = amplitude_noise(sd, offsets, RATE, draws=100, **options)
    assert noise.shape == (100, 1000, 2)
    inner = noise[:, 100:400]
    assert inner.std(axis=(0, 1)) == pytest.approx(sd, rel=0.03)
    power = (np.abs(np.fft.rfft(inner * np.hanning(300)[:, None], axis=1)) ** 2).mean(axis=(0, 2))
    hz = np.fft.rfftfreq(300, 1 / RATE)
    assert power[hz > 16].sum() < 0.01 * power.sum()
    again = amplitude_noise(sd, offsets, RATE, draws=100, **options)
    assert np.array_equal(noise, again)


def test_noise_follows_a_standard_error_that_varies():
    sd = np.column_stack([np.linspace(0.01, 0.1, 2000)])
    noise = amplitude_noise(
        sd, np.array([0, 2000]), RATE, cutoff_hz=10.0, order=5, draws=200, seed=2
    )
    ratio = noise[:, 100:-100].std(axis=0)[:, 0] / sd[100:-100, 0]
    assert ratio.mean() == pytest.approx(1, rel=0.02)
    assert ratio[:300].mean() / ratio[-300:].mean() == pytest.approx(1, rel=0.06)


# --- products with motion ------------------------------------------------------------------------


def filtered(columns):
    """What a caller does to all columns and to the torque alike."""
    return lowpass(columns, 8.0, RATE, order=2, axis=-2)


def product_columns(amplitude, angle):
    """Columns of kF s_F theta, kE s_E theta, filtered: linear in the amplitude, (..., n, 2)."""
    return filtered(amplitude * angle[:, None])


@pytest.fixture(scope="module")
def scheduled():
    """60 experiments of 60 s: amplitude with errors of 40 % of its swing, in the band of its
    low-pass, which the filter of the columns takes in part."""
    rng = np.random.default_rng(43)
    n = 6000
    time = np.arange(n) / RATE
    swing = np.column_stack([np.sin(2 * np.pi * 0.7 * time), np.sin(2 * np.pi * 0.43 * time + 1)])
    true_s = 0.2 + 0.1 * swing
    sd = np.array([0.03, 0.03])
    sos = butter(4, 5.0, fs=RATE, output="sos")
    offsets = np.array([0, n])
    options = {"cutoff_hz": 10.0, "order": 5}
    made = []
    for k in range(60):
        angle = 0.1 * sosfiltfilt(sos, rng.standard_normal(n)) / 0.3
        torque = (TRUE[0] + true_s @ TRUE[1:]) * angle + 0.02 * rng.standard_normal(n)
        error = amplitude_noise(sd, offsets, RATE, draws=1, seed=1000 + k, **options)[0]
        seen = true_s + error
        W = np.column_stack([filtered(angle[:, None]), product_columns(seen, angle)])
        draws = amplitude_noise(sd, offsets, RATE, draws=20, seed=k, **options)
        U = product_columns(draws, angle)
        U = np.concatenate([np.zeros((20, n, 1)), U], axis=2)
        y = filtered(torque[:, None])[:, 0]
        moments = moments_of_products(W, y, U, np.arange(0, n + 1, 150), names=NAMES, units=UNITS)
        made.append(solve_corrected(moments, small_sample_of_products(W, U, moments)))
    return made


def test_products_are_corrected_where_least_squares_is_flattened(scheduled):
    """Mean of 60 runs within 3 standard errors of the mean; least squares more than 8 % low."""
    found = np.array([f.coefficients for f in scheduled])
    error = found.std(axis=0, ddof=1) / np.sqrt(len(found))
    assert (np.abs(found.mean(axis=0) - TRUE) < 3 * error).all()
    naive = np.array([f.naive for f in scheduled]).mean(axis=0)
    assert (naive[1:] < 0.92 * TRUE[1:]).all()
    assert (error[1:] < 0.02 * TRUE[1:]).all()


def test_intervals_of_products_cover(scheduled):
    """180 limits: 95 % of them with a standard error of 1.6 %, three allowed below."""
    inside = [
        np.abs(f.coefficients - TRUE) < 2.03 * np.sqrt(np.diag(f.covariance)) for f in scheduled
    ]
    assert np.mean(inside) > 0.95 - 0.05


def test_shapes_that_do_not_belong_together():
    W, y, U = np.ones((10, 2)), np.ones(10), np.ones((3, 10, 2))
    for bad in ((W[:9], y, U), (W, y[:9], U), (W, y, U[0]), (W, y, U[:, :9])):
        with pytest.raises(InputError, match="expected"):
            moments_of_products(*bad, np.array([0, 5, 10]), names=("a", "b"), units=("", ""))
    with pytest.raises(InputError, match="clusters up to 8"):
        moments_of_products(W, y, U, np.array([0, 8]), names=("a", "b"), units=("", ""))
