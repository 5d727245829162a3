"""Profiles: the same in planner, simulator and file, and within the limits that they promise."""

from importlib.resources import files

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.hand.planning.profile import Profile, sampled, write_profile
from armimpedance.hand.planning.shapes import SHAPES
from manipulandum_sim.hand.disturbances import DISTURBANCES

T, AMPLITUDE = 0.3, 0.005
SHIPPED = files("armimpedance.hand.planning") / "profiles"


@pytest.mark.parametrize("name", SHAPES)
def test_planner_and_simulator_mean_the_same_shape(name):
    lag = np.linspace(-0.05, 0.35, 1601)
    ours = Profile(SHAPES.named(name), AMPLITUDE, T).at(lag)
    theirs = DISTURBANCES[name].profile(lag, T, AMPLITUDE)
    # coefficients are written with six decimals: 1e-6 of the peak
    peak = np.abs(theirs).max(axis=1, keepdims=True)
    np.testing.assert_allclose(ours / peak, theirs / peak, atol=1e-6)


def test_both_know_the_same_names():
    assert set(SHAPES) == set(DISTURBANCES)


@pytest.mark.parametrize("name", ["designed", "reflex_separating"])
def test_shipped_file_is_what_the_simulator_does(name):
    values = np.loadtxt(SHIPPED / f"{name}.csv", delimiter=",", skiprows=3)
    time = np.arange(301) / 1000
    np.testing.assert_allclose(values[:, 0], time, atol=1e-12)
    course = DISTURBANCES[name].profile(time, T, AMPLITUDE).T
    peak = np.abs(course).max(axis=0)
    np.testing.assert_allclose(values[:, 1:] / peak, course / peak, atol=1e-6)


@pytest.mark.parametrize("name", ["designed", "reflex_separating"])
def test_shipped_profiles_keep_their_limits(name):
    x, v, a = DISTURBANCES[name].profile(np.linspace(0, T, 30001), T, AMPLITUDE)
    assert 0.0049999 < np.abs(x).max() <= 0.005 * (1 + 1e-9)
    assert np.abs(a).max() <= 5.3
    # at rest at both ends
    np.testing.assert_allclose([x[[0, -1]], v[[0, -1]], a[[0, -1]]], 0, atol=1e-12)


def test_a_written_profile_comes_back(tmp_path):
    profile = Profile(SHAPES.named("biphasic"), 0.004, 0.25)
    write_profile(profile, tmp_path / "profile.csv", 2000.0)
    values = np.loadtxt(tmp_path / "profile.csv", delimiter=",", skiprows=3)
    np.testing.assert_allclose(values, sampled(profile, 2000.0), rtol=1e-8, atol=1e-12)
    heading = (tmp_path / "profile.csv").read_text().splitlines()
    assert heading[2] == "time_s,displacement_m,velocity_m_s,acceleration_m_s2"
    assert heading[0].startswith("# biphasic: 4 mm in 0.25 s")


@pytest.mark.parametrize("name", ["minimum_jerk", "designed", "reflex_separating", "raised_cosine"])
def test_velocity_and_acceleration_are_derivatives(name):
    profile, h = Profile(SHAPES.named(name), AMPLITUDE, T), 1e-5
    lag = np.linspace(0.01, T - 0.01, 201)
    low, mid, high = (profile.at(lag + d) for d in (-h, 0, h))
    for order in (0, 1):
        slope = (high[order] - low[order]) / (2 * h)
        scale = np.abs(mid[order + 1]).max()
        np.testing.assert_allclose(slope, mid[order + 1], atol=1e-5 * scale)


@pytest.mark.parametrize(
    ("amplitude", "duration"), [(0.0, 0.3), (-0.005, 0.3), (np.nan, 0.3), (0.005, 0.0), (0.5, 0.3)]
)
def test_impossible_profiles_are_refused(amplitude, duration):
    with pytest.raises(InputError):
        Profile(SHAPES.named("designed"), amplitude, duration)


def test_a_duration_between_samples_cannot_be_written(tmp_path):
    profile = Profile(SHAPES.named("designed"), AMPLITUDE, 0.2505)
    with pytest.raises(InputError, match="whole number of samples"):
        write_profile(profile, tmp_path / "profile.csv")
    assert not list(tmp_path.iterdir())


def test_unknown_names_are_refused():
    with pytest.raises(InputError, match="square"):
        SHAPES.named("square")
