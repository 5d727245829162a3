"""Rows with shared errors: the likelihood is that of dense matrices, its slope that of it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import block_diag

from armimpedance.muscles.models.activation.misfit import MixedRows

POINTS = [np.array([-0.3, -0.6]), np.array([-0.3, -0.6, -1.0, -2.0, -1.5])]
GROUP = np.array([0, 0, 1, 1])


@pytest.fixture(scope="module")
def rows():
    draw = np.random.default_rng(0).standard_normal
    P, r, p, m = 7, len(GROUP), 5, 3
    return MixedRows(
        draw((P, r, p)), draw((P, r)), draw((2, p)), GROUP, draw((P, r, 2 * m)), draw((P, r, m))
    )


def dense(rows, x):
    """Minus the restricted log likelihood of all rows at once, but for a constant."""
    own = np.diag(np.exp(2 * x[:2])[GROUP])
    single = np.exp(x[4]) * rows.arms if len(x) > 2 else np.zeros((len(rows.arms), len(GROUP), 1))
    V = block_diag(*(own + one @ one.T for one in single), np.eye(len(rows.prior)))
    if len(x) > 2:
        Z = np.concatenate([np.exp(x[2]) * rows.arms, np.exp(x[3]) * rows.law], axis=-1)
        Z = np.vstack([*Z, np.zeros((len(rows.prior), Z.shape[-1]))])
        V = V + Z @ Z.T
    X = np.vstack([*rows.design, rows.prior])
    y = np.append(rows.target.ravel(), np.zeros(len(rows.prior)))
    weight = np.linalg.inv(V)
    normal = X.T @ weight @ X
    left = y - X @ np.linalg.solve(normal, X.T @ weight @ y)
    return (np.linalg.slogdet(V)[1] + np.linalg.slogdet(normal)[1] + left @ weight @ left) / 2


@pytest.mark.parametrize("x", POINTS)
def test_the_likelihood_is_that_of_dense_matrices(rows, x):
    by = np.linspace(0.1, 0.3, len(x))
    expected = dense(rows, x + by) - dense(rows, x)
    assert rows.negative_log(x + by) - rows.negative_log(x) == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("x", POINTS)
def test_the_slope_is_that_of_differences(rows, x):
    steps = 1e-6 * np.eye(len(x))
    expected = [(dense(rows, x + s) - dense(rows, x - s)) / 2e-6 for s in steps]
    np.testing.assert_allclose(rows.likelihood(x)[1], expected, rtol=1e-6)
