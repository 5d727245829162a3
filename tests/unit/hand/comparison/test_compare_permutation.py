"""Permutation tests: exact p values, strata, levels, power, and what they must refuse."""

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.hand.comparison.matrix_test import exceedance, holm
from armimpedance.hand.comparison.permutation import (
    arrangements,
    permutation_test,
    permuted_members,
    statistics_of,
)
from armimpedance.numerics.regression.equations import solve_equations


def directions(trials):
    return np.arange(trials) % 8


def test_every_stratum_keeps_its_number_of_members():
    member = np.arange(40) < 15
    strata = np.arange(40) % 5
    drawn = permuted_members(member, strata, 50, np.random.default_rng(0))
    for label in range(5):
        counts = drawn[:, strata == label].sum(axis=1)
        assert (counts == member[strata == label].sum()).all()
    assert len(np.unique(drawn, axis=0)) > 40
    assert arrangements(np.array([True, True, False, False]), None) == 6
    assert arrangements(np.array([True, True, False, False]), np.array([0, 1, 0, 1])) == 4


def test_p_counts_ties_and_what_does_not_exist():
    assert exceedance(np.array([2.0, 1, 2, 3, np.nan])) == pytest.approx(4 / 5)
    assert exceedance(np.array([9.0, 1, 2, 3])) == pytest.approx(1 / 4)
    assert np.isnan(exceedance(np.array([np.nan, 1, 2])))


def test_the_data_are_solved_as_everywhere_else(equations):
    one, two = equations(1), equations(2, trials=16, noise=2.0)
    A, b = np.concatenate([one.A, two.A]), np.concatenate([one.b, two.b])
    found = statistics_of(A, b, np.arange(40)[None] < 24)
    x, y = (solve_equations(e, covariance="cr1") for e in (one, two))
    pick = np.array([[1, 0, 0, 0], [0, 0.5, 0.5, 0], [0, 0, 0, 1]])
    C = np.hstack([np.zeros((3, 8)), pick])
    d, V = C @ (y.parameters - x.parameters), C @ (x.covariance + y.covariance) @ C.T
    assert found.t2[0, 2] == pytest.approx(d @ np.linalg.solve(V, d))


@pytest.mark.study
@pytest.mark.first_cases(1)
@pytest.mark.parametrize(("trials", "noise"), [(24, 1.0), (16, 1.0), (16, 2.0), (40, 2.0)])
def test_equal_truth_is_rejected_at_the_level(equations, trials, noise):
    rejected, n = np.zeros((4, 2)), 200
    for seed in range(n):
        one, two = equations(2 * seed), equations(2 * seed + 1, trials, noise)
        tests = permutation_test(
            one, two, strata=(directions(24), directions(trials)), permutations=99, seed=seed
        )
        rejected += [(t.p_t2 <= 0.05, t.p_distance <= 0.05) for t in tests]
    # 3.5 standard errors of a rate of 5 %: eight rates in four cases
    reach = 3.5 * np.sqrt(0.05 * 0.95 / n)
    rates = rejected / n
    assert (rates <= 0.05 + reach).all(), rates
    if noise == 1.0:
        assert (rates[:, 0] >= max(0.05 - reach, 0)).all(), rates


def test_a_stiffer_limb_is_found_in_its_stiffness_only(equations, truth):
    stiffer = truth.copy()
    stiffer[8:] *= 1.6
    tests = permutation_test(
        equations(5, 40),
        equations(6, 40, truth=stiffer),
        strata=(directions(40), directions(40)),
        permutations=999,
    )
    by = {t.matrix: t for t in tests}
    assert by["stiffness"].p_t2 == by["all"].p_t2 == pytest.approx(1 / 1000)
    assert by["inertia"].p_t2 > 0.01
    # distance of K and 1.6 K with an error of about 10 %
    assert by["stiffness"].distance == pytest.approx(np.sqrt(2) * np.log(1.6), rel=0.5)


def test_same_seed_same_p_and_batches_do_not_matter(equations, monkeypatch):
    one, two = equations(1), equations(2)
    first = permutation_test(one, two, permutations=199, seed=4)
    from armimpedance.hand.comparison import permutation

    monkeypatch.setattr(permutation, "_BATCH_NUMBERS", 20_000)
    again = permutation_test(one, two, permutations=199, seed=4)
    assert [t.p_t2 for t in again] == [t.p_t2 for t in first]
    assert [t.p_distance for t in again] == [t.p_distance for t in first]
    other = permutation_test(one, two, permutations=199, seed=5)
    assert [t.p_t2 for t in other] != [t.p_t2 for t in first]


def test_groups_change_places(equations):
    one, two = equations(1), equations(2)
    there = permutation_test(one, two, permutations=19)
    back = permutation_test(two, one, permutations=19)
    assert [t.t2 for t in there] == pytest.approx([t.t2 for t in back])
    assert [t.distance for t in there[:3]] == pytest.approx([t.distance for t in back[:3]])


def test_units_do_not_matter(equations):
    """Grams and millimetres: every p stays."""
    one, two = equations(1), equations(2, noise=2.0)
    S = np.repeat([1e3, 1e-2, 7.0], 4)

    def scaled(e):
        return replace(e, A=e.A / S[:, None] / S, b=e.b / S)

    plain = permutation_test(one, two, permutations=199)
    other = permutation_test(scaled(one), scaled(two), permutations=199)
    assert [t.p_t2 for t in other] == [t.p_t2 for t in plain]
    assert [t.p_distance for t in other] == [t.p_distance for t in plain]


def test_a_matrix_that_is_not_definite_leaves_t2(equations, truth):
    odd = truth.copy()
    odd[8:] = [100, -150, -150, 100]
    tests = permutation_test(equations(1), equations(2, truth=odd, noise=0.1), permutations=199)
    assert np.isnan(tests[2].distance)
    assert np.isnan(tests[2].p_distance)
    assert tests[2].p_t2 == pytest.approx(1 / 200)


def test_few_trials_have_no_test_of_nine_elements(equations):
    tests = permutation_test(equations(1, 5), equations(2, 5), permutations=19)
    assert np.isnan(tests[3].p_t2)
    assert np.isfinite(tests[2].p_t2)


def test_refusals(equations):
    with pytest.raises(InputError, match="one trial"):
        permutation_test(equations(1), equations(2, 1))
    with pytest.raises(InputError, match="0 permutations"):
        permutation_test(equations(1), equations(2), permutations=0)
    with pytest.raises(NotIdentifiableError, match="direction_deg"):
        permutation_test(equations(1, 2), equations(2, 2), permutations=99)


def test_holm():
    p = holm([0.01, 0.04, 0.03, np.nan])
    assert p[:3] == pytest.approx([0.03, 0.06, 0.06])
    assert np.isnan(p[3])
    assert holm([0.9, 0.8]).max() <= 1
    assert (holm(np.linspace(0, 1, 9)) >= np.linspace(0, 1, 9)).all()
