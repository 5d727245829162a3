"""Each check passes on a sound recording and speaks up on the fault that it is there for."""

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.numerics.signals.validity import check_recording


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


def reaching(recording, rows, way=0.1):
    """The hand goes away in these trials and stays there."""
    position = recording.position.copy()
    for row in rows:
        at = recording.samples_of(row)
        s = np.clip((recording.time_s[at] - 0.25) / 0.3, 0, 1)
        position[at, 0] = 0.3 + way * s**3 * (10 - 15 * s + 6 * s**2)
    return replace(recording, position=position)


def test_reaches_are_no_disturbances_and_are_named(sound):
    checks = {c.name: c for c in check_recording(reaching(sound, range(16)))}
    assert checks["disturbance"].verdict == "unusable"
    assert "the hand moves 100.00 mm and does not return in 16 of 16" in (
        checks["disturbance"].message
    )


def test_a_single_reach_is_left_out_and_told(sound):
    checks = {c.name: c for c in check_recording(reaching(sound, [6]))}
    assert checks["disturbance"].verdict == "warning"
    assert "15 of 16 trials" in checks["disturbance"].message
    assert "(trial 7)" in checks["disturbance"].message


def test_reaches_that_were_marked_as_errors_count_for_nothing(sound):
    recording = reaching(sound, range(4))
    marks = (np.arange(16) < 4).astype(int)
    marked = replace(recording, trials=recording.trials.assign(is_error=marks))
    assert _verdicts(recording)["disturbance"] == "unusable"
    assert _verdicts(marked)["disturbance"] == "warning"


def test_the_top_of_one_swing_on_one_step_of_the_sensor_is_not_clipping(limb):
    """Coarse steps and little noise: one trial stays at the extreme, and no others."""
    recording = limb.record(sets=1)
    force = np.round(recording.force / 0.05) * 0.05
    one = replace(recording, force=np.where(np.arange(len(force))[:, None] < 801, 1.03, 1) * force)
    assert _verdicts(one)["clipping"] == "ok"
