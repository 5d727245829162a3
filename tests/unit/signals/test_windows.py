"""Windows: where they start, what they hold, what is left out; detection of missing times."""

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.errors import InputError
from armimpedance.signals.onset import detect_movement
from armimpedance.signals.windows import cut_windows, disturbance_times


def test_window_is_the_record_around_the_onset(limb):
    recording = limb.record(sets=1)
    window = cut_windows(recording)
    zero = int(np.flatnonzero(window.lag_s == 0)[0])
    onset = round(0.25 * limb.rate)
    for row in range(recording.n_trials):
        trial = recording.position[recording.samples_of(row)]
        assert np.array_equal(window.position[row, zero : zero + 50], trial[onset : onset + 50])
    assert window.usable.all()
    assert window.duration_s == pytest.approx(0.3)


def test_random_onsets_are_aligned(limb):
    """The same disturbance shifted within its record gives the same window."""
    early, late = limb.record(sets=1, before=0.25), limb.record(sets=1, before=0.40)
    a, b = cut_windows(early), cut_windows(late)
    assert np.allclose(a.position, b.position, atol=1e-15)


def test_missing_times_are_detected_and_said(limb):
    """The detected onset of a 5 mm bump with 20 um encoder steps is right within 20 ms."""
    recording = limb.record(sets=1)
    rounded = np.round(recording.position / 2e-5) * 2e-5
    blind = replace(
        recording, position=rounded, trials=recording.trials.drop(columns=["onset_s", "end_s"])
    )
    timing = disturbance_times(blind)
    assert np.abs(timing.onset_s - 0.25).max() < 0.02
    assert np.abs(timing.end_s - 0.55).max() < 0.02
    assert "detected" in timing.notes[0]


def test_a_hand_that_does_not_move_is_refused():
    t = np.arange(600) / 1000
    with pytest.raises(InputError, match="nothing moves"):
        detect_movement(np.zeros((600, 2)), t)


def test_a_trial_that_ends_early_is_left_out_and_said(limb):
    recording = limb.record(sets=3)
    lengths = np.diff(recording.offsets).copy()
    lengths[5] -= 300
    keep = np.concatenate(
        [np.arange(o, o + n) for o, n in zip(recording.offsets[:-1], lengths, strict=True)]
    )
    short = replace(
        recording,
        offsets=np.concatenate([[0], np.cumsum(lengths)]),
        time_s=recording.time_s[keep],
        position=recording.position[keep],
        force=recording.force[keep],
    )
    window = cut_windows(short)
    assert np.flatnonzero(~window.usable).tolist() == [5]
    assert "1 of 24 trials left out" in window.notes[-1]
    assert not window.position[5].any()


def test_trials_of_one_direction_are_the_same_disturbance(limb):
    recording = limb.record(sets=2)
    assert cut_windows(recording).disturbance.tolist() == [*range(8), *range(8)]
    turned = recording.trials.assign(direction_deg=recording.trials["direction_deg"] - 360.0)
    again = cut_windows(replace(recording, trials=turned)).disturbance
    assert again.tolist() == [*range(8), *range(8)]
    unknown = recording.trials.drop(columns="direction_deg")
    assert cut_windows(replace(recording, trials=unknown)).disturbance is None


def test_trials_marked_as_errors_are_left_out_and_said(limb):
    recording = limb.record(sets=1)
    marked = replace(recording, trials=recording.trials.assign(is_error=[0, 1, 0, 0, 0, 0, 1, 0]))
    window = cut_windows(marked)
    assert np.flatnonzero(~window.usable).tolist() == [1, 6]
    assert window.notes == ("2 of 8 trials left out: marked as an error when recorded",)


def test_nothing_but_errors_is_said_as_such(limb):
    recording = limb.record(sets=1)
    marked = replace(recording, trials=recording.trials.assign(is_error=True))
    with pytest.raises(InputError, match="all 8 trials are marked as errors"):
        cut_windows(marked)


def test_state_at_onset_is_the_mean_of_the_rest_before(limb):
    recording = limb.record(sets=1, force_noise=0.1)
    window = cut_windows(recording)
    first = recording.force[recording.samples_of(0)]
    assert window.force_at_onset[0] == pytest.approx(first[151:251].mean(axis=0))


def test_commanded_motion_is_cut_like_the_measured_one(limb):
    """Where every axis has its column; one alone is not a motion."""
    recording = limb.record(sets=1)
    told = {"x_command_m": recording.position[:, 0], "y_command_m": recording.position[:, 1]}
    window = cut_windows(replace(recording, extra=told))
    assert np.array_equal(window.commanded, window.position)
    assert cut_windows(recording).commanded is None
    half = {"x_command_m": told["x_command_m"]}
    assert cut_windows(replace(recording, extra=half)).commanded is None
