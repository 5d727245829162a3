"""Laws of the signals' room: straight lines pass a smoother, means have the error of means."""

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.signals import (
    check_recording,
    choose_span,
    cut_windows,
    mean_activation,
    respond,
)


def message(recording, name):
    """What one check of the recording says."""
    return next(c for c in check_recording(recording) if c.name == name)


def by_trial(recording, values):
    """Values (T, S, d) as the rows of a recording."""
    return np.asarray(values).reshape(recording.n_trials, -1, recording.position.shape[1])


@pytest.fixture(scope="module")
def clean(limb):
    return limb.record(sets=1)


# Smoothed response


def test_a_straight_line_passes_the_smoother_where_drift_is_kept(limb):
    """Smoothing kernels of unit sum keep a + b t; its derivatives are b and nothing."""
    window = cut_windows(limb.record(sets=1))
    slope = np.arange(1.0, 1 + 2 * len(window.position)).reshape(-1, 2)
    line = window.lag_s[None, :, None] * slope[:, None, :]
    made = respond(replace(window, position=line, force=3 + 2 * line), keep_drift=True)
    expected = made.lag_s[None, :, None] * slope[:, None, :]
    start = line[:, :1]
    np.testing.assert_allclose(made.displacement, expected - start, atol=1e-9)
    np.testing.assert_allclose(made.velocity, np.broadcast_to(slope[:, None], expected.shape))
    assert np.abs(made.acceleration).max() < 1e-6 * np.abs(slope).max()
    np.testing.assert_allclose(made.force, 3 + 2 * expected, atol=1e-9)


def test_kept_drift_is_all_that_the_projection_takes(limb):
    """What differs from the response without drift is a straight line in every trial and axis."""
    window = cut_windows(limb.record(sets=1, drift=0.02))
    kept, free = respond(window, keep_drift=True), respond(window)
    t = kept.lag_s
    for name in ("displacement", "velocity", "acceleration", "force"):
        apart = getattr(kept, name) - getattr(free, name)
        bent = np.diff(apart, 2, axis=1)
        assert np.abs(bent).max() < 1e-9 * max(np.abs(getattr(kept, name)).max(), 1.0)
        # and the free response holds no straight line
        for power in (0, 1):
            left = np.einsum("tsd,s->td", getattr(free, name), t**power)
            assert np.abs(left).max() < 1e-9 * max(np.abs(getattr(kept, name)).sum(), 1.0)


def test_room_at_either_end_of_a_record_counts_alike(limb):
    """A record that is short before the onset is smoothed as one that is short after the end."""
    before, after = (
        choose_span(cut_windows(limb.record(sets=1, **{short: 0.08}))).notes
        for short in ("before", "after")
    )
    assert before
    assert before == after


# Activation


def test_the_activation_before_the_onset_has_the_error_of_a_mean(limb):
    """Trials at levels that are known: their mean, and their sd over the root of their number."""
    recording = limb.record(sets=1)
    levels = np.random.default_rng(3).uniform(0.1, 0.6, (recording.n_trials, 2))
    samples = len(recording.time_s) // recording.n_trials
    known = replace(
        recording,
        emg=np.repeat(levels, samples, axis=0),
        muscles=("biceps", "triceps"),
        emg_unit="normalised",
    )
    onset = known.trials["onset_s"].to_numpy(dtype=float)
    for rows in (np.arange(8), np.array([1, 6]), np.array([2, 3, 5])):
        made = mean_activation(known, rows, onset)
        np.testing.assert_allclose(made.mean, levels[rows].mean(axis=0), rtol=1e-12)
        expected = np.sqrt(levels[rows].var(axis=0, ddof=1) / len(rows))
        np.testing.assert_allclose(made.sd, expected, rtol=1e-9)
    assert mean_activation(known, np.array([4]), onset).sd is None


# Checks of a recording


def test_a_value_far_from_rest_that_stays_is_clipped_and_a_near_one_is_not(clean):
    """Far is more than ten times the median distance from the median."""
    rng = np.random.default_rng(0)
    force = rng.normal(size=clean.force.shape)
    typical = np.median(np.abs(force[:, 0] - np.median(force[:, 0])))
    for times, verdict in ((14.0, "warning"), (7.0, "ok")):
        held = force.copy()
        held[100:160, 0] = times * typical + np.median(force[:, 0])
        assert message(replace(clean, force=held), "clipping").verdict == verdict


def test_the_step_is_the_common_divisor_also_where_most_levels_are_missing(clean):
    levels = 0.25 * np.array([0, 1, 3, 5, 7, 9, 11, 13])
    force = np.resize(levels, len(clean.force))[:, None] * np.ones(2)
    found = message(replace(clean, force=force), "force steps")
    assert found.message.startswith("0.25 N, 7.7 % of the range")


def test_readings_on_no_grid_have_no_step(clean):
    force = np.random.default_rng(1).normal(size=clean.force.shape)
    found = message(replace(clean, force=force), "force steps")
    assert found.message.startswith("none seen")


def test_what_is_left_at_the_end_is_told_in_millimetres_and_of_the_peak(clean):
    """A bump of 5 mm after which the hand stays 0.5 mm away."""
    t = by_trial(clean, clean.position) * 0 + clean.time_s.reshape(clean.n_trials, -1, 1)
    away = by_trial(clean, clean.position - 0.3)
    unit = away / np.maximum(np.linalg.norm(away, axis=2, keepdims=True).max(axis=1)[:, None], 1e-9)
    peak = unit[np.arange(8), np.linalg.norm(unit, axis=2).argmax(axis=1)][:, None]
    rest = np.where(t > 0.4, 0.1 * peak, 0.0)
    moved = 0.005 * np.where(np.linalg.norm(rest, axis=2, keepdims=True) > 0, rest, unit)
    moved[t[..., 0] <= 0.4] = 0.005 * unit[t[..., 0] <= 0.4]
    stays = replace(clean, position=0.3 + moved.reshape(-1, 2))
    found = message(stays, "returns to start")
    assert found.verdict == "warning"
    assert "0.50 mm (median), 10.0 % of the peak" in found.message


@pytest.mark.parametrize(("size", "verdict"), [(2.0, "ok"), (0.125, "warning")])
def test_noise_at_rest_is_told_against_the_response(clean, size, verdict):
    """A force that swings by 0.1 N at rest and answers with a constant: sd over rms."""
    lag = clean.time_s - 0.25
    swing = np.where(np.arange(len(lag)) % 2, 0.1, -0.1)
    inside = (lag > 0) & (lag <= 0.3)
    force = np.where(inside, size, swing)[:, None] * np.ones(2)
    found = message(replace(clean, force=force), "noise at rest")
    assert found.verdict == verdict
    assert f"force sd 0.1 N, {100 * 0.1 / size:.0f} % of" in found.message
