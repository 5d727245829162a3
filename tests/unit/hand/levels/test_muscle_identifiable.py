"""What one joint stiffness says of the muscles: sums, ranges, and when it cannot be at all."""

from itertools import combinations

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.hand.levels.muscle_identifiable import muscle_share
from armimpedance.hand.levels.muscle_map import joint_stiffness
from armimpedance.limb.arm.muscular_arms import arm_named

ARM = arm_named("planar6")
G = ARM.paths.moment_arms([1.04, 1.57])
NAMES = ARM.paths.muscles
EXACT = 1e-12 * np.eye(4)
HUMAN = np.array([1700.0, 1700.0, 6800.0, 6800.0, 2700.0, 2700.0])


def error_of(sd=(1.0, 0.7, 1.0)):
    """Covariance of a symmetric K, row by row: ss, se, es, ee."""
    spread = np.zeros((4, 3))
    spread[[0, 1, 2, 3], [0, 1, 1, 2]] = [sd[0], sd[1], sd[1], sd[2]]
    return spread @ spread.T


def measured(K, covariance, rng):
    root = np.linalg.eigh(covariance)
    noise = root.eigenvectors @ (np.sqrt(np.maximum(root.eigenvalues, 0)) * rng.standard_normal(4))
    return K + noise.reshape(2, 2)


def ranges(share):
    return {r.name: r for r in (*share.single, *share.groups)}


def corners(y, arms):
    """Every k >= 0 with at most three muscles that makes y (3,): the polytope's corners."""
    A = np.array([arms[:, 0] ** 2, arms[:, 0] * arms[:, 1], arms[:, 1] ** 2])
    found = []
    for chosen in combinations(range(len(arms)), 3):
        part = A[:, chosen]
        if np.linalg.matrix_rank(part / np.linalg.norm(part, axis=0)) < 3:
            continue
        k = np.zeros(len(arms))
        k[list(chosen)] = np.linalg.solve(part, y)
        if k.min() >= -1e-9 * np.abs(k).max():
            found.append(k)
    return np.array(found)


@pytest.mark.parametrize("seed", range(6))
def test_ranges_are_those_of_the_polytope_s_corners(seed):
    rng = np.random.default_rng(seed)
    arms = ARM.paths.moment_arms([1.0, 1.5]) * rng.uniform(0.6, 1.4, (6, 2))
    k = rng.exponential(3000, 6)
    K = joint_stiffness(arms, k)
    share = muscle_share(K, EXACT, arms, NAMES)
    every = corners(K[[0, 0, 1], [0, 1, 1]], arms)
    assert share.outside_se == 0
    for reach in ranges(share).values():
        values = every @ reach.coefficients
        scale = np.abs(values).max() + 1e-9
        assert reach.low == pytest.approx(values.min(), abs=1e-6 * scale)
        assert reach.high == pytest.approx(values.max(), abs=1e-6 * scale)
        true = k @ reach.coefficients
        assert reach.low - 1e-6 * scale <= true <= reach.high + 1e-6 * scale


def test_sums_are_the_joint_stiffness_less_its_curvature_term():
    curvature = np.array([[2.0, -0.5], [-0.5, -1.0]])
    K = joint_stiffness(G, HUMAN) + curvature
    sums = {
        c.name: c for c in muscle_share(K, error_of(), G, NAMES, curvature=curvature).combinations
    }
    own = joint_stiffness(G, HUMAN)
    assert set(sums) == {"ss", "se", "ee"}
    assert [sums[n].value for n in ("ss", "se", "ee")] == pytest.approx(own[[0, 0, 1], [0, 1, 1]])
    assert [sums[n].sd for n in ("ss", "se", "ee")] == pytest.approx([1.0, 0.7, 1.0])
    for c in sums.values():
        assert c.value == pytest.approx(c.coefficients @ HUMAN)
        assert c.high - c.value == pytest.approx(1.96 * c.sd, rel=1e-3)


def test_no_single_muscle_of_six_is_determined_but_the_two_joint_sum_is():
    share = muscle_share(joint_stiffness(G, HUMAN), error_of(), G, NAMES, dof=39)
    assert share.rank == 3
    assert not any(r.determined for r in share.single)
    groups = {r.name: r for r in share.groups}
    assert [n for n, r in groups.items() if r.determined] == ["two_joint_se"]
    se = next(c for c in share.combinations if c.name == "se")
    reach = groups["two_joint_se"]
    assert (reach.low, reach.outer_low, reach.outer_high) == pytest.approx(
        (se.value, se.low, se.high)
    )
    # all of a joint's stiffness is that of its own and of the two-joint muscles
    ss = next(c for c in share.combinations if c.name == "ss").value
    assert groups["shoulder_ss"].low + groups["two_joint_ss"].high == pytest.approx(ss)


def test_an_arm_of_three_muscles_gives_each_its_stiffness_within_its_interval():
    arms, names, k = G[[0, 2, 4]], ("a", "b", "c"), np.array([4000.0, 9000.0, 4000.0])
    K, rng, z = joint_stiffness(arms, k), np.random.default_rng(1), []
    for _ in range(20):
        share = muscle_share(measured(K, error_of(), rng), error_of(), arms, names)
        found = [next(c for c in share.combinations if c.name == n) for n in names]
        assert all(r.determined for r in share.single)
        for c, r in zip(found, share.single, strict=True):
            assert (r.low, r.outer_low, r.outer_high) == pytest.approx(
                (c.value, max(c.low, 0.0), c.high), abs=1e-3
            )
        z.append([(c.value - true) / c.sd for c, true in zip(found, k, strict=True)])
    z = np.array(z)
    # mean 0 and mean square 1, with standard errors 1/sqrt(20) and sqrt(2/20)
    assert np.abs(z.mean(axis=0)).max() < 4 / np.sqrt(20)
    assert np.abs((z**2).mean(axis=0) - 1).max() < 4 * np.sqrt(2 / 20)


def test_bounds_bend_to_the_safe_side_of_their_own_slope():
    # least values are convex in K_j, largest concave: a tangent never promises too much
    at = joint_stiffness(G, HUMAN)
    middle, step = ranges(muscle_share(at, EXACT, G, NAMES)), 1e-4
    units = [
        np.array(u, dtype=float) for u in ([[1, 0], [0, 0]], [[0, 1], [1, 0]], [[0, 0], [0, 1]])
    ]
    near = [ranges(muscle_share(at + step * u, EXACT, G, NAMES)) for u in units]
    rng, moved_far = np.random.default_rng(2), 0
    for _ in range(12):
        y = rng.normal(0, [6.0, 4.0, 6.0])
        there = muscle_share(
            at + sum(a * u for a, u in zip(y, units, strict=True)), EXACT, G, NAMES
        )
        if there.outside_se:
            continue
        for name, reach in ranges(there).items():
            slack = 1e-5 * (1 + abs(reach.high))
            for side, sign in (("low", 1), ("high", -1)):
                start = getattr(middle[name], side)
                slopes = [(getattr(n[name], side) - start) / step for n in near]
                tangent = start + np.dot(slopes, y)
                beyond = sign * (getattr(reach, side) - tangent)
                assert beyond > -slack * 100 * step
                moved_far += beyond > 0.05 * abs(start)
    # the bound does bend: the law is not one of straight lines only
    assert moved_far > 0


@pytest.mark.study
@pytest.mark.first_cases(1)
@pytest.mark.parametrize(
    "k",
    [HUMAN, np.array([0, 0, 0, 0, 6e3, 0.0])],
    ids=["all pull", "one muscle"],
)
def test_outer_limits_hold_the_true_range_as_often_as_they_say(k):
    K, covariance, count = joint_stiffness(G, k), error_of(), 60
    true = ranges(muscle_share(K, EXACT, G, NAMES))
    rng, held = np.random.default_rng(3), np.zeros((count, len(true)))
    for row in held:
        share = muscle_share(measured(K, covariance, rng), covariance, G, NAMES)
        found = ranges(share)
        for i, (name, t) in enumerate(true.items()):
            slack = 1e-5 * max(abs(t.high), 1e-3)
            row[i] = (
                found[name].outer_low <= t.low + slack and found[name].outer_high >= t.high - slack
            )
    assert held.mean(axis=0).min() >= 0.95 - 4 * np.sqrt(0.95 * 0.05 / count)
    # and not by being boundless
    assert ranges(share)["two_joint_ss"].outer_high < K[0, 0] + 5


def test_limits_shrink_to_the_range_with_the_error():
    K = joint_stiffness(G, HUMAN)
    widths = []
    for scale in (1.0, 0.1, 1e-3):
        reach = ranges(muscle_share(K, scale**2 * error_of(), G, NAMES))["shoulder_ss"]
        widths.append((reach.low - reach.outer_low, reach.outer_high - reach.high))
    assert widths[1] == pytest.approx([0.1 * w for w in widths[0]])
    assert widths[2] == pytest.approx([1e-3 * w for w in widths[0]], rel=1e-3)


def test_a_negative_cross_stiffness_is_as_far_out_as_its_error_says():
    K = np.array([[20.0, -3.5], [-3.5, 20.0]])
    near = muscle_share(K, error_of((1.0, 1.75, 1.0)), G, NAMES)
    assert near.outside_se == pytest.approx(2.0)
    assert near.possible
    two_joint = ranges(near)["two_joint_se"]
    assert two_joint.low == pytest.approx(0, abs=1e-6)
    far = muscle_share(K, error_of((1.0, 0.7, 1.0)), G, NAMES)
    assert far.outside_se == pytest.approx(5.0)
    assert not far.possible
    assert all(np.isnan([r.low, r.high, r.outer_low, r.outer_high]).all() for r in far.single)
    # what is determined is still told
    assert next(c for c in far.combinations if c.name == "se").value == pytest.approx(-3.5)


def test_a_cross_stiffness_larger_than_two_joint_muscles_make_is_told():
    # K_se / K_ss of a two-joint muscle is at most .0427 / .0386: a line in the plane of both
    K, steepest = np.array([[10.0, 13.0], [13.0, 30.0]]), 0.0427 / 0.0386
    beyond = (13.0 - 10.0 * steepest) / np.hypot(1, steepest)
    for sd, possible in ((0.8, True), (0.4, False)):
        share = muscle_share(K, error_of((sd, sd, sd)), G, NAMES)
        assert share.outside_se == pytest.approx(beyond / sd, rel=1e-6)
        assert share.possible == possible


@pytest.mark.study
def test_a_stiffness_of_possible_muscles_is_seldom_called_impossible():
    K, rng = joint_stiffness(G, np.array([0, 0, 0, 0, 6e3, 0.0])), np.random.default_rng(5)
    count = 60
    told = [
        muscle_share(measured(K, error_of(), rng), error_of(), G[4:], NAMES[4:]).possible
        for _ in range(count)
    ]
    assert np.mean(told) >= 0.95 - 4 * np.sqrt(0.95 * 0.05 / count)


def test_without_two_joint_muscles_the_cross_term_is_no_sum_but_a_check():
    arms, names = G[:4], NAMES[:4]
    K = joint_stiffness(arms, HUMAN[:4])
    share = muscle_share(K, error_of(), arms, names)
    assert share.rank == 2
    assert {c.name for c in share.combinations} == {"ss", "ee"}
    off = muscle_share(K + [[0, 5], [5, 0]], error_of(), arms, names)
    assert off.outside_se == pytest.approx(5 / 0.7, rel=1e-6)
    assert not off.possible


def test_the_antisymmetric_part_and_the_unit_do_not_matter():
    K = joint_stiffness(G, HUMAN)
    a = muscle_share(K, error_of(), G, NAMES)
    b = muscle_share(K + [[0, 2], [-2, 0]], error_of(), G, NAMES)
    small = muscle_share(1e-6 * K, 1e-12 * error_of(), G, NAMES)
    for x, y, z in zip(ranges(a).values(), ranges(b).values(), ranges(small).values(), strict=True):
        wanted = [x.low, x.high, x.outer_low, x.outer_high]
        assert [y.low, y.high, y.outer_low, y.outer_high] == pytest.approx(wanted, abs=1e-6)
        shrunk = [1e6 * v for v in (z.low, z.high, z.outer_low, z.outer_high)]
        assert shrunk == pytest.approx(wanted, rel=1e-6, abs=1e-4)


@pytest.mark.parametrize(
    ("K", "arms", "curvature"),
    [
        (np.full((2, 2), np.nan), G, None),
        (np.eye(3), G, None),
        (np.eye(2), G[:3], None),
        (np.eye(2), np.vstack([G[:5], [[0, 0]]]), None),
        (np.eye(2), G, np.eye(3)),
    ],
)
def test_what_does_not_belong_together_is_refused(K, arms, curvature):
    with pytest.raises(InputError):
        muscle_share(K, np.eye(len(K) ** 2), arms, NAMES, curvature=curvature)
