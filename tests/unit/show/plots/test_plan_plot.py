"""The figure of a plan: what was planned is what is drawn."""

import numpy as np
import pytest

from armimpedance.hand.planning.candidate import Wish
from armimpedance.hand.planning.design import Limits
from armimpedance.hand.planning.plan import candidates_of, make_plan
from armimpedance.hand.planning.setting import Setting
from armimpedance.hand.planning.show.plot import (
    best_of_each,
    plan_figure,
    plot_courses,
    plot_interval_over_trials,
)


@pytest.fixture(scope="module")
def plan():
    shapes = ["minimum_jerk", "designed", "raised_cosine"]
    profiles = candidates_of(shapes, (0.2, 0.3), Limits())
    return make_plan(Setting(), profiles, Wish(k_part=0.1), Limits())


def test_one_line_for_the_best_of_each_shape(plan):
    chosen = best_of_each(plan)
    assert [c.name for c in chosen] == ["minimum_jerk", "designed"]
    for candidate in chosen:
        rivals = [c for c in plan.candidates if c.name == candidate.name]
        assert candidate.precision.k_part(40) == min(c.precision.k_part(40) for c in rivals)


def test_courses_are_those_of_the_profiles(plan):
    chosen = best_of_each(plan)
    for order, scale in ((0, 1e3), (2, 1.0)):
        ax = plot_courses(chosen, order=order)
        for line, candidate in zip(ax.lines, chosen, strict=True):
            expected = scale * candidate.profile.at(line.get_xdata() / 1e3)[order]
            np.testing.assert_allclose(line.get_ydata(), expected, rtol=1e-9)


def test_intervals_fall_and_the_wish_is_a_line(plan):
    chosen = best_of_each(plan)
    ax = plot_interval_over_trials(chosen, wish=0.1)
    *curves, wish = ax.lines
    assert len(curves) == len(chosen)
    for line, candidate in zip(curves, chosen, strict=True):
        assert (np.diff(line.get_ydata()) < 0).all()
        at_40 = line.get_ydata()[list(line.get_xdata()).index(40)]
        assert at_40 == pytest.approx(100 * candidate.precision.k_part(40))
    assert set(wish.get_ydata()) == {10.0}


def test_the_figure_has_three_panels_with_units(plan):
    axes = plan_figure(plan).axes
    assert [ax.get_ylabel() for ax in axes] == [
        "displacement (mm)",
        "acceleration (m/s²)",
        "95 % interval of K (± %)",
    ]
