"""Sums of squares over posture: positive semidefinite whatever the data, optimal, with a proof."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import EstimationError, InputError
from armimpedance.hand.still.cones import nearest_semidefinite
from armimpedance.muscles.models.packed import matrix, triple
from armimpedance.muscles.models.posture.certificate import (
    Gram,
    GramShape,
    coefficient_map,
    coefficients_of,
    exponents,
    monomials,
    proves,
    smallest_eigenvalues,
)
from armimpedance.muscles.models.posture.data import PostureData, posture_data
from armimpedance.muscles.models.posture.fit import fit_posture_model
from armimpedance.muscles.models.posture.models.polynomial import fit_polynomial
from armimpedance.muscles.models.posture.program import STRUCTURES, GramProgram, _Compiled, tangent
from armimpedance.muscles.models.posture.sos import PENALTIES, choose, posterior
from armimpedance.muscles.models.rows import JointRows
from armimpedance.muscles.models.workspace import AngleScaling, Region

LOW, HIGH = np.array([0.3, 0.8]), np.array([1.6, 2.2])
ARMS = np.array(
    [[0.0536, 0], [0.0536, 0], [0, 0.0316], [0, 0.0267], [0.0386, 0.0427], [0.0388, 0.03]]
)
MUSCLE_STIFFNESS = np.array([1498, 1498, 5957, 5957, 2134, 2134.0])


def postures(count=20, seed=0):
    return np.random.default_rng(seed).uniform(LOW, HIGH, (count, 2))


def muscles(q, *, order=2, seed=1):
    """A relaxed arm, about [[15, 6], [6, 16]] N m/rad; two-joint arms depend on both angles."""
    powers = exponents(order)
    c = np.random.default_rng(seed).normal(0, 0.1, (6, 2, len(powers)))
    c[:, :, 0] = 1.0
    c[:4, 0, powers[:, 1] > 0] = 0
    c[:4, 1, powers[:, 0] > 0] = 0
    u = (np.asarray(q) - (LOW + HIGH) / 2) / ((HIGH - LOW) / 2)
    G = ARMS * np.einsum("mjt,pt->pmj", c, monomials(u, powers))
    return np.einsum("m,pmi,pmj->pij", MUSCLE_STIFFNESS, G, G)


def hostile(seed, sd=20.0):
    """Symmetric matrices that no arm could have."""
    return matrix(np.random.default_rng(seed).normal(0, sd, (20, 3)))


def data_of(K, q, sd=None):
    rows = JointRows(q, K, K, sd, sd)
    return posture_data(rows, "K", AngleScaling.of(q))


def program_of(structure, order, q):
    scaled = AngleScaling.of(q).scaled(q)
    return GramProgram(STRUCTURES[structure](order), scaled, exponents(2 * order))


@pytest.fixture(scope="module")
def full():
    """The program of twenty postures at order 2."""
    return program_of("full", 2, postures())


@pytest.mark.parametrize(("model", "order"), [("sos", 2), ("box", 1), ("sos", 1)])
def test_noise_free_moment_arms_are_recovered(model, order):
    q, new = postures(), AngleScaling.of(postures()).grid(20)
    K = muscles(q, order=order)
    made = fit_posture_model(JointRows(q, K, 0.1 * K), order=order, model=model)
    found = made.predict(new)
    np.testing.assert_allclose(found.stiffness, triple(muscles(new, order=order)), atol=1e-3)
    np.testing.assert_allclose(found.viscosity, triple(muscles(new, order=order)) / 10, atol=1e-4)
    assert smallest_eigenvalues(found.stiffness).min() >= -1e-8


@pytest.mark.study
def test_hostile_data_make_least_squares_indefinite_and_never_a_sum_of_squares():
    q, K = postures(), hostile(0)
    rows = JointRows(q, K, hostile(1))
    near, far = AngleScaling.of(q).grid(50), AngleScaling.of(q).grid(9) * 30 - 20
    free = fit_posture_model(rows, order=2, model="polynomial")
    assert smallest_eigenvalues(free.predict(near).stiffness).min() < -1
    sos = fit_posture_model(rows, order=2, model="sos")
    box = fit_posture_model(rows, order=1, model="box")
    for at, models in ((near, (sos, box)), (far, (sos,))):
        for model in models:
            for values in (model.predict(at).stiffness, model.predict(at).viscosity):
                size = np.abs(values).max()
                assert smallest_eigenvalues(values).min() >= -1e-8 * max(size, 1)
    assert sos.stiffness.certificate.promise == "everywhere"
    assert box.stiffness.certificate.promise == "on the workspace"


@pytest.mark.study
def test_stiffness_that_falls_to_the_edges_of_the_box_is_within_the_box_model_only():
    q = postures()
    scaling = AngleScaling.of(q)

    def peaked(at):
        s, e = scaling.scaled(at).T
        return (1.9 - 0.9 * s**2 - 0.9 * e**2)[:, None, None] * np.array([[10, 4], [4, 10.0]])

    rows, at = JointRows(q, peaked(q), peaked(q)), scaling.grid(20)
    wrong = {}
    for model in ("box", "sos"):
        made = fit_posture_model(rows, order=1, model=model)
        wrong[model] = np.abs(made.predict(at).stiffness - triple(peaked(at))).max()
        assert smallest_eigenvalues(made.predict(at).stiffness).min() >= -1e-8
        outside = smallest_eigenvalues(made.predict(3 * HIGH).stiffness)[0]
        assert (outside < -1) == (model == "box")
    assert wrong["box"] < 1e-3
    assert wrong["sos"] > 1


@pytest.mark.parametrize(("structure", "order"), [("full", 2), ("separable", 2), ("box", 1)])
def test_gram_matrices_are_the_matrix_at_every_posture(structure, order):
    rng = np.random.default_rng(4)
    u = rng.uniform(-2, 2, (15, 2))
    for shape in STRUCTURES[structure](order):
        half = rng.normal(size=(shape.size, shape.size))
        Q = half @ half.T
        n = len(shape.shoulder)
        B = np.zeros((15, 2, shape.size))
        B[:, 0, :n], B[:, 1, n:] = monomials(u, shape.shoulder), monomials(u, shape.elbow)
        s, e = u.T
        factor = {"1": 1 + 0 * s, "1 - s^2": 1 - s**2, "1 - e^2": 1 - e**2}[shape.multiplier]
        # K (15, 2, 2) = m B^T Q B, written out
        expected = factor[:, None, None] * np.einsum("pai,ij,pbj->pab", B, Q, B)
        gram = Gram(shape.multiplier, shape.shoulder, shape.elbow, Q)
        found = monomials(u, exponents(2 * order)) @ coefficients_of([gram], order)
        np.testing.assert_allclose(found, triple(expected), rtol=1e-10, atol=1e-9)


def test_single_joint_muscles_are_within_the_two_joint_gram_matrix():
    rng = np.random.default_rng(5)
    shape = STRUCTURES["full"](2)[0]
    T = coefficient_map(shape, exponents(4)).reshape(45, -1)
    # v(s) v(s)^T on the shoulder alone: a block of its own would be a Gram matrix of this one
    v = np.zeros(12)
    v[[0, 1, 3]] = rng.normal(size=3)
    assert shape.shoulder[[0, 1, 3], 1].tolist() == [0, 0, 0]
    single = (T @ np.outer(v, v).ravel()).reshape(3, 15)
    assert np.abs(single[1:]).max() == 0
    assert np.abs(single[0]).max() > 0


def test_the_certificate_proves_its_own_coefficients_only():
    q = postures()
    K = muscles(q) + hostile(2, sd=1.0)
    program = program_of("full", 2, q)
    solution = choose(program, data_of(K, q)).solution
    grams, C = program.grams(solution), np.array(solution.coefficients)
    assert proves(grams, C, 2)
    C[3, 0] *= 1.001
    assert not proves(grams, C, 2)
    with pytest.raises(InputError, match="proves nothing"):
        replace(grams[0], Q=grams[0].Q - 1e-3 * np.eye(12))
    with pytest.raises(InputError, match="multiplier"):
        GramShape("s^2 - 1", exponents(1), exponents(1))


@pytest.mark.parametrize("seed", range(4))
def test_one_matrix_for_all_postures_is_the_nearest_semidefinite_one(seed):
    q = postures()
    K = hostile(seed, sd=5.0) + np.diag([3.0, -3.0])
    program = program_of("full", 0, q)
    found = program.solve(triple(K), np.tile([1, np.sqrt(2), 1], (20, 1)), 0.0).coefficients[0]
    # closed form: nearest to the mean in the Frobenius norm, u = (m, x, y)
    ss, se, ee = triple(K).mean(axis=0)
    u = nearest_semidefinite(np.eye(3), np.array([(ss + ee) / 2, (ss - ee) / 2, se]), 2).u
    np.testing.assert_allclose(found, [u[0] + u[1], u[2], u[0] - u[1]], atol=1e-6)


@pytest.mark.parametrize("cost", [0.0, 0.1, 30.0])
def test_no_other_gram_matrix_costs_less(full, cost):
    q, rng = postures(), np.random.default_rng(6)
    k, w = triple(muscles(q) + hostile(3, sd=2.0)), np.ones((20, 3))

    def objective(Q):
        fitted = np.einsum("paij,ij->pa", full.regressors[0], Q)
        return ((fitted - k) ** 2).sum() + cost * full.costs[0] @ np.diag(Q)

    best = full.solve(k, w, cost).Q[0]
    least = objective(best)
    values, vectors = np.linalg.eigh(best)
    root = vectors * np.sqrt(np.maximum(values, 0))
    for size in (1e-3, 1e-2, 0.1, 1.0):
        for _ in range(50):
            other = root + size * rng.normal(size=(12, 12))
            assert objective(other @ other.T) >= least - 1e-7 * (1 + least)


@pytest.mark.first_cases(1)
@pytest.mark.parametrize("cost", [3.0, 0.3])
def test_the_hat_matrix_is_how_the_fit_moves_with_the_data(full, cost):
    q = postures()
    k, w = triple(muscles(q) + hostile(4, sd=1.0)), np.ones((20, 3))
    still = full.solve(k, w, cost)
    made = tangent(full, still, k, w, cost)
    step, moved = 1e-2, np.zeros((20, 3))
    for p in range(20):
        for j in range(3):
            e = np.zeros((20, 3))
            e[p, j] = step
            changed = full.solve(k + e, w, cost).coefficients - still.coefficients
            moved[p, j] = (full.X[p] @ changed[:, j]) / step
    # differences of one side, of noise 1
    np.testing.assert_allclose(made.spent, moved.sum(axis=0), atol=0.05)


def test_without_noise_or_cost_the_posterior_is_that_of_least_squares():
    # data well inside of the cone: the sum of squares is the free fit
    q = postures()
    K = np.array([[15, 6], [6, 16]]) + hostile(5, sd=0.1)
    sd = np.full_like(K, 0.1)
    data, program = data_of(K, q, sd), program_of("box", 1, q)
    solution = program.solve(data.values, data.weights, 0.0)
    made = tangent(program, solution, data.values, data.weights, 0.0)
    X = program.X
    free = np.linalg.lstsq(X, data.values, rcond=None)[0]
    np.testing.assert_allclose(solution.coefficients, free, atol=1e-5)
    expected = np.kron(np.eye(3), 0.01 * np.linalg.inv(X.T @ X))
    np.testing.assert_allclose(made.covariance, expected, atol=1e-6)
    np.testing.assert_allclose(made.spent, [6, 6, 6], atol=1e-4)


def test_rough_moment_arms_are_charged_more_when_noise_is_larger(full):
    q = postures()
    penalties = []
    for sd in (1e-3, 0.3, 3.0):
        K = muscles(q) + hostile(6, sd=sd)
        penalties.append(choose(full, data_of(K, q, np.full_like(K, sd))).penalty)
    assert penalties == sorted(penalties)
    assert penalties[0] < penalties[-1]
    assert set(penalties) <= set(PENALTIES)


def test_with_noise_it_predicts_better_than_least_squares_inside_and_outside(full):
    q = postures()
    scaling = AngleScaling.of(q)
    u = scaling.scaled(scaling.grid(15))
    ring = 1.3 * u[np.abs(u).max(axis=1) > 0.8]
    hull = u[Region.of(scaling.scaled(q), tolerance=0.0).contains(u)]
    errors, held = {"sos": [], "least": []}, []
    for seed in range(5):
        K = muscles(q) + hostile(100 + seed, sd=1.0)
        data = data_of(K, q, np.ones_like(K))
        chosen = choose(full, data)
        least = fit_polynomial(data, 2, np.random.default_rng(0), lambda _d, _t: None)
        V, _ = posterior(chosen.tangent, data)
        for name, C in (("sos", chosen.solution.coefficients), ("least", least.coefficients)):
            wrong = [
                monomials(at, exponents(4)) @ C - triple(muscles(scaling.angles(at)))
                for at in (hull, ring)
            ]
            errors[name].append([(one**2).mean() for one in wrong])
            if name == "sos":
                X = monomials(hull, exponents(4))
                blocks = V.reshape(3, 15, 3, 15)
                variance = np.einsum("pt,atav,pv->pa", X, blocks, X)
                held.append((np.abs(wrong[0]) <= 1.96 * np.sqrt(variance)).mean())
    rmse = {name: np.sqrt(np.mean(one, axis=0)) for name, one in errors.items()}
    assert rmse["sos"][0] <= 0.60
    assert (rmse["sos"] < rmse["least"]).all()
    # five fits, errors within one fit alike: a standard error of about 6 %; three of them
    assert 0.77 <= np.mean(held) <= 1.0


@pytest.mark.study
def test_a_seed_gives_the_same_bits():
    q = postures(12)
    rows = JointRows(q, muscles(q), 0.1 * muscles(q) + hostile(7, sd=1.0)[:12])
    one, again, other = (
        fit_posture_model(rows, order=1, model="sos", seed=seed) for seed in (3, 3, 4)
    )
    assert one.as_plain() == again.as_plain()
    # the seed is that of the shuffles alone
    np.testing.assert_array_equal(one.stiffness.coefficients, other.stiffness.coefficients)
    assert one.quality[0].null_r != other.quality[0].null_r


def chosen(q, K, sd=None):
    """Predictions at the postures, their covariances, and the penalty of the default model."""
    data, program = data_of(K, q, sd), program_of("full", 2, q)
    made = choose(program, data)
    V, _ = posterior(made.tangent, data)
    blocks = V.reshape(3, 15, 3, 15)
    sd = np.sqrt(np.einsum("pt,atav,pv->pa", program.X, blocks, program.X))
    return program.X @ made.solution.coefficients, sd, made.penalty


def test_the_order_of_the_rows_does_not_matter():
    q = postures()
    K = muscles(q) + hostile(7, sd=1.0)
    one, turned = chosen(q, K), chosen(q[::-1], K[::-1])
    np.testing.assert_allclose(turned[0][::-1], one[0], atol=1e-5)
    np.testing.assert_allclose(turned[1][::-1], one[1], rtol=1e-3)


def test_an_arm_with_its_joints_exchanged_has_its_impedance_exchanged():
    q = postures()
    K = muscles(q) + hostile(8, sd=1.0)
    one, swapped = chosen(q, K), chosen(q[:, ::-1], K[:, ::-1, ::-1])
    np.testing.assert_allclose(swapped[0][:, ::-1], one[0], atol=1e-5)
    np.testing.assert_allclose(swapped[1][:, ::-1], one[1], rtol=1e-3)


@pytest.mark.parametrize("told", [False, True])
def test_units_of_stiffness_do_not_matter(told):
    q = postures()
    K = muscles(q) + hostile(9, sd=1.0)
    sd = np.ones_like(K) if told else None
    one, small = chosen(q, K, sd), chosen(q, 1e-3 * K, 1e-3 * sd if told else None)
    assert one[2] == small[2]
    np.testing.assert_allclose(small[0], 1e-3 * one[0], rtol=1e-5)
    np.testing.assert_allclose(small[1], 1e-3 * one[1], rtol=1e-3)


def test_eleven_postures_are_enough_for_separable_arms_only():
    q = postures(11, seed=1)
    K = muscles(q)
    rows = JointRows(q, K, K)
    assert fit_posture_model(rows, order=2, model="separable").stiffness.structure == "separable"
    with pytest.raises(InputError, match="11 postures for the 15 coefficients"):
        fit_posture_model(rows, order=2, model="sos")


def test_negative_stiffness_is_fitted_by_none():
    q = postures()
    K = -muscles(q)
    made = fit_posture_model(JointRows(q, K, 0 * K), order=1, model="sos")
    assert np.abs(made.predict(q).stiffness).max() < 1e-3
    assert np.abs(made.predict(q).viscosity).max() < 1e-6


@pytest.mark.parametrize("status", ["optimal_inaccurate", "infeasible", "user_limit"])
def test_a_solver_that_does_not_end_optimal_gives_no_answer(full, monkeypatch, status):
    monkeypatch.setattr(_Compiled, "_end", lambda _self, _tolerance: status)
    with pytest.raises(EstimationError, match=f"ended {status}, not optimal"):
        full.solve(triple(muscles(postures())), np.ones((20, 3)), 1.0)


def test_standard_errors_too_far_apart_are_refused():
    q = postures()
    K, sd = muscles(q), np.ones((20, 2, 2))
    sd[3] = 1e-5
    with pytest.raises(InputError, match="standard errors of K from 1e-05 to 1"):
        fit_posture_model(JointRows(q, K, K, sd, np.ones_like(sd)), order=2, model="sos")


def test_shuffled_data_keep_each_measurement_with_its_error():
    q = postures()
    K = muscles(q) + hostile(10, sd=1.0)
    data = data_of(K, q, np.random.default_rng(0).uniform(1, 2, K.shape))
    order = np.random.default_rng(1).permutation(20)
    mixed = data.shuffled(order)
    assert isinstance(mixed, PostureData)
    np.testing.assert_array_equal(mixed.scaled, data.scaled)
    np.testing.assert_array_equal(mixed.values, data.values[order])
    np.testing.assert_array_equal(mixed.weights, data.weights[order])
