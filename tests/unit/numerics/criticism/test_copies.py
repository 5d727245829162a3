"""Copies of trials share their noise, whatever they are called; measured trials do not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from armimpedance.numerics.criticism import check_copies
from armimpedance.numerics.signals import cut_windows


def doubled(recording, delay_s=0.0):
    """Every trial twice; the second time read off a clock that is late by `delay_s`."""

    def again(samples):
        late = np.empty_like(samples)
        for row in range(recording.n_trials):
            at = recording.samples_of(row)
            clock = recording.time_s[at]
            for axis in range(samples.shape[1]):
                late[at, axis] = np.interp(clock + delay_s, clock, samples[at, axis])
        return np.concatenate([samples, late])

    more = recording.trials.assign(trial=recording.trials["trial"] + 100)
    return replace(
        recording,
        trials=pd.concat([recording.trials, more], ignore_index=True),
        offsets=np.concatenate([recording.offsets, recording.offsets[-1] + recording.offsets[1:]]),
        time_s=np.tile(recording.time_s, 2),
        position=again(recording.position),
        force=again(recording.force),
    )


def noisy(limb, seed, **fields):
    recording = limb.record(sets=2, force_noise=0.05, seed=seed, **fields)
    rng = np.random.default_rng(seed + 1000)
    return replace(
        recording, position=recording.position + rng.normal(0, 1e-5, recording.position.shape)
    )


@pytest.mark.parametrize("delay_s", [0.0, 0.0004])
@pytest.mark.parametrize("around_onset", [True, False])
def test_every_trial_twice_is_told_with_its_numbers(limb, delay_s, around_onset):
    twice = doubled(noisy(limb, 1), delay_s)
    found = check_copies(twice, cut_windows(twice) if around_onset else None)
    assert found.verdict == "unusable"
    assert "1 = 101" in found.message


def test_one_copy_among_many_is_found(limb):
    recording = noisy(limb, 2)
    both = doubled(recording)
    found = check_copies(both.select([*range(16), 20]))
    assert "5 = 105;" in found.message


def test_repeats_of_a_direction_are_no_copies(limb):
    """The same course, other noise: twenty recordings, none told."""
    for seed in range(20):
        recording = noisy(limb, seed)
        assert check_copies(recording, cut_windows(recording)).verdict == "ok"


def test_without_noise_nothing_can_be_told(limb):
    recording = limb.record(sets=2)
    assert "no noise" in check_copies(recording, cut_windows(recording)).message


def test_one_trial_alone(limb):
    assert check_copies(noisy(limb, 3).select([0])).verdict == "ok"
