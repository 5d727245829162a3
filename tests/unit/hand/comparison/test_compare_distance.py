"""The affine-invariant distance: a metric that no change of frame or unit touches."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra.numpy import arrays

from armimpedance.core.errors import InputError
from armimpedance.hand.comparison.matrix_test import (
    affine_invariant_distance,
    expected_square,
    upper_elements,
)

entries = st.floats(-3, 3)


def definite(root):
    """A positive-definite matrix of any root."""
    return root @ root.T + 0.1 * np.eye(len(root))


@given(*(arrays(float, (2, 2), elements=entries) for _ in range(4)))
def test_metric_and_invariances(a, b, c, g):
    A, B, C = definite(a), definite(b), definite(c)
    d = affine_invariant_distance(A, B)
    assert d == pytest.approx(affine_invariant_distance(B, A), abs=1e-9)
    assert affine_invariant_distance(A, A) == pytest.approx(0, abs=1e-6)
    inverse = affine_invariant_distance(np.linalg.inv(A), np.linalg.inv(B))
    assert d == pytest.approx(inverse, abs=1e-6)
    through = affine_invariant_distance(A, C) + affine_invariant_distance(C, B)
    assert d <= through + 1e-9
    G = g + 4 * np.eye(2)
    if abs(np.linalg.det(G)) > 0.1:
        moved = affine_invariant_distance(G @ A @ G.T, G @ B @ G.T)
        assert d == pytest.approx(moved, abs=1e-6)


@pytest.mark.parametrize("k", [1, 2, 3])
def test_a_scaled_matrix_is_as_far_as_its_logarithm(k):
    A = definite(np.random.default_rng(k).normal(size=(k, k)))
    assert affine_invariant_distance(A, 3 * A) == pytest.approx(np.sqrt(k) * np.log(3))


def test_the_antisymmetric_part_does_not_count():
    A, skew = np.array([[2.0, 0.3], [0.3, 1.0]]), np.array([[0, 0.4], [-0.4, 0]])
    assert affine_invariant_distance(A, A + skew) == pytest.approx(0, abs=1e-7)


def test_what_is_not_definite_has_no_distance_and_harms_no_other():
    A = np.array([[[2.0, 0], [0, 1]], [[1, 2], [2, 1]], [[2.0, 0], [0, 1]]])
    d = affine_invariant_distance(A, np.eye(2))
    assert np.isnan(d).tolist() == [False, True, False]
    assert d[0] == pytest.approx(np.log(2))
    with pytest.raises(InputError):
        affine_invariant_distance(np.eye(2), np.eye(3))


def test_expected_square_is_what_chance_makes_of_it():
    rng = np.random.default_rng(0)
    P = np.array([[105.0, -74], [-74, 179]])
    C = np.array([[4.0, 1, 0.5], [1, 3, 0], [0.5, 0, 5]])
    x = rng.multivariate_normal(np.zeros(3), C, 20_000)
    D = np.empty((len(x), 2, 2))
    D[:, 0, 0], D[:, 0, 1], D[:, 1, 0], D[:, 1, 1] = x[:, 0], x[:, 1], x[:, 1], x[:, 2]
    square = affine_invariant_distance(P - D / 2, P + D / 2) ** 2
    error = square.std() / np.sqrt(len(square))
    # 4 standard errors, and what the first order leaves out: of the order (2 %)^2
    assert abs(square.mean() - expected_square(P, C)) < 4 * error + 0.005 * square.mean()


def test_upper_elements_take_the_symmetric_part():
    A = np.arange(9.0).reshape(3, 3)
    S = (A + A.T) / 2
    assert upper_elements(3) @ A.ravel() == pytest.approx(S[np.triu_indices(3)])
