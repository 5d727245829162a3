"""Estimates and a response to draw."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from armimpedance.core.records import ImpedanceEstimate, Quality, Response

SHAPE = np.array([[104.8, -74.4], [-74.4, 179.3]])


def build_estimate(x: float = 0.0, y: float = 0.45, **changes: Any) -> ImpedanceEstimate:
    """A hand estimate at (x, y)."""
    scale = np.repeat([0.03, 0.4, 6.0], 4)
    fields: dict[str, Any] = {
        "level": "hand",
        "method": "exact",
        "inertia": SHAPE / 100,
        "viscosity": SHAPE / 12,
        "stiffness": SHAPE,
        "covariance": np.diag(scale**2),
        "dof": 39.0,
        "quality": Quality(40, 16000, 0.979, 0.958, 2.5e4, 130.0, 12, 0.08),
        "keys": {"condition": f"x {x:g}"},
        "position": np.array([x, y]),
        "force": np.array([9.8, 0.0]),
        "joint_angles": np.array([1.04, 1.57]),
        "shoulder_m": np.zeros(2),
    }
    return ImpedanceEstimate(**(fields | changes))


@pytest.fixture(scope="session")
def make_estimate() -> Callable[..., ImpedanceEstimate]:
    return build_estimate


@pytest.fixture(scope="session")
def response() -> Response:
    """Two trials of two axes, the second not usable."""
    lag = np.arange(-20, 120) / 1000
    signal = np.stack([np.sin(20 * lag), np.cos(20 * lag)], axis=-1)
    both = np.stack([signal, np.zeros_like(signal)])
    return Response(
        1000.0, lag, 0.005 * both, 0.1 * both, 2 * both, 3 * both, [4, 7], [True, False]
    )
