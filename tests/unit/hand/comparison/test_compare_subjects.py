"""Mean over subjects and the spread between them: limits, coverage, missing groups."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from armimpedance.core.errors import InputError
from armimpedance.hand.comparison.groups import ComparedGroup
from armimpedance.hand.comparison.subjects import compare_subjects, random_effects
from armimpedance.hand.ellipses import half_turn

K = np.array([[104.8, -74.4], [-74.4, 179.3]])


def test_without_errors_it_is_the_t_test_of_the_values():
    y = np.array([1.0, 2.5, 0.3, 1.9, 2.2])
    made = random_effects(y, np.full(5, 1e-12))
    plain = stats.ttest_1samp(y, 0)
    assert made.mean == pytest.approx(y.mean())
    assert made.mean / made.standard_error == pytest.approx(plain.statistic)
    assert made.between_sd == pytest.approx(y.std(ddof=1))


def test_subjects_that_agree_do_not_differ_and_no_interval_is_below_their_errors():
    made = random_effects(np.array([1.0, 1.01, 0.99, 1.0]), np.full(4, 0.25))
    assert made.between_sd == 0
    assert made.between_limits[0] == 0
    assert made.standard_error == pytest.approx(0.5 / 2)


def test_between_sd_solves_its_equation():
    y, v = np.array([0.0, 3.0, -2.0, 5.0]), np.array([0.5, 1.0, 2.0, 0.1])
    tau2 = random_effects(y, v).between_sd ** 2
    w = 1 / (v + tau2)
    mean = w @ y / w.sum()
    assert w @ (y - mean) ** 2 == pytest.approx(3)


@pytest.mark.first_cases(2)
@pytest.mark.parametrize("n", [4, 8])
@pytest.mark.parametrize("spread", [0.5, 3.0])
def test_coverage_of_mean_and_spread(n, spread):
    rng, draws, held = np.random.default_rng(n), 400, np.zeros(2)
    t = stats.t.ppf(0.975, n - 1)
    for _ in range(draws):
        sd = rng.uniform(0.7, 1.4, n)
        made = random_effects(spread * rng.normal(size=n) + sd * rng.normal(size=n), sd**2)
        low, high = made.between_limits
        held += [abs(made.mean) <= t * made.standard_error, low <= spread <= high]
    # 3.5 standard errors below 95 %
    assert (held / draws >= 0.95 - 3.5 * np.sqrt(0.05 * 0.95 / draws)).all(), held / draws


def people(estimated, factors, missing=()):
    """A subject for each factor by which its stiffness rises from relaxed to tense."""
    made = {}
    for i, factor in enumerate(factors):
        groups = [ComparedGroup("relaxed", estimated(K, sd=1.0))]
        if i not in missing:
            groups.append(ComparedGroup("tense", estimated(factor * K, sd=1.0)))
        made[f"s{i}"] = groups
    return made


def test_mean_change_is_the_geometric_mean_of_ratios(estimated):
    found = compare_subjects(people(estimated, (1.2, 1.5, 1.8, 1.4)))
    size = next(c for c in found if (c.matrix, c.quantity) == ("stiffness", "size"))
    ratios = np.array([1.2, 1.5, 1.8, 1.4]) ** 2
    assert size.value == pytest.approx(stats.gmean(ratios), rel=0.02)
    assert size.low < size.value < size.high
    assert size.n == 4
    assert size.between_sd == pytest.approx(np.log(ratios).std(ddof=1), rel=0.1)
    assert size.p < 0.05
    still = next(c for c in found if (c.matrix, c.quantity) == ("inertia", "size"))
    assert still.value == pytest.approx(1)


def test_a_subject_without_both_groups_is_left_out_of_the_pair(estimated):
    found = compare_subjects(people(estimated, (1.2, 1.5, 1.8), missing=(1,)))
    assert {c.n for c in found} == {2}


def test_turns_across_the_end_of_the_scale_are_averaged_the_short_way(estimated):
    def turned(angle):
        c, s = np.cos(angle), np.sin(angle)
        R = np.array([[c, -s], [s, c]])
        return R @ np.diag([300.0, 100.0]) @ R.T

    subjects = {
        f"s{i}": [
            ComparedGroup("a", estimated(turned(0.0), sd=1.0)),
            ComparedGroup("b", estimated(turned(np.radians(angle)), sd=1.0)),
        ]
        for i, angle in enumerate((88.0, 92.0, 91.0))
    }
    turn = next(
        c
        for c in compare_subjects(subjects)
        if c.quantity == "orientation" and c.matrix == "stiffness"
    )
    # 90.3 and -89.7 degrees are the same turn of an axis
    away = half_turn(turn.value - np.radians(271 / 3))
    assert abs(np.degrees(away)) < 0.01


def test_refusals(estimated):
    everybody = people(estimated, (1.2, 1.5))
    with pytest.raises(InputError, match="1 subject"):
        compare_subjects({"s0": everybody["s0"]})
    with pytest.raises(InputError, match="no group 'asleep'"):
        compare_subjects(everybody, against="asleep")
    apart = {
        "s0": everybody["s0"],
        "s1": [replace(g, name=g.name + "!") for g in everybody["s1"]],
    }
    with pytest.raises(InputError, match="two subjects have both"):
        compare_subjects(apart)
