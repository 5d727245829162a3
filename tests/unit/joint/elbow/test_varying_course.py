"""B(t) and K(t) come back: every method, its bands and its warnings."""

import warnings
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.joint.elbow.samples import COMMANDED, JointSamples, from_recording
from armimpedance.joint.elbow.varying.data import varying_data
from armimpedance.joint.elbow.varying.equation import linearise, start
from armimpedance.joint.elbow.varying.identify import identify_varying
from armimpedance.joint.elbow.varying.methods import VARYING_METHODS
from armimpedance.joint.elbow.varying.smoother import START_INTENSITY, settle, smooth
from armimpedance.joint.elbow.varying.smoother_model import Levels, smoother_model
from manipulandum_sim.elbow.bench import simulate_bench

INERTIA, B0, K0 = 0.07, 0.6, 20.0


@cache
def _bench(frequency_hz=0.7, snr_db=40.0, seed=0, lag_s=0.0, trials=1):
    def swing(t):
        return 1 + 0.3 * np.sin(2 * np.pi * frequency_hz * (t - lag_s))

    recording, truth = simulate_bench(
        INERTIA,
        lambda t: B0 * swing(t),
        lambda t: K0 * swing(t),
        snr_db=snr_db,
        seed=seed,
        duration_s=8.0,
        trials=trials,
    )
    return from_recording(recording), truth


def _beginning(samples, count):
    """The first samples of a single trial."""
    return JointSamples(
        1000.0, ("1",), np.array([0, count]), samples.torque[:count], samples.angle[:count]
    )


def _amplitude(samples, frequency_hz=0.7):
    t = np.tile(np.arange(8000) / 1000, samples.n_trials)
    flexor = 0.3 + 0.2 * np.sin(2 * np.pi * frequency_hz * t)
    return np.stack([flexor, 0.25 + 0.1 * np.sin(2 * np.pi * 0.37 * t + 1)], axis=1)


def _found(method, samples, **options):
    if method == "emg":
        options.setdefault("amplitude", _amplitude(samples))
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        return identify_varying(samples, method=method, **options)


def _percent(found, truth):
    at = np.round(found.time_s * 1000).astype(int)
    return [
        100 * np.sqrt(np.mean((getattr(found, k) / getattr(truth, k)[at] - 1) ** 2)) for k in "KB"
    ]


def _covered(found, truth):
    at = np.round(found.time_s * 1000).astype(int)
    out = []
    for k in "KB":
        low, high = found.band(k).T
        out.append(np.mean((low <= getattr(truth, k)[at]) & (getattr(truth, k)[at] <= high)))
    return out


@pytest.mark.parametrize("method", VARYING_METHODS)
def test_a_slow_course_comes_back(method):
    samples, truth = _bench(0.3)
    options = {"amplitude": _amplitude(samples, 0.3)} if method == "emg" else {}
    found = _found(method, samples, every_s=0.05, **options)
    # to the nearest sample of what is left after decimation
    np.testing.assert_allclose(np.diff(found.time_s), 0.05, atol=0.004)
    assert max(_percent(found, truth)) < 10
    assert found.inertia.value == pytest.approx(INERTIA, rel=0.05)
    at = np.round(found.time_s * 1000).astype(int)
    for name in "BK":
        # of the size of their standard errors: eight seconds hold some ten independent errors
        half = np.diff(found.band(name))[:, 0] / 2
        error = getattr(found, name) - getattr(truth, name)[at]
        assert 0.05 < np.sqrt(np.mean((error / half) ** 2)) < 1.2
    if method != "emg":
        # 8 s hold at least 8 points that are independent, of B and of K: .95 -+ 3 of .054
        assert np.mean(_covered(found, truth)) > 0.95 - 3 * np.sqrt(0.95 * 0.05 / 16)
    assert found.method == method


@pytest.mark.study
@pytest.mark.parametrize("method", ["smoother", "spline"])
def test_a_fast_course_comes_back_where_windows_cannot(method):
    samples, truth = _bench(1.5)
    assert max(_percent(_found(method, samples), truth)) < 10
    windows = _found("windows", samples)
    assert min(_percent(windows, truth)) > 10
    assert any("faster than windows" in w for w in windows.warnings)


@pytest.mark.study
def test_the_smoother_at_25_db_with_its_own_noise_levels():
    samples, truth = _bench(0.7, 25.0)
    found = _found("smoother", samples)
    assert _percent(found, truth)[0] < 10
    assert np.mean(_covered(found, truth)) > 0.95 - 3 * np.sqrt(0.95 * 0.05 / 16)


@pytest.mark.study
def test_bands_of_windows_take_in_what_they_miss():
    samples, truth = _bench(1.0)
    found = _found("windows", samples)
    assert np.mean(_covered(found, truth)) > 0.95 - 3 * np.sqrt(0.95 * 0.05 / 16)
    assert found.details["bias_percent"]["K"] > 5


def free_course(data):
    """A course that is free to vary, without its own noise levels."""
    course = start(data)
    scale = np.array([np.abs(course.B).mean(), np.abs(course.K).mean()])
    return settle(data, course, Levels(START_INTENSITY, START_INTENSITY, 1.0), scale, strict=False)


def test_the_smoother_equals_dense_least_squares():
    samples, _ = _bench(0.7)
    data = varying_data(_beginning(samples, 2000))
    levels = Levels(2.0, 3.0, 1.5)
    made = smooth(data, free_course(data), levels)
    eq = linearise(data, made.course)
    N, R = len(data.angle), len(eq.centre)
    rows = np.arange(R)
    X = np.zeros((R, 2 * N))
    X[rows, eq.centre], X[rows, N + eq.centre] = eq.x1, eq.x0
    X = np.column_stack([X, eq.x2, eq.nuisance])
    sigma = np.zeros((R, R))
    for k, values in enumerate(eq.sigma):
        sigma += np.diag(values[: R - k], -k) + (np.diag(values[: R - k], k) if k else 0)
    sigma += np.diag((levels.torque**2 - 1) * eq.sd_torque**2)
    D = np.diff(np.eye(N), 2, axis=0)
    scale = smoother_model(data, eq, np.array([1.0, 1.0])).unit
    first = free_course(data)
    size = np.array([np.abs(first.B).mean(), np.abs(first.K).mean()])
    q = scale * size**2 * np.array([levels.B, levels.K]) ** 2
    prior = np.zeros((X.shape[1],) * 2)
    prior[:N, :N], prior[N : 2 * N, N : 2 * N] = D.T @ D / q[0], D.T @ D / q[1]
    prior[2 * N + 1 :, 2 * N + 1 :] = np.diag(eq.prior_sd**-2)
    weighted = np.linalg.solve(sigma, np.column_stack([X, eq.y]))
    dense = np.linalg.solve(X.T @ weighted[:, :-1] + prior, X.T @ weighted[:, -1])
    # the course has settled: dense least squares about it gives it back
    inner = slice(20, -20)
    assert made.course.K[inner] == pytest.approx(dense[N : 2 * N][inner], rel=0.01)
    assert made.course.B[inner] == pytest.approx(dense[:N][inner], rel=0.02)
    assert made.course.inertia == pytest.approx(dense[2 * N], rel=1e-3)


def test_a_constant_joint_is_found_constant():
    recording, _ = simulate_bench(INERTIA, B0, K0, snr_db=30.0, duration_s=8.0)
    samples = from_recording(recording)
    # windows need all of it to exclude what may hide; the others see a constant in less
    for method in ("smoother", "spline"):
        found = _found(method, _beginning(samples, 4000))
        assert np.ptp(found.K) < 0.1 * K0
        assert found.K.mean() == pytest.approx(K0, rel=0.02)
    assert not _found("windows", samples).warnings


@pytest.mark.study
@pytest.mark.first_cases(1)
@pytest.mark.parametrize("method", VARYING_METHODS)
def test_trials_are_kept_apart(method):
    samples, truth = _bench(0.7, 40.0, 3, 0.0, 2)
    found = _found(method, samples)
    assert found.trials == samples.trials
    for row in range(2):
        here = found.points_of(row)
        assert found.time_s[here][0] < 0.6
        at = np.round(found.time_s[here] * 1000).astype(int)
        assert np.sqrt(np.mean((found.K[here] / truth.K[at] - 1) ** 2)) < 0.12


@pytest.mark.study
def test_the_same_samples_give_the_same_bits():
    samples = _beginning(_bench()[0], 2000)
    a, b = (_found("smoother", samples) for _ in range(2))
    assert (a.K == b.K).all()
    assert (a.sd_B == b.sd_B).all()


@pytest.mark.study
def test_units_of_the_angle_do_not_matter():
    # an angle in another unit scales I, B and K, and nothing else
    samples = _beginning(_bench()[0], 3000)
    factor = 10.0
    other = replace(samples, angle=samples.angle * factor)
    a, b = _found("spline", samples), _found("spline", other)
    assert b.K * factor == pytest.approx(a.K, rel=1e-4)
    assert b.sd_B * factor == pytest.approx(a.sd_B, rel=1e-2)


def test_the_emg_law_finds_its_coefficients():
    samples, truth = _bench(4.0)
    found = _found("emg", samples, amplitude=_amplitude(samples, 4.0))
    assert max(_percent(found, truth)) < 6
    assert not found.warnings
    # K = 20 (1 + .3 sin) = 20 (1 + .3 (aF - .3) / .2)
    for name, value in (("kF", 30.0), ("k0", 11.0), ("kE", 0.0), ("bF", 0.9)):
        estimate, sd = found.details["coefficients"][name]
        assert abs(estimate - value) < 4 * sd


def test_a_lag_is_told_and_read():
    samples, _ = _bench(0.7, 40.0, 0, 0.05)
    told = [w for w in _found("emg", samples).warnings if "lag of about" in w]
    assert len(told) == 1
    assert float(told[0].split("about ")[1].split(" ms")[0]) == pytest.approx(50, abs=10)


def test_a_saturating_law_is_told():
    t = np.arange(8000) / 1000

    def course(t):
        a = 0.3 + 0.2 * np.sin(2 * np.pi * 0.7 * t)
        return 0.5 + a / (a + 0.3)

    recording, _ = simulate_bench(
        INERTIA, B0, lambda t: K0 * course(t), snr_db=40.0, duration_s=8.0, seed=1
    )
    samples = from_recording(recording)
    assert len(t) == len(samples.torque)
    assert any("linear law does not hold" in w for w in _found("emg", samples).warnings)


@pytest.mark.study
def test_errors_of_the_amplitudes_are_accounted_for():
    from armimpedance.numerics.signals.filters import lowpass

    samples, _ = _bench(0.7)
    clean = _amplitude(samples)
    off = []
    for seed in range(4):
        rng = np.random.default_rng(seed)
        noise = lowpass(rng.standard_normal(clean.shape), 10.0, 1000.0, order=5, axis=0)
        noisy = clean + 0.08 * noise / noise.std()
        sd = np.array([0.08, 0.08])
        naive = _found("emg", samples, amplitude=noisy).details["coefficients"]["kF"]
        known = _found("emg", samples, amplitude=noisy, amplitude_sd=sd).details["coefficients"]
        off.append([naive[0] / 30 - 1, known["kF"][0] / 30 - 1])
    mean, error = np.mean(off, axis=0), np.std(off, axis=0) / np.sqrt(len(off))
    # attenuation var / (var + .08^2) = .02 / .0264: drawn to zero by a quarter
    assert mean[0] < -0.1
    assert abs(mean[1]) < max(3 * error[1], 0.5 * abs(mean[0]))


@pytest.mark.parametrize("lag_s", [0.0, 0.05])
def test_errors_of_the_amplitudes_are_no_lag(lag_s):
    from armimpedance.numerics.signals.filters import lowpass

    samples, _ = _bench(0.7, 40.0, 0, lag_s)
    clean = _amplitude(samples)
    noise = np.random.default_rng(2).standard_normal(clean.shape)
    noise = lowpass(noise, 10.0, 1000.0, order=5, axis=0)
    noisy = clean + 0.02 * noise / noise.std()
    found = _found("emg", samples, amplitude=noisy, amplitude_sd=np.array([0.02, 0.02]))
    assert any("lag of about" in w for w in found.warnings) == (lag_s > 0)


def test_amplitudes_that_move_together_still_give_a_course():
    samples, truth = _bench()
    alike = _amplitude(samples)[:, [0, 0]]
    found = _found("emg", samples, amplitude=alike)
    assert max(_percent(found, truth)) < 6
    assert "coefficients" not in found.details
    assert any("+1 flexor +1 extensor" in w for w in found.warnings)


def test_amplitudes_that_are_all_error_are_refused():
    samples, _ = _bench()
    noise = 0.3 + 0.05 * np.random.default_rng(0).standard_normal((8000, 2))
    with pytest.raises(NotIdentifiableError, match="errors explain"):
        _found("emg", samples, amplitude=noise, amplitude_sd=np.array([0.05, 0.05]))


@pytest.mark.study
def test_the_commanded_torque_is_told():
    samples = _beginning(_bench()[0], 3000)
    found = _found("windows", replace(samples, torque_is="commanded"))
    assert COMMANDED in found.warnings


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"method": "kalman"}, "unknown method"),
        ({"method": "emg"}, "without EMG"),
        ({"method": "emg", "amplitude": np.ones((3, 2))}, "shape"),
        ({"method": "emg", "amplitude": np.ones((8000, 2))}, "flexor"),
        ({"method": "smoother", "window_s": 0.5}, "no window"),
        ({"method": "windows", "window_s": 0.05}, "longer"),
        ({"method": "windows", "window_s": 20.0}, "shorter"),
        ({"method": "windows", "window_s": -1.0}, "more than 0"),
        ({"method": "spline", "cutoff_hz": 600.0}, "band edge"),
    ],
)
def test_bad_calls_are_told_in_one_line(options, match):
    samples, _ = _bench()
    with pytest.raises(InputError, match=match) as told:
        identify_varying(samples, **options)
    assert "\n" not in str(told.value)


def test_a_sign_that_is_wrong_is_told():
    samples = _beginning(_bench()[0], 3000)
    found = _found("windows", replace(samples, torque=-samples.torque))
    assert any("sign" in w for w in found.warnings)
