"""Pushes that are asked for one by one: the subject of the sets, and a closed loop that ends."""

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.hand.still import allowing, estimate
from armimpedance.lab.simulated.adaptive import closed_loop
from manipulandum_sim.hand import (
    IDEAL,
    AskedArm,
    AskedPush,
    Reflex,
    Rig,
    conditions_named,
    find_experiment,
    find_subject,
)


def arm(names=("cocontraction_00",), seed=1, **how):
    person = find_subject("A")
    known = find_experiment("cocontraction").conditions(person)
    drift = how.pop("drift", 0.0)
    rig = Rig(**{"servo": IDEAL, **how})
    return AskedArm(person, conditions_named(names, known), rig, seed, drift)


PUSH = AskedPush("cocontraction_00", (1.0, 0.0), "designed", 0.005, 0.3)


def test_the_same_number_is_the_same_push_and_another_one_other_noise():
    first, again, other = (arm().push([PUSH], n)[0] for n in (3, 3, 4))
    assert np.array_equal(first.force, again.force)
    assert not np.array_equal(first.force[:300], other.force[:300])


def test_the_hand_goes_where_it_is_pushed():
    turned = replace(PUSH, direction=(0.0, -1.0))
    made = arm(noise="none").push([turned], 0)[0]
    moved = made.position - made.position[0]
    assert np.abs(moved[:, 0]).max() < 1e-3
    assert np.abs(moved[:, 1]).max() == pytest.approx(0.005, rel=0.05)


def test_a_group_is_its_pushes_one_after_another():
    other = replace(PUSH, disturbance="minimum_jerk")
    group = arm().push([PUSH, PUSH, other], 5)
    for number, one in enumerate([PUSH, PUSH, other]):
        alone = arm().push([one], 5 + number)[0]
        assert np.allclose(alone.force, group[number].force, atol=1e-9)


def test_a_person_who_drifts_becomes_stiffer():
    # three times as strong: the slowest bump is half stiffness
    person, bump = arm(noise="none", drift=1.0), replace(PUSH, disturbance="minimum_jerk")
    early, late = (np.abs(person.push([bump], n)[0].force).max() for n in (0, 200))
    assert late > 1.1 * early


def test_unknown_conditions_are_refused():
    with pytest.raises(InputError, match="no condition"):
        arm(("other",))
    with pytest.raises(InputError, match="no condition"):
        arm().push([replace(PUSH, condition="other")], 0)


def test_a_closed_loop_ends_when_estimate_prints_what_was_wished_and_holds_the_truth():
    person = arm(seed=2)
    recording = closed_loop(person, None, most_trials=300, k_percent=15.0, shapes=["designed"])
    made = allowing(estimate(recording), recording, ("condition",))[0]
    low, high = (m[2] for m in made.interval())
    half = (high - low).diagonal() / (high + low).diagonal()
    assert (half <= 0.15).all()
    assert recording.n_trials < 100
    truth = person.truth.K_e[0]
    assert (np.abs((low + high) / 2 - truth) < (high - low)).all()


def test_a_reflex_is_named_or_k_is_the_intrinsic_one():
    person = arm(seed=3, reflex=Reflex(0.25))
    recording = closed_loop(person, None, most_trials=60, k_percent=15.0, shapes=["designed"])
    from armimpedance.hand.still import check_response

    named = any(
        one.name == "reflex" and one.verdict == "warning" for one in check_response(recording)
    )
    made = allowing(estimate(recording), recording, ("condition",))[0]
    low, high = (m[2] for m in made.interval())
    truth = person.truth.K_e[0]
    holds = ((low <= truth) & (truth <= high)).diagonal().all()
    assert named or holds
