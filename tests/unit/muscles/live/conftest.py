"""A model of posture and activation, fitted to a made-up arm."""

from __future__ import annotations

import numpy as np
import pytest
from made_up_arm import made_stiffness

from armimpedance.muscles.models import JointRows, MuscleModel, fit_muscle_model


@pytest.fixture(scope="session")
def model() -> MuscleModel:
    rng = np.random.default_rng(5)
    q = rng.uniform([0.5, 1.0], [1.6, 2.1], (40, 2))
    alpha = rng.uniform(0, 0.3, (40, 6)) * (rng.random((40, 6)) < 0.7)
    K = made_stiffness(q, alpha)
    noise = rng.normal(0, 0.3, K.shape)
    noise += noise.swapaxes(1, 2)
    rows = JointRows(q, K + noise, 0.06 * (K + noise), activation=alpha)
    return fit_muscle_model(rows, moment_arm_order=1)
