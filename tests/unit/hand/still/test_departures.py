"""Delay, reflex, amplitude: each found with its size, and none taken for another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import savgol_filter

from armimpedance.hand.still.doubts.departures import check_departures
from armimpedance.hand.still.doubts.model import _slopes


def told(recording):
    return {check.name for check in check_departures(recording) if check.verdict == "warning"}


def message(recording, name):
    return next(c.message for c in check_departures(recording) if c.name == name)


def by_trial(recording, change):
    """The force with `change(force, displacement, clock)` made of every trial's own."""
    force = recording.force.copy()
    for row in range(recording.n_trials):
        at = recording.samples_of(row)
        moved = recording.position[at] - recording.position[at][0]
        force[at] = change(force[at], moved, recording.time_s[at])
    return replace(recording, force=force)


def late(recording, delay_s):
    def change(force, _moved, clock):
        return np.column_stack([np.interp(clock - delay_s, clock, axis) for axis in force.T])

    return by_trial(recording, change)


def answering(recording, limb, part, delay_s=0.055):
    def change(force, moved, clock):
        before = [np.interp(clock - delay_s, clock, axis) for axis in moved.T]
        return force - part * np.column_stack(before) @ limb.K.T

    return by_trial(recording, change)


def bent(recording, limb, part, amplitude=0.005):
    """Stiffness ``K (1 + part |x|^2 / A^2)``."""

    def change(force, moved, _clock):
        size = (moved**2).sum(axis=1, keepdims=True) / amplitude**2
        return force - part * size * moved @ limb.K.T

    return by_trial(recording, change)


@pytest.fixture(scope="module")
def sound(limb):
    return limb.record(sets=3, force_noise=0.05, duration=0.2, seed=6)


def test_a_limb_of_second_order_is_told_nothing(sound):
    checks = check_departures(sound)
    names = ["own motion", "delay", "reflex", "amplitude", "friction", "voluntary"]
    names += ["lack of fit", "gain", "session", "single trials"]
    assert [check.name for check in checks] == names
    assert {check.verdict for check in checks} == {"ok"}
    assert all(check.smallest for check in checks)


def test_false_alarms_are_rare(limb):
    """Twenty recordings, levels of .002 to .007 for five checks: half of one expected, three or
    more by chance once in seventy times."""
    alarms = [told(limb.record(sets=1, force_noise=0.2, drift=0.002, seed=s)) for s in range(20)]
    assert sum(bool(each) for each in alarms) <= 2


@pytest.mark.parametrize("delay_ms", [-3.0, 1.0, 4.0])
def test_a_delay_is_found_with_its_size_and_nothing_else(sound, delay_ms):
    shifted = late(sound, delay_ms / 1e3)
    assert told(shifted) == {"delay"}
    text = message(shifted, "delay")
    assert ("late" if delay_ms > 0 else "early") in text
    # to first order in the delay: a tenth of 4 ms
    assert float(text.split(" ms")[0].split()[-1]) == pytest.approx(abs(delay_ms), abs=0.4)


def test_a_reflex_is_found_and_not_taken_for_a_delay(sound, limb):
    assert told(answering(sound, limb, 0.25)) == {"reflex"}


def test_delay_and_reflex_together(sound, limb):
    assert {"delay", "reflex"} <= told(late(answering(sound, limb, 0.4), 0.002))


@pytest.mark.parametrize("part", [-0.3, 0.3])
def test_a_bent_law_is_found_with_its_sign_and_size(sound, limb, part):
    """K of small deflections is known here: the change of K that is told must be the change."""
    recording = bent(sound, limb, part)
    assert "amplitude" in told(recording)
    percent = float(message(recording, "amplitude").split("makes K ")[1].split(" %")[0])
    assert np.sign(percent) == np.sign(part)
    assert 5 < abs(percent) < 100 * abs(part)


@pytest.mark.parametrize("newton", [0.2, 1.0])
def test_dry_friction_has_the_sign_of_the_velocity_and_is_no_delay(sound, newton):
    def change(force, moved, _clock):
        v = np.gradient(moved, 1e-3, axis=0)
        v = np.apply_along_axis(lambda one: np.convolve(one, np.ones(9) / 9, "same"), 0, v)
        return force - newton * v / (np.linalg.norm(v, axis=1, keepdims=True) + 1e-3)

    assert told(by_trial(sound, change)) == {"friction"}


@pytest.mark.parametrize("from_s", [0.1, 0.15])
def test_a_push_back_is_no_reflex(sound, from_s):
    def change(force, moved, clock):
        direction = moved[np.linalg.norm(moved, axis=1).argmax()] / 0.005
        onset = np.flatnonzero(np.linalg.norm(moved, axis=1) > 1e-4)[0]
        ramp = np.clip((clock - clock[onset] - from_s) / 0.15, 0, 1)
        return force - np.outer(ramp, direction)

    assert told(by_trial(sound, change)) == {"voluntary"}


def test_what_repeats_unexplained_is_told(sound):
    """A push that every trial of a direction meets again, of no form that a limb answers with."""

    def change(force, moved, clock):
        direction = moved[np.linalg.norm(moved, axis=1).argmax()] / 0.005
        return force + 0.4 * np.outer(np.sin(2 * np.pi * 14 * clock) * (clock > 0.1), direction)

    assert told(by_trial(sound, change))


def test_few_trials_and_no_conditions_that_are_long_enough(limb):
    found = check_departures(limb.record(sets=1, directions=4, force_noise=0.05))
    assert {check.verdict for check in found} == {"ok"}
    assert "no condition of 8 trials" in found[0].message


@pytest.mark.parametrize("gain", [0.85, 1.2])
def test_a_gain_of_one_axis_makes_the_inertia_asymmetric(sound, gain):
    uneven = replace(sound, force=sound.force * [1.0, gain])
    assert "gain" in told(uneven)
    assert "gain" not in told(replace(sound, force=sound.force * gain))


@pytest.mark.parametrize("half", [1, 4, 10])
def test_slopes_are_those_of_savitzky_and_golay(half):
    signal = np.random.default_rng(half).normal(size=(3, 40, 2)).cumsum(axis=1)
    expected = savgol_filter(signal, 2 * half + 1, 2, deriv=1, axis=1)
    np.testing.assert_allclose(_slopes(signal, half), expected, atol=1e-13)
