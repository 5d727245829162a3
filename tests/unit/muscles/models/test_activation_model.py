"""Stiffness over activation: truths recovered, limits, what is refused, files."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import nnls

from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.limb.arm.muscular_arms import arm_named
from armimpedance.muscles.models.activation.equations import muscle_patterns
from armimpedance.muscles.models.activation.fit import fit_activation_model
from armimpedance.muscles.models.activation.model import ActivationModel
from armimpedance.muscles.models.activation.models import ACTIVATION_MODELS
from armimpedance.muscles.models.packed import matrix, triple
from armimpedance.muscles.models.rows import JointRows

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
    kappa: float = 75.0,
    proportion: np.ndarray | float = 1.0,
) -> JointRows:
    """Conditions of the arm itself, independent activations up to .4."""
    rng = np.random.default_rng(seed)
    alpha = rng.uniform(0.02, 0.3, (conditions, 6)) * (rng.random((conditions, 6)) < 0.7) + 0.1
    active = RISE * alpha + bend * BEND * alpha**2
    A = muscle_patterns(ARM, POSTURE, curvature=True, stiffness_per_tension=75.0)
    K = (REST + active) @ A + sd * rng.normal(size=(conditions, 3))
    B = (0.06 * REST + 0.05 * active) @ A + 0.05 * sd * rng.normal(size=(conditions, 3))
    tau = np.array([0.3, -0.2]) - (proportion * active) @ ARM.paths.moment_arms(POSTURE) / kappa
    # errors of at most .08: no activation is clipped at 0, which would make them one-sided
    seen = alpha + activation_sd * np.clip(rng.normal(size=alpha.shape), -4, 4)
    return JointRows(
        joint_angles=np.tile(POSTURE, (conditions, 1)),
        stiffness=matrix(K),
        viscosity=matrix(B),
        activation=seen,
        activation_sd=np.full(alpha.shape, activation_sd) if activation_sd else None,
        torque=tau if torque else None,
        labels=tuple(f"condition {i}" for i in range(conditions)),
    )


def truth(alpha: np.ndarray, patterns: np.ndarray, bend: float = 0.0) -> np.ndarray:
    return (REST + RISE * alpha + bend * BEND * alpha**2) @ patterns


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
    stiffness = truth(alpha, fitted.patterns, bend=float(order > 1))
    assert predicted.stiffness == pytest.approx(stiffness, abs=1e-5)
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


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"patterns": [[1.0]]}, "patterns"),
        ({"order": 1.5}, "order"),
        ({"stiffness": "many"}, "stiffness"),
        ({"dof": 0.0}, "degrees of freedom"),
        ({"muscles": 3}, "muscles"),
        ({"extra": 1}, "extra"),
        ({"summary": {}}, "summary"),
        ({"leverage_limit": None}, "leverage_limit"),
    ],
)
def test_a_file_that_is_no_model_is_refused(change, said):
    plain = fit_activation_model(made_rows(sd=1.0), ARM, order=1).as_plain()
    with pytest.raises(InputError, match=said):
        ActivationModel.from_plain({**plain, **change})
    with pytest.raises(InputError):
        ActivationModel.from_plain([])


@pytest.mark.study
@pytest.mark.first_cases(1)
@pytest.mark.parametrize("model", ACTIVATION_MODELS)
def test_left_out_r_is_that_of_fits_without_the_condition(model):
    rows = made_rows(sd=3.0, conditions=24)
    fitted = fit_activation_model(rows, ARM, order=1, model=model)
    alone = []
    for i in range(rows.n_rows):
        others = fit_activation_model(
            rows.select(np.arange(rows.n_rows) != i), ARM, order=1, model=model
        )
        alone.append(others.predict(rows.activation[i]).stiffness[0])
    measured = triple(rows.stiffness)
    for e in range(3):
        r = np.corrcoef(measured[:, e], np.array(alone)[:, e])[0, 1]
        # bernstein: the range is that of the remaining conditions
        tolerance = 1e-9 if model == "polynomial" else 0.01
        assert fitted.quality[e].leave_one_out_r == pytest.approx(r, abs=tolerance)


def test_null_r_rises_with_the_order_and_the_squared_errors_of_a_matrix_fall():
    rows = made_rows(sd=5.0)
    fits = [fit_activation_model(rows, ARM, order=n) for n in (1, 2, 3)]
    for k in range(6):
        null = [fit.quality[k].null_r for fit in fits]
        assert sorted(null) == null
        assert fits[0].quality[k].r > null[0]
    for matrix_of in (slice(0, 3), slice(3, 6)):
        e = [sum(q.e for q in fit.quality[matrix_of]) for fit in fits]
        assert e[0] > e[1] > e[2]


def test_bernstein_never_makes_a_muscle_negative_where_least_squares_does():
    rng = np.random.default_rng(3)
    # noise as large as stiffness itself
    rows = made_rows(sd=80.0, conditions=26)
    bounded = fit_activation_model(rows, ARM, order=3, model="bernstein")
    free = fit_activation_model(rows, ARM, order=3)
    assert rest_misfit(bounded) < 1e-6
    assert rest_misfit(free) > 1.0
    assert any("falls with activation" in w for w in free.warnings)
    rising = fit_activation_model(rows, ARM, order=3, model="bernstein", increasing=True)
    alpha = np.sort(rng.uniform(*rising.activation_range.T, (50, 6)), axis=0)
    assert (np.diff(rising.muscle_stiffness(alpha), axis=0) >= -1e-6).all()
    assert not any("falls with activation" in w for w in rising.warnings)


def rest_misfit(model: ActivationModel) -> float:
    """How far K_0 is from one that nonnegative muscles and passive joints could make, N m/rad."""
    alpha = np.linspace(*model.activation_range.T, 400)
    least = -model.muscle_stiffness(alpha).min(axis=0)
    passive = np.array([[1.0, 0, 0], [0, 0, 1.0]])
    cone = np.vstack([model.patterns / np.linalg.norm(model.patterns, axis=1)[:, None], passive])
    return float(nnls(cone.T, model.stiffness[:3] - least @ model.patterns)[1])


def share_covered(fitted: ActivationModel, alpha: np.ndarray) -> float:
    predicted = fitted.predict(alpha)
    off = np.abs(predicted.stiffness - truth(alpha, fitted.patterns))
    return float((off <= predicted.half_width("stiffness")).mean())


def within(values: list[float], wanted: float, standard_errors: float = 4.0) -> bool:
    sd = np.std(values, ddof=1) / np.sqrt(len(values))
    return bool(abs(np.mean(values) - wanted) <= standard_errors * sd)


@pytest.mark.study
@pytest.mark.parametrize(("torque", "activation_sd"), [(False, 0.0), (True, 0.0), (False, 0.02)])
def test_intervals_cover_the_truth_as_often_as_they_say(torque, activation_sd):
    shares = []
    for seed in range(60):
        rows = made_rows(seed, sd=1.0, activation_sd=activation_sd)
        fitted = fit_activation_model(rows, ARM, order=1, torque=torque)
        shares.append(share_covered(fitted, new_activations(fitted)))
    # with torque exactly in proportion the intervals are wide: they allow that it is not
    assert within(shares, 0.95) or (torque and np.mean(shares) > 0.95)


@pytest.mark.study
def test_intervals_hold_where_tension_is_not_in_proportion_unless_it_is_said_to_be():
    honest, sure = [], []
    for seed in range(40):
        rng = np.random.default_rng(1000 + seed)
        rows = made_rows(seed, sd=2.0, proportion=1 + 0.1 * rng.normal(size=6))
        for sd, shares in ((0.1, honest), (1e-6, sure)):
            fitted = fit_activation_model(rows, ARM, order=1, torque=True, proportion_sd=sd)
            shares.append(share_covered(fitted, new_activations(fitted)))
    assert within(honest, 0.95) or np.mean(honest) > 0.95
    assert np.mean(sure) < 0.8


@pytest.mark.study
def test_torque_lowers_the_error():
    gain = []
    for seed in range(30):
        rows = made_rows(seed, sd=2.0)
        errors = []
        for torque in (False, True):
            fitted = fit_activation_model(rows, ARM, order=1, torque=torque)
            alpha = new_activations(fitted)
            errors.append(
                ((fitted.predict(alpha).stiffness - truth(alpha, fitted.patterns)) ** 2).mean()
            )
        gain.append(errors[0] - errors[1])
    assert np.mean(gain) > 3 * np.std(gain, ddof=1) / np.sqrt(len(gain))


@pytest.mark.study
def test_errors_of_activation_do_not_shrink_the_slopes_if_they_are_known():
    known, unknown = [], []
    for seed in range(30):
        rows = made_rows(seed, sd=0.5, activation_sd=0.02)
        for given, slopes in ((rows, known), (replace(rows, activation_sd=None), unknown)):
            fitted = fit_activation_model(given, ARM, order=1)
            slopes.append(float((fitted.stiffness[3:] / RISE).mean()))
    assert within(known, 1.0)
    assert np.mean(unknown) < 1 - 4 * np.std(unknown, ddof=1) / np.sqrt(len(unknown))


@pytest.mark.study
def test_stiffness_per_tension_is_found_and_told():
    found = []
    for seed in range(20):
        rows = made_rows(seed, sd=1.0, kappa=60.0)
        fitted = fit_activation_model(rows, ARM, order=1, torque=True, stiffness_per_tension="fit")
        found.append(fitted.stiffness_per_tension)
    assert within(found, 60.0)
    stated = fit_activation_model(rows, ARM, order=1, torque=True, stiffness_per_tension=50.0)
    assert stated.stiffness_per_tension == 50.0
    with pytest.raises(InputError, match="without torque"):
        fit_activation_model(rows, ARM, order=1, stiffness_per_tension="fit")


def on_a_line(count: int = 7) -> JointRows:
    """One pattern of co-contraction, its six muscles in nearly fixed proportions."""
    share = np.array([0.34, 0.26, 0.23, 0.36, 0.97, 1.03])
    rows = made_rows(conditions=count)
    alpha = np.linspace(0.0, 0.3, count)[:, None] * share
    return replace(rows, activation=alpha)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("torque", [False, True])
def test_one_pattern_of_activation_is_refused_naming_muscles(order, torque):
    with pytest.raises(NotIdentifiableError, match="cannot tell the muscles apart") as refused:
        fit_activation_model(on_a_line(25), ARM, order=order, torque=torque)
    assert set(refused.value.parameters) >= {"pectoralis_major", "infraspinatus"}


def test_a_muscle_that_never_varies_is_named():
    rows = made_rows()
    alpha = np.array(rows.activation)
    alpha[:, 3] = 0.1
    with pytest.raises(NotIdentifiableError, match="triceps_lateral never varies"):
        fit_activation_model(replace(rows, activation=alpha), ARM, order=1)


def test_too_few_conditions_are_refused():
    with pytest.raises(NotIdentifiableError, match="4 conditions give 12 numbers for 15"):
        fit_activation_model(made_rows(conditions=4), ARM, order=2)


def test_activation_that_is_all_error_is_refused_and_half_of_it_warned_of():
    rows = made_rows(sd=1.0)
    spread = np.asarray(rows.activation).std(axis=0)
    lost = replace(rows, activation_sd=np.tile(spread, (rows.n_rows, 1)))
    with pytest.raises(NotIdentifiableError, match="errors of the activation explain"):
        fit_activation_model(lost, ARM, order=1)
    doubtful = replace(rows, activation_sd=np.tile(spread / 4, (rows.n_rows, 1)))
    warned = fit_activation_model(doubtful, ARM, order=1)
    assert any("doubtful" in w for w in warned.warnings)


def test_several_postures_are_refused_naming_the_row():
    rows = made_rows()
    q = np.array(rows.joint_angles)
    q[7, 1] += 0.2
    with pytest.raises(InputError, match="more than one posture: condition 7"):
        fit_activation_model(replace(rows, joint_angles=q), ARM, order=1)


@pytest.mark.parametrize(
    ("rows", "options", "said"),
    [
        (replace(made_rows(), activation=None), {}, "without activation"),
        (replace(made_rows(), activation=np.full((30, 5), 0.1)), {}, "5 muscles"),
        (made_rows(torque=False), {"torque": True}, "torque asked for"),
        (made_rows(), {"model": "cubic"}, "unknown activation model"),
        (made_rows(), {"order": 0}, "order 0"),
        (made_rows(), {"order": True}, "order True"),
        (made_rows(), {"increasing": True}, "cannot promise"),
        (made_rows(), {"torque": True, "torque_sd": 0.0}, "torque_sd"),
        (made_rows(), {"torque": True, "proportion_sd": 0.0}, "proportion_sd"),
        (made_rows(), {"stiffness_per_tension": -1.0}, "stiffness per tension"),
    ],
)
def test_what_cannot_be_fitted_is_told_in_one_line(rows, options, said):
    with pytest.raises(InputError, match=said) as refused:
        fit_activation_model(rows, ARM, **{"order": 1, **options})
    assert "\n" not in str(refused.value)


def test_extrapolation_is_flagged_with_its_reason():
    rows = made_rows(sd=1.0)
    fitted = fit_activation_model(rows, ARM, order=1)
    low, high = fitted.activation_range.T
    assert not fitted.predict(rows.activation).extrapolated.any()
    beyond = high.copy()
    beyond[2] = 0.9
    said = fitted.predict(beyond).reasons[0]
    assert said == "activation outside of the measured range: brachialis"
    assert "far from all measured" in fitted.predict(high).reasons[0]
    for wrong in (np.full(5, 0.1), np.full(6, 1.1), np.full(6, np.nan)):
        with pytest.raises(InputError):
            fitted.predict(wrong)


def test_order_of_rows_and_seed():
    rows = made_rows(sd=1.0)
    first = fit_activation_model(rows, ARM, order=2, torque=True, seed=4)
    again = fit_activation_model(rows, ARM, order=2, torque=True, seed=4)
    assert first.as_plain() == again.as_plain()
    turned = fit_activation_model(rows.select(np.arange(30)[::-1]), ARM, order=2, torque=True)
    alpha = new_activations(first)
    assert turned.predict(alpha).stiffness == pytest.approx(
        first.predict(alpha).stiffness, abs=1e-3
    )


def test_standard_errors_given_as_they_are_change_nothing_but_their_own_size():
    rows = made_rows(sd=1.0)
    equal = replace(rows, stiffness_sd=np.full((30, 2, 2), 0.01))
    alpha = new_activations(fit_activation_model(rows, ARM, order=1))
    plain, weighted = (fit_activation_model(r, ARM, order=1).predict(alpha) for r in (rows, equal))
    assert weighted.stiffness == pytest.approx(plain.stiffness, abs=1e-6)
    # far too small a stated error is corrected by the residuals
    assert weighted.sd("stiffness") == pytest.approx(plain.sd("stiffness"), rel=1e-3)
    stated = replace(rows, stiffness_sd=np.full((30, 2, 2), 50.0))
    wide = fit_activation_model(stated, ARM, order=1).predict(alpha)
    assert (wide.sd("stiffness") > 20 * plain.sd("stiffness")).all()
