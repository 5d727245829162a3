"""Which trial does what: random order of the directions, random onsets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
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
        Row in the truth; from 1; row of `directions`; sample of the onset.
    directions : (D, d)
        Unit vectors; in the plane eighths of a turn.
    """

    labels: tuple[str, ...]
    keys: tuple[tuple[int, ...], ...]
    condition: IntArray
    set_number: IntArray
    direction: IntArray
    onset: IntArray
    directions: FloatArray

    @property
    def day(self) -> IntArray:
        """Day of each trial (T,), from 1."""
        return (self.set_number - 1) // SETS_PER_DAY + 1

    @property
    def unit(self) -> FloatArray:
        """Direction of each disturbance, (T, d)."""
        return np.asarray(self.directions[self.direction])


def planar_directions() -> FloatArray:
    """Unit vectors (8, 2) around a circle."""
    angle = 2 * np.pi / DIRECTIONS * np.arange(DIRECTIONS)
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def make_schedule(
    seed: int, runs: Sequence[Run], sets: int, directions: FloatArray | None = None
) -> Schedule:
    """Sets of all directions in random order, each run from a generator of its own.

    More sets leave the first ones as they are.

    Parameters
    ----------
    seed : int
    runs : sequence of Run
    sets : int
    directions : (D, d), optional
        Unit vectors; default: eight around a circle.

    Returns
    -------
    Schedule
    """
    first, last = (round(s * RATE_HZ) for s in ONSET_S)
    units = planar_directions() if directions is None else directions
    order, onsets = [], []
    for run in runs:
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(*run.key, 0)))
        for _ in range(sets):
            order.append(rng.permutation(len(units)))
            onsets.append(rng.integers(first, last, len(units), endpoint=True))
    per_run = sets * len(units)
    return Schedule(
        labels=tuple(run.label for run in runs for _ in range(per_run)),
        keys=tuple((*run.key, 1, t) for run in runs for t in range(per_run)),
        condition=np.repeat([run.condition for run in runs], per_run),
        set_number=np.tile(np.repeat(np.arange(1, sets + 1), len(units)), len(runs)),
        direction=np.concatenate(order),
        onset=np.concatenate(onsets),
        directions=units,
    )
