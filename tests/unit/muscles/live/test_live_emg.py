"""EMG live: the amplitude of a causal filter, faults seen in time, gains that drift."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_up_arm import SUBJECT
from scipy.signal import butter, sosfilt

from armimpedance.core.errors import InputError
from armimpedance.muscles.live import EmgLevels, Live
from armimpedance.numerics.signals import causal_lowpass
from manipulandum_sim.emg_carrier import carrier

RATE = 1000.0
MAXIMUM = np.array([0.4, 0.25, 0.6, 0.45, 0.7, 0.35]) * 1e-3
NOISE_V = 2e-6
LEVELS = EmgLevels(MAXIMUM, np.full(6, NOISE_V * np.sqrt(2 / np.pi)), np.full(6, 0.07))
POSTURE = [1.0, 1.5]
FAULTY = 4


def emg(alpha: np.ndarray, seed: int) -> np.ndarray:
    """Raw EMG (S, 6) in V at activations (S, 6), on the offsets of its electrodes."""
    rng = np.random.default_rng(seed)
    sd = np.hypot(alpha * MAXIMUM * np.sqrt(np.pi / 2), NOISE_V)
    return carrier(rng, len(alpha), 6) * sd + rng.normal(0, 1e-3, 6)


def held(samples: int) -> np.ndarray:
    return np.tile([0.1, 0.1, 0.2, 0.05, 0.3, 0.02], (samples, 1))


def test_the_amplitude_is_that_of_a_causal_filter(model):
    raw = emg(held(2200), 1)
    live = Live(model, SUBJECT, levels=LEVELS)
    alpha = np.array([live.update(x, q=POSTURE).activation for x in raw])
    band = sosfilt(butter(2, 10, "highpass", fs=RATE, output="sos"), raw - raw[0], axis=0)
    smooth = causal_lowpass(np.abs(band), 3.5, RATE, order=2)
    # how a filter begins is forgotten after a second
    np.testing.assert_allclose(alpha[1200:], LEVELS.activation(smooth)[0][1200:], atol=1e-6)
    # a second of |N| some 430 Hz wide: 860 independent samples; 4 standard errors of 2.6 %
    assert np.abs(alpha[1200:].mean(axis=0) / held(1) - 1).max() < 0.104
    assert live.delay_s == pytest.approx(np.sqrt(2) / (2 * np.pi * 3.5), rel=1e-2)


def faulty(kind: str, x: np.ndarray) -> np.ndarray:
    t, rng = np.arange(len(x)) / RATE, np.random.default_rng(7)
    return {
        "flat": 0 * x,
        "noise of the amplifier": rng.normal(0, 0.3 * NOISE_V, len(x)),
        "at its end": np.full(len(x), 0.01),
        "clipped": np.clip(8 * x, -0.0025, 0.0025),
        "hum of 50 Hz": 0.002 * np.sin(2 * np.pi * 50 * t),
        "hum of 60 Hz": 0.001 * np.sin(2 * np.pi * 60 * t + 1),
        "far too large": 20 * x,
        "swinging cable": x + 0.01 * np.sin(2 * np.pi * 3 * t),
        "nothing comes": np.full(len(x), np.nan),
        "infinite": np.full(len(x), np.inf),
    }[kind]


KINDS = [
    *("flat", "noise of the amplifier", "at its end", "clipped", "hum of 50 Hz", "hum of 60 Hz"),
    *("far too large", "swinging cable", "nothing comes", "infinite"),
]


@pytest.mark.parametrize("kind", KINDS)
def test_a_fault_is_seen_within_a_tenth_of_a_second_and_its_channel_is_held(model, kind):
    begins = 400
    raw = emg(held(600), 3)
    raw[begins:, FAULTY] = faulty(kind, raw[begins:, FAULTY])
    live = Live(model, SUBJECT, levels=LEVELS)
    results = [live.update(x, q=POSTURE, time_s=k / RATE) for k, x in enumerate(raw)]
    told = [any(live.muscles[FAULTY] in flag for flag in one.flags) for one in results]
    assert not any(told[:begins])
    assert begins <= told.index(True) <= begins + 100
    assert all(told[begins + 100 :])
    after = np.array([one.activation[FAULTY] for one in results[begins + 100 :]])
    assert np.abs(after - results[begins - 1].activation[FAULTY]).max() < 0.1
    assert np.isfinite([one.covariance for one in results]).all()
    assert (np.linalg.eigvalsh([one.stiffness for one in results])[:, 0] > 0).all()
    flags = {flag for one in results[200:] for flag in one.flags}
    assert all(live.muscles[FAULTY] in flag for flag in flags)


@pytest.mark.study
def test_a_channel_comes_back(model):
    raw = emg(held(2500), 4)
    raw[800:1200, FAULTY] = 0.0
    live = Live(model, SUBJECT, levels=LEVELS)
    results = [live.update(x, q=POSTURE) for x in raw]
    assert results[1100].flags
    assert not any(one.flags for one in results[1400:])
    after = np.array([one.activation[FAULTY] for one in results[1800:]])
    assert after.mean() == pytest.approx(0.3, rel=0.1)


@pytest.mark.study
def test_sound_emg_is_not_suspected(model):
    live = Live(model, SUBJECT, levels=LEVELS)
    alpha = held(6000)
    alpha[3000:] = [0.3, 0.01, 0.1, 0.2, 0.05, 0.0]
    results = [live.update(x, q=POSTURE) for x in emg(alpha, 5)]
    assert [one.flags for one in results[200:] if one.flags] == []


@pytest.mark.study
def test_the_band_holds_the_noise_of_the_carrier(model):
    """The spread of the live stiffness about its mean is what its band says of the activations."""
    live = Live(model, SUBJECT, levels=LEVELS)
    sure = replace(LEVELS, noise=np.zeros(6))
    without = Live(model, SUBJECT, levels=sure)
    K, own = [], []
    for x in emg(held(8000), 6):
        one = live.update(x, q=POSTURE)
        K.append(one.stiffness[np.triu_indices(2)])
        own.append(one.covariance - without.update(x, q=POSTURE).covariance)
    told = np.sqrt(np.mean(own[2000:], axis=0).diagonal())
    np.testing.assert_allclose(np.std(K[2000:], axis=0), told, rtol=0.5)


def test_an_envelope_is_taken_as_it_is(model):
    live = Live(model, SUBJECT, levels=LEVELS, envelope=True)
    amplitude = np.hypot(held(1)[0] * np.sqrt(MAXIMUM**2 - LEVELS.rest_V**2), LEVELS.rest_V)
    one = live.update(amplitude, q=POSTURE)
    np.testing.assert_allclose(one.activation, held(1)[0], rtol=1e-12)
    assert live.delay_s == 0


def test_a_gain_that_drifted_is_followed():
    rng = np.random.default_rng(8)
    gain = np.array([1.0, 1.5, 0.6, 1.2, 0.8, 1.0])
    known = rng.uniform(0.1, 0.3, (2, 6))
    known[:, 5] = 0.0
    scale = np.sqrt(MAXIMUM**2 - LEVELS.rest_V**2)
    loads = np.hypot(gain * known * scale, LEVELS.rest_V)
    found = LEVELS.recalibrated(LEVELS.rest_V, loads, known)
    np.testing.assert_allclose(found.gain[:5], gain[:5], rtol=1e-9)
    assert found.told.tolist() == [True] * 5 + [False]
    np.testing.assert_allclose(found.levels.activation(loads)[0], known, rtol=1e-9, atol=1e-12)
    assert found.levels.maximum_V[5] == MAXIMUM[5]


@pytest.mark.parametrize("loads", [np.ones((1, 6)), np.ones((2, 5)), np.full((2, 6), np.nan)])
def test_loads_that_cannot_tell_are_refused(loads):
    with pytest.raises(InputError):
        LEVELS.recalibrated(LEVELS.rest_V, loads, np.full((len(loads), 6), 0.2))


def test_levels_of_other_muscles_and_slow_raw_emg_are_refused(model):
    five = EmgLevels(MAXIMUM[:5], np.zeros(5), np.zeros(5))
    for wrong in ({"levels": five}, {"levels": LEVELS, "rate_hz": 100.0}):
        with pytest.raises(InputError):
            Live(model, SUBJECT, **({"levels": LEVELS} | wrong))
