"""Maximum likelihood with noisy motion: the stationary point is the numerical maximum."""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize

from armimpedance.hand.still.estimation import Options, estimate
from armimpedance.hand.still.methods.likelihood import score_equations
from armimpedance.hand.still.modal import modal_equation
from armimpedance.hand.still.weighing import through_impedance
from armimpedance.numerics.regression.equations import solve_total
from armimpedance.numerics.signals.windows import cut_windows


def test_noise_free_truth_comes_back(limb):
    made = estimate(limb.record(), options=Options(method="likelihood"))[0]
    for found, true in ((made.inertia, limb.M), (made.viscosity, limb.B), (made.stiffness, limb.K)):
        assert np.linalg.norm(found - true) < 2e-3 * np.linalg.norm(true)


def test_stationary_point_is_the_numerical_maximum(limb):
    """-2 log L = sum_t r_t^T Sigma(theta)^-1 r_t, minimised by a general optimiser."""
    single = {"inertia": np.array([[1.3]]), "viscosity": np.array([[9.0]]), "kind": "joint"}
    recording = limb.record(
        stiffness=np.array([[120.0]]), directions=4, sets=2, force_noise=0.1, **single
    )
    rng = np.random.default_rng(8)
    window = cut_windows(recording)
    noisy = window.position + rng.normal(0, 3e-5, window.position.shape)
    equation = modal_equation(type(window)(**{**vars(window), "position": noisy}))
    n = equation.modes.count
    force = 0.01 * np.eye(n)
    operators = equation.modes.stacked
    position = (9e-10 * operators @ operators.T)[None]

    def loss(scaled):
        theta = scaled * [1.0, 10.0, 100.0]
        r = equation.residual(theta)
        V = np.linalg.inv(force + through_impedance(theta, position))
        return np.einsum("ti,ij,tj->", r, V, r)

    best = minimize(
        loss, [1.0, 1.0, 1.0], method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-9}
    )
    theta = np.array([1.0, 10.0, 100.0])
    for _ in range(60):
        theta = solve_total(score_equations(equation, force, position, theta, "joint"))
    np.testing.assert_allclose(theta / [1, 10, 100], best.x, rtol=2e-5)


def test_truth_inside_the_interval_with_noise(limb):
    recording = limb.record(force_noise=0.1, drift=0.003, seed=6)
    made = estimate(recording, options=Options(method="likelihood"))[0]
    apart = np.abs(made.stiffness - limb.K) / made.sd[2]
    assert (apart < 3.5).all()
