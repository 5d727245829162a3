"""Windows: where they start, what they hold, what is left out; detection of missing times."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from armimpedance.core.errors import InputError
from armimpedance.numerics.signals.windows import cut_windows, detect_movement, disturbance_times


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


def cut_short(recording, rows):
    """The recording, 300 samples less at the ends of some trials."""
    lengths = np.diff(recording.offsets).copy()
    lengths[rows] -= 300
    keep = np.concatenate(
        [np.arange(o, o + n) for o, n in zip(recording.offsets[:-1], lengths, strict=True)]
    )
    return replace(
        recording,
        offsets=np.concatenate([[0], np.cumsum(lengths)]),
        time_s=recording.time_s[keep],
        position=recording.position[keep],
        force=recording.force[keep],
    )


@pytest.mark.parametrize(("sets", "rows"), [(3, [5]), (1, [5]), (1, [2, 5])])
def test_a_trial_that_ends_early_is_left_out_and_said(sets, rows, limb):
    """One of 24, one of 8, and a quarter of all."""
    window = cut_windows(cut_short(limb.record(sets=sets), rows))
    assert np.flatnonzero(~window.usable).tolist() == rows
    assert f"{len(rows)} of {8 * sets} trials left out" in window.notes[-1]
    assert not window.position[rows].any()


def test_more_than_a_quarter_that_ends_early_stops_the_session(limb):
    with pytest.raises(InputError, match="ends .* after its onset"):
        cut_windows(cut_short(limb.record(sets=1), [1, 3, 5]))


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


def with_trial(recording, row, position, time_s):
    """The recording with another course of one trial, at no force."""
    parts = [recording.samples_of(k) for k in range(recording.n_trials)]
    places = [position if k == row else recording.position[at] for k, at in enumerate(parts)]
    clocks = [time_s if k == row else recording.time_s[at] for k, at in enumerate(parts)]
    forces = [
        np.zeros_like(position) if k == row else recording.force[at] for k, at in enumerate(parts)
    ]
    return replace(
        recording,
        offsets=np.concatenate([[0], np.cumsum([len(each) for each in clocks])]),
        time_s=np.concatenate(clocks),
        position=np.concatenate(places),
        force=np.concatenate(forces),
    )


def reach(time_s, start_s, duration_s, way_m):
    s = np.clip((time_s - start_s) / duration_s, 0, 1)
    return 0.3 + way_m * np.column_stack([s**3 * (10 - 15 * s + 6 * s**2), 0 * s])


@pytest.mark.parametrize("stated", [True, False])
def test_one_long_reach_is_left_out_by_name_and_cuts_nobody(limb, stated):
    recording, t = limb.record(sets=3), np.arange(3000) / 1000
    odd = with_trial(recording, 4, reach(t, 0.3, 2.0, 0.1), t)
    trials = odd.trials.copy()
    trials.loc[4, ["onset_s", "end_s"]] = [0.3, 2.3]
    trials = trials if stated else trials.drop(columns=["onset_s", "end_s"])
    window = cut_windows(replace(odd, trials=trials))
    assert np.flatnonzero(~window.usable).tolist() == [4]
    assert "1 of 24 trials left out (trial 5)" in window.notes[-1]
    assert "0.1 m from its start: not a disturbance" in window.notes[-1]
    untouched = cut_windows(recording)
    assert window.lag_s[-1] == pytest.approx(untouched.lag_s[-1], abs=0.03)


def test_a_hand_that_goes_away_within_the_window_is_left_out(limb):
    recording = limb.record(sets=2)
    length = int(recording.offsets[1])
    t = np.arange(length) / 1000
    window = cut_windows(with_trial(recording, 2, reach(t, 0.25, 0.2, 0.06), t))
    assert np.flatnonzero(~window.usable).tolist() == [2]
    assert "(trial 3): the hand goes away and does not return" in window.notes[-1]


def test_disturbances_that_all_stay_away_are_all_kept(limb):
    """Ramp and hold: nobody is unlike the others."""
    recording, t = limb.record(sets=1), np.arange(801) / 1000
    for row in range(8):
        recording = with_trial(recording, row, reach(t, 0.25, 0.3, 0.005), t)
    assert cut_windows(recording).usable.all()


def test_two_durations_that_share_a_session_are_both_kept(limb):
    long, short = limb.record(sets=1, duration=0.4), limb.record(sets=1, duration=0.25, after=0.4)
    assert cut_windows(long).usable.all()
    lengths = [int(each.offsets[-1]) for each in (long, short)]
    both = replace(
        long,
        trials=pd.concat(
            [long.trials, short.trials.assign(trial=short.trials["trial"] + 8)], ignore_index=True
        ),
        offsets=np.concatenate([long.offsets, lengths[0] + short.offsets[1:]]),
        time_s=np.concatenate([long.time_s, short.time_s]),
        position=np.concatenate([long.position, short.position]),
        force=np.concatenate([long.force, short.force]),
    )
    assert cut_windows(both).usable.all()


def test_an_unsteady_hand_does_not_make_the_end_late(limb):
    """After the disturbance the hand rests .1 mm beside its start and wanders: .3 s stay .3 s."""
    recording = limb.record(sets=1, after=0.4)
    t = recording.time_s
    drift = 1e-4 * np.clip((t - 0.3) / 0.2, 0, 1) + 1e-5 * np.sin(2 * np.pi * 2 * t)
    moved = replace(
        recording,
        position=recording.position + drift[:, None],
        trials=recording.trials.drop(columns=["onset_s", "end_s"]),
    )
    timing = disturbance_times(moved)
    assert np.abs(timing.end_s - 0.55).max() < 0.04
