"""Least squares finds the truth within its own intervals, and says what it cannot find."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.joint.body.base_parameters import essential_base_parameters
from armimpedance.joint.body.equations import body_equations
from armimpedance.joint.body.estimate import clustered_covariance, fit_base, row_levels
from armimpedance.joint.body.regressor import inertial_parameters
from armimpedance.joint.body.rows import RowChoice


@pytest.fixture(scope="module")
def exact(small, rigs):
    return rigs.moving(small, 4)[0]


def noisy(recording, rng, levels=(1.0, 1.0, 1.0, 0.3, 0.3, 0.3), memory=0.0):
    e = rng.standard_normal(recording.wrenches.shape)
    for i in range(1, len(e)):
        e[i] = memory * e[i - 1] + np.sqrt(1 - memory**2) * e[i]
    return replace(recording, wrenches=recording.wrenches + e * np.array(levels))


@pytest.mark.parametrize("weighting", ["none", "levels"])
def test_exact_data_give_the_truth(exact, small, weighting):
    base = essential_base_parameters(small)
    found = fit_base(body_equations(exact, RowChoice()), base, weighting)
    truth = base.of(inertial_parameters(small))
    np.testing.assert_allclose(found.values, truth, rtol=1e-8, atol=1e-10)


def test_joint_rows_give_the_same(rigs, small):
    recording, parts = rigs.moving(small, 6, trials=2)
    tau = np.concatenate([rigs.inverse_dynamics(small, *p[1:]) for p in parts])
    # no plates: the recording's torque holds everything that acts on the root
    free = replace(recording, torque=tau, wrenches=None, plate_origins_m=None)
    base = essential_base_parameters(small, RowChoice(rows="all"))
    found = fit_base(body_equations(free, RowChoice(rows="all")), base)
    np.testing.assert_allclose(
        found.values, base.of(inertial_parameters(small)), rtol=1e-8, atol=1e-10
    )


def test_torques_and_plates_together_give_the_same(rigs, small):
    recording, parts = rigs.moving(small, 6, trials=2)
    from armimpedance.joint.body.rows import contact_torques
    from armimpedance.limb.arm.skeleton_model import skeleton_model

    tau = np.concatenate([rigs.inverse_dynamics(small, *p[1:]) for p in parts])
    felt = contact_torques(
        skeleton_model(small), small, recording.wrenches, recording.coordinates, ("forearm",)
    )
    # what motors must do beside a plate under the forearm
    motors = replace(recording, torque=tau - felt)
    choice = RowChoice(rows="all", standing=("forearm",))
    base = essential_base_parameters(small, choice)
    found = fit_base(body_equations(motors, choice), base)
    np.testing.assert_allclose(
        found.values, base.of(inertial_parameters(small)), rtol=1e-7, atol=1e-9
    )


def test_weights_find_the_rows_own_noise(exact, small):
    rng = np.random.default_rng(0)
    levels = np.array([0.2, 0.2, 0.2, 4.0, 4.0, 4.0])
    equations = body_equations(noisy(exact, rng, levels), RowChoice())
    base = essential_base_parameters(small)
    found = fit_base(equations, base)
    # sd of an sd from 1200 samples is 2 %; turning the frame mixes axes of one kind, and a noise
    # of the force on its lever to the root (below .1 N m here) adds to that of the moments
    np.testing.assert_allclose(1 / found.weights, levels, rtol=0.1)


def test_intervals_hold_for_noise_with_a_memory(exact, small):
    base, truth = essential_base_parameters(small), None
    truth = base.of(inertial_parameters(small))
    inside = {"classical": [], "robust": []}
    for seed in range(25):
        recording = noisy(exact, np.random.default_rng(seed), memory=0.9)
        found = fit_base(body_equations(recording, RowChoice()), base)
        robust = clustered_covariance(recording, RowChoice(), base, found, block_s=0.5)
        for name, C in (("classical", found.fit.covariance), ("robust", robust)):
            inside[name].append(np.abs(found.values - truth) < 1.96 * np.sqrt(np.diag(C)))
    # 25 x 26 intervals; those of one repeat depend on one another: sd of the mean some 2 %
    assert np.mean(inside["classical"]) < 0.75
    assert 0.86 < np.mean(inside["robust"]) <= 1


def test_independent_noise_needs_no_robustness(exact, small):
    base = essential_base_parameters(small)
    recording = noisy(exact, np.random.default_rng(1))
    found = fit_base(body_equations(recording, RowChoice()), base)
    robust = clustered_covariance(recording, RowChoice(), base, found, block_s=0.2)
    ratio = np.median(np.diag(robust) / np.diag(found.fit.covariance))
    assert 0.7 < ratio < 1.4


def test_validation_on_triangles_is_validation_on_samples(exact, small):
    from armimpedance.joint.body.rows import each_trial

    recording = noisy(exact, np.random.default_rng(2))
    base = essential_base_parameters(small)
    equations = body_equations(recording, RowChoice())
    phi = base.lift(fit_base(equations, base).values)
    judged = equations.validate(phi)
    for t, trial in enumerate(each_trial(recording, RowChoice())):
        e = trial.w - trial.W @ phi
        np.testing.assert_allclose(judged.rms[t], np.sqrt((e**2).mean(axis=0)), rtol=1e-9)
        total = ((trial.w - trial.w.mean(axis=0)) ** 2).sum(axis=0)
        np.testing.assert_allclose(judged.r2[t], 1 - (e**2).sum(axis=0) / total, atol=1e-8)
    assert judged.moments == ("mx", "my", "mz")


def test_the_same_filter_on_both_sides_costs_little(exact, small):
    base = essential_base_parameters(small)
    choice = RowChoice(cutoff_hz=8.0)
    found = fit_base(body_equations(exact, choice), base)
    truth = base.of(inertial_parameters(small))
    assert np.median(np.abs(found.values / truth - 1)) < 0.05


def test_a_still_root_is_refused_by_name(rigs, small):
    rng = np.random.default_rng(0)
    t, q, *_ = rigs.splined(len(small.coordinates), 4.0, rng)
    q[:, :6] = 0.1
    still = np.zeros_like(q)
    recording = rigs.record(small, [(t, q)], [rigs.contact_wrench(small, q, still, still)])
    equations = body_equations(recording, RowChoice())
    with pytest.raises(NotIdentifiableError) as caught:
        fit_base(equations, essential_base_parameters(small))
    assert "Ixx_trunk" in caught.value.parameters


def test_levels_are_never_zero(exact, small):
    equations = body_equations(exact, RowChoice())
    assert (row_levels(equations, inertial_parameters(small)) > 0).all()


def test_too_few_samples_and_unknown_weights_are_refused(exact, small):
    base = essential_base_parameters(small)
    equations = body_equations(exact, RowChoice())
    few = replace(equations, samples=np.array([1, 1, 1]))
    with pytest.raises(InputError, match="18 rows for 26 parameters"):
        fit_base(few, base)
    with pytest.raises(InputError, match="no weighting"):
        fit_base(equations, base, "heavy")
