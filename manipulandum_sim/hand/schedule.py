"""Which trial does what: random order of the directions, random onsets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from armimpedance.arrays import FloatArray, IntArray
from manipulandum_sim.hand.experiments import DIRECTIONS
from manipulandum_sim.hand.rig import ONSET_S, RATE_HZ

SETS_PER_DAY = 5


@dataclass(frozen=True)
class Run:
    """One condition as it is carried out: its row in the truth, its label, its random key."""

    condition: int
    label: str
    key: tuple[int, ...]


@dataclass(frozen=True)
class Schedule:
    """All trials of a session, T of them.

    Attributes
    ----------
    labels : tuple of str
    keys : tuple of tuple of int
        Key of each trial's random numbers.
    condition, set_number, direction, onset : (T,) int
        Row in the truth; from 1; eighths of a turn; sample of the onset.
    """

    labels: tuple[str, ...]
    keys: tuple[tuple[int, ...], ...]
    condition: IntArray
    set_number: IntArray
    direction: IntArray
    onset: IntArray

    @property
    def day(self) -> IntArray:
        """Day of each trial (T,), from 1."""
        return (self.set_number - 1) // SETS_PER_DAY + 1

    @property
    def unit(self) -> FloatArray:
        """Direction of each disturbance, (T, 2)."""
        angle = 2 * np.pi / DIRECTIONS * self.direction
        return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def make_schedule(seed: int, runs: Sequence[Run], sets: int) -> Schedule:
    """Sets of eight directions in random order, each run from a generator of its own.

    More sets leave the first ones as they are.

    Parameters
    ----------
    seed : int
    runs : sequence of Run
    sets : int

    Returns
    -------
    Schedule
    """
    first, last = (round(s * RATE_HZ) for s in ONSET_S)
    directions, onsets = [], []
    for run in runs:
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(*run.key, 0)))
        for _ in range(sets):
            directions.append(rng.permutation(DIRECTIONS))
            onsets.append(rng.integers(first, last, DIRECTIONS, endpoint=True))
    per_run = sets * DIRECTIONS
    return Schedule(
        labels=tuple(run.label for run in runs for _ in range(per_run)),
        keys=tuple((*run.key, 1, t) for run in runs for t in range(per_run)),
        condition=np.repeat([run.condition for run in runs], per_run),
        set_number=np.tile(np.repeat(np.arange(1, sets + 1), DIRECTIONS), len(runs)),
        direction=np.concatenate(directions),
        onset=np.concatenate(onsets),
    )
