"""Truths that the estimators of passive joints must give back, and what each gets wrong."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from armimpedance.joint.relaxed.identify import identify_passive, limit_cycle_rad
from armimpedance.joint.relaxed.linear import number_of_cosines
from armimpedance.joint.relaxed.methods import METHODS
from armimpedance.joint.relaxed.passive_fit import summary_of
from armimpedance.joint.relaxed.samples import PassiveSamples, from_motion

NAMES = ("k", "h", "f")


def values(fit):
    return np.array([fit.parameters[name].value for name in NAMES])


def truth_of(forearm):
    return np.array([getattr(forearm.truth, name) for name in NAMES])


@pytest.fixture(scope="module")
def clean(forearm):
    """A noise-free recording and its exact motion."""
    return forearm.swings(trials=3, samples=120)


def with_noise(forearm, seed):
    """Samples of 700 frames with half a millimetre of marker noise."""
    motion, _ = forearm.swings(seed=seed, angle_noise=2.5e-3, place_noise=3e-4, substeps=8)
    return from_motion(motion, [forearm.elbow])


@pytest.fixture(scope="module")
def noisy(forearm):
    """Six such recordings."""
    return [with_noise(forearm, seed) for seed in range(6)]


def exact_samples(forearm, exact, **more):
    """Samples without filter from exact derivatives, the torque as the law with a sharp sign."""
    x = forearm.truth
    law = x.k * (exact.q - x.q_r) + x.h * exact.qd + x.f * np.sign(exact.qd)
    return PassiveSamples(
        sample_rate_hz=30.0,
        offsets=exact.offsets,
        joints=(forearm.elbow,),
        q=exact.q[:, None],
        qd=exact.qd[:, None],
        torque=law[:, None],
        measured_q=exact.q[:, None],
        **more,
    )


@pytest.mark.parametrize("method", ["ls", "parallel"])
@pytest.mark.parametrize("rest", ["known", "free"])
def test_exact_derivatives_give_exact_parameters(forearm, clean, method, rest):
    samples = exact_samples(forearm, clean[1])
    angle = forearm.truth.q_r if rest == "known" else "free"
    (fit,) = identify_passive(samples, rest_angle=angle, method=method)
    np.testing.assert_allclose(values(fit), truth_of(forearm), rtol=1e-9)
    if rest == "free":
        assert fit.parameters["q_r"].value == pytest.approx(forearm.truth.q_r, rel=1e-9)
    assert fit.direct.r2 > 1 - 1e-12


def test_the_simulated_swing_gives_the_parameters_without_derivatives(forearm, clean):
    # what is left is the spline through 30 frames/s and the rig's smooth sign
    samples = from_motion(clean[0], [forearm.elbow], cutoff_hz=None)
    (fit,) = identify_passive(
        samples, rest_angle=forearm.truth.q_r, method="output-error", cross_validate=False
    )
    np.testing.assert_allclose(values(fit), truth_of(forearm), rtol=2e-3)


def test_quadratic_stiffness_and_its_rest_angle_come_back(forearm, clean):
    samples = exact_samples(forearm, clean[1])
    about = samples.q - forearm.truth.q_r
    curved = replace(samples, torque=samples.torque + 0.8 * about**2)
    for angle in (forearm.truth.q_r, "free"):
        (fit,) = identify_passive(curved, rest_angle=angle, quadratic=True, cross_validate=False)
        assert fit.parameters["K"].value == pytest.approx(0.8, rel=1e-7)
        np.testing.assert_allclose(values(fit), truth_of(forearm), rtol=1e-7)


@pytest.mark.study
def test_a_wrong_rest_angle_turns_stiffness_and_a_free_one_widens_it(forearm, noisy):
    known, wrong, free = (
        identify_passive(noisy[0], rest_angle=angle, method="parallel", cross_validate=False)[0]
        for angle in (forearm.truth.q_r, forearm.truth.q_r + 0.05, "free")
    )
    assert abs(wrong.parameters["k"].value / known.parameters["k"].value - 1) > 0.04
    assert free.parameters["k"].sd > 3 * known.parameters["k"].sd
    assert any("rest angle" in w for w in free.warnings)


@pytest.mark.study
def test_the_sources_own_way_is_biased_and_a_filtered_sign_is_not(forearm, noisy):
    truth = truth_of(forearm)
    error = {}
    for method in ("ls", "parallel"):
        found = [
            values(identify_passive(s, rest_angle=1.0, method=method, cross_validate=False)[0])
            for s in noisy
        ]
        spread = np.std(found, axis=0, ddof=1) / np.sqrt(len(found))
        error[method] = (np.mean(found, axis=0) - truth, spread)
    bias, se = error["ls"]
    assert bias[1] / truth[1] < -0.2
    assert bias[1] < -4 * se[1]
    bias, se = error["parallel"]
    assert (np.abs(bias) < 4 * se + [1e-3, 2e-4, 2e-4]).all()
    assert abs(bias[0]) < 0.01 * truth[0]


@pytest.mark.study
def test_output_error_is_several_times_sharper_than_derivatives(forearm, noisy):
    both = {
        method: [
            values(identify_passive(s, rest_angle=1.0, method=method, cross_validate=False)[0])
            for s in noisy
        ]
        for method in ("parallel", "output-error")
    }
    truth = truth_of(forearm)
    rms = {m: np.sqrt(np.mean((np.array(v) - truth) ** 2, axis=0)) for m, v in both.items()}
    assert (rms["output-error"][1:] < rms["parallel"][1:] / 2).all()


@pytest.mark.study
def test_negative_friction_is_told_with_its_limit_cycle(forearm):
    x = SimpleNamespace(k=2.95, h=0.05, f=-0.006, q_r=1.0)
    motion, _ = forearm.swings(trials=1, samples=900, truth=x, shake_m=0.0, start=0.05, substeps=8)
    samples = from_motion(motion, [forearm.elbow], cutoff_hz=None)
    (fit,) = identify_passive(samples, rest_angle=1.0, method="output-error", cross_validate=False)
    assert fit.parameters["f"].value < 0
    (told,) = [w for w in fit.warnings if "not dissipative" in w]
    assert "limit cycle" in told
    # the swing itself, after its transient
    q = samples.q[600:, 0]
    omega = np.sqrt(np.mean(samples.qd[600:, 0] ** 2)) / np.std(q)
    seen = np.sqrt(2) * np.std(q)
    assert limit_cycle_rad(x.f, x.h, omega) == pytest.approx(seen, rel=0.03)
    assert float(told.split("amplitude ")[1].split()[0]) == pytest.approx(seen, rel=0.05)


@pytest.mark.study
def test_a_turned_joint_axis_leaves_the_parameters(forearm, noisy):
    # q -> -q, torque -> -torque, q_r -> -q_r is the same joint seen from the other side
    samples = noisy[0]
    turned = replace(
        samples,
        q=-samples.q,
        qd=-samples.qd,
        torque=-samples.torque,
        measured_q=-samples.measured_q,
        hinges=None,
    )
    a, b = (
        identify_passive(s, rest_angle=rest, method="parallel", cross_validate=False)[0]
        for s, rest in ((samples, 1.0), (turned, -1.0))
    )
    np.testing.assert_allclose(values(a), values(b), rtol=1e-9)


@pytest.mark.study
def test_trials_are_filtered_and_fitted_apart(forearm):
    # the order of the trials does not matter: nothing crosses from one into the next
    motion, _ = forearm.swings(trials=3, samples=100, angle_noise=1e-3)
    samples = from_motion(motion, [forearm.elbow])
    back = samples.select([2, 0, 1])
    a, b = (identify_passive(s, rest_angle=1.0, cross_validate=False)[0] for s in (samples, back))
    np.testing.assert_allclose(values(a), values(b), rtol=1e-10)
    assert back.trials == ("3", "1", "2")


@pytest.mark.study
def test_cross_validation_leaves_each_trial_out_and_thirds_of_a_single_one(forearm, noisy):
    (fit,) = identify_passive(noisy[0], rest_angle=1.0)
    assert [c.left_out for c in fit.cross] == ["1", "2", "3"]
    motion, _ = forearm.swings(trials=1, samples=300)
    (single,) = identify_passive(from_motion(motion, [forearm.elbow]), rest_angle=1.0)
    assert [c.left_out[:7] for c in single.cross] == ["third 1", "third 2", "third 3"]
    assert all(c.validation.vaf > 0.99 for c in single.cross)


@pytest.mark.study
def test_a_fit_predicts_another_recording(forearm, noisy):
    (fit,) = identify_passive(noisy[0], rest_angle=1.0, cross_validate=False)
    clean_motion, _ = forearm.swings(seed=40)
    other = fit.validate(from_motion(clean_motion, [forearm.elbow]))
    assert other.vaf > 0.99
    assert other.rms[0] < fit.rms_Nm


def test_the_sources_standard_errors_are_the_textbook_ones(forearm):
    samples = with_noise(forearm, 0)
    (fit,) = identify_passive(samples, rest_angle=1.0, method="ls", cross_validate=False)
    W, Y = METHODS["ls"].equations(samples, fit.terms).stacked()
    residual = Y[:, 0] - W @ values(fit)
    sigma2 = residual @ residual / (len(Y) - 3)
    expected = np.sqrt(np.diag(sigma2 * np.linalg.inv(W.T @ W)))
    np.testing.assert_allclose([fit.parameters[n].sd for n in NAMES], expected, rtol=1e-9)
    assert fit.torque_fit.n_rows == len(Y) == 699
    assert fit.parameters["k"].well_identified
    assert not fit.parameters["h"].well_identified


def test_summary_names_parameters_and_counts_joints_from_one(forearm, clean):
    one = exact_samples(forearm, clean[1])
    two = PassiveSamples(
        **{
            **{f: getattr(one, f) for f in ("sample_rate_hz", "offsets")},
            **{f: np.hstack([getattr(one, f)] * 2) for f in ("q", "qd", "torque", "measured_q")},
            "joints": ("elbow", "wrist"),
        }
    )
    fits = identify_passive(two, rest_angle={"elbow": 1.0, "wrist": "free"}, cross_validate=False)
    summary = summary_of(fits)
    assert [(p.name, p.joint) for p in summary.parameters] == [
        *[(n, 1) for n in NAMES],
        *[(n, 2) for n in (*NAMES, "q_r")],
    ]
    assert summary.n == 2 * 360
    assert all(w.startswith("wrist: ") for w in summary.warnings)
    assert fits[0].summary.method == "parallel"


def test_share_of_friction(forearm, clean):
    (fit,) = identify_passive(exact_samples(forearm, clean[1]), rest_angle=1.0)
    torque = exact_samples(forearm, clean[1]).torque
    share = 100 * forearm.truth.f / np.sqrt(np.mean(torque**2))
    assert fit.friction_share_percent == pytest.approx(share, rel=0.05)


def test_intervals_of_white_noise_agree_with_the_textbook(forearm, clean):
    # where residuals are independent both covariances estimate the same
    rng = np.random.default_rng(5)
    samples = exact_samples(forearm, clean[1])
    ratios = []
    for _ in range(60):
        noise = 0.05 * rng.standard_normal(samples.torque.shape)
        (fit,) = identify_passive(
            replace(samples, torque=samples.torque + noise), rest_angle=1.0, cross_validate=False
        )
        ratios.append([(fit.parameters[n].sd_robust / fit.parameters[n].sd) ** 2 for n in NAMES])
    count = number_of_cosines(360, 30.0)
    # each ratio has mean 1 and variance 2 / count
    assert (np.abs(np.mean(ratios, axis=0) - 1) < 4 * np.sqrt(2 / count / 60)).all()


def test_a_trial_that_cannot_be_predicted_is_told():
    t = np.arange(200) / 30.0
    q = np.concatenate([np.sin(5 * t), np.full(200, 0.4)])[:, None]
    qd = np.concatenate([5 * np.cos(5 * t), np.zeros(200)])[:, None]
    torque = 2.0 * q + 0.1 * qd + 0.02 * np.sign(qd)
    samples = PassiveSamples(30.0, np.array([0, 200, 400]), ("q1",), q, qd, torque, q)
    (fit,) = identify_passive(samples, rest_angle=0.0)
    assert [c.left_out for c in fit.cross] == ["2"]
    told = [w for w in fit.warnings if w.startswith("not predicted from the others: 1 (")]
    assert len(told) == 1
