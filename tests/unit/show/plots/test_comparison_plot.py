"""The figure of compared groups: one outline each, told apart, joined where they differ."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.text import Text

from armimpedance.core.errors import InputError
from armimpedance.hand.comparison.compare import Pair
from armimpedance.hand.comparison.groups import ComparedGroup
from armimpedance.hand.comparison.matrix_test import MatrixTest
from armimpedance.hand.comparison.show.plot import plot_comparison


def groups_at(make_estimate, places, names=None):
    names = [f"g{i}" for i in range(len(places))] if names is None else names
    return [
        ComparedGroup(name, make_estimate(x, y)) for name, (x, y) in zip(names, places, strict=True)
    ]


def pair(first, second, p):
    names = ("inertia", "viscosity", "stiffness", "all")
    tests = tuple(MatrixTest(name, 0.1, p, 5.0, p, p, p) for name in names)
    return Pair(first, second, (), tests, "permutation")


def test_groups_differ_in_line_and_colour(make_estimate):
    places = [(0.1 * i, 0.4) for i in range(10)]
    ax = plot_comparison(groups_at(make_estimate, places))
    drawn = [line for line in ax.lines if str(line.get_label()).startswith("g")]
    looks = {(line.get_color(), str(line._dash_pattern)) for line in drawn}
    assert len(drawn) == 10
    assert len(looks) == 10
    # without colour five lines remain, and no two neighbours share one
    dashes = [str(line._dash_pattern) for line in drawn]
    assert all(a != b for a, b in zip(dashes, dashes[1:], strict=False))


def test_many_groups_are_numbered(make_estimate):
    ax = plot_comparison(groups_at(make_estimate, [(0.1 * i, 0.4) for i in range(12)]))
    texts = [text.get_text() for text in ax.findobj(Text)]
    assert {str(i) for i in range(1, 13)} <= set(texts)
    assert any("12  g11" in text for text in texts)


def test_pairs_that_differ_are_joined(make_estimate):
    groups = groups_at(make_estimate, [(0.0, 0.4), (0.2, 0.4), (0.1, 0.5)])
    pairs = [pair("g0", "g1", 0.01), pair("g0", "g2", 0.2)]
    ax = plot_comparison(groups, pairs)
    joins = [line for line in ax.lines if line.get_label() == "differ"]
    assert len(joins) == 1
    assert "1 of 2 pairs" in ax.get_legend().get_title().get_text()
    assert np.array_equal(joins[0].get_xydata(), [[0.0, 0.4], [0.2, 0.4]])


def test_groups_in_one_place_share_a_centre_and_have_no_shoulder(make_estimate):
    groups = groups_at(make_estimate, [(0.0, 0.4), (0.0003, 0.4002)])
    ax = plot_comparison(groups, [pair("g0", "g1", 0.01)])
    outlines = [line for line in ax.lines if len(line.get_xdata())]
    centres = [line.get_xydata()[:-1].mean(axis=0) for line in outlines]
    assert centres[0] == pytest.approx(centres[1])
    assert "shoulder" not in [text.get_text() for text in ax.findobj(Text)]
    assert not [line for line in outlines if line.get_label() == "differ"]


def test_subjects_of_one_group_stand_at_their_mean_place_without_bands(make_estimate):
    places = [(0.0, 0.4), (0.2, 0.4), (0.02, 0.42), (0.22, 0.42)]
    ax = plot_comparison(groups_at(make_estimate, places, ["a", "b", "a", "b"]))
    drawn = [line for line in ax.lines if line.get_label() in "ab"]
    centres = [line.get_xydata()[:-1].mean(axis=0) for line in drawn]
    for centre, x in zip(centres, (0.01, 0.21, 0.01, 0.21), strict=True):
        assert centre == pytest.approx([x, 0.41], abs=1e-6)
    assert "95 % band" not in ax.get_legend_handles_labels()[1]


def test_a_group_without_a_place_is_refused(make_estimate):
    group = ComparedGroup("g", replace(make_estimate(), position=None))
    with pytest.raises(InputError, match="position"):
        plot_comparison([group, group])
