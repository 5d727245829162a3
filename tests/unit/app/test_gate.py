"""Every verb that fits a recording checks it first, refuses a STOP, and marks what goes on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sessions import LEVELS, pushes

import armimpedance as ai
from armimpedance.app.inspection import inspect
from armimpedance.core.errors import InputError
from armimpedance.hand.comparison.show import compare
from armimpedance.hand.planning.show import plan
from armimpedance.hand.still.show import checked_response, estimate, estimate_all, reflex
from manipulandum_sim.elbow import simulate_elbow

VERBS = {
    "estimate": estimate,
    "estimate_all": estimate_all,
    "compare": compare,
    "reflex": reflex,
    "plan": lambda recording, **options: plan(
        pilot=recording, shape="minimum_jerk", duration_s=0.3, **options
    ),
}


@pytest.fixture(scope="module")
def hand():
    return pushes()


def late(recording, samples):
    return replace(recording, force=np.roll(recording.force, samples, axis=0))


@pytest.mark.parametrize("verb", VERBS.values(), ids=VERBS)
def test_a_stop_of_inspect_refuses(hand, verb):
    turned = replace(hand, force=hand.force[:, ::-1])
    with pytest.raises(InputError, match=r"axes.*exchanged.*--despite 'axes'"):
        verb(turned)


def test_despite_goes_on_and_marks_every_row(hand):
    made = estimate(replace(hand, force=-hand.force), despite="force sign")
    assert all(row.warnings[0].startswith("despite force sign: ") for row in made)
    assert any("plausible: inertia" in warning for warning in made[0].warnings)
    difference = compare(replace(hand, force=-hand.force), permutations=99, despite=["force sign"])
    assert "despite force sign" in difference.to_frame()["warnings"].iloc[0]
    assert "warning: " in str(difference)


def test_despite_needs_the_name_of_a_check(hand):
    with pytest.raises(InputError, match=r"no check 'sign' here \(expected one of amplitude, axes"):
        estimate(hand, despite="sign")


@pytest.mark.study
def test_a_broken_assumption_marks_every_row_of_every_verb(hand):
    shifted = late(hand, 3)
    assert not inspect(hand).of_verdict("warning")
    found = [estimate(shifted)[0].warnings, estimate_all(shifted).estimates[0].warnings]
    found += [reflex(shifted).warnings, compare(shifted, permutations=99).warnings]
    found += [VERBS["plan"](shifted).warnings]
    for warnings in found:
        assert any("delay: force" in warning for warning in warnings)
    assert estimate(hand)[0].warnings == ()


def test_the_reflex_verb_leaves_the_reflex_to_itself(hand):
    one = (hand.trials["condition"] == LEVELS[0]) & (hand.trials["set"] == 1)
    shifted = reflex(late(hand.select(one.to_numpy()), 3))
    assert not any(warning.startswith("reflex") for warning in shifted.warnings)
    assert "delay" in shifted.to_frame()["warnings"].iloc[0]


def test_what_moves_no_limb_gives_no_number():
    still = simulate_elbow("calibration", seed=1, repetitions=1)[0]
    assert inspect(still).usable
    with pytest.raises(InputError, match="coherence: motion explains"):
        estimate(still, band_hz=(5, 45))


def test_a_device_that_imposes_the_torque_is_named():
    recording = simulate_elbow("posture", seed=1, repetitions=1, duration_s=4.5)[0]
    assert any(
        warning.startswith("imposed: ")
        for warning in estimate(recording, band_hz=(5, 45))[0].warnings
    )


def test_many_trials_are_checked_by_a_sample(hand, monkeypatch):
    monkeypatch.setattr("armimpedance.show.verbs.checks.MOST_CHECKED", 16)
    assert checked_response(hand) == ()
    with pytest.raises(InputError, match="force sign"):
        checked_response(replace(hand, force=-hand.force))


def test_conditions_of_one_direction_can_be_one_group(hand):
    """A condition for each direction, all of them fitted together; and checked together."""
    labels = [f"to {angle:g}" for angle in hand.trials["direction_deg"]]
    apart = replace(hand, trials=hand.trials.assign(condition=labels))
    assert not inspect(apart).usable
    assert estimate(apart, by=[])[0].quality.n_trials == 32
    with pytest.raises(InputError, match="force sign"):
        estimate(replace(apart, force=-apart.force), by=[])


ONE_WAY = {**VERBS, "random": ai.random, "movement": ai.movement}


@pytest.mark.parametrize("verb", ONE_WAY.values(), ids=ONE_WAY)
def test_one_direction_a_condition_gives_no_matrix(hand, verb):
    one_way = hand.select((hand.trials["direction_deg"] == 45.0).to_numpy())
    with pytest.raises(InputError, match="one direction only"):
        verb(one_way)


def test_each_group_needs_its_directions_not_each_condition(hand):
    diagonal = hand.trials["direction_deg"].to_numpy() % 90 == 45
    named = np.where(diagonal, "diagonal", "straight")
    directions = hand.trials["direction_deg"].astype(str)
    each = replace(hand, trials=hand.trials.assign(condition=directions, ways=named))
    assert len(estimate(each, by="ways")) == 2
    with pytest.raises(InputError, match="one direction only"):
        estimate(each)
