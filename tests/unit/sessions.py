"""Simulated sessions that many files look at and none changes: a process makes each once."""

from __future__ import annotations

from functools import cache

from armimpedance.core.motion import MarkerRecording
from armimpedance.core.records import Recording
from manipulandum_sim.hand import simulate
from manipulandum_sim.passive import simulate_passive

LEVELS = ("cocontraction_10", "cocontraction_30")


@cache
def pushes(sets: int = 2, conditions: tuple[str, ...] = LEVELS) -> Recording:
    """Pushes of a hand at two levels of co-contraction or at one, up to three sets, with EMG."""
    if (sets, conditions) == (3, LEVELS):
        return simulate("cocontraction", seed=1, sets=sets, conditions=conditions)[0]
    every = pushes(3)
    kept = (every.trials["set"] <= sets) & every.trials["condition"].isin(conditions)
    return every.select(kept.to_numpy())


@cache
def swing() -> MarkerRecording:
    """A relaxed forearm that is let go, filmed."""
    return simulate_passive("release", trials=1, duration_s=4.0)[0]
