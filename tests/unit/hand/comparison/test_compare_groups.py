"""From recordings and results to groups, and pairs of groups."""

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.hand.comparison.compare import common_strata, compare, paired
from armimpedance.hand.comparison.groups import (
    ComparedGroup,
    groups_of_estimates,
    groups_of_recording,
    name_of,
)
from armimpedance.hand.comparison.parametric import parametric_test
from armimpedance.hand.still.estimation import Options
from armimpedance.numerics.regression.equations import solve_total


def two_conditions(limb, **changes):
    """Sets 1-3 are one condition, sets 4-6 the other."""
    recording = limb.record(sets=6, force_noise=0.05, **changes)
    table = recording.trials.assign(condition=np.where(recording.trials["set"] <= 3, "a", "b"))
    return replace(recording, trials=table)


@pytest.mark.parametrize("method", ["exact", "weighted"])
def test_equations_solve_to_the_limb_without_the_handle(limb, method):
    recording = two_conditions(limb, handle_mass_kg=0.3)
    for group in groups_of_recording(recording, ["condition"], options=Options(method=method)):
        theta = solve_total(group.equations)
        # the fit and the normal equations lose different digits
        assert theta == pytest.approx(group.estimate.parameters, rel=1e-6)
        assert group.disturbance.tolist() == [45_000 * (i % 8) for i in range(24)]


def test_equal_limbs_are_not_told_apart_and_different_ones_are(limb):
    same = groups_of_recording(two_conditions(limb), ["condition"])
    other = groups_of_recording(two_conditions(limb, stiffness=1.2 * limb.K, seed=3), ["condition"])
    (equal,) = compare(same, permutations=199)
    assert min(t.p_t2 for t in equal.tests) > 0.005
    (different,) = compare([same[0], replace(other[0], name="c")], permutations=199)
    assert different.basis == "permutation"
    by = {t.matrix: t.p_t2 for t in different.tests}
    assert by["stiffness"] == by["all"] == pytest.approx(1 / 200)
    size = next(c for c in different.changes if (c.matrix, c.quantity) == ("stiffness", "size"))
    assert size.low < 1.44 < size.high


def test_missing_column_and_single_trials_are_refused(limb):
    recording = two_conditions(limb)
    with pytest.raises(InputError, match="no column 'posture'"):
        groups_of_recording(recording, ["posture"])
    lone = recording.trials.assign(condition=["x", *["y"] * 47])
    with pytest.raises(InputError, match="one usable trial"):
        groups_of_recording(replace(recording, trials=lone), ["condition"])


def test_names():
    assert name_of({"a": 2.0, "b": "tense", "c": 0.5}, ["a", "b", "c"]) == "2, tense, 0.5"


def test_results_must_name_their_groups_once(estimated):
    pair = [estimated(keys={"condition": c}) for c in "ab"]
    assert [g.name for g in groups_of_estimates(pair, ["condition"])] == ["a", "b"]
    with pytest.raises(InputError, match="column day"):
        groups_of_estimates(pair, ["day"])
    with pytest.raises(InputError, match="several results for a"):
        groups_of_estimates([pair[0], pair[0]], ["condition"])


def test_pairs(estimated):
    groups = [ComparedGroup(name, estimated()) for name in "abc"]
    assert [(x.name, y.name) for x, y in paired(groups, None)] == [
        ("a", "b"),
        ("a", "c"),
        ("b", "c"),
    ]
    assert [(x.name, y.name) for x, y in paired(groups, "b")] == [("b", "a"), ("b", "c")]
    with pytest.raises(InputError, match="1 group: a"):
        paired(groups[:1], None)
    with pytest.raises(InputError, match="no group 'd'"):
        paired(groups, "d")


def test_adjusted_over_pairs(estimated):
    groups = [ComparedGroup(n, estimated(keys={"condition": n})) for n in "abc"]
    for pair in compare(groups, permutations=99):
        assert pair.basis == "covariance"
        for test in pair.tests:
            assert test.p_t2_adjusted >= test.p_t2


def test_exchange_keeps_to_directions_that_both_have(equations, estimated):
    def group(directions):
        directions = np.array(directions)
        return ComparedGroup("g", estimated(), equations(1, len(directions)), directions)

    both, notes = common_strata(group([0, 45, 90] * 5), group([0, 45, 90] * 5))
    assert both is not None
    assert notes == ()
    both, notes = common_strata(group([0, 45, 90] * 5), group([0, 45, 180] * 5))
    assert "2 directions" in notes[0]
    both, notes = common_strata(group([0, 45] * 5), group([90, 135] * 5))
    assert both is None
    assert "across directions" in notes[0]
    unknown = replace(group([0, 1]), disturbance=None)
    assert common_strata(unknown, unknown)[0] is None


@pytest.mark.study
def test_tests_from_estimates_hold_their_level(estimated):
    rng, n = np.random.default_rng(0), 300
    base = estimated()
    L = np.sqrt(np.diag(base.covariance))
    rejected = np.zeros((4, 2))
    for seed in range(n):
        pair = []
        for _ in range(2):
            x = base.parameters + L * rng.standard_normal(12)
            M, B, K = x.reshape(3, 2, 2)
            seen = base.covariance * rng.chisquare(39) / 39
            pair.append(replace(base, inertia=M, viscosity=B, stiffness=K, covariance=seen))
        tests = parametric_test(*pair, draws=199, seed=seed)
        rejected += [(t.p_t2 <= 0.05, t.p_distance <= 0.05) for t in tests]
    # 3.5 standard errors of 5 %; one common factor of the covariance is harder than a full Wishart
    assert (rejected / n <= 0.05 + 3.5 * np.sqrt(0.05 * 0.95 / n)).all(), rejected / n


def test_an_estimate_without_error_is_refused(estimated):
    sure = estimated(covariance=np.zeros((12, 12)))
    with pytest.raises(InputError, match="without an error"):
        parametric_test(sure, sure)
