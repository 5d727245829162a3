"""Changes between two estimates: their values, their intervals, what swaps and what rotates."""

import numpy as np
import pytest
from scipy.special import stdtrit

from armimpedance.core.errors import InputError
from armimpedance.hand.comparison.differences import changes, welch_dof
from armimpedance.hand.ellipses import half_turn

K = np.array([[104.8, -74.4], [-74.4, 179.3]])


def by_name(one, two):
    return {(c.matrix, c.quantity): c for c in changes(one, two)}


def turned(matrix, angle):
    c, s = np.cos(angle), np.sin(angle)
    R = np.array([[c, -s], [s, c]])
    return R @ matrix @ R.T


def test_elements_have_welch_intervals(estimated):
    one, two = estimated(dof=39.0), estimated(K + 10, sd=12.0, dof=15.0)
    change = by_name(one, two)["stiffness", "K_11"]
    v1, v2 = 36.0, 144.0
    dof = (v1 + v2) ** 2 / (v1**2 / 39 + v2**2 / 15)
    assert change.dof == pytest.approx(dof)
    assert change.value == pytest.approx(10)
    assert change.high - change.value == pytest.approx(stdtrit(dof, 0.975) * np.sqrt(v1 + v2))
    # the symmetric element of two independent ones has half their variance
    assert by_name(one, two)["stiffness", "K_12"].sd == pytest.approx(np.sqrt((v1 + v2) / 2))


def test_a_scaled_limb_changes_in_size_only(estimated):
    change = by_name(estimated(), estimated(1.3 * K))
    assert change["stiffness", "size"].value == pytest.approx(1.69)
    assert change["stiffness", "shape"].value == pytest.approx(1)
    assert change["stiffness", "orientation"].value == pytest.approx(0, abs=1e-12)
    assert change["viscosity", "size"].value == pytest.approx(1)


def test_swapping_the_groups_turns_the_sign(estimated):
    one, two = estimated(), estimated(turned(1.2 * K, 0.3), sd=9.0, dof=12.0)
    there, back = changes(one, two), changes(two, one)
    for a, b in zip(there, back, strict=True):
        if a.kind == "ratio":
            assert (a.value, a.low, a.high) == pytest.approx((1 / b.value, 1 / b.high, 1 / b.low))
        else:
            ends = (-b.value, -b.high, -b.low)
            assert (a.value, a.low, a.high) == pytest.approx(ends, abs=1e-12)


@pytest.mark.parametrize("start", [-80.0, -10.0, 44.0, 88.0])
def test_a_turn_is_the_short_way_round(estimated, start):
    thin = np.diag([300.0, 100.0])
    one = estimated(turned(thin, np.radians(start)), sd=2.0)
    two = estimated(turned(thin, np.radians(start + 15)), sd=2.0)
    change = by_name(one, two)["stiffness", "orientation"]
    assert np.degrees(change.value) == pytest.approx(15)
    assert change.low < change.value < change.high
    assert change.high - change.low < 0.2


def test_a_circle_has_no_turn(estimated):
    change = by_name(estimated(), estimated(np.eye(2) * 150 + np.diag([1, 0])))
    turn = change["stiffness", "orientation"]
    assert (turn.low, turn.high) == pytest.approx((-np.pi / 2, np.pi / 2))
    assert np.isnan(turn.sd)
    assert change["stiffness", "shape"].high > change["stiffness", "shape"].value


def test_no_ellipse_no_ratio(estimated):
    change = by_name(estimated(), estimated([[100, 200], [200, 100]]))
    assert np.isnan(change["stiffness", "size"].value)
    assert change["stiffness", "K_12"].value == pytest.approx(274.4)


@pytest.mark.study
@pytest.mark.parametrize("seed", [0, 1])
def test_intervals_hold_what_they_promise(estimated, seed):
    rng = np.random.default_rng(seed)
    n, names = 500, ("K_11", "size", "shape", "orientation")
    truth = [K, turned(1.2 * K, 0.2)]
    true = by_name(estimated(truth[0]), estimated(truth[1]))
    held = np.zeros(len(names))
    for _ in range(n):
        pair = []
        for matrix, dof, sd in ((truth[0], 39, 6.0), (truth[1], 15, 9.0)):
            wrong = rng.normal(0, sd, (2, 2))
            seen = sd * np.sqrt(rng.chisquare(dof) / dof)
            pair.append(estimated(matrix + wrong, sd=seen, dof=float(dof)))
        found = by_name(*pair)
        for i, name in enumerate(names):
            c = found["stiffness", name]
            held[i] += c.low <= true["stiffness", name].value <= c.high
    # 3.5 standard errors of 95 %, and a point for the first order
    reach = 3.5 * np.sqrt(0.05 * 0.95 / n) + 0.01
    assert (np.abs(held / n - 0.95) < reach).all(), held / n


def test_levels_must_agree(estimated):
    with pytest.raises(InputError, match="joint"):
        changes(estimated(), estimated(level="joint"))


def test_welch_and_wrap_limits():
    assert welch_dof((1.0, 0.0), (7.0, 3.0)) == pytest.approx(7)
    assert welch_dof((1.0, 1.0), (9.0, 9.0)) == pytest.approx(18)
    assert welch_dof((1.0, 1.0), (np.inf, np.inf)) == np.inf
    assert half_turn(np.pi / 2) == pytest.approx(np.pi / 2)
    assert half_turn(-np.pi / 2) == pytest.approx(np.pi / 2)
    assert half_turn(3.0) == pytest.approx(3.0 - np.pi)
