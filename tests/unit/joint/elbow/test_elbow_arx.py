"""Every stationary method on a joint with a known truth; what each says where it must fail."""

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import ArmImpedanceError, EstimationError, InputError
from armimpedance.joint.elbow.checks import spectra_of
from armimpedance.joint.elbow.elbow_result import NAMES
from armimpedance.joint.elbow.samples import JointSamples, from_recording
from armimpedance.joint.elbow.stationary.band import band_of
from armimpedance.joint.elbow.stationary.diagnosis import ljung_box
from armimpedance.joint.elbow.stationary.discrete import solve_structure
from armimpedance.joint.elbow.stationary.identify import estimate_joint, identify_elbow
from armimpedance.joint.elbow.stationary.methods import METHODS
from armimpedance.joint.elbow.stationary.noise_bias import predicted_bias
from armimpedance.joint.elbow.stationary.preparation import prepare
from armimpedance.numerics.regression import t_factor
from manipulandum_sim.elbow.bench import simulate_bench

JOINTS = {"underdamped": (0.07, 0.6, 20.0), "overdamped": (0.07, 3.5, 9.0)}
RUNS = 36


def samples_of(torque, angle, perturbation=None, rate=1000.0):
    """One trial per row."""
    count, length = torque.shape
    return JointSamples(
        rate,
        tuple(str(t) for t in range(count)),
        length * np.arange(count + 1),
        torque.ravel(),
        angle.ravel(),
        perturbation=None if perturbation is None else perturbation.ravel(),
    )


def noisy(clean, snr_db, rng):
    size = clean.std(axis=-1, keepdims=True) * 10 ** (-snr_db / 20)
    return clean + size * rng.standard_normal(clean.shape)


@pytest.fixture(scope="module", params=JOINTS, ids=str)
def truths(request):
    """A joint, and noise-free torques and angles, (RUNS, S)."""
    joint = JOINTS[request.param]
    _, truth = simulate_bench(*joint, trials=RUNS, seed=21)
    return np.array(joint), truth.torque, truth.angle


@pytest.mark.parametrize("method", METHODS)
def test_without_noise_the_truth_is_found(truths, method):
    joint, torque, angle = truths
    fit = identify_elbow(samples_of(torque[:1], angle[:1], torque[:1]), method=method)
    # The bilinear transform is off by (w T)^2 / 12 where the torque ends.
    exact = method != "arx"
    np.testing.assert_allclose(fit.parameters.values, joint, rtol=1e-6 if exact else 2e-3)
    assert fit.summary.r2 > 0.99999
    assert fit.summary.warnings == ()
    assert fit.details["orders"][0].orders == (2, 1, 0)


@pytest.mark.study
@pytest.mark.first_cases(3)
@pytest.mark.parametrize(
    ("method", "commanded"),
    [*((m, False) for m in METHODS), ("iv", True), ("derivative", True)],
)
def test_the_intervals_cover(truths, method, commanded):
    """Of RUNS records at 20 dB, 95 % hold the truth: 3 standard errors of a share."""
    joint, torque, angle = truths
    rng = np.random.default_rng(8)
    held, z = [], []
    for u, y in zip(torque, angle, strict=True):
        device = u[None] if commanded else None
        record = samples_of(noisy(u[None], 20.0, rng), noisy(y[None], 20.0, rng), device)
        prepared = prepare(record, spectra_of(record))
        found = METHODS[method].identify(prepared, band_of(prepared)).parameters
        sd = found.sd
        held.append(np.abs(found.values - joint) <= t_factor(found.dof) * sd)
        z.append((found.values - joint) / sd)
    share = np.mean(held, axis=0)
    assert (share >= 0.95 - 3 * np.sqrt(0.95 * 0.05 / RUNS)).all(), share
    # Not by being far too wide: arx alone adds what it knows to be off.
    assert (np.std(z, axis=0) > (0.1 if method == "arx" else 0.6)).all()


@pytest.mark.first_cases(3)
@pytest.mark.parametrize("method", ["iv", "output-error", "derivative"])
def test_within_ten_percent_at_5_db(truths, method):
    joint, torque, angle = truths
    rng = np.random.default_rng(9)
    errors = []
    for u, y in zip(torque[:10], angle[:10], strict=True):
        record = samples_of(noisy(u[None], 5.0, rng), noisy(y[None], 5.0, rng))
        prepared = prepare(record, spectra_of(record))
        found = METHODS[method].identify(prepared, band_of(prepared)).parameters
        errors.append(found.values / joint - 1)
    assert (np.sqrt(np.mean(np.square(errors), axis=0)) < 0.1).all()


@pytest.mark.study
@pytest.mark.first_cases(1)
def test_filtered_arx_within_ten_percent_at_15_db(truths):
    joint, torque, angle = truths
    rng = np.random.default_rng(10)
    errors = [
        estimate_joint(
            samples_of(noisy(u[None], 15.0, rng), noisy(y[None], 15.0, rng)), "arx"
        ).values
        / joint
        - 1
        for u, y in zip(torque[:20], angle[:20], strict=True)
    ]
    assert (np.sqrt(np.mean(np.square(errors), axis=0)) < 0.1).all()


@pytest.mark.parametrize("snr_db", [15.0, 40.0, 60.0])
def test_raw_arx_is_refused_before_it_fails(truths, snr_db):
    joint, torque, angle = truths
    rng = np.random.default_rng(11)
    record = samples_of(noisy(torque[:1], snr_db, rng), noisy(angle[:1], snr_db, rng))
    with pytest.raises(InputError, match="arx on raw samples at 1000 Hz.*(bias of I|no joint)"):
        identify_elbow(record, method="arx", cutoff_hz=None, decimation=1)
    # It would have failed indeed.
    try:
        values = solve_structure(
            prepare(record, spectra_of(record), None, 1), "zoh"
        ).parameters.values
    except ArmImpedanceError:
        return
    assert (np.abs(values / joint - 1) > 0.1).any()


def test_the_predicted_bias_is_the_bias(truths):
    """Mean error of least squares over the records against what was told before the fit."""
    joint, torque, angle = truths
    rng = np.random.default_rng(12)
    told, seen = [], []
    for u, y in zip(torque, angle, strict=True):
        record = samples_of(noisy(u[None], 12.0, rng), noisy(y[None], 12.0, rng))
        prepared = prepare(record, spectra_of(record), 12.0)
        band = band_of(prepared)
        told.append(predicted_bias(prepared, band, joint, "tustin"))
        seen.append(solve_structure(prepared, "tustin").parameters.values / joint - 1)
    error = np.std(seen, axis=0, ddof=1) / np.sqrt(RUNS)
    # A tenth of the bias for what the torque's own noise in the band adds to both.
    off = np.abs(np.mean(seen, axis=0) - np.mean(told, axis=0))
    assert (off < 4 * error + 0.1 * np.abs(np.mean(told, axis=0))).all()


@pytest.mark.study
@pytest.mark.first_cases(1)
def test_trials_are_pooled(truths):
    joint, torque, angle = truths
    rng = np.random.default_rng(13)
    u, y = noisy(torque[:8], 15.0, rng), noisy(angle[:8], 15.0, rng)
    for method in METHODS:
        all_of_them = identify_elbow(samples_of(u, y), method=method)
        if method != "arx":
            # Without the doubts, whose allowance shrinks faster.
            records = [samples_of(u[r : r + 1], y[r : r + 1]) for r in range(8)]
            alone = np.mean([estimate_joint(s, method).sd ** 2 for s in records], axis=0)
            ratio = alone / estimate_joint(samples_of(u, y), method).sd ** 2
            # Eight times the data; variances of 8 x 9 and of 79 degrees, in ratio known to .24.
            assert (np.abs(ratio / 8 - 1) < 4 * 0.24).all()
        half = np.diff(all_of_them.parameters.interval())[:, 0] / 2
        assert (np.abs(all_of_them.parameters.values - joint) < 2 * half).all()


@pytest.mark.study
def test_units_of_torque_and_angle_scale_through(truths):
    _, torque, angle = truths
    rng = np.random.default_rng(14)
    u, y = noisy(torque[:1], 20.0, rng), noisy(angle[:1], 20.0, rng)
    for method in METHODS:
        plain = estimate_joint(samples_of(u, y), method).values
        twice = estimate_joint(samples_of(2 * u, y), method).values
        mirrored = estimate_joint(samples_of(-u, -y), method).values
        np.testing.assert_allclose(twice, 2 * plain, rtol=1e-5)
        np.testing.assert_allclose(mirrored, plain, rtol=1e-5)
    # and with all that is doubted
    whole, twice = (identify_elbow(samples_of(gain * u, y)).parameters for gain in (1, 2))
    np.testing.assert_allclose(twice.interval(), 2 * whole.interval(), rtol=1e-5)


@pytest.mark.first_cases(4)
@pytest.mark.parametrize("method", METHODS)
def test_the_same_record_gives_the_same_bits(truths, method):
    _, torque, angle = truths
    record = samples_of(noisy(torque[:1], 20.0, np.random.default_rng(1)), angle[:1])
    first, second = (identify_elbow(record, method=method) for _ in range(2))
    assert (first.parameters.values == second.parameters.values).all()
    assert (first.parameters.covariance == second.parameters.covariance).all()


@pytest.mark.parametrize("method", METHODS)
def test_a_torque_of_the_wrong_sign_is_told(truths, method):
    _, torque, angle = truths
    with pytest.raises(EstimationError, match="wrong sign"):
        identify_elbow(samples_of(-torque[:1], angle[:1]), method=method)


def loop(seed, voluntary):
    """Arm and device under a perturbation and the subject's own torque, periodic, 1 kHz.

    ``(Z + Zd) theta = p + v``, interaction torque on the limb ``p - Zd theta``.
    """
    rng = np.random.default_rng(seed)
    count = 20_000
    f = np.fft.rfftfreq(count, 1e-3)
    s = 2j * np.pi * f
    arm, device = 0.07 * s**2 + 0.6 * s + 20.0, 0.05 * s**2 + 0.4 * s

    def random(end_hz):
        noise = np.fft.rfft(rng.standard_normal(count)) / np.sqrt(1 + (f / end_hz) ** 8)
        noise[0] = 0
        return noise / np.sqrt((np.abs(noise) ** 2).mean())

    p, v = random(10.0), voluntary * random(4.0)
    theta = (p + v) / (arm + device)
    signals = [np.fft.irfft(x, count)[None] for x in (p - device * theta, theta, p)]
    scale = 1 / signals[2].std()
    return [scale * x for x in signals]


@pytest.mark.study
def test_instruments_from_the_perturbation_stand_the_subjects_own_torque():
    """Voluntary torque moves the limb and the measured torque alike: only the command is free."""
    joint = np.array([0.07, 0.6, 20.0])
    rng = np.random.default_rng(3)
    free, bound = [], []
    for seed in range(12):
        torque, angle, command = loop(seed, voluntary=0.3)
        torque, angle = noisy(torque, 30.0, rng), noisy(angle, 30.0, rng)
        free.append(estimate_joint(samples_of(torque, angle, command), "iv"))
        wrongly_told = replace(samples_of(torque, angle), imposed="torque")
        bound.append(estimate_joint(wrongly_told, "iv"))
    z = [(f.values - joint) / f.sd for f in free]
    # Mean of 12 standardised errors, t with 19 degrees each: 4 standard errors.
    assert (np.abs(np.mean(z, axis=0)) < 4 * 1.06 / np.sqrt(12)).all()
    off = np.mean([f.values / joint - 1 for f in bound], axis=0)
    spread = np.std([f.values / joint - 1 for f in bound], axis=0, ddof=1) / np.sqrt(12)
    assert (np.abs(off) > 4 * spread).any()


@pytest.mark.study
def test_a_third_order_joint_is_told():
    """A lag of 20 ms between torque and what the joint feels is no joint of second order."""
    from scipy.signal import lfilter

    _, truth = simulate_bench(0.07, 0.6, 20.0, duration_s=20.0, seed=5)
    rng = np.random.default_rng(5)
    pole = np.exp(-1 / 20.0)
    lagging = lfilter([1 - pole], [1, -pole], truth.angle)
    record = samples_of(noisy(truth.torque, 30.0, rng), noisy(lagging, 30.0, rng))
    fit = identify_elbow(record, method="output-error")
    violated = {one.name for one in fit.checks if one.verdict == "warning"}
    assert violated & {"skew", "order", "band"}
    plain = samples_of(noisy(truth.torque, 30.0, rng), noisy(truth.angle, 30.0, rng))
    assert identify_elbow(plain, method="output-error").summary.warnings == ()


def test_commanded_torque_is_told(truths):
    _, torque, angle = truths
    record = replace(samples_of(torque[:1], angle[:1]), torque_is="commanded")
    assert any("arm and device" in w for w in identify_elbow(record).summary.warnings)


def test_a_fit_says_what_it_is():
    recording, _ = simulate_bench(0.07, 0.6, 20.0, snr_db=25.0, seed=2)
    fit = identify_elbow(from_recording(recording))
    assert tuple(p.name for p in fit.summary.parameters) == NAMES
    assert fit.summary.rank == 3
    assert fit.snr.torque_db == pytest.approx(25, abs=0.5)
    assert fit.preparation
    for parameter, variance in zip(
        fit.summary.parameters, np.diag(fit.parameters.covariance), strict=True
    ):
        assert parameter.sd_robust == pytest.approx(np.sqrt(variance))


def test_white_noise_passes_ljung_box_and_a_memory_does_not():
    rng = np.random.default_rng(0)
    p = [ljung_box([rng.standard_normal(300), rng.standard_normal(200)]).p for _ in range(300)]
    # Uniform: the mean of 300 is known to .017, the share below .05 to .013.
    assert np.mean(p) == pytest.approx(0.5, abs=4 * 0.017)
    assert np.mean(np.array(p) < 0.05) == pytest.approx(0.05, abs=4 * 0.013)
    walk = np.convolve(rng.standard_normal(500), np.ones(4), mode="valid")
    told = ljung_box([walk])
    assert told.p < 1e-6
    assert told.largest_correlation == pytest.approx(0.75, abs=0.1)
