"""An electrode that shows less from some condition on: found by the rows themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import ArmImpedanceError
from armimpedance.limb.arm import arm_named
from armimpedance.muscles.models import JointRows, fit_activation_model, fit_muscle_model, matrix
from armimpedance.muscles.models.changed_gain import WhiteRows

ARM = arm_named("planar6")
POSTURE = np.array([1.04, 1.57])
G = ARM.paths.moment_arms(POSTURE)
SD = 0.5


def rows_of(seed, conditions=24):
    """Rows of muscles whose stiffness is linear in the activation."""
    rng = np.random.default_rng([38, seed])
    alpha = rng.uniform(0.02, 0.3, (conditions, 6))
    K = np.einsum("pm,mi,mj->pij", 2000 + 40_000 * alpha, G, G)
    noise = [matrix(SD * rng.standard_normal((conditions, 3))) for _ in "KB"]
    return JointRows(
        joint_angles=np.tile(POSTURE, (conditions, 1)),
        stiffness=K + noise[0],
        viscosity=0.05 * (K + noise[1]),
        stiffness_sd=np.full(K.shape, SD),
        viscosity_sd=np.full(K.shape, 0.05 * SD),
        activation=alpha,
    )


def weaker(rows, part, first=12, muscle=0):
    """One channel, or all (None), with this part of its gain from a condition on."""
    alpha = np.array(rows.activation)
    alpha[first:, slice(None) if muscle is None else muscle] *= part
    return replace(rows, activation=alpha)


def fit(rows, **options):
    return fit_activation_model(rows, ARM, curvature=False, **options)


def session(model):
    (one,) = (check for check in model.summary.checks if check.name == "session")
    return one


@pytest.mark.study
def test_false_alarms_are_rare():
    assert [session(fit(rows_of(seed))).verdict for seed in range(20)] == 20 * ["ok"]


@pytest.mark.parametrize("kind", [fit, lambda rows: fit_muscle_model(rows, ARM)])
def test_an_electrode_that_shows_half_is_named_with_its_place_and_size(kind):
    model = kind(weaker(rows_of(1), 0.5))
    said = session(model)
    assert said.verdict == "warning"
    assert f"{ARM.paths.muscles[0]} changes by +" in said.message
    assert "from row 13 on" in said.message
    assert said.sentence in model.summary.warnings


@pytest.mark.study
def test_the_change_is_told_to_a_few_of_its_errors():
    parts = []
    for seed in range(10):
        text = session(fit(weaker(rows_of(seed), 0.5))).message
        size, sd = text.split("changes by +")[1].split(" %")[0], text.split("(sd ")[1].split(")")[0]
        parts.append((float(size) - 100) / float(sd))
    # the same EMG stands for twice the stiffness
    assert np.abs(parts).max() < 4


def test_a_gain_of_all_channels_is_told_of_all():
    assert "all muscles" in session(fit(weaker(rows_of(2), 0.8, muscle=None))).message


def test_one_wrong_condition_is_no_change():
    rows = rows_of(3)
    K = np.array(rows.stiffness)
    K[20] *= 3
    assert session(fit(replace(rows, stiffness=K))).verdict == "ok"


def test_the_intervals_hold_both_gains():
    ask = np.full((1, 6), 0.15)
    before = np.full(6, 2000 + 40_000 * 0.15)
    # after the change the same EMG of the first muscle is that of twice the activation
    after = before + np.eye(6)[0] * 40_000 * 0.15
    found = fit(weaker(rows_of(4), 0.5)).predict(ask)
    sd = np.sqrt(found.stiffness_covariance[0, 0, 0])
    for stiffness in (before, after):
        truth = np.einsum("m,mi,mj->ij", stiffness, G, G)[0, 0]
        assert abs(found.stiffness[0, 0] - truth) < 2.5 * sd


def test_few_conditions_are_not_asked():
    assert not [c for c in fit(rows_of(5, 5)).summary.checks if c.name == "session"]


def test_a_condition_left_out_is_a_fit_without_it():
    rng = np.random.default_rng(6)
    X, y = rng.standard_normal((8, 3, 4)), rng.standard_normal((8, 3))
    D = rng.standard_normal((8, 3, 2))

    def solved(design, target):
        A = np.einsum("pri,prj->ij", design, design)
        theta = np.linalg.solve(A, np.einsum("pri,pr->i", design, target))
        return theta, np.linalg.inv(A), target - design @ theta

    theta, C, error = solved(X, y)
    left = WhiteRows(X, error, theta, C, D, np.array([[0], [1]])).without(2)
    kept = np.arange(8) != 2
    theta, C, error = solved(X[kept], y[kept])
    assert np.allclose(left.theta, theta)
    assert np.allclose(left.covariance, C)
    assert np.allclose(left.error[kept], error)
    assert not left.slopes[2].any()


def test_what_the_fit_refuses_is_still_refused():
    rows = rows_of(7)
    with pytest.raises(ArmImpedanceError):
        fit(replace(rows, activation=np.full_like(rows.activation, 0.1)))
