"""Symmetric positive semidefinite fit: optimal, free where it may be, held where it must be."""

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import EstimationError
from armimpedance.hand.ellipses import ellipse_of
from armimpedance.hand.levels.symmetry import antisymmetric_part
from armimpedance.hand.show import read_results, write_results
from armimpedance.hand.show.text import estimate_text, summary_table
from armimpedance.hand.still.estimation import Options, estimate
from armimpedance.hand.still.methods import definite, exact
from armimpedance.numerics.signals.windows import cut_windows

DEFINITE = Options(method="definite")
#: Stiff along x, and pushing away along y: no passive limb.
NEGATIVE = np.array([[100.0, 0.0], [0.0, -60.0]])


def _prepared(recording, free=exact):
    return definite.within(free.prepare)(cut_windows(recording), recording.kind)


def _solution(prepared):
    """Parameters in the chart, and the information and solution without constraint."""
    from armimpedance.numerics.regression.equations import solve_total

    chart, equations = prepared.chart, prepared.equations
    theta = chart.expand(solve_total(chart.restrict(equations)))
    return theta, equations.A.sum(axis=0), solve_total(equations)


def test_noise_free_gives_the_truth(limb):
    made = estimate(limb.record(sets=1), options=DEFINITE)[0]
    assert made.inertia == pytest.approx(limb.M, rel=1e-3)
    assert made.stiffness == pytest.approx(limb.K, rel=1e-3, abs=0.1)
    assert np.array_equal(made.stiffness, made.stiffness.T)


def test_inside_the_cones_only_symmetry_is_imposed(limb):
    """Symmetric least squares in closed form: E (E^T H E)^-1 E^T H theta."""
    theta, H, free = _solution(_prepared(limb.record(sets=2, force_noise=0.3)))
    E = np.kron(np.eye(3), definite.symmetric_basis(2))
    assert theta == pytest.approx(E @ np.linalg.solve(E.T @ H @ E, E.T @ H @ free), rel=1e-9)
    assert np.abs(free[9] - free[10]) > 1e-3


def test_on_the_surface_the_whole_problem_is_optimal(limb):
    """Conditions of the convex problem, all three matrices together: the gradient of each
    matrix is semidefinite and orthogonal to it."""
    prepared = _prepared(limb.record(sets=2, force_noise=0.05, stiffness=NEGATIVE))
    theta, H, free = _solution(prepared)
    matrices = theta.reshape(3, 2, 2)
    gradient = (H @ (theta - free)).reshape(3, 2, 2)
    gradient = (gradient + gradient.transpose(0, 2, 1)) / 2
    scale = np.abs(H @ free).reshape(3, -1).max(axis=1)
    for X, G, s in zip(matrices, gradient, scale, strict=True):
        size = np.linalg.norm(X)
        assert np.linalg.eigvalsh(X)[0] > -1e-9 * size
        assert np.linalg.eigvalsh(G)[0] > -1e-7 * s
        assert abs((X * G).sum()) < 1e-7 * s * size
    assert abs(np.linalg.eigvalsh(matrices[2])[0]) < 1e-9 * np.linalg.norm(matrices[2])
    assert any("stiffness held positive semidefinite" in text for text in prepared.warnings)


def test_a_cvxpy_solution_is_no_better(limb):
    cp = pytest.importorskip("cvxpy")
    recording = limb.record(sets=2, force_noise=0.05, stiffness=NEGATIVE)
    theta, H, free = _solution(_prepared(recording))
    X = [cp.Variable((2, 2), PSD=True) for _ in range(3)]
    stacked = cp.hstack([x[i, j] for x in X for i in range(2) for j in range(2)])
    root = np.linalg.cholesky(H / np.trace(H)).T
    problem = cp.Problem(cp.Minimize(cp.sum_squares(root @ (stacked - free))))
    problem.solve(solver="CLARABEL")
    ours = float(np.sum((root @ (theta - free)) ** 2))
    assert ours == pytest.approx(problem.value, rel=1e-4)


def test_what_it_assumes_matters(limb):
    """A limb that pushes away along y: the free fit says so, this one cannot."""
    recording = limb.record(sets=2, force_noise=0.05, stiffness=NEGATIVE)
    free = estimate(recording)[0]
    held = estimate(recording, options=DEFINITE)[0]
    assert free.stiffness[1, 1] == pytest.approx(-60, abs=4 * free.sd[2, 1, 1])
    assert held.stiffness[1, 1] > -1e-9


def test_antisymmetric_part_is_zero_with_no_error_and_reports_live_with_it(limb, tmp_path):
    for stiffness in (limb.K, NEGATIVE):
        recording = limb.record(sets=2, force_noise=0.2, stiffness=stiffness)
        made = estimate(recording, options=DEFINITE)[0]
        part = antisymmetric_part(made)
        assert np.abs(part.value).max() < 1e-9 * np.abs(made.stiffness).max()
        assert np.abs(part.sd).max() < 1e-6 * made.sd.max()
        assert (made.sd >= 0).all()
        assert "definite" in estimate_text(made)
        assert "Stiffness" in summary_table([made])
        write_results([made], tmp_path / "r.csv")
        assert read_results(tmp_path / "r.csv")[0].stiffness == pytest.approx(made.stiffness)
    # a singular matrix has no ellipse, whatever the rounding
    assert ellipse_of(made, "stiffness") is None


def test_intervals_are_no_wider_than_without_the_constraint(limb):
    recording = limb.record(sets=5, force_noise=0.3)
    free = estimate(recording, options=Options(method="weighted"))[0]
    held = estimate(recording, options=DEFINITE)[0]
    assert held.bound is not None
    assert (np.diag(held.bound) <= np.diag(free.bound) * (1 + 1e-9)).all()
    assert np.linalg.matrix_rank(held.covariance, tol=1e-9 * held.covariance.max()) <= 9


def test_one_axis_is_cut_at_zero(limb):
    one = {"inertia": np.eye(1), "viscosity": 8 * np.eye(1), "stiffness": -30 * np.eye(1)}
    made = estimate(limb.record(sets=4, directions=2, force_noise=0.02, **one), options=DEFINITE)[0]
    assert made.stiffness == pytest.approx(0, abs=1e-12)
    assert made.sd[2] == 0
    assert made.inertia[0, 0] > 0


def test_three_axes_are_symmetric_or_refused_by_name(limb):
    rng = np.random.default_rng(8)
    M, B, K = (s * (a @ a.T + np.eye(3)) for s in (1, 5, 80) for a in [rng.normal(size=(3, 3))])
    fields = {"inertia": M, "viscosity": B, "directions": 9, "sets": 2, "force_noise": 0.02}
    made = estimate(limb.record(stiffness=K, **fields), options=DEFINITE)[0]
    assert np.linalg.norm(made.stiffness - K) < 0.02 * np.linalg.norm(K)
    assert np.array_equal(made.stiffness, made.stiffness.T)
    bad = limb.record(stiffness=K - 200 * np.eye(3), **fields)
    with pytest.raises(EstimationError, match="stiffness of 3 axes is not positive semidefinite"):
        _prepared(bad)


def test_the_order_of_trials_does_not_matter(limb):
    recording = limb.record(sets=2, force_noise=0.05, stiffness=NEGATIVE)
    turned = recording.select(np.arange(recording.n_trials)[::-1])
    a, b = (estimate(r, options=DEFINITE)[0] for r in (recording, replace(turned)))
    assert b.parameters == pytest.approx(a.parameters, rel=1e-5, abs=1e-5)
