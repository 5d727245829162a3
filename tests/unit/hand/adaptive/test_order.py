"""An order that nobody foresees, balanced, and the same for the same seed."""

import numpy as np
from hypothesis import given, strategies as st

from armimpedance.hand.adaptive.menu import lines_of
from armimpedance.hand.adaptive.order import (
    Comfort,
    in_random_order,
    longest_run,
    pauses,
    shared_out,
    ways,
)


@given(st.lists(st.integers(0, 50), min_size=3, max_size=8), st.integers(0, 60))
def test_pushes_are_shared_out_in_proportion_and_none_is_lost(counts, pushes):
    made = shared_out([np.array(counts[:2]), np.array(counts[2:])], pushes)
    flat = np.concatenate(made)
    assert flat.sum() == min(pushes, sum(counts))
    assert (flat <= np.array(counts) + 1).all()
    if sum(counts):
        exact = np.array(counts) * flat.sum() / sum(counts)
        assert (np.abs(flat - exact) < 1).all()


@given(st.lists(st.integers(0, 9), min_size=8, max_size=8), st.integers(0, 99))
def test_both_ways_of_a_line_are_pushed_alike(counts, seed):
    lines = lines_of(2)
    units = ways(lines, np.array(counts), np.random.default_rng(seed))
    assert len(units) == sum(counts)
    for line, count in zip(lines, counts, strict=True):
        along = units @ line
        sign = along[np.abs(np.abs(along) - 1) < 1e-9]
        assert len(sign) == count
        assert abs(sign.sum()) < 1.5


def test_no_more_than_two_alike_follow_each_other():
    rng = np.random.default_rng(5)
    units = ways(lines_of(2), np.array([8, 0, 0, 0, 4, 0, 0, 0]), rng)
    for _ in range(50):
        assert longest_run(in_random_order(units, 2, rng)) <= 2


def test_the_next_way_is_hard_to_guess():
    rng = np.random.default_rng(6)
    units = ways(lines_of(2), np.array([6, 0, 0, 0, 2, 0, 0, 0]), rng)
    right = []
    for _ in range(400):
        order = in_random_order(units, 2, rng)
        right += [np.allclose(a, b) for a, b in zip(order[:-1], order[1:], strict=True)]
    # whoever guesses the last way again: at most 3 of 7 by chance, some 400 * 7 guesses
    assert np.mean(right) < 3 / 7 + 3 * np.sqrt(0.25 / len(right))


def test_there_is_a_rest_after_every_forty_pushes():
    made = pauses(100, 0, Comfort(rest_every=40, rest_s=60), np.random.default_rng(0))
    assert list(np.flatnonzero(made > 10)) == [40, 80]
    assert (made[made < 10] >= 1).all()


def test_lines_in_space_are_the_axes_and_diagonals():
    lines = lines_of(3)
    assert lines.shape == (13, 3)
    assert np.allclose(np.linalg.norm(lines, axis=1), 1)
    assert np.abs(lines @ lines.T - np.eye(13)).max() < 1 - 1e-9
