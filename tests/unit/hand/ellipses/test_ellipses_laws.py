"""Turning a matrix with its covariance turns the ellipse and its limits, and nothing else."""

import numpy as np
import pytest

from armimpedance.hand.ellipses import ellipse, locus


def rotation(angle):
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


@pytest.fixture(scope="module")
def covariance():
    """Of a matrix' four elements, row by row: very different along its directions."""
    root = np.random.default_rng(4).normal(size=(4, 4)) * [6.0, 1.0, 1.0, 2.0]
    return root @ root.T


@pytest.mark.parametrize("degrees", range(-87, 93, 4))
def test_limits_turn_with_the_matrix(covariance, degrees):
    """Size and shape keep their limits, the axis' limits turn: whichever axis of the page is near.

    The reference turns too, so that the orientation itself stays.
    """
    A, turn = np.diag([150.0, 90.0]), np.deg2rad(degrees)
    R = rotation(turn)
    both = np.kron(R, R)
    first = ellipse(A, covariance=covariance, dof=20)
    turned = ellipse(
        R @ A @ R.T,
        covariance=both @ covariance @ both.T,
        reference_angle_rad=turn,
        dof=20,
    )
    assert not first.may_be_circular()
    np.testing.assert_allclose(turned.interval(), first.interval(), rtol=1e-8, atol=1e-9)
    assert turned.size == pytest.approx(first.size)
    np.testing.assert_allclose(turned.covariance, first.covariance, rtol=1e-8, atol=1e-10)


def test_limits_of_the_axis_lie_about_it(covariance):
    made = ellipse(np.diag([150.0, 90.0]), covariance=covariance, dof=20)
    low, high = made.interval()[1]
    assert low < made.orientation_rad < high
    assert high - low < np.pi / 2


@pytest.mark.parametrize("points", [2, 7, 200])
def test_the_locus_is_the_matrix_on_the_unit_circle(points):
    A = np.array([[150.0, 40.0], [-10.0, 60.0]])
    angle = np.linspace(0, 2 * np.pi, points)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    np.testing.assert_allclose(locus(A, points), circle @ (A + A.T) / 2, atol=1e-12)
