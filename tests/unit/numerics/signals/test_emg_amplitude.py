"""EMG amplitude: RMS, its noise, its delay, what comes off, how near it is to the activation."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from armimpedance.core.errors import InputError
from armimpedance.numerics.signals.emg.activation import envelope
from armimpedance.numerics.signals.emg.amplitude import emg_amplitude, segment_amplitude
from armimpedance.numerics.signals.emg.cleaning import (
    lowpass_overlap,
    rectified_correlation,
    relative_sd,
)
from armimpedance.numerics.signals.filters import advanced, causal_lowpass, lowpass, lowpass_delay_s
from manipulandum_sim.elbow.simulate import simulate_elbow

RATE = 1000.0
TIME = np.arange(10_000) / RATE


def held(*levels, trials=1, samples=10_000):
    return np.broadcast_to(np.array(levels), (trials, samples, 2))


@pytest.fixture(scope="module")
def steady(emg_recording):
    return emg_recording(held(0.3, 0.1, trials=40), seed=1)


# --- amplitude and its standard error ------------------------------------------------------------


def test_rms_is_the_root_of_the_mean_square(steady):
    """Exact but for rounding: not the root of the sum, over n, that the source prints."""
    found = segment_amplitude(steady)
    mvc = steady.trials[["mvc_biceps_V", "mvc_triceps_V"]].to_numpy()
    raw = steady.emg.reshape(40, -1, 2)
    deviation = raw.std(axis=1)
    assert found.amplitude == pytest.approx(deviation / (mvc * np.sqrt(np.pi / 2)), rel=1e-12)


@pytest.mark.parametrize("kind", ["rms", "rectified"])
def test_both_amplitudes_are_the_activation_with_the_standard_error_they_state(steady, kind):
    """Mean of 800 segments: 4 standard errors. Their spread is known to 1/sqrt(1600) = 2.5 %;
    4 times that is allowed."""
    found = segment_amplitude(steady, kind=kind, segment_s=0.5)
    assert found.amplitude.shape == (800, 2)
    error = found.amplitude.std(axis=0) / np.sqrt(800)
    assert (np.abs(found.amplitude.mean(axis=0) - [0.3, 0.1]) < 4 * error).all()
    spread = found.amplitude.std(axis=0) / np.sqrt((found.sd**2).mean(axis=0))
    assert np.abs(spread - 1).max() < 0.1


@pytest.mark.parametrize("causal", [False, True])
def test_the_spread_over_time_is_the_standard_error_stated(steady, causal):
    """400 s of 20 independent values a second: known to 1/sqrt(2 8000), some 1 %; a first-order
    propagation and ends of trials get 4 %."""
    found = emg_amplitude(steady, causal=causal)
    inner = np.concatenate([np.arange(a + 300, b - 300) for a, b in _trials(found.offsets)])
    level = found.amplitude[inner]
    assert level.std(axis=0) / found.noise_sd == pytest.approx(np.ones(2), abs=0.04)
    assert found.relative_noise == pytest.approx(found.sd[0] / found.amplitude[0], rel=1e-9)


def _trials(offsets):
    return zip(offsets[:-1], offsets[1:], strict=True)


def test_covariance_of_rectified_noise_against_draws():
    """1e6 draws of a bivariate normal: the covariance, over 2/pi, is known to some 1.5e-3."""
    rng = np.random.default_rng(2)
    a, b = rng.standard_normal((2, 1_000_000))
    for rho in (-0.6, 0.3, 0.95):
        other = rho * a + np.sqrt(1 - rho**2) * b
        seen = np.cov(np.abs(a), np.abs(other))[0, 1] / (2 / np.pi)
        assert rectified_correlation(np.array(rho)) == pytest.approx(seen, abs=6e-3)
    assert rectified_correlation(np.array(0.0)) == pytest.approx(0.0, abs=1e-15)
    assert rectified_correlation(np.array(1.0)) == pytest.approx(np.pi / 2 - 1)


@pytest.mark.parametrize("causal", [False, True])
def test_noise_gain_of_the_low_pass_is_the_energy_of_its_impulse_response(causal):
    impulse = np.zeros(4001)
    impulse[2000] = 1.0
    if causal:
        h = sosfilt(butter(5, 10, fs=RATE, output="sos"), impulse)
    else:
        h = lowpass(impulse, 10.0, RATE, order=5, axis=0)
    overlap = lowpass_overlap(10.0, RATE, 5, 30, causal=causal)
    lagged = [h[: len(h) - k] @ h[k:] for k in range(30)]
    assert overlap == pytest.approx(np.array(lagged), abs=1e-8)
    white = np.zeros((30, 1))
    white[0] = 1.0
    assert relative_sd(white, overlap) == pytest.approx(np.sqrt([h @ h]), rel=1e-6)


# --- delay ---------------------------------------------------------------------------------------


def test_the_causal_fifth_order_low_pass_is_late_by_51_ms():
    """A ramp comes out late by the group delay at 0 Hz exactly; to 1 ms is asked."""
    delay = lowpass_delay_s(10.0, RATE, 5)
    ramp = causal_lowpass(TIME, 10.0, RATE, order=5)
    seen = (TIME - ramp)[5000:]
    assert seen == pytest.approx(np.full(5000, delay), abs=1e-9)
    # analog: (1 / w_c) sum of 2 cos of the poles' angles, 3.236 / w_c
    assert delay == pytest.approx((1 + np.sqrt(5)) / (2 * np.pi * 10), abs=1e-3)


def test_aligned_it_follows_zero_phase_and_unaligned_it_is_late(emg_recording):
    course = 0.3 + 0.2 * np.sin(2 * np.pi * 0.7 * TIME)
    recording = emg_recording(np.broadcast_to(course[None, :, None], (10, 10_000, 2)), seed=3)
    late, aligned = (emg_amplitude(recording, causal=True, align=a) for a in (False, True))
    assert (late.lag_s, aligned.lag_s) == (pytest.approx(0.0515, abs=1e-3), 0.0)
    assert any("51.5 ms late" in note for note in late.notes)
    known = delay_of(emg_amplitude(recording))
    # noise of the carrier, some 1 ms, is the same in all three
    assert known == pytest.approx(0, abs=4e-3)
    assert delay_of(late) - known == pytest.approx(late.lag_s, abs=1e-3)
    assert delay_of(aligned) - known == pytest.approx(0, abs=1e-3)


def delay_of(found):
    """Of the mean amplitude behind the sine of the activation."""
    inner = slice(500, -500)
    mean = found.amplitude.reshape(10, -1, 2).mean(axis=(0, 2))[inner]
    phase = 2 * np.pi * 0.7 * TIME[inner]
    X = np.column_stack([np.ones_like(phase), np.sin(phase), np.cos(phase)])
    _, sine, cosine = np.linalg.lstsq(X, mean, rcond=None)[0]
    return np.arctan2(-cosine, sine) / (2 * np.pi * 0.7)


def test_advancing_by_part_of_a_sample_is_exact_for_a_line():
    line = np.linspace(0, 1, 101)[:, None]
    moved = advanced(line, 2.5e-3, RATE)
    assert moved[:90] == pytest.approx(line[:90] + 0.025)
    assert moved[-1] == line[-1]


def test_causal_output_does_not_know_the_future():
    rng = np.random.default_rng(4)
    emg = rng.normal(size=(3000, 1))
    # the offset is the trial's: antisymmetric additions leave it
    other = emg.copy()
    other[2000:2500] += 5
    other[2500:] -= 5
    both = [envelope(x, RATE, cutoff_hz=10.0, order=5, causal=True) for x in (emg, other)]
    assert both[0][:2000] == pytest.approx(both[1][:2000], abs=1e-9)
    assert np.abs(both[0][2100:] - both[1][2100:]).max() > 1


# --- what comes off ------------------------------------------------------------------------------


def test_noise_of_the_electrode_is_taken_off_in_squares(emg_recording):
    """SNR 0 dB at activation 0.05: without rest the amplitude is 41 % too large. 40 trials of 10 s:
    4 standard errors of the mean."""
    noise = 0.05 * 4e-4 * np.sqrt(np.pi / 2)
    activation = held(0.05, 0.3, trials=40)
    known = emg_recording(activation, seed=5, noise_V=noise, rest=True)
    found = segment_amplitude(known)
    error = found.amplitude.std(axis=0) / np.sqrt(40)
    assert (np.abs(found.amplitude.mean(axis=0) - [0.05, 0.3]) < 4 * error).all()
    spread = found.amplitude.std(axis=0) / np.sqrt((found.sd**2).mean(axis=0))
    # 40 values: spread known to 11 %
    assert np.abs(spread - 1).max() < 0.4
    raw = segment_amplitude(emg_recording(activation, seed=5, noise_V=noise))
    assert raw.amplitude[:, 0].mean() == pytest.approx(0.05 * np.sqrt(2), rel=0.02)


def test_hum_is_taken_out_and_said(emg_recording):
    """Hum as strong as the EMG, off the nominal 50 Hz, with a harmonic; sinusoids that are
    subtracted leave the rest of the samples alone, so the clean recording is the truth."""
    activation = held(0.2, 0.2, trials=2)
    hum = np.sin(2 * np.pi * 50.06 * TIME + 1) + 0.3 * np.sin(2 * np.pi * 150.18 * TIME)
    clean = emg_amplitude(emg_recording(activation, seed=6))
    dirty = emg_recording(activation, seed=6, extra_V=1e-4 * hum[None, :, None])
    found = emg_amplitude(dirty)
    assert any("hum at multiples of 50 Hz taken out of 4 channels" in n for n in found.notes)
    assert any("hum" in w for w in found.warnings)
    ratio = np.sqrt((found.amplitude**2).mean() / (clean.amplitude**2).mean())
    assert ratio == pytest.approx(1, abs=0.01)
    assert np.abs(found.amplitude - clean.amplitude).max() < 0.03


def test_a_moving_electrode_is_filtered_and_said(emg_recording):
    rng = np.random.default_rng(7)
    slow = sosfilt(butter(4, 5, fs=RATE, output="sos"), rng.normal(size=(4, 10_000, 2)), axis=1)
    activation = held(0.2, 0.2, trials=4)
    dirty = emg_recording(activation, seed=8, extra_V=slow * np.array([1e-3, 0.0]))
    found = emg_amplitude(dirty)
    assert [n for n in found.notes if "high-pass" in n][0].startswith("biceps: zero-phase high")
    assert not any("triceps: " in n for n in found.notes)
    clean = emg_amplitude(emg_recording(activation, seed=8))
    # the high-pass takes some 1 % of the EMG with it
    ratio = found.amplitude.mean(axis=0) / clean.amplitude.mean(axis=0)
    assert 0.97 < ratio[0] < 1.01
    assert ratio[1] == pytest.approx(1, abs=1e-9)


def test_without_anything_wrong_nothing_is_taken_out(steady):
    found = emg_amplitude(steady)
    assert found.warnings == ()
    assert len(found.notes) == 2
    assert found.notes[0].startswith("rectified")
    assert "not taken off: no rest_biceps_V, rest_triceps_V" in found.notes[1]


def test_activation_in_the_moving_exoskeleton_is_the_subjects():
    """Hum, electrode noise and cables that swing with the arm; the high-pass against the latter
    takes 1 % of the EMG, and 1.3 % is the standard error of 3 s: 4 of them besides."""
    recording, truth = simulate_elbow("cocontraction", seed=9, repetitions=1, duration_s=3.0)
    found = segment_amplitude(recording)
    true = truth.activation.reshape(recording.n_trials, -1, 2).mean(axis=1)
    assert (np.abs(found.amplitude - 0.99 * true) < 4 * found.sd + 0.01 * true).all()
    assert any("high-pass" in note for note in found.notes)


# --- invariances and refusals --------------------------------------------------------------------


def test_offset_sign_and_unit_do_not_matter(steady):
    known = emg_amplitude(steady.select([0, 1])).amplitude
    two = steady.select([0, 1])
    columns = {c: 1e6 * two.trials[c] for c in ("mvc_biceps_V", "mvc_triceps_V")}
    microvolt = replace(two, emg=-1e6 * two.emg + 300, trials=two.trials.assign(**columns))
    assert emg_amplitude(microvolt).amplitude == pytest.approx(known, abs=1e-9)


def test_a_trial_does_not_see_its_neighbours(steady):
    both, one = emg_amplitude(steady.select([0, 1])), emg_amplitude(steady.select([1]))
    assert both.amplitude[both.samples_of(1)] == pytest.approx(one.amplitude, abs=1e-12)


def test_normalised_emg_is_an_amplitude_already(steady):
    one = steady.select([0])
    flat = np.broadcast_to([0.2, 0.4], one.emg.shape)
    found = emg_amplitude(replace(one, emg=flat, emg_unit="normalised"))
    assert found.amplitude == pytest.approx(np.array(flat), abs=1e-9)
    assert not found.sd.any()
    assert "noise is not known" in found.warnings[0]
    means = segment_amplitude(replace(one, emg=flat, emg_unit="normalised"), segment_s=1.0)
    assert means.amplitude == pytest.approx(np.broadcast_to([0.2, 0.4], (10, 2)))
    with pytest.raises(InputError, match="causal amplitude of normalised"):
        emg_amplitude(replace(one, emg=flat, emg_unit="normalised"), causal=True)


def test_a_band_that_the_rate_cannot_hold_is_refused(steady):
    with pytest.raises(InputError, match="20 to 500 Hz at 1000 Hz.*expected 0 < low < high < 500"):
        emg_amplitude(steady, band_hz=(20, 500))
    assert "20 to 450 Hz" in emg_amplitude(steady.select([0]), band_hz=(20, 450)).notes[0]


def test_a_trial_shorter_than_the_low_pass_is_named(emg_recording):
    with pytest.raises(InputError, match=r"trial 1: EMG record of 0.05 s \(expected at least"):
        emg_amplitude(emg_recording(held(0.2, 0.2, samples=50)))


@pytest.mark.parametrize("options", [{"kind": "peak"}, {"segment_s": 11.0}, {"segment_s": 0.0}])
def test_hostile_segments(steady, options):
    with pytest.raises(InputError, match="unknown amplitude|segments of"):
        segment_amplitude(steady, **options)


def test_a_maximum_that_was_none_is_refused(steady):
    small = steady.trials.assign(mvc_triceps_V=1e-5)
    with pytest.raises(InputError, match="of triceps.*is the MVC"):
        segment_amplitude(replace(steady, trials=small))
