"""The Kalman filter's rows and states, beside the same model written as one large matrix."""

from __future__ import annotations

import numpy as np
import pytest

from armimpedance.joint.relaxed.state_noise import StateSteps

S, RATIO = 25, 0.3


@pytest.fixture(scope="module")
def model():
    """Steps of one trial of which five samples were not measured, and its dense matrices."""
    rng = np.random.default_rng(1)
    Phi = np.array([[1.0, 0.1], [-0.5, 0.9]]) + 0.02 * rng.standard_normal((S - 1, 1, 2, 2))
    push = rng.standard_normal((S - 1, 1, 2))
    seen = np.ones((S, 1), bool)
    seen[-5:] = False
    # states (2 S,) = A inputs (2 S,) where input 0 is the start
    A = np.zeros((2 * S, 2 * S))
    for j in range(S):
        block = np.eye(2)
        for i in range(j, S):
            A[2 * i : 2 * i + 2, 2 * j : 2 * j + 2] = block
            if i < S - 1:
                block = Phi[i, 0] @ block
    return StateSteps(Phi, push, seen), A


def test_whitened_rows_give_the_weighted_squares_of_the_dense_model(model):
    steps, A = model
    rng = np.random.default_rng(2)
    y, u, start = rng.standard_normal(S), rng.standard_normal((S - 1, 2)), rng.standard_normal(2)
    rows, lost = steps.whiten(
        y[:, None, None], u[:, None, :, None], start[None, :, None], np.array([0.0, RATIO])
    )
    mean = (A @ np.concatenate([start, u.ravel()]))[::2]
    B = (A[:, 2:].reshape(2 * S, S - 1, 2) * steps.push[:, 0]).sum(axis=-1)[::2]
    for i, ratio in enumerate((0.0, RATIO)):
        C = (np.eye(S) + ratio * B @ B.T)[:-5, :-5]
        e = (y - mean)[:-5]
        assert (rows[i] ** 2).sum() == pytest.approx(e @ np.linalg.solve(C, e), rel=1e-9)
        assert lost[i] == pytest.approx(np.linalg.slogdet(C)[1], abs=1e-9)


def test_smoothed_states_are_the_dense_models_best(model):
    steps, A = model
    rng = np.random.default_rng(3)
    y, u, start = rng.standard_normal(S), rng.standard_normal((S - 1, 2)), rng.standard_normal(2)
    found = steps.smooth(y[:, None], u[:, None], start[None], RATIO)[:, 0]
    mean = A @ np.concatenate([start, u.ravel()])
    B = (A[:, 2:].reshape(2 * S, S - 1, 2) * steps.push[:, 0]).sum(axis=-1)
    H = np.eye(2 * S)[::2][:-5]
    C = np.eye(S - 5) + RATIO * H @ B @ B.T @ H.T
    best = mean + RATIO * B @ B.T @ H.T @ np.linalg.solve(C, y[:-5] - H @ mean)
    np.testing.assert_allclose(found.ravel(), best, rtol=1e-8, atol=1e-8)
