"""Nearest semidefinite matrices: their optimality conditions, and a general solver's answer."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from armimpedance.core.errors import InputError
from armimpedance.hand.still.cones import nearest_semidefinite, project_on_cone


def _in_cone(u, slack=1e-9):
    return u[0] >= np.hypot(u[1], u[2]) - slack


@given(st.integers(0, 10_000))
def test_one_cone_is_optimal(seed):
    """u in the cone, gradient Q (u - c) in the dual cone, orthogonal to u: necessary and
    sufficient for a convex problem."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(3, 3))
    Q, c = A @ A.T + 0.05 * np.eye(3), rng.normal(size=3)
    u, place = project_on_cone(Q, c)
    gradient = Q @ (u - c)
    scale = np.linalg.norm(Q @ c)
    assert _in_cone(u)
    assert _in_cone(gradient / scale, 1e-6)
    assert abs(u @ gradient) < 1e-6 * scale * max(np.linalg.norm(c), 1)
    if place == "apex":
        assert not u.any()
    elif place == "surface":
        assert u[0] == np.hypot(u[1], u[2])
    else:
        assert np.array_equal(u, c)


def test_places_of_known_centres():
    one = np.eye(3)
    assert project_on_cone(one, np.array([2.0, 1, 1]))[1] == "inside"
    # the Euclidean projection of (0, 1, 0) on the cone is (1/2, 1/2, 0)
    u, place = project_on_cone(one, np.array([0.0, 1, 0]))
    assert place == "surface"
    assert u == pytest.approx([0.5, 0.5, 0], abs=1e-12)
    u, place = project_on_cone(one, np.array([-0.5, 1, 0]))
    assert u == pytest.approx([0.25, 0.25, 0], abs=1e-12)
    assert project_on_cone(one, np.array([-2.0, 1, 1]))[1] == "apex"


@pytest.mark.parametrize("seed", range(12))
def test_three_matrices_against_a_general_solver(seed):
    """cvxpy solves the same problem as a semidefinite program; its objective agrees to 1e-6."""
    cp = pytest.importorskip("cvxpy")
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(9, 9))
    Q = A @ A.T + np.eye(9)
    c = rng.normal(size=9) + np.tile([0.5, 0, 0], 3)
    found = nearest_semidefinite(Q, c, 2)
    X = [cp.Variable((2, 2), PSD=True) for _ in range(3)]
    u = cp.hstack(
        [v for x in X for v in ((x[0, 0] + x[1, 1]) / 2, (x[0, 0] - x[1, 1]) / 2, x[0, 1])]
    )
    problem = cp.Problem(cp.Minimize(cp.sum_squares(np.linalg.cholesky(Q).T @ (u - c))))
    problem.solve(solver="CLARABEL")
    ours = (found.u - c) @ Q @ (found.u - c)
    assert all(_in_cone(found.u[i : i + 3]) for i in (0, 3, 6))
    assert ours == pytest.approx(problem.value, rel=1e-6, abs=1e-6)


def test_scalars_are_cut_at_zero_together():
    """Two correlated numbers, one negative: the other moves to its conditional optimum."""
    Q = np.array([[1.0, 0.5], [0.5, 1.0]])
    found = nearest_semidefinite(Q, np.array([-1.0, 2.0]), 1)
    assert found.u == pytest.approx([0.0, 1.5])
    assert found.places == ("apex", "inside")


def test_what_has_no_closed_form_is_refused():
    with pytest.raises(InputError, match="size 3"):
        nearest_semidefinite(np.eye(6), np.ones(6), 3)
    with pytest.raises(InputError, match="not positive definite"):
        nearest_semidefinite(np.diag([1.0, 1, -1]), np.ones(3), 2)
