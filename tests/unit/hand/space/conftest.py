"""Sessions in space that several files look at: each takes seconds, however few its trials."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import armimpedance as ai
from armimpedance.core.records import Recording
from armimpedance.hand.show import Estimates
from manipulandum_sim.space import SpaceCondition, SpaceTruth, simulate_space


@pytest.fixture(scope="session")
def noiseless() -> tuple[Recording, SpaceTruth]:
    """A held elbow, two sets of 26 directions."""
    return simulate_space(seed=71, sets=2, noise="none")


@pytest.fixture(scope="session")
def held(noiseless) -> tuple[Recording, SpaceTruth]:
    """The same session with a force sensor of 0.1 N (sd)."""
    recording, truth = noiseless
    noise = np.random.default_rng(71).normal(0, 0.1, recording.force.shape)
    return replace(recording, force=recording.force + noise), truth


@pytest.fixture(scope="session")
def soft() -> tuple[Recording, SpaceTruth]:
    """5 % co-contraction, sensors' noise only: the swivel is plain to see."""
    made = [SpaceCondition("nominal", 0.05)]
    return simulate_space(made, seed=2, sets=3, directions=6, noise="sensor", elbow="free")


@pytest.fixture(scope="session")
def hands(held) -> tuple[Estimates, Recording, SpaceTruth]:
    """What the session of a held elbow gives: hand, recording and truth."""
    recording, truth = held
    return ai.estimate(recording), recording, truth
