"""Live stiffness on a plant that is not ours: MyoSuite's arm in MuJoCo (extra `plant`)."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco")
pytest.importorskip("myo_sim")
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmarks" / "live"))

from myoarm import RANGE, MyoArm
from space import borne, one_study


@pytest.fixture(scope="module")
def plant() -> MyoArm:
    return MyoArm()


def test_the_plants_stiffness_is_that_of_its_hand_pushed_slowly_while_the_elbow_swivels(plant):
    rng = np.random.default_rng(0)
    for _ in range(2):
        q = rng.uniform(*RANGE.T)
        force, alpha = borne(plant, q, rng)
        K = plant.hand_stiffness(q, alpha, force)
        assert np.abs(plant.pushed(q, alpha) - K).max() < 1e-5 * np.abs(K).max()


def test_fifty_postures_never_calibrated(plant):
    error, held, flagged = one_study(plant, "30x2", seed=100)
    assert np.median(error) < 0.12
    # 300 elements, six a posture: standard error of the mean about 2 %
    assert 0.86 < held.mean() < 0.995
    assert 0 < flagged.mean() < 1
