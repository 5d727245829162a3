"""What changes over the trials of a session, from the estimates of single trials."""

from __future__ import annotations

import numpy as np
import pytest

from armimpedance.numerics.criticism import HAND_WORDS, change_over_trials, check_inertia_over


def trials(rng, factor, n=6, sd=0.01):
    """I, B, K of n trials with this relative noise, each times a factor of the trial."""
    truth = np.array([0.07, 1.2, 20.0]) * factor(np.arange(n))[:, None]
    return truth * (1 + sd * rng.standard_normal((n, 3))), sd * truth


def test_false_alarms_are_rare():
    rng = np.random.default_rng(1)
    found = [change_over_trials(*trials(rng, np.ones_like)) for _ in range(1000)]
    assert sum(one.seen for one in found) <= 5


def test_a_step_is_found_where_it_is_with_its_size():
    rng = np.random.default_rng(2)
    for _ in range(50):
        one = change_over_trials(*trials(rng, lambda i: np.where(i >= 4, 1.2, 1.0)))
        assert one.seen
        assert one.first == 4
        assert abs(one.size - 0.2) < 5 * one.error
        assert one.alike


def test_a_drift_is_no_step():
    rng = np.random.default_rng(3)
    drifts = [change_over_trials(*trials(rng, lambda i: 1 + 0.06 * i)) for _ in range(20)]
    assert sum(one.first is None for one in drifts) >= 18


def test_numbers_that_go_another_way_are_not_alike():
    rng = np.random.default_rng(4)
    values, sd = trials(rng, np.ones_like)
    values[3:, 0] *= 1.2
    one = change_over_trials(values, sd)
    assert one.seen
    assert not one.alike


def test_units_and_the_order_of_the_courses_do_not_matter():
    rng = np.random.default_rng(5)
    values, sd = trials(rng, lambda i: np.where(i >= 2, 1.3, 1.0))
    one, other = change_over_trials(values, sd), change_over_trials(1e3 * values, 1e3 * sd)
    assert one.size == pytest.approx(other.size)
    assert one.first == other.first
    back = change_over_trials(values[::-1], sd[::-1])
    assert back.first == 4
    assert (1 + back.size) * (1 + one.size) == pytest.approx(1)


def test_a_sign_that_turns_is_a_change():
    rng = np.random.default_rng(6)
    one = change_over_trials(*trials(rng, lambda i: np.where(i >= 4, -1.0, 1.0)))
    assert one.seen
    assert one.first == 4
    assert abs(one.size + 2) < 5 * one.error


def test_a_change_of_all_axes_is_told_of_all():
    rng = np.random.default_rng(7)
    series = {axis: trials(rng, lambda i: np.where(i >= 3, 1.1, 1.0)) for axis in ("", "x", "y")}
    (told,) = check_inertia_over("abcdef", series, HAND_WORDS)
    assert told.verdict == "warning"
    assert " along " not in told.message
    series[""], series["y"] = trials(rng, np.ones_like), trials(rng, np.ones_like)
    (told,) = check_inertia_over("abcdef", series, HAND_WORDS)
    assert "along x" in told.message
    assert "from d on" in told.message


@pytest.mark.parametrize("values", [np.ones((2, 3)), np.full((4, 1), np.nan)])
def test_what_cannot_be_asked_is_not(values):
    assert change_over_trials(values, np.full(values.shape, 0.1)) is None
