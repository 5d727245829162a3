"""Estimates to write and read: any number of axes, any covariance."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from armimpedance.core.records import ImpedanceEstimate, Quality


def build_estimate(k: int = 2, seed: int = 0, **changes: Any) -> ImpedanceEstimate:
    """A hand estimate with positive definite matrices and a full covariance."""
    rng = np.random.default_rng(seed)
    p = 3 * k * k
    root = rng.normal(size=(p, p)) / np.sqrt(p)
    scale = np.repeat([0.02, 0.5, 5.0], k * k)
    covariance = root @ root.T * np.outer(scale, scale)
    turned = np.eye(k) + 0.3 * np.ones((k, k)) + 0.02 * rng.normal(size=(k, k))
    fields: dict[str, Any] = {
        "level": "hand",
        "method": "exact",
        "inertia": 1.1 * turned,
        "viscosity": 12.0 * turned,
        "stiffness": 150.0 * turned,
        "covariance": (covariance + covariance.T) / 2,
        "dof": 39.0,
        "quality": Quality(40, 16000, 0.979, 0.958, 2.5e4, 130.0, p, 0.08),
        "inertia_with_handle": 1.1 * turned + 0.164 * np.eye(k),
        "keys": {"condition": "relaxed", "day": 2},
        "position": rng.normal(size=k),
        "force": rng.normal(size=k),
        "joint_angles": np.array([1.04, 1.57]),
        "shoulder_m": np.zeros(k),
        "warnings": ("onsets were detected",),
        "provenance": ("filtered at 15 Hz",),
    }
    return ImpedanceEstimate(**(fields | changes))


@pytest.fixture
def undrawn(monkeypatch):
    """Pages of the hand without their pictures, which are most of the work: the words are asked."""
    from armimpedance.hand.still.show import hand_page
    from armimpedance.show.pages.page import Printed

    monkeypatch.setattr(hand_page, "linked_ellipses", lambda *_: Printed("ellipses"))
    monkeypatch.setattr(hand_page, "_drawn", lambda *_: [])


@pytest.fixture(scope="session")
def make_estimate() -> Callable[..., ImpedanceEstimate]:
    return build_estimate
