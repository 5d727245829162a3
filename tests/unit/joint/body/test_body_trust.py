"""A prior held against the data: its sd comes back, and intervals hold where it was told wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.joint.body.angle_noise import NoiseShift
from armimpedance.joint.body.base_parameters import essential_base_parameters
from armimpedance.joint.body.consistent import _Problem, trust_in_prior, unit_covariance
from armimpedance.joint.body.equations import body_equations
from armimpedance.joint.body.estimate import fit_base
from armimpedance.joint.body.identify import identify_body
from armimpedance.joint.body.regressor import inertial_parameters, pseudo_inertias
from armimpedance.joint.body.rows import RowChoice


@pytest.fixture(scope="module")
def noisy(small, rigs):
    """Three motions of a small tree; noise of the plates only."""
    exact = rigs.moving(small, 4, trials=3, size=0.3)[0]
    rng = np.random.default_rng(0)
    noise = np.array([2.0, 2, 2, 0.6, 0.6, 0.6]) * rng.standard_normal(exact.wrenches.shape)
    return replace(exact, wrenches=exact.wrenches + noise)


def deviating(skeleton, sd, rng):
    """Masses and inertias of the same bones, each segment's density off by this relative sd."""
    factors = np.exp(sd * rng.standard_normal(len(skeleton.segments)))
    changed = [
        replace(s, mass_kg=f * s.mass_kg, inertia_kgm2=f * s.inertia_kgm2)
        for s, f in zip(skeleton.segments, factors, strict=True)
    ]
    return replace(skeleton, segments=tuple(changed))


def test_the_covariance_is_the_curvature_that_the_consistent_fit_has(small, noisy):
    equations, base = body_equations(noisy, RowChoice()), essential_base_parameters(small)
    prior = inertial_parameters(small)
    weights = fit_base(equations, base).weights
    problem = _Problem(equations, base, weights, pseudo_inertias(prior), None)
    G, _ = problem.cones(base.of(prior), problem.hidden(prior))
    expected = 4 * np.linalg.inv(G.T @ G)
    np.testing.assert_allclose(unit_covariance(prior), expected, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("true_sd", [0.1, 0.3, 1.0])
def test_the_sd_that_made_the_parameters_comes_back(small, true_sd):
    base, prior = essential_base_parameters(small), inertial_parameters(small)
    C_1 = base.mapping @ unit_covariance(prior) @ base.mapping.T
    # errors of the data a tenth of what a prior of 30 % allows
    C_d = 0.03**2 * np.diag(np.diag(C_1))
    rng, found = np.random.default_rng(5), []
    for _ in range(30):
        b = base.of(prior) + rng.multivariate_normal(np.zeros(base.rank), true_sd**2 * C_1 + C_d)
        found.append(trust_in_prior(base, prior, b, C_d, 0.3))
    logs = np.log([one.likely for one in found])
    assert abs(logs.mean() - np.log(true_sd)) < 3 * logs.std() / np.sqrt(30) + 0.02
    named = [one.finding.verdict == "warning" for one in found]
    assert all(named) if true_sd > 0.9 else not any(named)
    assert all(one.used >= 0.3 for one in found)


def test_a_prior_that_the_data_contradict_is_named_and_trusted_less(small, noisy):
    wrong = deviating(small, 0.8, np.random.default_rng(3))
    truth, held, named = inertial_parameters(small), {}, {}
    for name, prior in (("wrong", wrong), ("right", small)):
        fit = identify_body(
            noisy, choice=RowChoice(), check=False, method="prior", motions=None, prior=prior,
            prior_sd=0.1,
        )  # fmt: skip
        low, high = np.array([p.ci95 for p in fit.summary.parameters]).T
        held[name] = np.mean((low <= fit.base.of(truth)) & (fit.base.of(truth) <= high))
        (table,) = [one for one in fit.checks if one.name == "table"]
        named[name] = table.verdict
        assert (table.sentence in fit.warnings) == (table.verdict == "warning")
    assert named == {"wrong": "warning", "right": "ok"}
    # 26 parameters: two outside are 92 %
    assert min(held.values()) > 0.9


def test_what_a_line_back_to_no_noise_leaves_is_allowed_for():
    # estimates that fall as b / (1 + r) with the noise's share r
    b, r = np.full(4, 3.0), np.array([0.02, 0.05, 0.1, 0.2])
    once, twice = b / (1 + r), b / (1 + 2 * r)
    noise = NoiseShift(twice - once, np.zeros((4, 4)), 1e-3, 0.1, "elbow")
    values = once - noise.shift
    left = values - b
    assert np.sign(noise.left(values)) == pytest.approx(np.sign(left))
    np.testing.assert_allclose(np.abs(noise.left(values)), np.abs(left), rtol=0.45)
    # near zero it is never more than what was taken off
    assert np.abs(noise.left(1e-9 * b)) == pytest.approx(np.abs(noise.shift))


def test_noise_of_the_angles_is_named_where_it_is_large_or_cannot_be_seen(small, rigs):
    exact = rigs.moving(small, 2, trials=2, size=0.3)[0]
    rng = np.random.default_rng(1)
    w = exact.wrenches + 0.05 * rng.standard_normal(exact.wrenches.shape)
    verdicts = {}
    for noise in (2e-4, 2e-2):
        q = exact.coordinates + noise * rng.standard_normal(exact.coordinates.shape)
        shaken = replace(exact, coordinates=q, wrenches=w)
        given = {"check": False, "motions": None, "choice": RowChoice(cutoff_hz=6.0)}
        verdicts[noise] = angle_noise(identify_body(shaken, **given)).verdict
    assert verdicts == {2e-4: "ok", 2e-2: "warning"}
    plain = angle_noise(identify_body(shaken, **given, method="ls"))
    assert (plain.verdict, "biases" in plain.message) == ("cannot tell", True)
    given["choice"] = RowChoice()
    assert "without a filter" in angle_noise(identify_body(shaken, **given)).message


def angle_noise(fit):
    (found,) = [one for one in fit.checks if one.name == "angle noise"]
    return found


def test_a_prior_that_is_no_rigid_body_is_refused(small):
    prior = inertial_parameters(small)
    prior[4] += 1e3 * prior[0]
    with pytest.raises(InputError, match="no rigid body"):
        unit_covariance(prior)
