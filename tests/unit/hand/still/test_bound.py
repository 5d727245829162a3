"""The bound: an oracle with the motion among the unknowns, scaling laws, and an estimator at it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from armimpedance.hand.still.bound import bound
from armimpedance.hand.still.modal import modal_equation, weighted_equations
from armimpedance.hand.still.weighing import through_impedance
from armimpedance.numerics.regression.equations import solve_total
from armimpedance.numerics.signals.windows import cut_windows


def equation_of(limb, **options):
    return modal_equation(cut_windows(limb.record(**options)))


def test_unknown_motion_oracle(limb):
    """Joint information of theta and every unknown of the motion, inverted as a whole."""
    single = {"inertia": np.array([[1.3]]), "viscosity": np.array([[9.0]]), "kind": "joint"}
    equation = equation_of(limb, stiffness=np.array([[120.0]]), sets=1, directions=3, **single)
    n, trials = equation.modes.count, equation.trials
    theta, rng = np.array([1.3, 9.0, 120.0]), np.random.default_rng(0)
    root = 1e-6 * rng.normal(size=(3 * n, 3 * n))
    position = (root @ root.T)[None] + 1e-14 * np.eye(3 * n)
    force = 1e-3 * np.eye(n) + 1e-3 * np.ones((n, n))
    quick = bound(equation, force + through_impedance(theta, position))
    # unknown: theta and z_t = (x'', x', x) in modes of each trial, measured with noise; y = A z + e
    A = np.hstack([theta[m] * np.eye(n) for m in range(3)])
    p = 3 + trials * 3 * n
    information = np.zeros((p, p))
    V, P = np.linalg.inv(force), np.linalg.inv(position[0])
    for t in range(trials):
        G = equation.motion[t, :, 0].T
        z = slice(3 + t * 3 * n, 3 + (t + 1) * 3 * n)
        information[:3, :3] += G.T @ V @ G
        information[:3, z] = G.T @ V @ A
        information[z, :3] = information[:3, z].T
        information[z, z] = A.T @ V @ A + P
    scale = 1 / np.sqrt(np.diag(information))
    slow = np.linalg.inv(information * scale[:, None] * scale) * scale[:, None] * scale
    np.testing.assert_allclose(quick, slow[:3, :3], rtol=1e-5)


def test_twice_the_noise_four_times_the_variance_twice_the_trials_half_of_it(limb):
    few, many = equation_of(limb, sets=2), equation_of(limb, sets=4)
    covariance = np.eye(2 * few.modes.count)
    one = bound(few, covariance)
    np.testing.assert_allclose(bound(few, 4 * covariance), 4 * one, rtol=1e-10)
    np.testing.assert_allclose(bound(many, covariance), one / 2, rtol=1e-8)


def test_position_noise_never_helps(limb):
    equation = equation_of(limb, sets=1)
    n = equation.modes.count
    theta = np.concatenate([limb.M.ravel(), limb.B.ravel(), limb.K.ravel()])
    operators = equation.modes.stacked
    position = np.stack([25e-12 * operators @ operators.T] * 2)
    force = 1e-3 * np.eye(2 * n)
    known, unknown = (
        bound(equation, force),
        bound(equation, force + through_impedance(theta, position)),
    )
    assert np.linalg.eigvalsh(unknown - known).min() > -1e-9 * np.abs(known).max()
    # inertia lives on acceleration, where position noise is largest
    assert (np.diag(unknown)[:4] > 1.02 * np.diag(known)[:4]).all()


def test_least_squares_with_known_weights_reaches_it(limb):
    equation = equation_of(limb, sets=1)
    n, trials = equation.modes.count, equation.trials
    lag = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
    covariance = np.kron(np.array([[1.0, 0.3], [0.3, 0.5]]), 0.01 * 0.7**lag)
    least = np.diag(bound(equation, covariance))
    V, rng, found = np.linalg.inv(covariance), np.random.default_rng(4), []
    for _ in range(400):
        noise = rng.multivariate_normal(np.zeros(2 * n), covariance, trials).reshape(trials, 2, n)
        noisy = replace(equation, force=equation.force + noise)
        found.append(solve_total(weighted_equations(noisy, (V + V.T) / 2, "hand")))
    ratio = np.var(found, axis=0) / least
    # a variance from 400 draws has a standard error of 7 %
    assert (np.abs(ratio - 1) < 4 * 0.07).all()
