"""Intervals that allow for departures: narrow where there are none, wide enough where there are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.hand.still.doubts.allowance import allowing, in_common
from armimpedance.hand.still.doubts.departures import check_departures
from armimpedance.hand.still.doubts.odds import tails
from armimpedance.hand.still.estimation import estimate

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


def test_an_answer_to_the_velocity_is_named_and_the_intervals_hold(limb):
    held = []
    for seed in range(12):
        sound = limb.record(sets=2, force_noise=0.1, drift=0.001, seed=seed)
        force = sound.force.copy()
        for row in range(sound.n_trials):
            at = sound.samples_of(row)
            rate = np.gradient(sound.position[at], 1 / limb.rate, axis=0)
            # 30 ms times K x'(t - 45 ms); no column but its own resembles it
            force[at] -= 0.03 * np.roll(rate, 45, axis=0) @ limb.K.T
        recording = replace(sound, force=force)
        (plain,) = estimate(recording)
        (wide,) = allowing([plain], recording, BY)
        low, high = wide.interval()[:, 2]
        held.append(((low < limb.K) & (high > limb.K)).mean())
        told = next(one for one in check_departures(recording) if one.name == "reflex")
        assert told.verdict == "warning"
    # 48 elements of .95 that are alike in fours: 2.5 standard errors of 12 independent ones
    assert np.mean(held) > 0.79


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


def test_what_all_conditions_share_is_part_of_their_covariance(limb):
    recording = answering(limb.record(sets=2, force_noise=0.1, seed=4), limb.K, 0.3)
    (plain,) = estimate(recording)
    (wide,) = allowing([plain], recording, BY)
    more = wide.covariance - plain.covariance
    assert "reflex" in wide.shared_errors
    errors = np.array(list(wide.shared_errors.values()))
    rest = more - errors.T @ errors
    size = np.abs(more).max()
    assert (np.linalg.eigvalsh(rest) > -1e-9 * size).all()
    # columns of one departure differ little: the vectors hold nearly all of it
    assert np.trace(rest) < 0.1 * np.trace(more)
    # a reflex makes K larger, whatever the sign that a decomposition gives
    assert np.trace(wide.shared_errors["reflex"][-4:].reshape(2, 2)) > 0


def test_departures_of_all_groups_come_together():
    one, other = np.array([[1.0, 2.0, 0.5]]), np.array([[-2.0, 1.0, 3.0]])
    columns = [np.vstack([one, 0.5 * one]), np.vstack([other, 0.5 * other])]
    first, none, second = in_common([{"reflex": columns[0]}, {}, {"reflex": columns[1]}])
    assert none == {}
    # collinear columns lose nothing, and the covariance between groups is theirs
    np.testing.assert_allclose(
        np.outer(first["reflex"], second["reflex"]), columns[0].T @ columns[1], atol=1e-12
    )
    assert first["reflex"] @ one[0] > 0


def test_a_normal_interval_is_as_wide_as_that_of_a_mixture():
    rng = np.random.default_rng(2)
    n = 400_000
    for p in (0.1, 0.2, 0.5, 1.0):
        there = rng.random(n) < p
        drawn = np.where(there, rng.standard_normal(n), 0.0)
        held = np.mean(np.abs(drawn) <= 1.959964 * np.sqrt(p * tails(p)))
        assert held >= 0.95 - 4 * np.sqrt(0.95 * 0.05 / n)
    assert tails(0.01) == 1.0
