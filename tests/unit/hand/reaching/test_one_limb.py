"""A session of pushed reaches as its own witness."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from armimpedance.hand.reaching import identify_course, identify_movement
from manipulandum_sim.movement import simulate_movement


@cache
def reaches(**rig):
    """Reaches of one person, pushed at one phase."""
    return simulate_movement(seed=3, phases=(0.5,), repeats=6, unperturbed=40, **rig)[0]


def with_gain(recording, gain):
    """The force of trial t of n times ``gain(t / n)`` (2,)."""
    force = np.array(recording.force)
    for row in range(recording.n_trials):
        force[recording.samples_of(row)] *= gain(row / recording.n_trials)
    return replace(recording, force=force)


def session(recording):
    said = [one.warnings for one in identify_movement(recording)]
    return [text for text in said[0] if text.startswith("session: ")]


@pytest.mark.study
@pytest.mark.parametrize("options", [{}, pytest.param({"push": "servo"}, marks=pytest.mark.study)])
def test_a_clean_session_is_no_alarm(options):
    assert not session(reaches(**options))


@pytest.mark.parametrize(
    ("gain", "words"),
    [
        (lambda t: 1 + 0.15 * (t >= 0.5), ("M changes by +", "gain")),
        (lambda t: np.array([1 - 0.5 * (t >= 0.5), 1.0]), ("M along x changes by -",)),
        (lambda t: 1 + 0.25 * t, ("M changes by +", "from the first part to the last")),
    ],
)
def test_a_gain_that_changes_is_named(gain, words):
    (said,) = session(with_gain(reaches(), gain))
    for word in words:
        assert word in said


def test_its_size_and_place_are_told():
    (said,) = session(with_gain(reaches(), lambda t: 1 - 0.5 * (t >= 0.5)))
    size = float(said.split("changes by ")[1].split(" %")[0])
    trial = int(said.split("from trial ")[1].split(" ")[0])
    assert abs(size + 50) < 6
    assert abs(trial - reaches().n_trials / 2) < 0.06 * reaches().n_trials


@pytest.mark.study
def test_a_course_over_phases_says_it_too():
    recording, _ = simulate_movement(seed=4, phases=(0.3, 0.7))
    changed = with_gain(recording, lambda t: 1 + 0.15 * (t >= 0.5))
    every = identify_course(changed)
    assert all(any(text.startswith("session: ") for text in one.warnings) for one in every)
