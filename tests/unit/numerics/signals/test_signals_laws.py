"""Laws of the signals' room: straight lines pass a smoother, means have the error of means."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.signal import butter, sosfiltfilt

from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from armimpedance.numerics.signals import (
    bandpass,
    check_emg,
    check_recording,
    choose_span,
    cut_windows,
    emg_amplitude,
    lowpass,
    mean_activation,
    multiple_coherence,
    position_noise,
    respond,
    segment_amplitude,
    spline_modes,
)
from armimpedance.numerics.signals.emg.cleaning import mean_overlap


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
    """Near: a force to one side rests at its smallest value; far: a tenth of the range away."""
    rng = np.random.default_rng(0)
    force = np.abs(rng.normal(size=clean.force.shape))
    force[clean.offsets[:-1]] = 0.0
    for value, verdict in ((0.0, "ok"), (1.1 * force.max(), "warning")):
        held = force.copy()
        held[100:160, 0] = value
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


# Filters and spectra


@pytest.mark.parametrize(("order", "edges"), [(2, (10.0,)), (4, (3.0,)), (2, (20.0, 90.0))])
@pytest.mark.parametrize("samples", [400, 60])
def test_filters_are_scipy_s_forward_and_backward(order, edges, samples):
    """Of even order, where SciPy's own padding of the ends is the textbook's."""
    signal = np.cumsum(np.random.default_rng(7).normal(size=(3, samples)), axis=1)
    kind = "low" if len(edges) == 1 else "band"
    sos = butter(order, edges[0] if kind == "low" else edges, kind, fs=500.0, output="sos")
    made = (lowpass if kind == "low" else bandpass)(signal, *edges, 500.0, order=order)
    expected = sosfiltfilt(sos, signal, padlen=3 * (2 * len(sos) + 1))
    np.testing.assert_allclose(made, expected, atol=1e-12)


def test_coherence_of_an_exact_system_is_one_and_never_more():
    rng = np.random.default_rng(12)
    motion = rng.normal(size=(20_000, 2))
    told = multiple_coherence(motion, motion @ [[3.0, -1.0], [0.5, 2.0]], 500.0)
    assert (told.coherence <= 1).all()
    assert (told.coherence >= 0).all()
    assert told.coherence.min() > 1 - 1e-9
    assert told.frequency_hz[-1] == 250.0
    np.testing.assert_allclose(np.diff(told.frequency_hz), 1.0)
    alone = multiple_coherence(motion, rng.normal(size=(20_000, 2)), 500.0)
    # two inputs, some 79 segments that overlap by half
    assert alone.mean(1, 249) == pytest.approx(2 / 40, abs=0.03)


def test_readings_on_a_grid_have_a_twelfth_of_its_square():
    """Uniform between two steps: variance step^2/12, whatever moved."""
    t = np.arange(600) / 1000.0
    true = 0.005 * np.sin(2 * np.pi * 3 * t)[None, :, None] * np.ones((6, 1, 2))
    step = 2e-5
    made = position_noise(np.round(true / step) * step, 1000.0, spline_modes(600, 1000.0))
    assert made.step == pytest.approx(step, rel=1e-9)
    assert made.variance == pytest.approx(step**2 / 12, rel=1e-9)


# EMG


def test_a_running_mean_overlaps_itself_as_a_triangle():
    """``(h * h)_k`` of n equal weights 1/n: (n - k)/n^2 up to n, then nothing."""
    for n in (1, 4, 9):
        h = np.full(n, 1 / n)
        expected = [h[: n - k] @ h[k:] if k < n else 0.0 for k in range(12)]
        np.testing.assert_allclose(mean_overlap(n, 12), expected, atol=1e-15)


@pytest.fixture(scope="module")
def emg(emg_recording):
    level = 0.3 + 0.2 * np.sin(2 * np.pi * 0.5 * np.arange(6000) / 1000.0)
    return emg_recording(np.repeat(level, 2).reshape(1, 6000, 2), seed=3, noise_V=2e-6, rest=True)


def test_an_amplitude_is_aligned_unless_asked_otherwise(emg):
    usual, aligned, late = (
        emg_amplitude(emg, causal=True, **how) for how in ({}, {"align": True}, {"align": False})
    )
    np.testing.assert_array_equal(usual.amplitude, aligned.amplitude)
    assert np.abs(usual.amplitude - late.amplitude).max() > 1e-3


def test_the_column_that_is_lacking_is_named(emg):
    def notes(drop):
        some = replace(emg, trials=emg.trials.drop(columns=[f"rest_{m}_V" for m in drop]))
        return " ".join(emg_amplitude(some).notes)

    for gone, stays in (("biceps", "triceps"), ("triceps", "biceps")):
        said = notes([gone])
        assert f"rest_{gone}_V" in said
        assert f"rest_{stays}_V" not in said
    empty = replace(emg, trials=emg.trials.assign(rest_biceps_V=np.nan))
    said = " ".join(emg_amplitude(empty).notes)
    assert "rest_biceps_V" in said


def test_a_converter_of_few_levels_is_not_saturated(emg):
    """Sixteen levels that are all as frequent: each extreme holds a sixteenth of the samples."""
    levels = np.random.default_rng(6).integers(0, 16, emg.emg.shape)

    def verdict(values):
        told = check_emg(replace(emg, emg=1e-5 * values))
        return next(c.verdict for c in told if c.name == "saturated")

    assert verdict(levels) == "ok"
    assert verdict(np.where(levels > 10, 15, levels)) == "unusable"
    assert verdict(np.where(levels < 5, 0, levels)) == "unusable"


def test_segments_hold_the_mean_of_what_they_span(emg):
    """Normalised EMG: the amplitude of a segment is its plain mean."""
    flat = np.linspace(0.0, 0.9, emg.emg.size).reshape(emg.emg.shape)
    known = replace(emg, emg=flat, emg_unit="normalised")
    made = segment_amplitude(known, segment_s=0.5)
    expected = flat.reshape(12, 500, 2).mean(axis=1)
    np.testing.assert_allclose(made.amplitude, expected, rtol=1e-12)


def test_a_recording_holds_samples():
    with pytest.raises(InputError):
        Recording(
            kind="hand",
            sample_rate_hz=1000.0,
            trials=pd.DataFrame({"trial": [1], "condition": ["c"]}),
            offsets=np.array([0, 0]),
            time_s=np.zeros(0),
            position=np.zeros((0, 2)),
            force=np.zeros((0, 2)),
        )
