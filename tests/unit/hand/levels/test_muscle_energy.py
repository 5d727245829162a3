"""Joint stiffness of muscles is the second derivative of their energy, curvature included."""

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.hand.levels.muscle_map import curvature_term, joint_stiffness, joint_viscosity
from armimpedance.limb.arm.muscular_arms import arm_named
from armimpedance.limb.arm.polynomial_paths import PolynomialPaths, monomial_exponents
from armimpedance.limb.arm.table_paths import TablePaths

STEP = 4e-3
SHOULDER, ELBOW = np.deg2rad(np.arange(0, 121, 15)), np.deg2rad(np.arange(15, 136, 15))


def some_polynomials():
    exponents = monomial_exponents(2, 3)
    c = np.random.default_rng(4).standard_normal((6, len(exponents)))
    c = 0.03 * c / 2 ** exponents.sum(axis=1)
    return PolynomialPaths(tuple("abcdef"), exponents, c, np.array([[0.0, 2.0], [0.3, 2.3]]))


def cosine_table():
    """Arms that rise and fall with their own joint, two of six muscles over both."""
    rng = np.random.default_rng(5)
    arms = np.zeros((6, len(SHOULDER), len(ELBOW), 2))
    size = rng.uniform(0.02, 0.05, (6, 2)) * np.array([[1, -1]] * 3 + [[-1, 1]] * 3)
    size[0, 1] = size[1, 1] = size[2, 0] = size[3, 0] = 0
    for j, q in enumerate((SHOULDER[:, None], ELBOW[None, :])):
        peak = rng.uniform(0.5, 2.0, (6, 1, 1))
        arms[..., j] = size[:, j, None, None] * (1 + 0.3 * np.cos(q - peak))
    return TablePaths(tuple("abcdef"), SHOULDER, ELBOW, arms)


PATHS = {
    "polynomial": some_polynomials,
    "table": cosine_table,
    "arm26": lambda: arm_named("arm26").paths,
    "planar6": lambda: arm_named("planar6").paths,
}


def lengthening(paths, start, q):
    """Length at q (..., 2) less that at `start`: Gauss's rule on the straight line, exact inside
    one mesh of a cubic spline and for polynomial arms up to order 11."""
    nodes, weights = np.polynomial.legendre.leggauss(6)
    way = q - start
    points = start + way[..., None, :] * (nodes[:, None] + 1) / 2
    along = np.einsum("...gmj,...j->...gm", paths.moment_arms(points), way)
    return np.einsum("g,...gm->...m", weights / 2, along)


def energy_and_truth(paths, q):
    """The energy of six springs as a function of q, and their tensions and stiffnesses at q.

    Tension grows quadratically: its slope is not its chord.
    """
    rng = np.random.default_rng(6)
    f, k, bend = rng.uniform(50, 200, 6), rng.uniform(1e3, 6e3, 6), rng.uniform(1e4, 5e4, 6)

    def energy(at):
        x = lengthening(paths, q, at)
        return (f * x + k * x**2 / 2 + bend * x**3 / 6).sum(axis=-1)

    return energy, f, k


def second_differences(function, q):
    """Fourth-order differences of differences, (2, 2)."""
    offsets, weights = np.array([-2, -1, 1, 2]), np.array([1, -8, 8, -1]) / 12

    def first(at, j):
        moved = at[..., None, :] + offsets[:, None] * STEP * np.eye(2)[j]
        return np.einsum("o,...o->...", weights, function(moved)) / STEP

    return np.array([[first_of(first, q, i, j) for j in (0, 1)] for i in (0, 1)]) / STEP


def first_of(first, q, i, j):
    offsets, weights = np.array([-2, -1, 1, 2]), np.array([1, -8, 8, -1]) / 12
    return weights @ first(q + offsets[:, None] * STEP * np.eye(2)[i], j)


@pytest.mark.parametrize("name", PATHS)
@pytest.mark.parametrize("degrees", [(37, 68), (52, 97), (82, 113)])
def test_joint_stiffness_is_the_second_derivative_of_the_energy(name, degrees):
    paths, q = PATHS[name](), np.deg2rad(np.array(degrees, dtype=float))
    energy, f, k = energy_and_truth(paths, q)
    G, C = paths.moment_arms(q), paths.curvature(q)
    wanted = second_differences(energy, q)
    found = joint_stiffness(G, k, f, C)
    size = np.linalg.norm(wanted)
    assert np.linalg.norm(found - wanted) < 1e-6 * size
    if name == "planar6":
        assert (C == 0).all()
        return
    # the other sign, and none, fail by far
    bare = joint_stiffness(G, k)
    assert np.linalg.norm(bare - curvature_term(f, C) - wanted) > 1e-2 * size
    assert np.linalg.norm(bare - wanted) > 5e-3 * size


def test_stiffness_and_viscosity_in_batches_are_those_one_by_one():
    paths, rng = some_polynomials(), np.random.default_rng(7)
    q, k, f = (
        rng.uniform(0.5, 1.5, (4, 3, 2)),
        rng.uniform(0, 5e3, (4, 3, 6)),
        rng.random((4, 3, 6)),
    )
    G, C = paths.moment_arms(q), paths.curvature(q)
    K, B = joint_stiffness(G, k, f, C), joint_viscosity(G, k)
    for i in np.ndindex(4, 3):
        alone = G[i].T @ np.diag(k[i]) @ G[i]
        np.testing.assert_allclose(B[i], alone, rtol=1e-13)
        np.testing.assert_allclose(K[i], alone + np.tensordot(f[i], C[i], axes=1), rtol=1e-12)


def test_half_a_curvature_term_and_wrong_sizes_are_refused():
    G, C = np.ones((6, 2)), np.ones((6, 2, 2))
    with pytest.raises(InputError, match="both"):
        joint_stiffness(G, np.ones(6), tensions=np.ones(6))
    with pytest.raises(InputError, match="both"):
        joint_stiffness(G, np.ones(6), curvature=C)
    with pytest.raises(InputError):
        joint_stiffness(G, np.ones(5))
    with pytest.raises(InputError):
        joint_stiffness(G, np.ones(6), np.ones(5), C)
    with pytest.raises(InputError):
        joint_viscosity(G, 3.0)
