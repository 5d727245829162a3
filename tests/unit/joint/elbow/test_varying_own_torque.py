"""The subject pushes too: an autoregression in the torque is found, weighed and told."""

import functools
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.signal import lfilter

from armimpedance.joint.elbow.samples import from_recording
from armimpedance.joint.elbow.varying.beginning import begin
from armimpedance.joint.elbow.varying.data import (
    Autoregression,
    applied,
    by_reflection,
    from_reflections,
    phases,
    reflections_of,
    transposed,
    varying_data,
)
from armimpedance.joint.elbow.varying.departures import _probability
from armimpedance.joint.elbow.varying.equation import HALF, linearise, start
from armimpedance.joint.elbow.varying.identify import identify_varying
from armimpedance.joint.elbow.varying.smoother import course_of, factor_of, solve_course
from armimpedance.joint.elbow.varying.smoother_model import Levels, smoother_model
from manipulandum_sim.elbow.bench import simulate_bench
from manipulandum_sim.elbow.simulate import simulate_elbow

PROCESS = from_reflections(np.array([0.95, -0.4, 0.2]), 0.01)


@functools.cache
def _rig(subject="3", seed=0, repetitions=3, noise="nominal"):
    recording, truth = simulate_elbow(
        "varying", subject=subject, seed=seed, repetitions=repetitions, noise=noise
    )
    return from_recording(recording), truth


def _at(found, truth):
    first = np.repeat(truth.offsets[:-1], np.diff(found.offsets))
    return first + np.round(found.time_s * 1000).astype(int)


def test_reflections_and_autocovariances_belong_together():
    reflections, variance = reflections_of(PROCESS.covariance)
    assert reflections == pytest.approx([0.95, -0.4, 0.2])
    assert variance == pytest.approx(0.01**2)


def test_slopes_are_those_of_differences():
    reflections, phase = np.array([0.9, -0.5, 0.3]), phases(np.linspace(0.001, 0.4, 20), 3)
    steps = 1e-6 * np.eye(3)
    made = [from_reflections(reflections + s, 0.7).coefficients for s in (*steps, *-steps)]
    expected = (np.array(made[:3]) - made[3:]).T / 2e-6
    np.testing.assert_allclose(by_reflection(reflections), expected, atol=1e-8)
    process = from_reflections(reflections, 0.7)
    powers = [
        Autoregression(process.coefficients + s, 0.7).spectrum_at(phase) for s in (*steps, *-steps)
    ]
    expected = (np.array(powers[:3]) - powers[3:]).T / 2e-6
    np.testing.assert_allclose(process.with_slope_at(phase)[1], expected, rtol=1e-6, atol=1e-6)


def test_the_spectrum_holds_the_variance():
    frequency = np.arange(20000) / 20000
    assert PROCESS.spectrum(frequency).mean() == pytest.approx(PROCESS.rms**2, rel=1e-6)


def test_the_operator_makes_white_in_every_trial():
    lengths = np.array([12, 2, 9])
    A = PROCESS.operator(lengths)
    dense = applied(A, np.eye(23))
    assert transposed(A, np.eye(23)) == pytest.approx(dense.T)
    lags = np.concatenate([PROCESS.covariance, np.zeros(20)])
    for k in range(4, 24):
        lags[k] = PROCESS.coefficients @ lags[k - 3 : k][::-1]
    covariance = np.zeros((23, 23))
    for a, b in ((0, 12), (12, 14), (14, 23)):
        covariance[a:b, a:b] = toeplitz(lags[: b - a])
    assert dense @ covariance @ dense.T == pytest.approx(0.01**2 * np.eye(23), abs=1e-12)


@pytest.mark.study
def test_whitened_rows_know_sensors_and_subject():
    samples = from_recording(simulate_bench(0.07, 0.6, 20.0, duration_s=3.0, snr_db=30.0)[0])
    data = replace(varying_data(samples), own=PROCESS)
    eq = linearise(data, start(data))
    R = len(eq.centre)
    dense = np.zeros((R, len(data.angle)))
    for row, (centre, L) in enumerate(zip(eq.centre, eq.L, strict=True)):
        dense[row, centre - HALF : centre + HALF + 1] = L
    lags = list(PROCESS.covariance)
    while len(lags) < R:
        lags.append(PROCESS.coefficients @ lags[: -PROCESS.order - 1 : -1])
    sigma = np.diag(eq.sd_torque**2) + dense @ np.diag(eq.sd_angle**2) @ dense.T + toeplitz(lags)
    white = eq.whitened(np.eye(R))
    assert white @ sigma @ white.T == pytest.approx(np.eye(R), abs=1e-6)
    part = slice(30, 70)
    own = eq.whitened(np.eye(40), part)
    assert own @ sigma[part, part] @ own.T == pytest.approx(np.eye(40), abs=1e-6)


def test_the_smoother_with_a_torque_state_equals_weighted_least_squares():
    samples = from_recording(simulate_bench(0.07, 0.6, 20.0, duration_s=2.5, snr_db=30.0)[0])
    data = replace(varying_data(samples), own=PROCESS)
    course = start(data)
    eq, levels = linearise(data, course), Levels(2.0, 3.0, 1.0)
    model = smoother_model(data, eq, np.array([0.6, 20.0]))
    made, variance, sd_inertia = solve_course(course, model, levels)
    alone = course_of(course, model, levels, factor_of(model, levels))
    assert pytest.approx(made.K, rel=1e-9) == alone.K
    N, rows = len(data.angle), np.arange(len(eq.centre))
    X = np.zeros((len(rows), 2 * N))
    X[rows, eq.centre], X[rows, N + eq.centre] = eq.x1, eq.x0
    X = np.column_stack([X, eq.x2, eq.nuisance])
    D = np.diff(np.eye(N), 2, axis=0)
    q = model.unit * np.array([levels.B, levels.K]) ** 2
    prior = np.zeros((X.shape[1],) * 2)
    prior[:N, :N], prior[N : 2 * N, N : 2 * N] = D.T @ D / q[0], D.T @ D / q[1]
    prior[2 * N + 1 :, 2 * N + 1 :] = np.diag(eq.prior_sd**-2)
    white = eq.whitened(np.column_stack([X, eq.y]))
    H = white[:, :-1].T @ white[:, :-1] + prior
    dense = np.linalg.solve(H, white[:, :-1].T @ white[:, -1])
    sd = np.sqrt(np.diag(np.linalg.inv(H)))
    # tolerance: a hundredth of the standard error
    assert np.abs(made.K - dense[N : 2 * N]).max() < 0.01 * sd[N : 2 * N].min()
    assert np.sqrt(variance[:, 1]) == pytest.approx(sd[N : 2 * N], rel=0.01)
    assert sd_inertia == pytest.approx(sd[2 * N], rel=0.01)


def test_no_torque_is_found_where_there_is_none():
    for frequency in (1.0, 3.0):
        recording, _ = simulate_bench(
            0.07,
            0.6,
            lambda t, f=frequency: 20 * (1 + 0.3 * np.sin(2 * np.pi * f * t)),
            snr_db=40.0,
            duration_s=8.0,
        )
        assert begin(varying_data(from_recording(recording))).data.own.order == 0
    assert begin(varying_data(_rig(repetitions=1, noise="sensor")[0])).data.own.rms < 0.02


def test_the_torque_that_is_there_is_found():
    samples, truth = _rig(repetitions=1)
    found = identify_varying(samples, method="smoother")
    # slow, some 12 correlation times of 0.8 s: rms known to 1 / sqrt(24) = 20 %; 3 of them
    assert found.details["own_torque_rms"] == pytest.approx(truth.motion.restless.std(), rel=0.6)
    told = [w for w in found.warnings if "limits K" in w]
    assert len(told) == 1


@pytest.mark.study
def test_bands_hold_where_the_subject_pushes():
    samples, truth = _rig()
    found = identify_varying(samples, method="smoother")
    shares = []
    for name in "KB":
        low, high = found.band(name).T
        true = getattr(truth, name)[_at(found, truth)]
        shares.append(np.mean((low <= true) & (true <= high)))
    # 30 s hold at least 30 points that are independent, of B and of K
    assert np.mean(shares) > 0.95 - 3 * np.sqrt(0.95 * 0.05 / 60)


@pytest.mark.study
def test_a_spline_settles_where_the_subject_pushes():
    samples, truth = _rig("1", repetitions=2)
    found = identify_varying(samples, method="spline")
    assert np.sqrt(np.mean((found.B / truth.B[_at(found, truth)] - 1) ** 2)) < 0.1


def test_the_score_test_keeps_its_level():
    rng = np.random.default_rng(0)
    mixed = rng.standard_normal((6, 6))
    p = np.array([_probability(rng.standard_normal((50, 6)) @ mixed) for _ in range(2000)])
    # 3 standard errors of a share of .05
    assert np.mean(p < 0.05) == pytest.approx(0.05, abs=3 * np.sqrt(0.05 * 0.95 / 2000))
    away = rng.standard_normal((50, 6)) + 1.0
    assert _probability(away) < 1e-6


def test_a_process_that_was_drawn_comes_back():
    from armimpedance.joint.elbow.varying.beginning import Residual, own_torque

    rng = np.random.default_rng(0)
    v = lfilter([0.01], np.append(1, -PROCESS.coefficients), rng.standard_normal(20000))
    power = np.abs(np.fft.rfft(v)) ** 2 / len(v)
    frequency = np.arange(len(power)) / len(v)
    keep = slice(10, 8000)
    one = np.ones(len(power[keep]))
    made = own_torque(Residual(frequency[keep], power[keep], 1e-9 * one, one))
    at = np.array([0.001, 0.01, 0.1, 0.3])
    # some 160 bins per parameter and more: 20 %
    assert made.spectrum(at) == pytest.approx(PROCESS.spectrum(at), rel=0.2)


def test_order_none_is_no_torque():
    none = Autoregression()
    assert none.rms == 0
    assert applied(none.operator(np.array([3])), np.eye(3)) == pytest.approx(np.eye(3))
