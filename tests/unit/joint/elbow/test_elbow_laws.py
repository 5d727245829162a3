"""Laws of the elbow's room, by its face: known joints come back, units change nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import RecordError
from armimpedance.joint.elbow import (
    JointSamples,
    identify_elbow,
)
from armimpedance.joint.elbow.checks import spectra_of

RATE = 1000.0
JOINT = np.array([0.07, 0.6, 20.0])


def samples_of(torque, angle, rate=RATE):
    """Trials of equal length, one per row."""
    torque, angle = np.atleast_2d(torque), np.atleast_2d(angle)
    count, length = torque.shape
    names = tuple(str(t) for t in range(1, count + 1))
    offsets = length * np.arange(count + 1)
    return JointSamples(rate, names, offsets, torque.ravel(), angle.ravel())


def periodic(impedance, seed=0, seconds=16.0, end_hz=15.0, trials=1):
    """Random torque (T, S) up to `end_hz`, and the angle of a joint with this Z(s), exactly."""
    rng = np.random.default_rng(seed)
    count = round(seconds * RATE)
    f = np.fft.rfftfreq(count, 1 / RATE)
    band = (f > 0) & (f <= end_hz)
    drawn = rng.standard_normal((trials, 2, len(f)))
    spectrum = band * (drawn[:, 0] + 1j * drawn[:, 1])
    angle = np.zeros_like(spectrum)
    angle[:, band] = spectrum[:, band] / impedance(2j * np.pi * f[band])
    torque, angle = np.fft.irfft(spectrum, count), np.fft.irfft(angle, count)
    scale = 1 / torque.std()
    return scale * torque, scale * angle


def joint(s):
    return JOINT @ [s**2, s, np.ones_like(s)]


def noisy(clean, snr_db, rng):
    return clean + clean.std() * 10 ** (-snr_db / 20) * rng.standard_normal(clean.shape)


# Constant joints


@pytest.mark.parametrize("delay_s", [0.05, 0.12])
def test_a_late_answer_is_found_at_its_delay(delay_s):
    def reflex(s):
        return joint(s) + (0.4 * s + 6.0) * np.exp(-s * delay_s)

    rng = np.random.default_rng(1)
    torque, angle = periodic(reflex, seconds=8.0, trials=2)
    record = samples_of(noisy(torque, 50, rng), noisy(angle, 50, rng))
    fit = identify_elbow(replace(record, imposed="torque"))
    late = fit.details["reflex"]
    assert late.delay_s == pytest.approx(delay_s, abs=0.003)
    assert late.K_r == pytest.approx(6.0, rel=0.1)
    np.testing.assert_allclose(fit.parameters.values, JOINT, rtol=0.1)


def test_units_of_torque_scale_all_three_parameters():
    """Torque in other units: I, B, K, their errors and intervals are in those units."""
    rng = np.random.default_rng(2)
    torque, angle = periodic(joint)
    torque, angle = noisy(torque, 35, rng), noisy(angle, 35, rng)
    one, ten = (identify_elbow(samples_of(k * torque, angle)).parameters for k in (1.0, 16.0))
    np.testing.assert_allclose(ten.values, 16 * one.values, rtol=1e-6)
    np.testing.assert_allclose(ten.covariance, 256 * one.covariance, rtol=1e-4)


@pytest.mark.study
def test_a_joint_behind_a_filter_is_told_from_a_joint():
    """A filter of first order beside the joint: (2, 2, 0) holds the record, (2, 1, 0) does not."""

    def behind(s):
        return joint(s) / (1 + s / (2 * np.pi * 6))

    rng = np.random.default_rng(3)
    torque, angle = periodic(behind, trials=3)
    fit = identify_elbow(samples_of(noisy(torque, 20, rng), noisy(angle, 45, rng)))
    scores = {score.orders: score for score in fit.details["orders"]}
    best, plain = scores[2, 2, 0], scores[2, 1, 0]
    assert plain.squares > 1.5 * best.squares
    assert plain.bic > best.bic


def test_every_sample_kept_is_no_decimation():
    rng = np.random.default_rng(4)
    torque, angle = periodic(joint)
    samples = samples_of(noisy(torque, 40, rng), noisy(angle, 40, rng))
    one, three = (identify_elbow(samples, method="arx", decimation=k).preparation for k in (1, 3))
    assert any("no decimation" in note for note in one)
    assert not any("sample kept" in note for note in one)
    assert any("every 3. sample kept, as asked" in note for note in three)


@pytest.mark.parametrize("offsets", [[0, 0, 10], [0, 10, 10], [1, 5, 10], [0, 7, 5, 10]])
def test_trials_without_samples_are_refused(offsets):
    names = tuple(str(t) for t in range(len(offsets) - 1))
    with pytest.raises(RecordError):
        JointSamples(RATE, names, np.array(offsets), np.zeros(10), np.zeros(10))


def test_a_white_floor_reaches_to_half_of_the_rate():
    """The noise's variance is its density times the whole band, 500 Hz."""
    rng = np.random.default_rng(7)
    torque, angle = periodic(joint, trials=2)
    spectra = spectra_of(samples_of(noisy(torque, 10, rng), noisy(angle, 20, rng)))
    for channel, clean, snr_db in ((spectra.torque, torque, 10), (spectra.angle, angle, 20)):
        assert channel.frequency_hz[-1] == RATE / 2
        assert channel.noise_variance == pytest.approx(RATE / 2 * channel.floor, rel=1e-12)
        assert channel.noise_variance == pytest.approx(clean.var() * 10 ** (-snr_db / 10), rel=0.05)
        assert channel.snr_db == pytest.approx(snr_db, abs=0.4)


def test_a_result_knows_its_parameters_by_name():
    rng = np.random.default_rng(8)
    torque, angle = periodic(joint)
    fit = identify_elbow(samples_of(noisy(torque, 40, rng), noisy(angle, 40, rng)))
    assert tuple(fit.parameters.names) == ("I", "B", "K")
    np.testing.assert_allclose(fit.parameters.values, JOINT, rtol=0.02)
    named = [fit.inertia.value, fit.viscosity.value, fit.stiffness.value]
    np.testing.assert_array_equal(named, fit.parameters.values)
