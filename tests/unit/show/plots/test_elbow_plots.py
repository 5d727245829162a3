"""One joint's drawings: what is drawn is what was measured, fitted and known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.joint.elbow.elbow_result import ChannelSnr, VaryingImpedance
from armimpedance.joint.elbow.emg.law import fit_emg_law
from armimpedance.joint.elbow.emg.law_result import OperatingPoints
from armimpedance.joint.elbow.frequency_response import frequency_response, model_compliance
from armimpedance.joint.elbow.samples import from_recording
from armimpedance.joint.elbow.show.plot import (
    averaged,
    plot_emg_law,
    plot_frequency_response,
    plot_law,
    plot_varying,
    plot_varying_both,
)
from armimpedance.joint.elbow.stationary.identify import identify_elbow
from armimpedance.numerics.regression import Parameters
from armimpedance.show.plots.style import new_axes
from manipulandum_sim.elbow.bench import simulate_bench

TRUTH = (0.07, 0.6, 20.0)
AMPLITUDE = np.array([[0.1, 0.1], [0.1, 0.3], [0.3, 0.1], [0.3, 0.3], [0.2, 0.2], [0.4, 0.1]])


@pytest.fixture(scope="module")
def varying():
    """Two trials, of four and of three points."""
    rng = np.random.default_rng(8)
    return VaryingImpedance(
        method="windows",
        trials=("1", "7"),
        offsets=np.array([0, 4, 7]),
        time_s=np.array([0.5, 1.0, 1.5, 2.0, 0.5, 1.0, 1.5]),
        B=3 + rng.standard_normal(7),
        K=9 + rng.standard_normal(7),
        sd_B=rng.uniform(0.1, 0.3, 7),
        sd_K=rng.uniform(0.2, 0.6, 7),
        parameters=Parameters(("I",), ("kg m^2",), [0.07], [[0.001**2]], dof=12.0),
        snr=ChannelSnr(40.0, 40.0),
    )


@pytest.fixture(scope="module")
def bench():
    """Samples of a joint, and their fit."""
    samples = from_recording(simulate_bench(*TRUTH, snr_db=30.0, seed=6)[0])
    return samples, identify_elbow(samples)


@pytest.mark.parametrize("name", ["B", "K"])
@pytest.mark.parametrize("trial", [0, 1])
def test_course_and_band_are_those_of_the_trial(varying, name, trial):
    ax = plot_varying(varying, name, trial=trial)
    (line,), (band,) = ax.lines, ax.collections
    rows = varying.points_of(trial)
    np.testing.assert_array_equal(line.get_xdata(), varying.time_s[rows])
    np.testing.assert_array_equal(line.get_ydata(), getattr(varying, name)[rows])
    corners = {tuple(v) for v in np.round(band.get_paths()[0].vertices, 9)}
    ends = varying.band(name)[rows]
    for time, limits in zip(varying.time_s[rows], ends, strict=True):
        for limit in limits:
            assert (round(time, 9), round(limit, 9)) in corners
    assert ax.get_ylabel().startswith(f"{name} (N m")


def test_the_truth_lies_below_the_estimate(varying):
    time, value = np.linspace(0, 2, 9), np.linspace(5, 6, 9)
    ax = plot_varying(varying, "K", truth=(time, value), label="smoother")
    true, estimated = ax.lines
    np.testing.assert_array_equal(true.get_ydata(), value)
    assert true.get_color() == "black"
    assert (true.get_label(), estimated.get_label()) == ("true", "smoother")


@pytest.mark.parametrize("trial", [-1, 2])
def test_a_trial_that_there_is_not_is_refused(varying, trial):
    with pytest.raises(InputError, match=f"no trial {trial}"):
        plot_varying(varying, "K", trial=trial)


def test_axes_that_are_given_are_drawn_on(varying):
    ax = new_axes()
    assert plot_varying(varying, "B", ax=ax) is ax
    plot_varying(varying, "B", trial=1, ax=ax)
    assert len(ax.lines) == 2


def test_both_have_stiffness_above_viscosity_and_say_the_trial(varying):
    upper, lower = plot_varying_both(varying, trial=1).axes
    assert upper.get_ylabel().startswith("K")
    assert lower.get_ylabel().startswith("B")
    assert upper.get_title(loc="left") == "windows, trial 7, 95 % bands"
    assert upper.get_xlabel() == ""
    assert lower.get_xlabel() == "time (s)"


def test_compliance_is_that_measured_and_that_of_the_fit(bench):
    samples, fit = bench
    gain, phase, coherence = plot_frequency_response(samples, fit).axes
    measured = frequency_response(samples)
    named = ("I, B, K", "beyond")
    fitted, beyond = (line for line in gain.lines if line.get_label().startswith(named))
    for line in (fitted, beyond):
        model = model_compliance(line.get_xdata(), fit.parameters.values)
        np.testing.assert_allclose(line.get_ydata(), np.abs(model))
    # solid up to the end of the fitted band, dashed from there on
    assert fitted.get_xdata()[-1] == pytest.approx(fit.details["band_hz"])
    assert beyond.get_xdata()[0] == pytest.approx(fit.details["band_hz"])
    np.testing.assert_allclose(coherence.lines[0].get_ydata(), measured.coherence)
    assert gain.get_xscale() == gain.get_yscale() == "log"


def test_measured_points_are_means_with_their_errors_and_follow_the_model(bench):
    samples, fit = bench
    shown = averaged(frequency_response(samples), fit.parameters.values)
    model = model_compliance(shown.frequency_hz, fit.parameters.values)
    inside = shown.frequency_hz < fit.details["band_hz"]
    gone = np.abs(np.log(shown.gain / np.abs(model))) / shown.error
    # the bench is linear: two in three points within a standard error or so, nearly all within 4
    assert (gone[inside] < 4).mean() > 0.9
    turns = shown.phase_deg - np.degrees(np.angle(model))
    assert (np.abs(turns) <= 180).all()
    assert (np.diff(np.floor(24 * np.log10(shown.frequency_hz) + 1e-9)) >= 0).all()


def test_a_gain_without_coherence_is_not_drawn(bench):
    samples, fit = bench
    measured = frequency_response(samples)
    shown = averaged(measured, fit.parameters.values)
    assert (shown.coherence >= 0.3).all()
    # the torque ends near 10 Hz
    assert shown.frequency_hz[-1] < measured.frequency_hz[-1]


@pytest.fixture(scope="module")
def law():
    """Laws of K and of B from six operating points, and the points."""
    rng = np.random.default_rng(9)
    K = 2 + AMPLITUDE @ [40.0, 30.0] + 0.2 * rng.standard_normal(6)
    B = 1 + AMPLITUDE @ [5.0, 8.0] + 0.05 * rng.standard_normal(6)
    made = fit_emg_law(K, 0.2, AMPLITUDE, 0.0, viscosity=B, viscosity_sd=0.05)
    return made, K, B


def test_points_stand_over_what_the_law_predicts_with_their_errors(law):
    made, K, _ = law
    sd = np.linspace(0.1, 0.6, 6)
    ax = plot_law(made.stiffness, K, sd, AMPLITUDE)
    (bars,) = ax.containers
    points, _, (stems,) = bars.lines
    np.testing.assert_allclose(points.get_xdata(), made.stiffness.predict(AMPLITUDE).value)
    np.testing.assert_allclose(points.get_ydata(), K)
    heights = [np.ptp(s[:, 1]) for s in stems.get_segments()]
    np.testing.assert_allclose(heights, 2 * 1.96 * sd)
    low, high = ax.lines[0].get_xdata()
    np.testing.assert_array_equal(ax.lines[0].get_ydata(), [low, high])
    assert low <= min(K.min(), points.get_xdata().min())
    assert high >= max(K.max(), points.get_xdata().max())


def test_a_law_of_both_has_two_panels_of_one_has_one(law):
    made, K, B = law
    sd = np.full(6, 0.2)
    points = OperatingPoints(range(1, 7), ("flexor", "extensor"), AMPLITUDE, K, sd, B, sd / 4)
    axes = plot_emg_law(replace(made, points=points)).axes
    assert [ax.get_ylabel()[0] for ax in axes] == ["K", "B"]
    np.testing.assert_allclose(axes[1].containers[0].lines[0].get_ydata(), B)
    alone = fit_emg_law(K, 0.2, AMPLITUDE, 0.0)
    assert len(plot_emg_law(replace(alone, points=points)).axes) == 1
    with pytest.raises(InputError, match="points"):
        plot_emg_law(alone)
