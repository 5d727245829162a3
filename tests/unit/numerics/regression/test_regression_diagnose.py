"""Rank, null space and condition by name."""

import numpy as np
import pytest

from armimpedance.core.errors import NotIdentifiableError
from armimpedance.numerics.regression.diagnose import null_space
from armimpedance.numerics.regression.factors import trial_factors
from armimpedance.numerics.regression.solve import fit


def factors_of(W, names):
    Y = np.random.default_rng(99).standard_normal((*W.shape[:2], 1))
    return trial_factors(W, Y, regressors=names, outputs=["f"])


def movement(seed=0, columns=6):
    return np.random.default_rng(seed).standard_normal((10, 60, columns))


def test_full_rank_has_no_null_space():
    factors = factors_of(movement(), list("abcdef"))
    assert null_space(factors) == ()
    result = fit(factors)
    assert result.rank == 6
    assert result.warnings == ()
    stacked = movement().reshape(-1, 6)
    assert result.cond_raw == pytest.approx(np.linalg.cond(stacked), rel=1e-9)
    unit = stacked / np.linalg.norm(stacked, axis=0)
    assert result.cond_scaled == pytest.approx(np.linalg.cond(unit), rel=1e-9)


def test_one_direction_only_names_the_other_axis():
    W = movement()
    W[..., [1, 3, 5]] = 0
    names = ["xdd", "ydd", "xd", "yd", "x", "y"]
    factors = factors_of(W, names)
    with pytest.raises(NotIdentifiableError, match="the columns ydd, yd, y are zero") as refused:
        fit(factors)
    assert refused.value.parameters == ("ydd", "yd", "y")
    assert [d.regressors for d in null_space(factors)] == [("ydd",), ("yd",), ("y",)]


def test_an_oblique_line_pairs_each_column_with_its_copy():
    W = movement(1)
    W[..., 3:] = W[..., :3] * 0.7
    factors = factors_of(W, ["xdd", "xd", "x", "ydd", "yd", "y"])
    with pytest.raises(NotIdentifiableError, match="rank 3 of 6"):
        fit(factors)
    pairs = {frozenset(d.regressors) for d in null_space(factors)}
    assert pairs == {frozenset(("xdd", "ydd")), frozenset(("xd", "yd")), frozenset(("x", "y"))}


def test_a_raised_cosine_with_offset_cannot_tell_inertia_from_stiffness():
    """x = a (1 - cos wt): acceleration, position and offset are dependent, velocity is not."""
    s = np.linspace(0, 1, 301)[None, :, None]
    a, w = np.array([5e-3, 4e-3, -5e-3])[:, None, None], 2 * np.pi / 0.3
    x, xd, xdd = (
        a * (1 - np.cos(2 * np.pi * s)),
        a * w * np.sin(2 * np.pi * s),
        a * w**2 * np.cos(2 * np.pi * s),
    )
    offsets = np.zeros((3, 301, 3))
    for t in range(3):
        offsets[t, :, t] = 1
    factors = factors_of(
        np.concatenate([xdd, xd, x, offsets], axis=2), ["xdd", "xd", "x", "o1", "o2", "o3"]
    )
    with pytest.raises(NotIdentifiableError) as refused:
        fit(factors)
    assert set(refused.value.parameters) == {"xdd", "x", "o1", "o2", "o3"}
    (direction,) = null_space(factors)
    assert direction.weights[2] / direction.weights[0] == pytest.approx(w**2, rel=1e-6)


def test_null_directions_are_unseen_by_the_data():
    scale = np.array([1e4, 1.0, 1e-5, 3.0, 1e-2, 7.0])
    W = movement(3)
    W[..., 4] = W[..., 0] - 2 * W[..., 1]
    W[..., 5] = W[..., 2] + W[..., 3]
    W = W * scale
    found = null_space(factors_of(W, list("abcdef")))
    assert len(found) == 2
    for direction in found:
        assert np.abs(W @ direction.weights).max() < 1e-10
        weights = dict(zip("abcdef", direction.weights * scale, strict=True))
        assert {n for n, v in weights.items() if abs(v) > 1e-9} == set(direction.regressors)


def test_nothing_moved():
    with pytest.raises(NotIdentifiableError, match="the columns a, b are zero"):
        fit(factors_of(np.zeros((4, 20, 2)), ["a", "b"]))


def test_fewer_rows_than_columns():
    with pytest.raises(NotIdentifiableError, match="rank 4 of 6"):
        fit(factors_of(movement()[:2, :2], list("abcdef")))


@pytest.mark.parametrize(("closeness", "warned"), [(1e-4, False), (1e-7, True)])
def test_near_dependence_warns_by_name(closeness, warned):
    W = movement(4)
    W[..., 4] = 1e3 * (W[..., 1] + closeness * W[..., 4])
    result = fit(factors_of(W, list("abcdef")))
    assert bool(result.warnings) is warned
    if warned:
        assert result.warnings[0].startswith("nearly dependent columns: ")
        named = result.warnings[0].split(": ")[1].split(" (")[0]
        assert set(named.split(", ")) == {"b", "e"}


@pytest.mark.parametrize("rows", [10, 1000])
def test_rank_tolerance_lies_between_rounding_and_the_hardest_real_problem(rows):
    """Rounded copies are refused, a part of 1e-10 of its own is still seen."""
    rng = np.random.default_rng(5)
    W = rng.standard_normal((20, rows, 3))
    own = W[..., 2].copy()
    W[..., 2] = (W[..., 0] * 0.1 + W[..., 1]) * 3.0
    with pytest.raises(NotIdentifiableError):
        fit(factors_of(W, list("abc")))
    W[..., 2] += 3e-10 * own
    assert fit(factors_of(W, list("abc"))).rank == 3
