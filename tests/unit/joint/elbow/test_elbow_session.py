"""The trials of one joint as each other's witness."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.joint.elbow.samples import from_recording, pieces_of
from armimpedance.joint.elbow.show import elbow
from armimpedance.joint.elbow.show.verb import _over_pieces
from manipulandum_sim.elbow import simulate_bench


def five(gain):
    """Five trials whose torque has a gain of its own in each."""
    recording, _ = simulate_bench(0.07, 1.2, 20.0, trials=5, duration_s=10.0, snr_db=20.0, seed=2)
    force = recording.force.copy()
    for row in range(5):
        force[recording.samples_of(row)] *= gain(row)
    return replace(recording, force=force)


def session(fit):
    (one,) = (check for check in fit.checks if check.name == "session")
    return one


@pytest.mark.study
def test_a_clean_session_is_no_alarm():
    fit = elbow(five(lambda _: 1.0))
    assert session(fit).verdict == "ok"
    assert not [text for text in fit.warnings if text.startswith("session")]


@pytest.mark.parametrize(
    ("gain", "says"),
    [
        (lambda row: 0.5 if row >= 3 else 1.0, ("-50 %", "from trial 4 on")),
        (lambda row: 1 + 0.025 * row, ("from the first trial to the last", "gain")),
    ],
)
def test_a_gain_of_the_torque_that_changes_is_named(gain, says):
    fit = elbow(five(gain))
    assert session(fit).verdict == "warning"
    for words in says:
        assert words in session(fit).message
    assert any(text.startswith("session: ") for text in fit.warnings)


def changed_at_half(gain, seed=2, **options):
    """A record without trials to compare, whose torque has another gain from its half on."""
    recording, _ = simulate_bench(0.07, 1.2, 20.0, snr_db=20.0, seed=seed, **options)
    force = recording.force.copy()
    force[len(force) // 2 :] *= gain
    return replace(recording, force=force)


def test_a_gain_that_changes_within_one_long_record_is_named():
    fit = elbow(changed_at_half(0.85, duration_s=40.0))
    assert session(fit).verdict == "warning"
    assert "from 20 s on" in session(fit).message
    assert "gain" in session(fit).message


def test_pieces_are_those_of_long_trials_without_a_sample_lost():
    samples = from_recording(changed_at_half(1.0, duration_s=25.0, trials=2))
    pieces = pieces_of(samples)
    assert list(pieces)[::2] == ["trial 1 at 0 s", "trial 2 at 0 s"]
    together = np.concatenate([one.angle for one in pieces.values()])
    np.testing.assert_array_equal(together, samples.angle)
    assert not pieces_of(from_recording(changed_at_half(1.0, duration_s=12.0, trials=2)))


@pytest.mark.study
def test_long_records_are_no_alarm_and_a_tenth_is_seen():
    """40 records of 60 s at 20 dB: at most one false alarm, and all changes of 10 %."""

    def seen(gain, seed):
        samples = from_recording(changed_at_half(gain, seed, duration_s=60.0))
        (one,) = _over_pieces(pieces_of(samples))
        return one.verdict == "warning"

    assert sum(seen(1.0, seed) for seed in range(40)) <= 1
    assert all(seen(0.9, seed) for seed in range(40))
