"""Lack of fit beside pure error: what wrong moment arms and laws do, and what is said of them."""

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.limb.arm import arm_named
from armimpedance.muscles.models import (
    ActivationModel,
    JointRows,
    fit_activation_model,
    matrix,
    triple,
)

ARM = arm_named("planar6")
POSTURE = np.array([1.04, 1.57])
G = ARM.paths.moment_arms(POSTURE)
KAPPA = 75.0
FULL = KAPPA * 800.0
SD_K, SD_TORQUE = 1.0, 0.05
RECORDS = 4


def stiffness(f: np.ndarray, arms: np.ndarray) -> np.ndarray:
    """K_ss, K_se, K_ee of muscles' stiffness f (P, 6) and arms (6, 2) or (P, 6, 2)."""
    arms = np.broadcast_to(arms, (len(f), 6, 2))
    A = triple(arms[..., :, None] * arms[..., None, :])
    return np.array([10.0, 2.0, 8.0]) + np.einsum("pm,pme->pe", f, A)


def made(seed: int, shared=0.0, single=0.0, bend=0.0) -> tuple[JointRows, np.ndarray, np.ndarray]:
    """Rows of 30 conditions, new activations and their true K; relative errors of what is known."""
    rng = np.random.default_rng([81, seed])
    alpha = rng.uniform(0.02, 0.3, (30, 6))
    new = rng.uniform(0.04, 0.28, (60, 6))
    own = G * np.exp(shared * rng.standard_normal(G.shape))
    arms = own * np.exp(single * rng.standard_normal((30, *G.shape)))
    power = np.exp(bend * rng.standard_normal(6))
    f = FULL * 0.3 * (alpha / 0.3) ** power
    tau = 1.0 - np.einsum("pmj,pm->pj", arms, f) / KAPPA
    K = stiffness(f, arms)
    rows = JointRows(
        joint_angles=np.tile(POSTURE, (30, 1)),
        stiffness=matrix(K + SD_K * rng.standard_normal(K.shape)),
        viscosity=matrix(0.05 * (K + SD_K * rng.standard_normal(K.shape))),
        stiffness_sd=np.full((30, 2, 2), SD_K),
        viscosity_sd=np.full((30, 2, 2), 0.05 * SD_K),
        activation=alpha,
        torque=tau + SD_TORQUE * rng.standard_normal(tau.shape),
    )
    return rows, new, stiffness(FULL * 0.3 * (new / 0.3) ** power, own)


def fitted(rows: JointRows, **options) -> ActivationModel:
    return fit_activation_model(rows, ARM, torque=True, curvature=False, **options)


def studied(**wrong) -> tuple[float, list[str]]:
    """Share of K that intervals hold, and what is said of the rows of K, over records."""
    inside, said = [], []
    for seed in range(RECORDS):
        rows, new, K = made(seed, **wrong)
        model = fitted(rows)
        predicted = model.predict(new)
        off = np.abs(predicted.stiffness - K)
        inside.append((off <= predicted.half_width("stiffness")).mean())
        said.append(model.summary.checks[0].verdict)
    return float(np.mean(inside)), said


def test_rows_that_obey_the_model_have_no_lack_of_fit():
    inside, said = studied()
    assert "warning" not in said
    # standard error of the mean over 4 records some .03
    assert inside == pytest.approx(0.95, abs=0.09)


@pytest.mark.parametrize("wrong", [{"shared": 0.06}, {"single": 0.06}, {"bend": 0.15}])
def test_what_the_model_cannot_follow_is_named_and_in_the_intervals(wrong):
    inside, said = studied(**wrong)
    assert said.count("warning") >= RECORDS - 1
    assert inside >= 0.86


def test_single_muscles_are_wider_where_moment_arms_are_wrong():
    rows, new, _ = made(3, shared=0.08)
    model = fitted(rows)
    alone = model.muscle_stiffness_sd(new)
    as_known = replace(model, muscle_covariance=model.stiffness_covariance[3:, 3:])
    assert (alone > 1.5 * as_known.muscle_stiffness_sd(new)).mean() > 0.5
    check = model.summary.checks[0]
    assert check.name == "lack of fit"
    assert check.sentence in model.warnings


def test_a_stiffness_in_the_wrong_unit_is_no_arms():
    rows, _, _ = made(6)
    sd = np.asarray(rows.stiffness_sd)
    model = fitted(replace(rows, stiffness=1000 * rows.stiffness, stiffness_sd=1000 * sd))
    assert (model.summary.checks[-1].name, model.summary.checks[-1].verdict) == ("units", "warning")
    assert fitted(rows).summary.checks[-1].verdict == "ok"


def test_a_bounded_model_keeps_its_bounds():
    rows, new, _ = made(4, single=0.08)
    model = fitted(rows, model="bernstein", order=2, increasing=True)
    assert (np.diff(model.muscle_stiffness(np.sort(new, axis=0)), axis=0) >= -1e-6).all()
    assert model.summary.checks[0].verdict == "warning"


def test_a_model_written_before_single_muscles_had_their_own_covariance_is_read():
    rows, new, _ = made(5)
    plain = fitted(rows).as_plain()
    del plain["muscle_covariance"]
    again = ActivationModel.from_plain(plain)
    active = again.stiffness_covariance[3:, 3:]
    assert again.muscle_covariance == pytest.approx(active)
    assert again.summary.checks[0].name == "lack of fit"
