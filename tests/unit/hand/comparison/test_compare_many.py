"""Many pairs: tests without draws that keep their level, bounded memory, the same numbers."""

import tracemalloc
from itertools import islice

import numpy as np
import pytest
from scipy import stats

from armimpedance.core.errors import InputError
from armimpedance.hand.comparison.compare import MOST_DRAWN_PAIRS, compare
from armimpedance.hand.comparison.groups import ComparedGroup
from armimpedance.hand.comparison.matrix_test import (
    affine_invariant_distance,
    expected_square,
    holm,
)
from armimpedance.hand.comparison.parametric import (
    Elements,
    first_order_tests,
    mixture_tail,
    parametric_test,
)
from armimpedance.hand.comparison.permutation import permutation_test, planar_ratios
from armimpedance.hand.comparison.show.table import comparison_content
from armimpedance.hand.comparison.show.text import comparison_text


def perturbed(estimated, count, seed=0, stiffer=None):
    """Groups of one truth; of every second one K is larger where `stiffer` says how much."""
    rng, base = np.random.default_rng(seed), estimated()
    sd, groups = np.sqrt(np.diag(base.covariance)), []
    for i in range(count):
        M, B, K = (base.parameters + sd * rng.standard_normal(12)).reshape(3, 2, 2)
        K = K * (stiffer if stiffer and i % 2 else 1.0)
        errors = sd * rng.standard_normal((39, 12))
        seen = errors.T @ errors / 39
        made = estimated(stiffness=K, inertia=M, viscosity=B, covariance=seen)
        groups.append(ComparedGroup(f"g{i}", made))
    return groups


@pytest.mark.parametrize("dof", [3.0, 39.0, np.inf])
@pytest.mark.parametrize("J", [1, 3, 9])
def test_equal_weights_are_the_f_distribution(J, dof):
    q = np.geomspace(0.05, 60, 100)
    found = mixture_tail(np.full((len(q), J), 2.0), np.full(len(q), dof), 2 * J * q)
    exact = stats.f.sf(q, J, dof) if np.isfinite(dof) else stats.chi2.sf(J * q, J)
    # the saddlepoint of one chi-square, whose density is not finite at zero, is the worst
    assert found / exact == pytest.approx(1, abs=0.15 if J == 1 else 0.06)
    assert (np.diff(found) <= 0).all()


def test_unequal_weights_are_what_draws_say():
    rng, w = np.random.default_rng(1), np.array([0.8, 0.15, 0.05])
    drawn = rng.chisquare(1, (400_000, 3)) @ w / (rng.chisquare(20, 400_000) / 20)
    for p in (0.9, 0.5, 0.05, 0.001):
        q = np.array([np.quantile(drawn, 1 - p)])
        # 4 standard errors of the draws, and 8 % of the saddlepoint
        reach = 4 * np.sqrt((1 - p) / (p * 400_000)) + 0.08
        assert mixture_tail(w[None], np.array([20.0]), q)[0] / p == pytest.approx(1, abs=reach)
    assert mixture_tail(w[None], np.array([20.0]), np.array([0.0]))[0] == pytest.approx(1, abs=1e-3)


def test_the_closed_form_is_the_distance_over_chance():
    rng = np.random.default_rng(2)
    x, y = rng.normal([2, 0.3, 1], 0.6, (2, 500, 3))
    root = rng.normal(size=(500, 3, 3))
    V = root @ root.swapaxes(1, 2)
    A, B = (z[:, [0, 1, 1, 2]].reshape(-1, 2, 2) for z in (x, y))
    d = affine_invariant_distance(A, B)
    found = planar_ratios(x, y, V)
    known = np.isfinite(d)
    assert 50 < known.sum() < 500
    assert np.isfinite(found).tolist() == known.tolist()
    oracle = d[known] ** 2 / expected_square((A + B)[known] / 2, V[known])
    assert found[known] == pytest.approx(oracle, rel=1e-9)
    one = planar_ratios(x, y, V[0])
    assert one[known][0] == pytest.approx(
        d[known][0] ** 2 / expected_square((A + B)[known][0] / 2, V[0])
    )
    # the same matrices are at no distance, to rounding
    assert planar_ratios(x[known], x[known], V[known]) == pytest.approx(0, abs=1e-20)


def test_p_without_draws_is_that_of_draws(estimated):
    groups = perturbed(estimated, 8, stiffer=1.25)
    elements = Elements.of([group.estimate for group in groups])
    i, j = np.triu_indices(8, 1)
    found = first_order_tests(elements, i, j)
    for row in (0, 5, 11, 27):
        pair = groups[i[row]].estimate, groups[j[row]].estimate
        drawn = parametric_test(*pair, draws=20_000, seed=row)
        for test, (distance, p, t2, p_t2) in zip(drawn, found[row], strict=True):
            assert (test.t2, test.p_t2) == pytest.approx((t2, p_t2), rel=1e-9)
            assert np.isclose(test.distance, distance, rtol=1e-12, equal_nan=True)
            # one in five, and 4 standard errors: draws also vary what the test holds still
            reach = 0.2 + 4 / np.sqrt(20_000 * test.p_distance)
            assert p == pytest.approx(test.p_distance, rel=reach)


@pytest.mark.study
def test_equal_truth_has_uniform_p(estimated):
    """Disjoint pairs, so that their p values are independent."""
    n = 1500
    groups = perturbed(estimated, 2 * n, seed=5)
    elements = Elements.of([group.estimate for group in groups])
    p = first_order_tests(elements, np.arange(n), np.arange(n, 2 * n))[:, :, [1, 3]]
    for level in (0.5, 0.2, 0.05, 0.01):
        # 3.5 standard errors, and one in ten of the first order
        reach = 3.5 * np.sqrt(level * (1 - level) / n) + 0.1 * level
        assert np.abs((p <= level).mean(axis=0) - level).max() < reach, level


def test_many_pairs_are_those_of_few(estimated):
    groups = perturbed(estimated, 21, stiffer=1.6)
    told = []
    many = compare(groups, progress=lambda done, total: told.append((done, total)))
    assert len(many) == 210 > MOST_DRAWN_PAIRS
    assert told[-1] == (210, 210)
    assert {pair.basis for pair in many} == {"first order"}
    few = compare(groups[-7:], permutations=9)
    assert {pair.basis for pair in few} == {"covariance"}
    names = {group.name for group in groups[-7:]}
    same = [pair for pair in many if {pair.first, pair.second} <= names]
    for a, b in zip(same, few, strict=True):
        assert (a.first, a.second) == (b.first, b.second)
        assert tuple(a.changes) == b.changes
        assert [t.t2 for t in a.tests] == pytest.approx([t.t2 for t in b.tests], rel=1e-9)
    assert many[-1].changes[-1] == few[-1].changes[-1]
    assert [pair.first for pair in many[-2:]] == [pair.first for pair in few[-2:]]
    raw = np.array([[t.p_t2 for t in pair.tests] for pair in many])
    adjusted = np.array([[t.p_t2_adjusted for t in pair.tests] for pair in many])
    assert np.array_equal(adjusted, np.column_stack([holm(column) for column in raw.T]))
    # of 110 pairs that differ Holm finds most: their p is not bounded below by a number of draws
    found = [t.tests[3].p_distance_adjusted <= 0.05 for t in many]
    assert sum(found) > 90


@pytest.mark.study
def test_few_exchanges_decide_where_p_is_large(equations, estimated, truth):
    """Where p is small it is that of all exchanges to the last bit, elsewhere that of 1999."""
    stiffer = truth.copy()
    stiffer[8:] *= 2
    groups = [
        ComparedGroup(f"g{i}", estimated(), equations(i, 16, truth=stiffer if i == 9 else truth))
        for i in range(10)
    ]
    pairs = compare(groups)
    assert len(pairs) == 45
    count = 100 * 45 - 1
    early = 0
    for number, pair in list(enumerate(pairs))[::15]:
        one, two = (groups[int(name[1:])].equations for name in (pair.first, pair.second))
        seed = np.random.SeedSequence(0, spawn_key=(number,))
        every = permutation_test(one, two, permutations=count, seed=seed)
        for few, all_of_them in zip(pair.tests, every, strict=True):
            p, exact = few.p_t2, all_of_them.p_t2
            assert p == pytest.approx(exact, abs=5 * np.sqrt(exact * (1 - exact) / 1999) + 1e-3)
            assert p == exact or p > 0.01
            early += p != exact
    assert early > 2
    assert pairs[8].tests[2].p_t2 == pytest.approx(1 / (count + 1))
    asked = compare(groups[:2], permutations=5999)
    again = permutation_test(
        groups[0].equations,
        groups[1].equations,
        permutations=5999,
        seed=np.random.SeedSequence(0, spawn_key=(0,)),
    )
    assert [t.p_t2 for t in asked[0].tests] == [t.p_t2 for t in again]


@pytest.mark.study
def test_memory_does_not_grow_with_the_pairs(estimated):
    groups = perturbed(estimated, 45)
    tracemalloc.start()
    pairs = compare(groups)
    content = comparison_content(pairs)
    rows = sum(1 for _ in content.rows)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert rows == len(content.rows) == 26 * 990
    # the rows, some 20 kB a pair, never stand together
    assert peak < 12e6


def test_screen_says_how_many_and_shows_the_clearest(estimated):
    pairs = compare(perturbed(estimated, 40, stiffer=1.6))
    text = comparison_text(pairs)
    assert "of 780 pairs differ" in " ".join(text.split())
    assert len(text.splitlines()) < 130
    clearest = min(pairs, key=lambda pair: pair.tests[3].p_t2)
    assert f"{clearest.first} | {clearest.second}" in text


def test_what_cannot_be_compared_is_named(estimated):
    groups = perturbed(estimated, 22)
    groups[7] = ComparedGroup("odd", estimated(level="joint"))
    with pytest.raises(InputError, match="g0 and odd"):
        compare(groups)
    sure = estimated(covariance=np.zeros((12, 12)))
    groups[3], groups[7] = ComparedGroup("s", sure), ComparedGroup("t", sure)
    with pytest.raises(InputError, match="s and t: an estimate without an error"):
        compare(groups)


def test_a_matrix_that_is_not_definite_and_too_few_trials(estimated):
    groups = perturbed(estimated, 22)
    groups[2] = ComparedGroup("odd", estimated([[100, 200], [200, 100]]))
    groups[4] = ComparedGroup("few", estimated(dof=2.0))
    groups[5] = ComparedGroup("fewer", estimated(dof=2.0))
    found = {(pair.first, pair.second): pair for pair in compare(groups)}
    odd, few = found["g1", "odd"], found["few", "fewer"]
    assert np.isnan(odd.tests[2].p_distance)
    assert odd.tests[2].p_t2 < 0.01
    assert "not positive definite" in odd.notes[0]
    assert np.isnan(few.tests[3].p_t2)
    assert np.isfinite(few.tests[2].p_t2)
    assert next(islice(found.values(), 1)).notes == ()
