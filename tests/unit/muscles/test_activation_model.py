"""Stiffness over activation: truths recovered, limits, what is refused, files."""

from __future__ import annotations

import json

import numpy as np
import pytest

from armimpedance.arm.muscular_arms import arm_named
from armimpedance.errors import InputError, NotIdentifiableError
from armimpedance.muscles.activation_design import muscle_patterns
from armimpedance.muscles.activation_fit import ACTIVATION_MODELS, fit_activation_model
from armimpedance.muscles.activation_model import ActivationModel
from armimpedance.muscles.joint_rows import JointRows, matrix, triple

POSTURE = np.array([1.04, 1.57])
ARM = arm_named("planar6")
MUSCLES = ARM.paths.muscles
#: N/m of each muscle at rest and per unit of activation (and of its square).
REST = np.array([1300.0, 1300.0, 5000.0, 5000.0, 2100.0, 2100.0])
RISE = np.array([50e3, 45e3, 52e3, 55e3, 27e3, 30e3])
BEND = np.array([20e3, -15e3, 10e3, 0.0, 15e3, -10e3])


def made_rows(
    seed: int = 0,
    *,
    conditions: int = 30,
    sd: float = 0.0,
    bend: float = 0.0,
    activation_sd: float = 0.0,
    torque: bool = True,
) -> JointRows:
    """Conditions of the arm itself, independent activations up to .3."""
    rng = np.random.default_rng(seed)
    alpha = rng.uniform(0.02, 0.3, (conditions, 6)) * (rng.random((conditions, 6)) < 0.7) + 0.005
    active = RISE * alpha + bend * BEND * alpha**2
    A = muscle_patterns(ARM, POSTURE, curvature=True, stiffness_per_tension=75.0)
    K = (REST + active) @ A + sd * rng.normal(size=(conditions, 3))
    B = (0.06 * REST + 0.05 * active) @ A + 0.05 * sd * rng.normal(size=(conditions, 3))
    tau = np.array([0.3, -0.2]) - active @ ARM.paths.moment_arms(POSTURE) / 75.0
    seen = np.clip(alpha + activation_sd * rng.normal(size=alpha.shape), 0, 1)
    return JointRows(
        joint_angles=np.tile(POSTURE, (conditions, 1)),
        stiffness=matrix(K),
        viscosity=matrix(B),
        activation=seen,
        activation_sd=np.full(alpha.shape, activation_sd) if activation_sd else None,
        torque=tau if torque else None,
        labels=tuple(f"condition {i}" for i in range(conditions)),
    )


def new_activations(model: ActivationModel, count: int = 200) -> np.ndarray:
    low, high = model.activation_range.T
    return np.random.default_rng(5).uniform(low, high, (count, 6))


@pytest.mark.parametrize("model", ACTIVATION_MODELS)
@pytest.mark.parametrize("torque", [False, True])
@pytest.mark.parametrize("order", [1, 2, 3])
def test_noise_free_truth_is_recovered(model, torque, order):
    rows = made_rows(bend=float(order > 1))
    fitted = fit_activation_model(rows, ARM, order=order, model=model, torque=torque)
    alpha = new_activations(fitted)
    active = RISE * alpha + (order > 1) * BEND * alpha**2
    predicted = fitted.predict(alpha)
    assert predicted.stiffness == pytest.approx((REST + active) @ fitted.patterns, abs=1e-5)
    viscosity = (0.06 * REST + 0.05 * active) @ fitted.viscous_patterns
    assert predicted.viscosity == pytest.approx(viscosity, abs=1e-6)
    assert fitted.muscle_stiffness(alpha) == pytest.approx(active, abs=1.0)


def test_no_curvature_is_the_source_model():
    plain = fit_activation_model(made_rows(), ARM, order=1, curvature=False)
    G = ARM.paths.moment_arms(POSTURE)
    assert plain.patterns == pytest.approx(triple(G[:, :, None] * G[:, None, :]))


def test_json_and_back_predicts_the_same():
    fitted = fit_activation_model(made_rows(sd=1.0), ARM, order=2, torque=True)
    back = ActivationModel.from_plain(json.loads(json.dumps(fitted.as_plain(), allow_nan=False)))
    alpha = new_activations(fitted)
    for name in ("stiffness", "viscosity", "stiffness_covariance", "extrapolated"):
        assert np.array_equal(
            getattr(back.predict(alpha), name), getattr(fitted.predict(alpha), name)
        )
    assert back.quality == fitted.quality
    assert back.summary == fitted.summary
