"""A force or a position that comes late is found and named."""

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.impedance.reflex.delay import check_delay


def _late(samples, by):
    parts = samples.reshape(16, -1, samples.shape[1])
    return np.roll(parts, by, axis=1).reshape(samples.shape)


def _found(check):
    return float(check.message.split("percents: ")[1].split()[0])


@pytest.fixture(scope="module")
def sound(limb):
    return limb.record(sets=2, force_noise=0.03)


def test_no_delay_is_no_warning(sound):
    assert check_delay(sound)[0].verdict == "ok"


@pytest.mark.parametrize("by", [1, 4])
def test_late_force(sound, by):
    check = check_delay(replace(sound, force=_late(sound.force, by)))[0]
    assert check.verdict == "warning"
    found = _found(check)
    assert "force" in check.message
    assert found == pytest.approx(by, abs=0.3)


def test_late_kinematics(sound):
    check = check_delay(replace(sound, position=_late(sound.position, 3)))[0]
    assert "kinematics" in check.message
    assert _found(check) == pytest.approx(-3.0, abs=0.3)


def test_noise_is_not_taken_for_a_delay(limb):
    """Strong slow noise moves the minimum by more than half a sample; its error says so. Of 20
    recordings without a delay at most two may warn: with a three-sigma rule none is expected."""
    warned = 0
    for seed in range(20):
        recording = limb.record(sets=2, seed=seed)
        rng = np.random.default_rng(seed)
        t = np.tile(np.arange(recording.offsets[1]) / 1000, recording.n_trials)[:, None]
        phase = np.repeat(
            rng.uniform(0, 6.3, (recording.n_trials, 2)), recording.offsets[1], axis=0
        )
        noisy = recording.force + 0.3 * np.sin(2 * np.pi * 3 * t + phase)
        warned += check_delay(replace(recording, force=noisy))[0].verdict != "ok"
    assert warned <= 2
