"""The next pushes of a recording: what is said first, when it is enough, what is refused."""

from dataclasses import replace

import numpy as np
import pytest

import armimpedance as ai
from armimpedance.core.errors import InputError
from armimpedance.hand.adaptive.show import next_text
from manipulandum_sim.hand import simulate
from manipulandum_sim.hand.robot import IDEAL

CONDITIONS = ["cocontraction_00", "cocontraction_10"]


@pytest.fixture(scope="module")
def session():
    return reaches_of(2)


def reaches_of(sets):
    """Designed disturbances in two conditions."""
    rig = {"disturbance": "designed", "emg": False, "servo": IDEAL}
    return simulate("cocontraction", seed=1, sets=sets, conditions=CONDITIONS, **rig)[0]


#: One condition, of which 6 % is asked.
WISH = {"k_percent": 6, "conditions": CONDITIONS[:1], "shapes": ["designed"]}


@pytest.fixture(scope="module")
def wished(session):
    return ai.next_trials(session, **WISH, seed=4)


def test_nothing_measured_yet_gives_a_set_along_eight_lines():
    made = ai.next_trials(None, conditions=["relaxed", "tense"], seed=3)
    table = made.to_frame()
    assert dict(made.remaining) == {"relaxed": 8, "tense": 8}
    for _, own in table.groupby("condition"):
        assert len(set(own["direction_deg"] % 180)) == 8
        assert len(set(own["direction_deg"] // 180)) == 2
    assert set(table["shape"]) == {"reflex_separating"}


@pytest.mark.study
def test_the_half_widths_by_now_are_those_that_estimate_prints(session):
    made = ai.next_trials(session, k_percent=5, shapes=["designed"])
    hand = ai.estimate(session)
    for target, now in zip(made.targets, made.now, strict=True):
        name, axis = target.name.split()[-1], "xy".index(target.name.split()[1][0])
        low, high = (m[2][axis, axis] for m in hand[name].interval())
        K = (low + high) / 2
        assert target.allowed * now == pytest.approx((high - low) / 2, rel=1e-9)
        assert target.allowed == pytest.approx(0.05 * K, rel=0.02)
    assert not made.met
    assert len(made.pushes) == 8
    assert sum(made.remaining.values()) > 8


def test_a_wish_that_is_met_asks_for_no_push(session):
    made = ai.next_trials(session, k_percent=40, shapes=["designed"])
    assert made.met
    assert not made.pushes
    assert sum(made.remaining.values()) == 0
    assert "met" in next_text(made)


def test_the_same_recording_and_seed_give_the_same_pushes(session, wished):
    first = wished.to_dict()
    again, other = (ai.next_trials(session, **WISH, seed=seed).to_dict() for seed in (4, 5))
    assert first == again
    assert other["remaining"] == first["remaining"]
    assert other["pushes"] != first["pushes"]


def test_a_condition_that_is_new_begins_with_a_set(session):
    made = ai.next_trials(session, k_percent=5, conditions=["cocontraction_00", "new"])
    assert dict(made.remaining) == {"new": 8}


def test_what_remains_is_about_what_it_takes(wished):
    # so many pushes evenly along all directions need more than those that are chosen
    left = wished.remaining["cocontraction_00"]
    more = reaches_of(2 + int(np.ceil(1.8 * left / 8)))
    low, high = (m[2].diagonal() for m in ai.estimate(more)["cocontraction_00"].interval())
    half = ((high - low) / (high + low)).max()
    # standard errors of so many trials are themselves known to some 10 %
    assert half < 0.06 * 1.25


@pytest.mark.parametrize(
    "wrong",
    [
        {"k_percent": -1},
        {"difference_percent": 20},
        {"joint_percent": 5, "conditions": ["cocontraction_00"], "power": 2},
        {"k_percent": 5, "max_duration_s": 0.01},
        {"k_percent": 5, "shapes": ["none"]},
        {"k_percent": 5, "max_acceleration": -1},
    ],
)
def test_a_wrong_wish_is_refused(session, wrong):
    with pytest.raises(InputError):
        ai.next_trials(session, **wrong)


def test_other_recordings_are_refused(session):
    with pytest.raises(InputError):
        ai.next_trials(replace(session, perturbation="stochastic"), k_percent=5)
