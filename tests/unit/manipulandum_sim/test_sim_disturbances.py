"""Disturbances: closed forms that belong together and return."""

import warnings

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from manipulandum_sim.hand.disturbances import DISTURBANCES, custom, find_disturbance
from manipulandum_sim.hand.rig import Rig
from manipulandum_sim.hand.robot import IDEAL
from manipulandum_sim.hand.simulate import simulate_condition


def sampled():
    s = np.linspace(0, 1, 41)
    return custom("sampled", s**4 * (1 - s) ** 5)


ALL = [*DISTURBANCES.values(), sampled()]


@pytest.mark.parametrize("shape", ALL, ids=lambda s: s.name)
@pytest.mark.parametrize("residual", [0.0, 0.0003])
def test_velocity_and_acceleration_are_the_derivatives(shape, residual):
    T, h = 0.3, 1e-5
    t = np.linspace(0.02, T - 0.02, 101)
    low, mid, high = (shape.profile(t + d, T, 0.005, residual) for d in (-h, 0, h))
    for order in (0, 1):
        slope = (high[order] - low[order]) / (2 * h)
        np.testing.assert_allclose(slope, mid[order + 1], atol=1e-5 * np.abs(mid[order + 1]).max())


@pytest.mark.parametrize("shape", ALL, ids=lambda s: s.name)
def test_it_reaches_its_amplitude_and_returns(shape):
    t = np.linspace(-0.1, 0.5, 6001)
    x, v, a = shape.profile(t, 0.3, 0.005)
    assert np.abs(x).max() == pytest.approx(0.005, rel=2e-3)
    outside = (t < 0) | (t > 0.3 + 1e-9)
    assert np.abs(x[outside]).max() < 1e-15
    assert not v[outside].any()
    assert not a[outside].any()


@pytest.mark.parametrize("name", ["minimum_jerk", "biphasic", "designed", "reflex_separating"])
def test_smooth_shapes_start_and_end_at_rest(name):
    x = find_disturbance(name).profile(np.array([0.0, 0.3]), 0.3, 0.005)
    np.testing.assert_allclose(x, 0, atol=1e-9)


def test_a_residual_is_what_is_left():
    x, v, a = find_disturbance("minimum_jerk").profile(np.array([0.3, 0.4]), 0.3, 0.005, 3e-4)
    np.testing.assert_allclose(x, 3e-4, rtol=1e-9)
    np.testing.assert_allclose([v, a], 0, atol=1e-9)


def test_published_peak_acceleration_of_the_bump():
    """5 mm: 1.33, 3.0, 5.33 m/s^2 at .3, .2, .15 s (measured in simulation); doublet 3.7 at .3."""
    for name, T, peak in (
        ("minimum_jerk", 0.3, 1.33),
        ("minimum_jerk", 0.2, 3.0),
        ("minimum_jerk", 0.15, 5.33),
        ("biphasic", 0.3, 3.7),
    ):
        a = find_disturbance(name).profile(np.linspace(0, T, 3001), T, 0.005)[2]
        assert np.abs(a).max() == pytest.approx(peak, rel=0.01)


def test_the_raised_cosine_warns_and_the_others_do_not():
    with pytest.warns(UserWarning, match="cannot be told apart"):
        simulate_condition(seed=0, sets=1, disturbance="raised_cosine", servo=IDEAL, emg=False)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulate_condition(seed=0, sets=1, disturbance="biphasic", servo=IDEAL, emg=False)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"disturbance": "square"}, "no disturbance 'square'"),
        ({"disturbance": "half_sine", "servo": IDEAL}, "no ideal servo"),
        ({"duration_s": 0.1234}, "0.1234 s"),
        ({"duration_s": 0.0}, "0.0 s"),
        ({"duration_s": float("nan")}, "nan s"),
        ({"amplitude_m": 5.0}, "amplitude of 5.0 m"),
        ({"noise": "loud"}, "no noise level"),
    ],
)
def test_impossible_settings_are_refused(settings, said):
    with pytest.raises(InputError, match=said):
        Rig(**settings)


@pytest.mark.parametrize("values", [[0, 1, 0], np.zeros(20), np.linspace(0, 1, 20), [np.nan] * 9])
def test_custom_shapes_that_are_none_are_refused(values):
    with pytest.raises(InputError):
        custom("bad", values)
