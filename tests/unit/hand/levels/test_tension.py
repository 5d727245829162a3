"""Static optimisation against a general solver, and what it refuses."""

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.hand.levels.tension import tensions_for
from armimpedance.limb.arm.muscular_arms import arm_named


def reachable(name, count, seed=0, top=1.0):
    """Moment arms and torques that some tensions make."""
    arm, rng = arm_named(name), np.random.default_rng(seed)
    low, high = arm.angle_range.T
    G = arm.paths.moment_arms(rng.uniform(low, high, (count, 2)))
    tension = arm.max_tension * top * rng.random((count, 6)) ** rng.choice([0.3, 1, 4], (count, 1))
    return arm, G, -np.einsum("pmn,pm->pn", G, tension)


def oracle(tau, G, top, wished):
    """The same problem through Clarabel, slowly."""
    import cvxpy as cp

    a = cp.Variable(len(top))
    made = -(G * top[:, None]).T @ a
    problem = cp.Problem(cp.Minimize(cp.sum_squares(a - wished)), [made == tau, a >= 0, a <= 1])
    problem.solve(solver="CLARABEL", tol_gap_abs=1e-11, tol_gap_rel=1e-11, tol_feas=1e-11)
    assert problem.status == "optimal"
    return a.value


@pytest.mark.parametrize("name", ["planar6", "arm26"])
@pytest.mark.parametrize("measured", [False, True])
def test_tensions_are_those_of_a_general_solver(name, measured):
    arm, G, tau = reachable(name, 12)
    wished = np.random.default_rng(1).random((12, 6)) if measured else np.zeros((12, 6))
    found = tensions_for(tau, G, arm.max_tension, activation=wished if measured else None)
    for row in range(12):
        a = oracle(tau[row], G[row], arm.max_tension, wished[row])
        assert np.abs(found[row] / arm.max_tension - a).max() < 1e-6


@pytest.mark.parametrize("name", ["planar6", "arm26"])
def test_tensions_make_the_torque_and_keep_their_limits(name):
    arm, G, tau = reachable(name, 3000, seed=2)
    f = tensions_for(tau, G, arm.max_tension)
    assert np.abs(np.einsum("pmn,pm->pn", G, f) + tau).max() < 1e-8
    assert f.min() >= 0
    assert (f <= arm.max_tension).all()


def test_no_torque_needs_no_tension_and_measured_activation_that_fits_stays():
    arm, G, _ = reachable("planar6", 5)
    np.testing.assert_array_equal(tensions_for(np.zeros((5, 2)), G, arm.max_tension), 0)
    a = np.random.default_rng(3).random((5, 6))
    tau = -np.einsum("pmn,pm->pn", G, a * arm.max_tension)
    f = tensions_for(tau, G, arm.max_tension, activation=a)
    np.testing.assert_allclose(f, a * arm.max_tension, atol=1e-6)


def test_a_batch_gives_the_bits_of_its_rows():
    arm, G, tau = reachable("planar6", 24, seed=4)
    together = tensions_for(tau.reshape(4, 6, 2), G.reshape(4, 6, 6, 2), arm.max_tension)
    for i, (row, arms) in enumerate(zip(tau, G, strict=True)):
        alone = tensions_for(row, arms, arm.max_tension)
        np.testing.assert_array_equal(together.reshape(24, 6)[i], alone)


def test_effort_is_least_among_tensions_of_the_same_torque():
    arm, G, tau = reachable("planar6", 1, seed=5, top=0.3)
    f = tensions_for(tau, G, arm.max_tension)[0]
    null = np.linalg.svd(G[0].T)[2][2:]
    effort = np.sum((f / arm.max_tension) ** 2)
    others = f + np.random.default_rng(6).normal(0, 20, (400, 4)) @ null
    allowed = others[(others >= 0).all(axis=1) & (others <= arm.max_tension).all(axis=1)]
    assert len(allowed) > 5
    assert (np.sum((allowed / arm.max_tension) ** 2, axis=1) >= effort).all()


def test_three_joints_and_nine_muscles():
    rng = np.random.default_rng(7)
    G, top = rng.normal(0, 0.04, (20, 9, 3)), rng.uniform(300, 900, 9)
    a = rng.random((20, 9))
    tau = -np.einsum("pmn,pm->pn", G, a * top)
    f = tensions_for(tau, G, top)
    assert np.abs(np.einsum("pmn,pm->pn", G, f) + tau).max() < 1e-8
    assert (np.sum((f / top) ** 2, axis=1) <= np.sum(a**2, axis=1) * (1 + 1e-12)).all()


def test_a_torque_out_of_reach_names_the_row_and_what_can_be_made():
    arm, G, tau = reachable("planar6", 3, seed=8)
    # along this direction biceps and pectoralis pull with all they have
    limit = 0.0536 * 800 + 0.0386 * 800
    tau[1] = [limit / 0.8, 0.0427 * 800 / 0.8]
    with pytest.raises(InputError, match="row 2: no tensions") as told:
        tensions_for(tau, G, arm.max_tension)
    share = float(str(told.value).split("at most ")[1].split(" %")[0]) / 100
    assert share == pytest.approx(0.8, abs=1e-3)
    tau[1] *= 0.999 * share
    tensions_for(tau, G, arm.max_tension)
    tau[1] *= 1.01 / 0.999
    with pytest.raises(InputError, match="monday"):
        tensions_for(tau, G, arm.max_tension, labels=["sunday", "monday", "tuesday"])


def test_a_direction_that_nobody_pulls_in():
    # two flexors of one joint
    G = np.array([[-0.05, 0.0], [-0.03, 0.0]])
    with pytest.raises(InputError, match="a direction that the muscles can pull in"):
        tensions_for([-5.0, 0.0], G, [500.0, 500.0])
    np.testing.assert_allclose(tensions_for([5.0, 0.0], G, [500.0, 500.0]) @ G, [-5, 0], atol=1e-8)


@pytest.mark.parametrize(
    ("tau", "top"),
    [([np.nan, 0.0], [1.0, 1.0]), ([1.0, 0.0], [1.0, 0.0]), ([1.0, 0.0], [-1.0, 1.0])],
)
def test_nonsense_is_refused(tau, top):
    with pytest.raises(InputError):
        tensions_for(tau, np.full((2, 2), 0.03), top)
