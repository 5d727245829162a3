"""One model of posture and activation: derivatives, truths recovered, certificate, files."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import EstimationError, InputError, NotIdentifiableError
from armimpedance.limb.arm.muscular_arms import arm_named
from armimpedance.limb.arm.polynomial_paths import constant_paths
from armimpedance.muscles.models.combined.equations import MuscleEquations
from armimpedance.muscles.models.combined.fit import fit_muscle_model
from armimpedance.muscles.models.combined.lengths import corrected_lengths
from armimpedance.muscles.models.combined.model import MuscleModel
from armimpedance.muscles.models.least_squares import whitening
from armimpedance.muscles.models.packed import matrix
from armimpedance.muscles.models.rows import JointRows

ARM = arm_named("planar6")
NOMINAL = np.array([1.04, 1.57])
#: N/m at rest and at the highest activation, and N s/m.
REST = np.array([1300.0, 1500.0, 5000.0, 4500.0, 2100.0, 2000.0])
RISE = np.array([12e3, 14e3, 15e3, 13e3, 8e3, 9e3])
HIGHEST = np.full(6, 0.3)


def design(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Relaxed postures, then activations at the nominal one."""
    rng = np.random.default_rng(seed)
    postures = rng.uniform([0.5, 1.0], [1.6, 2.1], (16, 2))
    active = rng.uniform(0, 0.3, (25, 6)) * (rng.random((25, 6)) < 0.7)
    active[0] = HIGHEST
    q = np.vstack([postures, np.tile(NOMINAL, (25, 1))])
    return q, np.vstack([rng.uniform(0, 0.01, (16, 6)), active])


def form(order: int, curvature: bool = True) -> MuscleEquations:
    lengths = corrected_lengths(ARM, design(0)[0], order=order, prior_part=0.2)
    return MuscleEquations(lengths, 1, HIGHEST, 75.0, curvature)


def true_parameters(equations: MuscleEquations, seed: int, size: float = 1.0) -> np.ndarray:
    """Corrections drawn from the prior; muscles of human size."""
    layout, rng = equations.layout, np.random.default_rng(seed)
    x = np.zeros(layout.e.stop)
    x[layout.z] = size * rng.normal(size=layout.corrections)
    x[layout.f] = np.column_stack([REST, RISE]).ravel()
    x[layout.b] = np.column_stack([0.06 * REST, 0.05 * RISE]).ravel()
    x[layout.passive_K], x[layout.passive_B] = 1.0, 0.2
    x[layout.tau_p] = rng.normal(size=6)
    return x


def made_rows(seed: int, *, sd: float, order: int = 1, size: float = 1.0) -> tuple:
    """Rows of a subject whose lengths differ from the arm's as the prior says, and the truth."""
    equations = form(order)
    x = true_parameters(equations, 100 + seed, size)
    q, alpha = design(seed)
    at, rng = equations.at(q, alpha), np.random.default_rng(seed)
    K = at.stiffness(x)[0] + sd * rng.normal(size=(len(q), 3))
    B = at.viscosity(x)[0] + 0.05 * sd * rng.normal(size=(len(q), 3))
    tau = at.torque(x)[0]
    rows = JointRows(q, matrix(K), matrix(B), activation=alpha, torque=tau)
    return rows, equations, x


def new_conditions(seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(900 + seed)
    return rng.uniform([0.6, 1.1], [1.5, 2.0], (150, 2)), rng.uniform(0, 0.3, (150, 6))


@pytest.fixture(scope="module")
def fitted() -> MuscleModel:
    return fit_muscle_model(made_rows(1, sd=1.0)[0], ARM, moment_arm_order=1)


@pytest.mark.parametrize("what", ["stiffness", "viscosity", "torque"])
@pytest.mark.parametrize("curvature", [True, False])
def test_derivatives_by_the_parameters(what, curvature):
    equations = form(2, curvature)
    x = true_parameters(equations, 3)
    x[equations.layout.e] = 0.1
    at = equations.at(*new_conditions(0))
    value = getattr(at, what)
    slope = value(x)[1]
    steps = 1e-5 * np.maximum(np.abs(x), 1.0)[: slope.shape[-1]]
    for k, h in enumerate(steps):
        e = np.zeros(len(x))
        e[k] = h
        numeric = (value(x + e)[0] - value(x - e)[0]) / (2 * h)
        assert np.abs(slope[..., k] - numeric).max() <= 1e-8 * (1 + np.abs(slope).max())


@pytest.mark.parametrize("which", ["K", "B"])
def test_derivatives_by_the_activations(which):
    equations = form(1)
    x = true_parameters(equations, 3)
    q, alpha = new_conditions(1)

    def value(a):
        at = equations.at(q, a)
        return (at.stiffness(x) if which == "K" else at.viscosity(x))[0]

    slope = equations.at(q, alpha).by_activation(x, which)
    for i in range(6):
        e = 1e-6 * np.eye(6)[i]
        numeric = (value(alpha + e) - value(alpha - e)) / 2e-6
        np.testing.assert_allclose(slope[..., i], numeric, rtol=1e-5, atol=1e-5)


def test_corrected_moment_arms_and_curvature_come_from_one_length():
    lengths = corrected_lengths(ARM, design(0)[0], order=2, prior_part=0.2)
    paths = lengths.paths(np.random.default_rng(0).normal(size=len(lengths.muscle)))
    q, h = design(1)[0], 1e-5
    for j in range(2):
        e = h * np.eye(2)[j]
        arms = (paths.lengths(q + e) - paths.lengths(q - e)) / (2 * h)
        assert paths.moment_arms(q)[..., j] == pytest.approx(arms, abs=1e-9)
        bend = (paths.moment_arms(q + e) - paths.moment_arms(q - e)) / (2 * h)
        assert paths.curvature(q)[..., j] == pytest.approx(bend, abs=1e-9)


def test_without_corrections_the_arms_are_the_anatomical_ones_and_zero_stays_zero():
    lengths = corrected_lengths(ARM, design(0)[0], order=2, prior_part=0.2)
    q = design(1)[0]
    nominal = ARM.paths.moment_arms(q)
    assert lengths.paths(np.zeros(len(lengths.muscle))).moment_arms(q) == pytest.approx(
        nominal, abs=1e-12
    )
    changed = lengths.paths(np.ones(len(lengths.muscle))).moment_arms(q)
    assert (changed[nominal == 0] == 0).all()
    assert (changed[nominal != 0] != nominal[nominal != 0]).all()


def test_noise_free_rows_are_reproduced():
    rows, equations, x = made_rows(2, sd=0.0, size=0.5)
    model = fit_muscle_model(rows, ARM, moment_arm_order=1)
    again = model.predict(rows.joint_angles, rows.activation)
    truth = equations.at(rows.joint_angles, np.asarray(rows.activation))
    # standard errors found from residuals are not taken below .01 % of the rows' size
    assert again.stiffness == pytest.approx(truth.stiffness(x)[0], abs=0.02)
    assert again.viscosity == pytest.approx(truth.viscosity(x)[0], abs=0.002)


@pytest.mark.study
@pytest.mark.parametrize("torque", [False, True])
def test_intervals_at_new_postures_and_activations_cover_truths_drawn_from_the_prior(torque):
    shares = []
    for seed in range(14):
        rows, equations, x = made_rows(seed, sd=1.0)
        model = fit_muscle_model(rows, ARM, moment_arm_order=1, torque=torque)
        q, alpha = new_conditions(seed)
        predicted = model.predict(q, alpha)
        off = np.abs(predicted.stiffness - equations.at(q, alpha).stiffness(x)[0])
        shares.append(float((off <= predicted.half_width("stiffness")).mean()))
    error = np.std(shares, ddof=1) / np.sqrt(len(shares))
    # the tension is exactly in proportion here, which the intervals with torque do not count on
    assert abs(np.mean(shares) - 0.95) <= 4 * error or (torque and np.mean(shares) > 0.95)


def test_torque_and_a_narrower_prior_narrow_the_intervals(fitted):
    rows = made_rows(1, sd=1.0)[0]
    q, alpha = new_conditions(1)
    plain = fitted.predict(q, alpha).sd("stiffness").mean()
    with_torque = fit_muscle_model(rows, ARM, moment_arm_order=1, torque=True)
    narrow = fit_muscle_model(rows, ARM, moment_arm_order=1, prior_percent=5.0)
    assert with_torque.predict(q, alpha).sd("stiffness").mean() < plain
    assert narrow.predict(q, alpha).sd("stiffness").mean() < plain


def test_stiffness_is_positive_and_the_certificate_no_larger_than_any_sample(fitted):
    rng = np.random.default_rng(0)
    q = rng.uniform(*fitted.box.T, (400, 2))
    alpha = rng.uniform(0, fitted.highest, (400, 6))
    sampled = np.linalg.eigvalsh(fitted.predict(q, alpha).stiffness_matrices)[:, 0].min()
    certificate = fitted.smallest_eigenvalue()
    assert 0 < certificate <= sampled + 1e-2
    inner = np.array([[0.9, 1.1], [1.4, 1.6]])
    assert fitted.smallest_eigenvalue(inner) >= certificate
    assert (
        np.diff(fitted.muscle_stiffness(np.linspace(0, 0.3, 20)[:, None] * np.ones(6)), axis=0) >= 0
    ).all()


def test_json_and_back_predicts_the_same(fitted):
    back = MuscleModel.from_plain(json.loads(json.dumps(fitted.as_plain(), allow_nan=False)))
    q, alpha = new_conditions(2)
    for name in ("stiffness", "viscosity", "stiffness_covariance", "reasons"):
        assert np.array_equal(
            getattr(back.predict(q, alpha), name), getattr(fitted.predict(q, alpha), name)
        )
    assert back.summary == fitted.summary


@pytest.mark.parametrize(
    "change",
    [
        {"parameters": [1.0]},
        {"muscle": [0.5]},
        {"muscle": [77] * 18},
        {"highest": [0.0] * 6},
        {"exponents": "no"},
        {"box": [[1.0, 0.0], [0.0, 1.0]]},
        {"quality": 3},
        {"curvature": 1},
    ],
)
def test_a_file_that_is_no_model_is_refused(fitted, change):
    with pytest.raises(InputError):
        MuscleModel.from_plain({**fitted.as_plain(), **change}).predict(NOMINAL, np.zeros(6))


def test_extrapolation_is_flagged_with_its_reason(fitted):
    assert fitted.predict(NOMINAL, HIGHEST / 2).reasons == ("",)
    far = fitted.predict([0.2, 2.3], HIGHEST / 2)
    assert far.reasons == ("posture outside of the measured ones",)
    strong = np.full(6, 0.1)
    strong[5] = 0.8
    assert "triceps_long" in fitted.predict(NOMINAL, strong).reasons[0]
    assert fitted.predict(np.tile(NOMINAL, (3, 1)), strong).extrapolated.all()
    with pytest.raises(InputError, match="as many"):
        fitted.predict(np.tile(NOMINAL, (3, 1)), np.zeros((2, 6)))
    with pytest.raises(InputError):
        fitted.predict([1.0, 2.0, 3.0], np.zeros(6))


def test_what_the_rows_do_not_tell_is_said(fitted):
    said = " ".join(fitted.warnings)
    assert "the prior the rest" in said
    assert "K_passive_s" in said
    assert "arm_pectoralis_major_s0" in said


def test_a_wrong_arm_is_warned_of():
    rows = made_rows(1, sd=1.0)[0]
    wrong = fit_muscle_model(rows, arm_named("arm26"), moment_arm_order=0)
    rng = np.random.default_rng(0)
    q, alpha = rng.uniform(*wrong.box.T, (2000, 2)), rng.uniform(0, 0.3, (2000, 6))
    negative = np.linalg.eigvalsh(wrong.predict(q, alpha).stiffness_matrices).min() < 0
    warned = any("not positive definite" in w for w in wrong.warnings)
    assert warned == (wrong.smallest_eigenvalue() <= 0)
    assert warned or not negative
    shuffled = np.random.default_rng(2).permutation(rows.n_rows)
    noise = replace(rows, activation=np.asarray(rows.activation)[shuffled])
    assert any("no better than noise" in w for w in fit_muscle_model(noise, ARM).warnings)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"moment_arm_order": 4}, "moment_arm_order"),
        ({"activation_order": 0}, "activation_order"),
        ({"prior_percent": 0.0}, "prior_percent"),
        ({"proportion_sd": -1.0}, "proportion_sd"),
        ({"torque": True, "torque_sd": -1.0}, "torque_sd"),
    ],
)
def test_options_out_of_range_are_refused(options, said):
    with pytest.raises(InputError, match=said):
        fit_muscle_model(made_rows(1, sd=1.0)[0], ARM, **options)


def test_rows_that_cannot_do_are_refused():
    rows = made_rows(1, sd=1.0)[0]
    idle = np.array(rows.activation)
    idle[:, 2] = 0.0
    with pytest.raises(NotIdentifiableError, match="never active: brachialis"):
        fit_muscle_model(replace(rows, activation=idle), ARM)
    with pytest.raises(InputError, match="without activation"):
        fit_muscle_model(replace(rows, activation=None), ARM)
    with pytest.raises(InputError, match="torque asked for"):
        fit_muscle_model(replace(rows, torque=None), ARM, torque=True)
    arms = ARM.paths.moment_arms([1.0, 1.5])
    arms[3] = 1e-300
    slack = replace(ARM, paths=constant_paths(ARM.paths.muscles, arms))
    with pytest.raises(InputError, match=f"{ARM.paths.muscles[3]} has no moment arm"):
        fit_muscle_model(rows, slack)


def test_same_rows_same_bits():
    rows = made_rows(1, sd=1.0)[0]
    first, again = (fit_muscle_model(rows, ARM, moment_arm_order=0, seed=3) for _ in range(2))
    assert first.as_plain() == again.as_plain()


def test_rows_are_whitened_or_refused_where_one_is_known_without_error():
    factor = np.random.default_rng(5).normal(size=(4, 3, 3))
    covariance = factor @ factor.transpose(0, 2, 1)
    L = whitening(covariance)
    np.testing.assert_allclose(L @ covariance @ L.transpose(0, 2, 1), [np.eye(3)] * 4, atol=1e-9)
    covariance[2] = np.diag([1.0, 1e-300**2, 1.0])
    with pytest.raises(EstimationError, match="without error"):
        whitening(covariance)
