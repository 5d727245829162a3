"""Where postures were measured, and the scaled angles in which that is asked."""

from __future__ import annotations

import numpy as np
import pytest

from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.muscles.models.posture.certificate import (
    checked_order,
    exponents,
    monomials,
    term_names,
)
from armimpedance.muscles.models.workspace import (
    AngleScaling,
    Region,
    require_spread,
    stated_scaling,
)


def test_the_hull_holds_its_points_all_mixtures_of_them_and_nothing_far_out():
    rng = np.random.default_rng(0)
    points = rng.normal(size=(30, 2))
    region = Region.of(points, tolerance=1e-9)
    assert region.contains(points).all()
    assert region.contains(rng.dirichlet(np.ones(30), 200) @ points).all()
    outwards = rng.normal(size=(50, 2))
    outwards /= np.linalg.norm(outwards, axis=1)[:, None]
    # beyond the furthest point in a direction there is nothing
    reach = (points @ outwards.T).max(axis=0)
    assert not region.contains((reach + 1e-6)[:, None] * outwards).any()


def test_the_nearest_point_is_nearer_than_any_mixture():
    rng = np.random.default_rng(1)
    points, asked = rng.normal(size=(8, 2)), 4 * rng.normal(size=(40, 2))
    nearest = Region.of(points).nearest(asked)
    mixtures = rng.dirichlet(np.full(8, 0.3), 3000) @ points
    gap = np.linalg.norm(asked[:, None] - mixtures, axis=-1).min(axis=1)
    assert (np.linalg.norm(asked - nearest, axis=1) <= gap + 1e-12).all()
    assert Region.of(points, tolerance=1e-9).contains(nearest).all()


def test_tolerance_widens_the_hull_by_just_that_much():
    square = Region.of([[0, 0], [1, 0], [1, 1], [0, 1]], tolerance=0.1)
    assert square.contains([[1.09, 0.5], [1.07, 1.07]]).all()
    assert not square.contains([[1.11, 0.5], [1.08, 1.08]]).any()


@pytest.mark.parametrize(
    "points",
    [[[0.3, 0.4]], [[0.3, 0.4]] * 3, [[0, 0], [0.6, 0.8]], [[0, 0], [0.3, 0.4], [0.6, 0.8]]],
)
def test_points_on_a_line_make_a_segment(points):
    region = Region.of(points, tolerance=0.01)
    assert region.contains(points).all()
    assert region.contains([0.304, 0.403])
    assert not region.contains([[0.33, 0.38], [2, 2], [-1, -1]]).any()


def test_a_region_needs_points_and_a_tolerance():
    with pytest.raises(InputError, match="without points"):
        Region(np.zeros((0, 2)))
    with pytest.raises(InputError, match="tolerance"):
        Region.of([[0, 0]], tolerance=-1.0)


def test_scaled_angles_fill_the_box_and_come_back():
    q = np.random.default_rng(2).uniform([0.1, 1.0], [1.5, 2.0], (12, 2))
    scaling = AngleScaling.of(q)
    u = scaling.scaled(q)
    np.testing.assert_allclose([u.min(axis=0), u.max(axis=0)], [[-1, -1], [1, 1]], atol=1e-12)
    np.testing.assert_allclose(scaling.angles(u), q, atol=1e-14)
    corners = scaling.grid(5)
    assert len(corners) == 25
    np.testing.assert_allclose(corners.min(axis=0), scaling.box[:, 0])


def test_a_box_must_be_one_and_hold_the_postures():
    q = np.array([[0.5, 1.0], [1.0, 1.5]])
    with pytest.raises(InputError, match="lowest angle first"):
        AngleScaling(np.array([[1.0, 0.0], [0.0, 1.0]]))
    with pytest.raises(InputError, match="far: elbow at 85.9 degrees is outside"):
        stated_scaling([[0, 2], [0, 1.2]], q, ("near", "far"))
    assert stated_scaling([[0, 2], [0, 2]], q, ("near", "far")).half_range.tolist() == [1, 1]


def test_joints_that_did_not_move_are_named():
    q = np.random.default_rng(3).uniform(0, 1, (9, 2))
    require_spread(q, 1)
    with pytest.raises(NotIdentifiableError, match="elbow did not move") as caught:
        require_spread(q * [1, 0.001], 1)
    assert caught.value.parameters == ("elbow",)
    with pytest.raises(NotIdentifiableError, match="all postures are the same"):
        require_spread(np.tile(q[:1], (9, 1)), 1)


@pytest.mark.parametrize(("degree", "terms"), [(0, 1), (2, 6), (4, 15)])
def test_terms_are_all_monomials_of_a_degree(degree, terms):
    powers = exponents(degree)
    assert len(powers) == len(set(map(tuple, powers.tolist()))) == len(set(term_names(powers)))
    assert len(powers) == terms
    u = np.array([[0.3, -0.7]])
    np.testing.assert_allclose(monomials(u, powers)[0], np.prod(u**powers, axis=1), rtol=1e-14)


@pytest.mark.parametrize("order", [-1, 7, 1.0, "2", True, None])
def test_an_order_is_a_small_whole_number(order):
    with pytest.raises(InputError, match="moment arms of order"):
        checked_order(order)
