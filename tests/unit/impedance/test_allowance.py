"""Intervals that allow for departures: narrow where there are none, wide enough where there are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.impedance.doubts.allowance import allowing
from armimpedance.impedance.estimation import estimate

BY = ("condition",)


def answering(recording, K, part, delay_s=0.055):
    """A reflex of this part of K."""
    force = recording.force.copy()
    for row in range(recording.n_trials):
        at = recording.samples_of(row)
        clock, moved = recording.time_s[at], recording.position[at] - recording.position[at][0]
        late = [np.interp(clock - delay_s, clock, axis) for axis in moved.T]
        force[at] -= part * np.column_stack(late) @ K.T
    return replace(recording, force=force)


def covered(limb, part, seeds=range(16)):
    """Part of K's elements within their intervals without and with allowance; growth of sds."""
    held, growth = [], []
    for seed in seeds:
        sound = limb.record(sets=2, force_noise=0.1, duration=0.25, drift=0.001, seed=seed)
        recording = answering(sound, limb.K, part)
        (plain,) = estimate(recording)
        (wide,) = allowing([plain], recording, BY)
        inside = []
        for one in (plain, wide):
            low, high = one.interval()[:, 2]
            inside.append(((low < limb.K) & (high > limb.K)).mean())
        held.append(inside)
        growth.append(wide.sd[2] / plain.sd[2])
    return np.mean(held, axis=0), float(np.median(growth))


def test_without_a_departure_the_intervals_grow_little_and_hold(limb):
    (_, wide), growth = covered(limb, 0.0)
    assert wide > 0.88  # 64 elements of .95 that are alike in fours
    # A reflex of .3 K is taken for as likely as none: what it may do beside this noise.
    assert 1.0 <= growth < 1.6


@pytest.mark.parametrize("part", [0.15, 0.4])
def test_a_reflex_that_biases_stays_within_the_intervals(limb, part):
    (plain, wide), growth = covered(limb, part)
    assert wide > 0.85
    assert wide > plain
    assert growth > 1.1


def test_values_stay_and_the_provenance_says_what_is_allowed_for(limb):
    recording = limb.record(sets=1, force_noise=0.1, seed=3)
    (plain,) = estimate(recording)
    (wide,) = allowing([plain], recording, BY)
    np.testing.assert_array_equal(wide.parameters, plain.parameters)
    more = wide.covariance - plain.covariance
    np.testing.assert_allclose(wide.bound - plain.bound, more, atol=1e-9 * np.abs(more).max())
    assert (np.linalg.eigvalsh(more) > -1e-12).all()
    assert "intervals allow for" in wide.provenance[-1]


def test_too_few_trials_stay_as_they_are(limb):
    recording = limb.record(sets=1, directions=4, force_noise=0.1)
    (plain,) = estimate(recording)
    assert allowing([plain], recording, BY) == [plain]
