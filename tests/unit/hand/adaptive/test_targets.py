"""What is wished: gradients against differences and against `to_joint`."""

from dataclasses import replace

import numpy as np
import pytest
from test_push_choice import LIMB, measured

from armimpedance.core.errors import InputError
from armimpedance.hand.adaptive import Aim
from armimpedance.hand.adaptive.so_far import so_far
from armimpedance.hand.adaptive.target import targets_of
from armimpedance.hand.ellipses import ellipse
from armimpedance.hand.levels import arm_posture_for, to_joint
from armimpedance.hand.still import estimate
from manipulandum_sim.hand import simulate
from manipulandum_sim.hand.robot import IDEAL

RNG = np.random.default_rng(11)


@pytest.mark.parametrize("number", range(5))
def test_orientation_and_difference_change_as_their_gradients_say(number):
    step = 1e-3 * np.random.default_rng(number).standard_normal((2, 2))
    known = (measured(), measured(1.5 * LIMB, "tense"))
    turn = targets_of(Aim(orientation_rad=0.1), known[:1])[0]
    K = LIMB[2]
    told = turn.gradients["relaxed"][8:].reshape(2, 2)
    changed = ellipse(K + step).orientation_rad - ellipse(K).orientation_rad
    assert (told * step).sum() == pytest.approx(changed, rel=1e-3, abs=1e-12)
    apart = targets_of(Aim(difference_part=0.2, between=("relaxed", "tense")), known)[0]
    moved = np.log(ellipse(K + step).size / ellipse(K).size)
    told = apart.gradients["relaxed"][8:].reshape(2, 2)
    assert (told * step).sum() == pytest.approx(moved, rel=1e-3)
    assert apart.allowed == pytest.approx(np.log(1.2))


def test_joint_targets_have_the_variance_that_to_joint_finds():
    recording, _ = simulate(
        "cocontraction", seed=2, sets=2, conditions=["cocontraction_10"], emg=False, servo=IDEAL
    )
    one = so_far(recording, "cocontraction_10")
    hand = estimate(recording)[0]
    joint = to_joint(hand, arm_posture_for(hand, recording.subject)[0])
    for number, target in enumerate(targets_of(Aim(joint_part=0.1), [one])):
        slope = target.gradients["cocontraction_10"]
        sd = np.sqrt(slope @ hand.covariance @ slope)
        assert sd == pytest.approx(joint.sd[2][number, number], rel=1e-6)


def test_a_difference_needs_more_than_an_interval():
    known = (measured(), measured(1.5 * LIMB, "tense"))
    apart = targets_of(Aim(difference_part=0.2, between=("relaxed", "tense")), known)[0]
    # 90 % power beyond the boundary of many looks: 2.24 + 1.28 standard errors
    assert apart.factor(1e6) == pytest.approx(2.2414 + 1.28155, abs=1e-3)


@pytest.mark.parametrize(("drift", "least", "most"), [(0.0, 0.01, 0.05), (1.0, 0.87, 0.93)])
def test_a_difference_is_detected_as_often_as_is_said_however_often_it_is_asked(drift, least, most):
    """Estimates of growing precision, looked at 60 times; 2000 sessions, sd of .05 is .005."""
    known = (measured(), measured(1.5 * LIMB, "tense"))
    apart = targets_of(Aim(difference_part=0.2, between=("relaxed", "tense")), known)[0]
    sd_end = apart.allowed / apart.factor(1e6)
    t = np.arange(1, 61) / 60
    steps = np.random.default_rng(3).standard_normal((2000, 60)) / np.sqrt(60)
    # B(t) + theta t, an estimate being sd_end B(t) / t
    found = sd_end * (steps.cumsum(axis=1) / t) + drift * apart.allowed
    # at each look whatever is larger is detected too: the least that is, by halving
    least_found = []
    for when in t:
        low, high = 0.0, 10 * apart.allowed / np.sqrt(when)
        for _ in range(40):
            middle = (low + high) / 2
            detected = apart.is_detected(middle, sd_end / np.sqrt(when), 1e6)
            low, high = (low, middle) if detected else (middle, high)
        assert high < 10 * apart.allowed / np.sqrt(when)
        least_found.append(high)
    assert least <= np.mean((np.abs(found) >= least_found).any(axis=1)) <= most


@pytest.mark.parametrize(
    "wrong",
    [
        {},
        {"k_part": 0.0},
        {"k_part": float("nan")},
        {"difference_part": 0.2},
        {"between": ("a", "b"), "k_part": 0.1},
        {"k_part": 0.1, "power": 1.0},
    ],
)
def test_a_wish_that_means_nothing_is_refused(wrong):
    with pytest.raises(InputError):
        Aim(**wrong)


def test_joints_of_an_arm_of_unknown_lengths_are_refused():
    with pytest.raises(InputError, match="lengths"):
        targets_of(Aim(joint_part=0.1), [replace(measured(), jacobian=None)])
