"""Pushed reaches of one person that several files look at: each session takes seconds."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from armimpedance.core.records import Recording
from manipulandum_sim.movement import MovementTruth, simulate_movement


@cache
def two_phases() -> tuple[Recording, MovementTruth]:
    """Four pushes of each direction at 30 % and at 60 % of the way, and 30 reaches without any."""
    return simulate_movement(seed=11, phases=(0.3, 0.6), repeats=4, unperturbed=30, after_s=0.2)


@cache
def one_phase(**rig: Any) -> tuple[Recording, MovementTruth]:
    """One phase: that of 60 % of `two_phases`, or a session of another rig pushed half-way."""
    if rig:
        return simulate_movement(seed=11, phases=(0.5,), after_s=0.2, **rig)
    recording, truth = two_phases()
    return recording.select(np.flatnonzero(recording.trials["phase"] != "30%")), truth
