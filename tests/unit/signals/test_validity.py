"""Each check passes on a sound recording and speaks up on the fault that it is there for."""

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.signals.validity import check_recording


def _verdicts(recording):
    return {check.name: check.verdict for check in check_recording(recording)}


@pytest.fixture(scope="module")
def sound(limb):
    return limb.record(sets=2, force_noise=0.05)


def test_a_sound_recording_passes_everything(sound):
    assert set(_verdicts(sound).values()) == {"ok"}


def test_force_of_the_device_is_recognised_by_its_work(sound):
    assert _verdicts(replace(sound, force=-sound.force))["force sign"] == "unusable"


def test_one_direction_only(limb):
    assert _verdicts(limb.record(directions=1, sets=6))["directions"] == "unusable"


def test_a_hand_that_stays_away_is_told(sound):
    moved = np.maximum.accumulate(np.abs(sound.position - 0.3).reshape(16, -1, 2), axis=1)
    away = replace(sound, position=0.3 + moved.reshape(-1, 2))
    assert _verdicts(away)["returns to start"] == "warning"


def test_clipping(sound):
    clipped = replace(sound, force=np.clip(sound.force, -0.8, 0.8))
    assert _verdicts(clipped)["clipping"] == "warning"


def test_coarse_steps(sound):
    coarse = replace(sound, force=np.round(sound.force / 1.5) * 1.5)
    assert _verdicts(coarse)["force steps"] == "warning"


def test_a_force_that_never_changes(sound):
    assert _verdicts(replace(sound, force=np.zeros_like(sound.force)))["force steps"] == "warning"


def test_noise_that_drowns_the_response(sound):
    rng = np.random.default_rng(5)
    noisy = replace(sound, force=sound.force + rng.normal(0, 20, sound.force.shape))
    assert _verdicts(noisy)["noise at rest"] == "warning"


def test_slow_sampling(limb):
    assert _verdicts(limb.record(sets=1, rate=100.0))["rate"] == "warning"
