"""Trials as equations about a known truth, and estimates to compare."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from armimpedance.core.conventions import parameter_names
from armimpedance.core.records import ImpedanceEstimate, Quality
from armimpedance.numerics.regression.equations import TrialEquations

TRUTH = np.concatenate(
    [[1.731, -0.655, -0.655, 1.001], [8.63, -6.4, -6.4, 13.86], [104.8, -74.4, -74.4, 179.3]]
)
#: Information of one trial about M, B, K of each output: of the size that 5 mm in 0.3 s gives.
INFORMATION = np.diag(np.repeat([400.0, 20.0, 0.4], 2))


def _direction(number: int) -> tuple[np.ndarray, np.ndarray]:
    """Information (12, 12) of a trial in one of eight directions, and its root."""
    order = np.arange(12).reshape(3, 2, 2).transpose(1, 0, 2).ravel()
    u = np.array([np.cos(np.pi / 4 * number), np.sin(np.pi / 4 * number)])
    gram = np.sqrt(INFORMATION) @ np.kron(np.eye(3), np.outer(u, u)) @ np.sqrt(INFORMATION)
    A = np.zeros((12, 12))
    A[np.ix_(order, order)] = np.kron(np.eye(2), gram)
    return A, np.linalg.cholesky(A + 1e-12 * np.eye(12))


DIRECTIONS, ROOTS = (np.array(part) for part in zip(*map(_direction, range(8)), strict=True))


def make_equations(
    seed: int, trials: int = 24, noise: float = 1.0, truth: np.ndarray = TRUTH
) -> TrialEquations:
    """Trials in eight directions (trial % 8) with scores of unit information times `noise`."""
    rng = np.random.default_rng(seed)
    number = np.arange(trials) % 8
    A, scores = DIRECTIONS[number], rng.standard_normal((trials, 12, 1))
    b = A @ truth + noise * (ROOTS[number] @ scores)[..., 0]
    return TrialEquations(A, b, parameter_names(2), ("",) * 12)


def make_estimate(
    stiffness: Any = ((104.8, -74.4), (-74.4, 179.3)), sd: float = 6.0, **changes: Any
) -> ImpedanceEstimate:
    """A hand estimate whose elements err independently."""
    scale = np.repeat([0.02, 0.3, sd], 4)
    fields: dict[str, Any] = {
        "level": "hand",
        "method": "exact",
        "inertia": TRUTH[:4].reshape(2, 2),
        "viscosity": TRUTH[4:8].reshape(2, 2),
        "stiffness": np.array(stiffness),
        "covariance": np.diag(scale**2),
        "dof": 39.0,
        "quality": Quality(40, 16000, 0.979, 0.958, 2.5e4, 130.0, 12, 0.08),
        "keys": {"condition": "relaxed"},
        "position": np.array([-0.14, 0.43]),
        "shoulder_m": np.zeros(2),
    }
    return ImpedanceEstimate(**(fields | changes))


@pytest.fixture(scope="session")
def equations() -> Callable[..., TrialEquations]:
    return make_equations


@pytest.fixture(scope="session")
def estimated() -> Callable[..., ImpedanceEstimate]:
    return make_estimate


@pytest.fixture(scope="session")
def truth() -> np.ndarray:
    return TRUTH.copy()
