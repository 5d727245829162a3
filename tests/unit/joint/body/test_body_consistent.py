"""Every segment possible, as near to the data as that allows, and to the prior as it is trusted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.joint.body.base_parameters import essential_base_parameters
from armimpedance.joint.body.consistent import fit_consistent
from armimpedance.joint.body.equations import body_equations
from armimpedance.joint.body.estimate import fit_base
from armimpedance.joint.body.regressor import (
    inertial_parameters,
    pseudo_inertia_basis,
    pseudo_inertias,
)
from armimpedance.joint.body.rows import RowChoice


@pytest.fixture(scope="module")
def problem(small, rigs):
    """Noise that makes the free fit impossible."""
    recording, _ = rigs.moving(small, 4, trials=1, size=0.15)
    rng = np.random.default_rng(1)
    levels = np.array([4.0, 4, 4, 2, 2, 2])
    noise = levels * rng.standard_normal(recording.wrenches.shape)
    recording = replace(recording, wrenches=recording.wrenches + noise)
    equations = body_equations(recording, RowChoice())
    base = essential_base_parameters(small)
    return equations, base, fit_base(equations, base).weights


@pytest.fixture(scope="module")
def prior(rigs):
    """Another body with the same bones: the masses of another seed."""
    return inertial_parameters(rigs.tree(rigs.SMALL, 8))


def misfit(equations, weights, phi):
    r = equations.stacked(weights)
    p = len(equations.columns)
    return float(((r[:, p] - r[:, :p] @ phi) ** 2).sum())


def test_exact_data_give_the_truth_whatever_the_prior(small, rigs, prior):
    equations = body_equations(rigs.moving(small, 4)[0], RowChoice())
    base = essential_base_parameters(small)
    weights = fit_base(equations, base).weights
    found = fit_consistent(equations, base, weights, prior)
    truth = base.of(inertial_parameters(small))
    assert np.abs(found.base / truth - 1).max() < 1e-9
    assert np.linalg.eigvalsh(pseudo_inertias(found.phi)).min() > 0


def test_the_free_fit_is_impossible_and_the_other_is_not(problem, prior):
    import cvxpy as cp

    equations, base, weights = problem
    free = fit_base(equations, base)
    # no choice of what is hidden makes the free fit possible
    hidden, margin = cp.Variable(base.null_space.shape[1]), cp.Variable()
    phi = base.lift(free.values) + base.null_space @ hidden
    blocks = [
        sum(phi[10 * s + i] * B for i, B in enumerate(pseudo_inertia_basis())) for s in range(3)
    ]
    task = cp.Problem(cp.Maximize(margin), [b - margin * np.eye(4) >> 0 for b in blocks])
    task.solve(solver=cp.CLARABEL)
    assert margin.value < -1e-4
    found = fit_consistent(equations, base, weights, prior)
    assert np.linalg.eigvalsh(pseudo_inertias(found.phi)).min() > 0
    np.testing.assert_allclose(found.base, base.of(found.phi))


def test_without_a_prior_it_is_the_semidefinite_program(problem, prior):
    """The oracle: cvxpy and Clarabel on the same triangle."""
    import cvxpy as cp

    equations, base, weights = problem
    found = fit_consistent(equations, base, weights, prior)
    r, p = equations.stacked(weights), len(equations.columns)
    phi = cp.Variable(p)
    blocks = [
        sum(phi[10 * s + i] * B for i, B in enumerate(pseudo_inertia_basis())) for s in range(3)
    ]
    size = np.abs(r[:, p]).max()
    task = cp.Problem(
        cp.Minimize(cp.sum_squares((r[:, p] - r[:, :p] @ phi) / size)), [b >> 0 for b in blocks]
    )
    task.solve(solver=cp.CLARABEL)
    best = task.value * size**2
    own, free = misfit(equations, weights, found.phi), fit_base(equations, base)
    lowest = misfit(equations, weights, base.lift(free.values))
    assert lowest < own < best + 1e-5 * (best - lowest) + 1e-7 * best


def test_the_gradient_vanishes(problem, prior):
    equations, base, weights = problem
    found = fit_consistent(equations, base, weights, prior, prior_sd=0.3)
    inverse = np.linalg.inv(pseudo_inertias(prior))

    def objective(phi):
        P = pseudo_inertias(phi)
        divergence = np.einsum("sij,sji->", inverse, P) - np.linalg.slogdet(P)[1].sum()
        return misfit(equations, weights, phi) / 2 + found.gamma * divergence

    rng = np.random.default_rng(0)
    here = objective(found.phi)
    sd = np.sqrt(np.diag(found.covariance))
    for _ in range(10):
        step = 0.05 * sd * rng.standard_normal(len(found.phi))
        slope = (objective(found.phi + step) - objective(found.phi - step)) / 2
        curve = (objective(found.phi + step) + objective(found.phi - step)) / 2 - here
        assert curve > 0
        # the odd part of the divergence is of third order: far below the even one
        assert abs(slope) < 0.3 * curve


def test_the_covariance_is_the_inverse_of_the_curvature(problem, prior):
    equations, base, weights = problem
    found = fit_consistent(equations, base, weights, prior, prior_sd=0.3)
    P = np.linalg.inv(pseudo_inertias(found.phi))
    basis = pseudo_inertia_basis()
    H = np.zeros((30, 30))
    for s in range(3):
        at = slice(10 * s, 10 * s + 10)
        H[at, at] = np.einsum("ab,ibc,cd,jda->ij", P[s], basis, P[s], basis)
    r = equations.stacked(weights)[:, :30]
    np.testing.assert_allclose(
        found.covariance @ (r.T @ r + found.gamma * H), np.eye(30), atol=1e-6
    )


def test_a_prior_trusted_fully_is_the_answer_and_one_hardly_trusted_is_none(problem, prior):
    equations, base, weights = problem
    sure = fit_consistent(equations, base, weights, prior, prior_sd=1e-5)
    np.testing.assert_allclose(sure.phi, prior, atol=1e-4)
    unsure = fit_consistent(equations, base, weights, prior, prior_sd=1e4)
    none = fit_consistent(equations, base, weights, prior)
    a, b = (misfit(equations, weights, f.phi) for f in (unsure, none))
    # both within the gap that is left on purpose, 1e-9 of the residual squares
    assert abs(a - b) < 1e-8 * b


def test_more_trust_moves_towards_the_prior(problem, prior):
    equations, base, weights = problem
    fits = [fit_consistent(equations, base, weights, prior, prior_sd=sd) for sd in (0.03, 0.3, 3.0)]
    misfits = [misfit(equations, weights, f.phi) for f in fits]
    away = [np.linalg.norm((f.phi - prior) / np.abs(prior)) for f in fits]
    assert misfits == sorted(misfits, reverse=True)
    assert away[0] < away[1] < away[2]


def test_inflation_is_the_same_as_fewer_samples(problem, prior):
    equations, base, weights = problem
    inflated = fit_consistent(equations, base, weights, prior, prior_sd=0.3, inflation=4.0)
    lighter = fit_consistent(equations, base, weights / 2, prior, prior_sd=0.3)
    np.testing.assert_allclose(inflated.phi, lighter.phi, rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose(inflated.covariance, lighter.covariance, rtol=1e-3, atol=1e-9)


def test_an_impossible_prior_is_refused(problem, prior):
    equations, base, weights = problem
    bad = np.array(prior)
    bad[0] = -1.0
    with pytest.raises(InputError, match="not positive definite"):
        fit_consistent(equations, base, weights, bad)
    with pytest.raises(InputError, match="a prior of 3"):
        fit_consistent(equations, base, weights, prior[:3])
    with pytest.raises(InputError, match="more than 0"):
        fit_consistent(equations, base, weights, prior, prior_sd=-0.1)
