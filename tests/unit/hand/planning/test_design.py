"""Designed disturbances: gradient, limits, reproducible, better than what they start from."""

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.hand.planning.design import (
    Goal,
    Limits,
    _Problem,
    check_limits,
    design,
    shortest_duration,
)
from armimpedance.hand.planning.precision import PlannedMotion, precision
from armimpedance.hand.planning.profile import Profile
from armimpedance.hand.planning.setting import Servo, Setting
from armimpedance.hand.planning.shapes import SHAPES


@pytest.mark.parametrize(
    "goal", [Goal(), Goal((0.055,)), Goal((0.04, 0.07), delay_known=False)], ids=repr
)
def test_gradient_is_the_slope(goal):
    problem = _Problem(Setting(servo=Servo(5000.0)), Limits(), goal, 4)
    c = np.random.default_rng(3).standard_normal(5)
    slope = problem.value_and_gradient(c)[1]
    h = 1e-6
    for j, unit in enumerate(np.eye(5)):
        high, low = (problem.value_and_gradient(c + s * h * unit)[0] for s in (1, -1))
        assert slope[j] == pytest.approx((high - low) / (2 * h), rel=1e-4, abs=1e-6)


@pytest.mark.parametrize("limits", [Limits(0.005, 0.3, 3.0), Limits(0.003, 0.2, 5.3)], ids=repr)
def test_limits_hold_everywhere(limits):
    made = design(Setting(), limits, starts=3)
    x, v, a = made.profile.at(np.linspace(0, limits.duration_s, 20_001))
    assert np.abs(x).max() <= limits.amplitude_m * (1 + 1e-6)
    assert np.abs(a).max() <= limits.acceleration * (1 + 1e-6)
    np.testing.assert_allclose([x[[0, -1]], v[[0, -1]], a[[0, -1]]], 0, atol=1e-9)


def test_the_same_call_gives_the_same_profile():
    first, second = (design(Setting(), Limits(), starts=2, seed=5) for _ in range(2))
    assert np.array_equal(first.coefficients, second.coefficients)


@pytest.fixture(scope="module")
def designed():
    """The precision of a design within the usual limits."""
    return precision(PlannedMotion(Setting(), design(Setting(), Limits(), starts=6).profile))


def test_design_beats_the_shapes_within_its_limits(designed):
    for name in ("minimum_jerk", "biphasic"):
        profile = Profile(SHAPES.named(name), 0.005, 0.3)
        assert profile.peak_acceleration <= 5.3
        assert designed.relative_sd[2] < precision(PlannedMotion(Setting(), profile)).relative_sd[2]


def test_shipped_coefficients_are_as_good_as_a_new_search(designed):
    shipped = precision(PlannedMotion(Setting(), Profile(SHAPES.named("designed"), 0.005, 0.3)))
    assert shipped.relative_sd[2] <= 1.02 * designed.relative_sd[2]


def test_less_acceleration_costs_precision():
    sd = [design(Setting(), Limits(acceleration=a), starts=2).relative_sd for a in (2.0, 4.0, 8.0)]
    assert sd[0] > sd[1] > sd[2]


def test_impossible_limits_are_refused_with_the_shortest_duration():
    shortest = shortest_duration(0.005, 5.3)
    with pytest.raises(InputError, match=f"{shortest:.3f} s"):
        check_limits(Limits(duration_s=0.05))
    check_limits(Limits(duration_s=1.01 * shortest))
    with pytest.raises(InputError):
        Limits(acceleration=-1.0)
