"""What a methods paragraph says of all groups is true of each of them."""

from __future__ import annotations

from armimpedance.pages.methods_text import shared_steps


def test_numbers_of_all_groups_stand_as_a_range():
    steps = [("covariance cr3", f"at most {n} times, {k} trials") for n, k in ((1.3, 16), (9, 16))]
    assert shared_steps(steps) == ["covariance cr3", "at most 1.3 to 9 times, 16 trials"]


def test_a_step_of_one_group_is_not_said_of_all():
    assert shared_steps([("filtered", "an odd step"), ("filtered",)]) == ["filtered"]
    assert shared_steps([]) == []
