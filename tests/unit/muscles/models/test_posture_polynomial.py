"""Free polynomials over posture: they recover polynomials, and say what they cannot know."""

from __future__ import annotations

import numpy as np
import pytest

from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.muscles.models.packed import triple
from armimpedance.muscles.models.posture.certificate import exponents, monomials
from armimpedance.muscles.models.posture.fit import fit_posture_model
from armimpedance.muscles.models.rows import JointRows

BOX = np.array([[0.3, 1.6], [0.8, 2.2]])


def postures(count, seed=0):
    return np.random.default_rng(seed).uniform(*BOX.T, (count, 2))


def arms_truth(order, seed=1):
    """K = G^T K_m G at joint angles (P, 2), moment arms polynomials of an order."""
    rng = np.random.default_rng(seed)
    powers = exponents(order)
    arm = rng.normal(0, 0.4, (4, 2, len(powers)))
    arm[:, :, 0] += 2.0

    def at(q):
        G = np.einsum("mjt,pt->pmj", arm, monomials(np.asarray(q) - BOX.mean(axis=1), powers))
        return np.einsum("pmi,pmj->pij", G, G)

    return at


def noisy(truth, q, seed, sd=1.0):
    return truth(q) + np.random.default_rng(seed).normal(0, sd, (len(q), 2, 2))


def polynomial(q, K, order, **options):
    rows = JointRows(q, K, 0.1 * K, **options)
    return fit_posture_model(rows, order=order, model="polynomial")


@pytest.mark.parametrize("order", [0, 1, 2])
def test_noise_free_polynomial_arms_are_recovered_everywhere(order):
    truth, q, new = arms_truth(order), postures(20), postures(50, seed=2)
    found = polynomial(q, truth(q), order).predict(new)
    np.testing.assert_allclose(found.stiffness, triple(truth(new)), atol=1e-8)
    np.testing.assert_allclose(found.viscosity, triple(0.1 * truth(new)), atol=1e-9)


def test_the_box_that_angles_are_scaled_to_changes_nothing():
    q, new = postures(20), postures(9, seed=2)
    rows = JointRows(q, noisy(arms_truth(2), q, 0), noisy(arms_truth(2), q, 1))
    own = fit_posture_model(rows, order=2, model="polynomial").predict(new)
    stated = fit_posture_model(rows, order=2, model="polynomial", box=[[0, 2], [0.5, 2.5]])
    other = stated.predict(new)
    np.testing.assert_allclose(own.stiffness, other.stiffness, rtol=1e-9)
    np.testing.assert_allclose(own.sd("viscosity"), other.sd("viscosity"), rtol=1e-7)


def test_both_cross_terms_get_one_polynomial_that_of_their_mean():
    q = postures(20)
    K = noisy(arms_truth(1), q, 0)
    both = polynomial(q, K, 1)
    mean = polynomial(q, (K + K.transpose(0, 2, 1)) / 2, 1)
    np.testing.assert_allclose(both.stiffness.coefficients, mean.stiffness.coefficients)
    r = {quality.element: quality.r for quality in both.quality}
    assert r["K_se"] != r["K_es"]


def test_a_row_with_a_large_standard_error_does_not_count():
    q = postures(12)
    K = noisy(arms_truth(1), q, 0)
    K[5] += 50.0
    sd = np.ones_like(K)
    sd[5] = 1e6
    heavy = polynomial(q, K, 1, stiffness_sd=sd, viscosity_sd=0.1 * sd).predict(q)
    left = np.arange(12) != 5
    without = polynomial(q[left], K[left], 1).predict(q)
    np.testing.assert_allclose(heavy.stiffness, without.stiffness, atol=1e-6)


@pytest.mark.study
def test_intervals_hold_the_truth_as_often_as_they_say():
    truth, q, at = arms_truth(1), postures(14), postures(1, seed=5)
    held = []
    for seed in range(100):
        found = polynomial(q, noisy(truth, q, seed), 1).predict(at)
        held.append(np.abs(found.stiffness - triple(truth(at))) <= found.half_width("stiffness"))
    # 300 intervals of 95 %, those of one fit nearly independent: 3 standard errors are 3.8 %
    assert 0.95 - 0.038 <= np.mean(held) <= 0.95 + 0.038


def test_standard_errors_that_are_too_small_are_scaled_and_too_large_ones_kept():
    q = postures(20)
    K = noisy(arms_truth(1), q, 0)
    made = {}
    for size in (0.01, 1.0, 100.0):
        sd = np.full_like(K, size)
        made[size] = polynomial(q, K, 1, stiffness_sd=sd, viscosity_sd=0.1 * sd)
    small, large = made[0.01].predict(q), made[100.0].predict(q)
    plain = polynomial(q, K, 1).predict(q)
    np.testing.assert_allclose(small.sd("stiffness"), plain.sd("stiffness"), rtol=1e-9)
    assert small.dof == plain.dof == 14
    assert np.isinf(large.dof)
    # a mean of 20 rows would have 100/sqrt(20) = 22
    assert (large.sd("stiffness")[:, 0] > 22).all()


def test_leaving_a_row_out_is_what_a_fit_without_it_predicts():
    q = postures(18)
    K = noisy(arms_truth(1), q, 0)
    predicted = []
    for row in range(18):
        rest = np.arange(18) != row
        predicted.append(polynomial(q[rest], K[rest], 1).predict(q[row]).stiffness[0])
    expected = np.corrcoef(K[:, 0, 1], np.array(predicted)[:, 1])[0, 1]
    quality = {one.element: one for one in polynomial(q, K, 1).quality}
    assert quality["K_se"].leave_one_out_r == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(("order", "coefficients"), [(1, 6), (2, 15)])
def test_noise_alone_gives_the_r_of_its_degrees_of_freedom(order, coefficients):
    q = postures(20)
    K = np.random.default_rng(3).normal(0, 1, (20, 2, 2))
    quality = {one.element: one for one in polynomial(q, K, order).quality}
    # E(R^2) = (p - 1)/(P - 1) for normal noise
    expected = np.sqrt((coefficients - 1) / 19)
    for element in ("K_ss", "K_ee", "B_ss", "B_ee"):
        assert quality[element].null_r == pytest.approx(expected, abs=0.03)


def test_a_constant_explains_nothing():
    q = postures(20)
    model = polynomial(q, noisy(arms_truth(2), q, 0), 0)
    for one in model.quality:
        assert one.r == one.leave_one_out_r == one.null_r == 0
    assert [p.name for p in model.summary.parameters] == [
        *("K_ss[1]", "K_se[1]", "K_ee[1]", "B_ss[1]", "B_se[1]", "B_ee[1]")
    ]


def test_scaled_angles_are_far_better_conditioned_than_radians():
    q = postures(20)
    summary = polynomial(q, arms_truth(2)(q), 2).summary
    assert summary.cond_raw > 100 * summary.cond_scaled
    assert summary.rank == 15


def test_a_grid_of_four_by_five_angles_cannot_tell_a_fourth_power():
    s, e = np.meshgrid(np.linspace(0.3, 1.6, 5), np.linspace(0.8, 2.2, 4), indexing="ij")
    q = np.stack([s, e], axis=-1).reshape(-1, 2)
    for model in ("polynomial", "sos", "box"):
        rows = JointRows(q, arms_truth(2)(q), arms_truth(2)(q))
        with pytest.raises(NotIdentifiableError, match="rank 14 of 15") as caught:
            fit_posture_model(rows, order=2, model=model)
        assert "e^4" in caught.value.parameters
        assert "s^4" not in caught.value.parameters


def test_postures_on_a_line_are_refused_with_the_terms_that_are_alike():
    q = np.linspace([0.3, 0.8], [1.6, 2.2], 20)
    with pytest.raises(NotIdentifiableError, match="rank 3 of 6") as caught:
        polynomial(q, arms_truth(1)(q), 1)
    assert {"s", "e"} <= set(caught.value.parameters)
    assert polynomial(q, arms_truth(0)(q), 0).predict(q[0]).stiffness.shape == (1, 3)


def test_equal_postures_allow_a_constant_only():
    q = np.tile([[1.0, 1.5]], (6, 1))
    K = noisy(arms_truth(0), q, 0)
    assert polynomial(q, K, 0).predict(q[0]).stiffness == pytest.approx(
        triple(K).mean(axis=0)[None]
    )
    with pytest.raises(NotIdentifiableError, match="all postures are the same"):
        polynomial(q, K, 1)


def test_too_few_postures_are_told_how_many_are_needed():
    q = postures(20)
    K = noisy(arms_truth(1), q, 0)
    for model in ("polynomial", "sos"):
        with pytest.raises(InputError, match="14 postures for the 15 coefficients of order 2"):
            fit_posture_model(JointRows(q[:14], K[:14], K[:14]), order=2, model=model)
        with pytest.raises(InputError, match="none to spare.*16 postures or more"):
            fit_posture_model(JointRows(q[:15], K[:15], K[:15]), order=2, model=model)
    sd = np.ones((15, 2, 2))
    through = polynomial(q[:15], K[:15], 2, stiffness_sd=sd, viscosity_sd=sd)
    assert any("cannot be judged" in warning for warning in through.summary.warnings)
    assert all(np.isnan(one.adjusted_r2) for one in through.quality)


def test_an_indefinite_fit_is_said_where_it_is():
    q = postures(20)
    model = polynomial(q, noisy(arms_truth(2), q, 0, sd=8.0), 2)
    found = model.stiffness.certificate
    assert found.promise == "nowhere proved"
    assert found.smallest_eigenvalue < 0
    there = model.predict(found.at).stiffness_matrices[0]
    assert np.linalg.eigvalsh(there)[0] == pytest.approx(found.smallest_eigenvalue)
    assert any("K is not positive definite" in warning for warning in model.summary.warnings)
