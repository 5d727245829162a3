"""What a methods paragraph says of all groups is true of each of them."""

from __future__ import annotations

from armimpedance.show.files import shared_steps


def test_numbers_of_all_groups_stand_as_a_range():
    steps = [("covariance cr3", f"at most {n} times, {k} trials") for n, k in ((1.3, 16), (9, 16))]
    assert shared_steps(steps) == ["covariance cr3", "at most 1.3 to 9 times, 16 trials"]


def test_a_step_of_one_group_is_not_said_of_all():
    assert shared_steps([("filtered", "an odd step"), ("filtered",)]) == ["filtered"]
    twice = ("trial 3 left out", "trial 5 left out")
    assert shared_steps([twice, ("filtered",)]) == []
    assert shared_steps([("without trials 3, 5",), ("without trials 2, 7",)]) == []
    assert shared_steps([("without trials 3, 5",), ("without trials 3, 5",)]) != []
    assert shared_steps([]) == []


def test_a_number_is_taken_whole():
    assert shared_steps([("noise of 5.4e-05 m",), ("noise of 6.4e-05 m",)]) == [
        "noise of 5.4e-05 to 6.4e-05 m"
    ]
    assert shared_steps([("cr3, eq. 1.2.3",), ("cr1, eq. 1.2.3",)]) == []
