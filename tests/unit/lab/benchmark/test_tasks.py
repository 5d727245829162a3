"""What is true of a record hangs on its seed: neither shared with others nor told by the files."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from armimpedance.lab.benchmark import Key
from armimpedance.lab.benchmark_command.task import nameless
from armimpedance.lab.benchmark_command.tasks import TASKS, drawn, truth_of

KEY = Key(bytes(32))
#: Their truth needs the whole simulation, of ten seconds and more.
SLOW = ("contribution", "base_parameters")
QUICK = [name for name in TASKS.names if name not in SLOW]


@pytest.mark.parametrize("task", QUICK)
def test_truths_are_finite_repeatable_and_others_for_each_record_and_half(task):
    first, again, second = (truth_of(task, [name], None) for name in ("p01", "p01", "p02"))
    sealed = truth_of(task, ["p01"], KEY)
    assert first == again
    assert all(math.isfinite(k.value) and k.scale > 0 for k in first)
    assert len({k.asked.quantity for k in first}) == len(first)
    for other in (second, sealed):
        assert [k.asked.quantity for k in other] == [k.asked.quantity for k in first]
        values = [{k.value for k in part} for part in (first, other)]
        assert not values[0] & values[1]


def test_a_record_that_is_asked_for_its_own_limb_tells_no_mass_nor_how_it_was_made():
    made = drawn("hand_ideal", "p01", None)
    (recording,) = made.recordings().values()
    told = nameless(recording, made.body_told)
    assert told.subject.mass_kg is None
    assert "seed" not in " ".join(told.provenance)
    assert np.array_equal(told.position, recording.position)


def test_hand_truth_is_the_plants_without_its_handle_and_reflex():
    # the reflex of hand_reflex is in the data, not in what is asked: a passive limb is symmetric
    truth = {k.asked.quantity: k.value for k in truth_of("hand_reflex", ["p01"], None)}
    for name in "MBK":
        assert truth[f"{name}_12"] == pytest.approx(truth[f"{name}_21"], rel=1e-3)
        assert truth[f"{name}_11"] * truth[f"{name}_22"] > truth[f"{name}_12"] ** 2


def test_a_relaxed_joint_comes_with_its_rest_angle(tmp_path):
    drawn("relaxed_joint", "p01", None).beside(tmp_path)
    assert 1.2 < json.loads((tmp_path / "told.json").read_text())["rest_angle_rad"] < 1.7


@pytest.mark.study
def test_a_random_hand_is_asked_for_what_its_simulator_holds_true_some_with_a_reflex(monkeypatch):
    from manipulandum_sim import random_hand

    simulate, calls = random_hand.simulate_random, []

    def noted(**call):
        calls.append(call)
        return None, None

    monkeypatch.setattr(random_hand, "simulate_random", noted)
    made = [drawn("hand_random", name, None) for name in ("p01", "p02", "p03", "p04")]
    for one in made:
        one.recordings()
    # one of each kind; the truth is found without a simulation and has to be the simulator's own
    kinds = {call["reflex"] is not None: n for n, call in enumerate(calls)}
    assert set(kinds) == {True, False}
    for n in kinds.values():
        _, truth = simulate(**calls[n] | {"trials": 1, "duration_s": 2.0})
        for group in made[n].groups:
            own = getattr(truth, f"{group.name}_e").ravel()
            assert list(group.values.values()) == pytest.approx(own, rel=1e-9)
