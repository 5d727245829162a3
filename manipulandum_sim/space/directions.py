"""Directions on a sphere, plus and minus of each, and which trial takes which."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Final

import numpy as np

from armimpedance.arrays import FloatArray, IntArray
from armimpedance.errors import InputError
from manipulandum_sim.hand import RATE_HZ, Run

#: The onset lies this long after the trial's start (s), uniformly.
ONSET_S: Final = (0.3, 0.5)
#: How many of a cube's three coordinates a direction has -> a family of its directions.
_FAMILIES: Final = {6: (1,), 8: (3,), 12: (2,), 14: (1, 3), 18: (1, 2), 26: (1, 2, 3)}
#: The sets of directions that can be asked for.
COUNTS: Final = tuple(_FAMILIES)


def sphere_directions(count: int) -> FloatArray:
    """Unit vectors (count, 3): a cube's faces (6), corners (8), edges (12), or several of them.

    Each direction's opposite is among them; the order is that of azimuth within elevation.

    Raises
    ------
    InputError
        No such set of directions.
    """
    if count not in _FAMILIES:
        known = ", ".join(map(str, COUNTS))
        raise InputError(f"{count} directions on a sphere", expected=f"one of {known}")
    cube = np.array(list(product((-1.0, 0.0, 1.0), repeat=3)))
    chosen = cube[np.isin(np.abs(cube).sum(axis=1), _FAMILIES[count])]
    units = chosen / np.linalg.norm(chosen, axis=1, keepdims=True)
    azimuth, elevation = angles_deg(units)
    return np.asarray(units[np.lexsort((azimuth, elevation))])


def angles_deg(units: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Azimuth, counter-clockwise from x in [0, 360), and elevation above the x-y plane, each (D,).

    A vertical direction has the azimuth 0.
    """
    level = np.hypot(units[:, 0], units[:, 1])
    turned = np.degrees(np.arctan2(units[:, 1], units[:, 0]))
    azimuth = np.where(level > 1e-9, np.round(turned, 6) % 360.0, 0.0)
    return azimuth, np.asarray(np.round(np.degrees(np.arctan2(units[:, 2], level)), 6))


@dataclass(frozen=True)
class SpaceSchedule:
    """All trials of a session, T of them.

    Attributes
    ----------
    labels : tuple of str
    keys : tuple of tuple of int
        Key of each trial's random numbers.
    condition, set_number, onset : (T,) int
        Row in the truth; from 1; sample of the onset.
    unit : (T, 3)
    """

    labels: tuple[str, ...]
    keys: tuple[tuple[int, ...], ...]
    condition: IntArray
    set_number: IntArray
    onset: IntArray
    unit: FloatArray


def space_schedule(
    seed: int, runs: Sequence[Run], sets: int, directions: FloatArray
) -> SpaceSchedule:
    """Sets of all directions in random order, each run from a generator of its own.

    More sets leave the first ones as they are.
    """
    first, last = (round(s * RATE_HZ) for s in ONSET_S)
    count = len(directions)
    order, onsets = [], []
    for run in runs:
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(*run.key, 0)))
        for _ in range(sets):
            order.append(rng.permutation(count))
            onsets.append(rng.integers(first, last, count, endpoint=True))
    per_run = sets * count
    return SpaceSchedule(
        labels=tuple(run.label for run in runs for _ in range(per_run)),
        keys=tuple((*run.key, 1, t) for run in runs for t in range(per_run)),
        condition=np.repeat([run.condition for run in runs], per_run),
        set_number=np.tile(np.repeat(np.arange(1, sets + 1), count), len(runs)),
        onset=np.concatenate(onsets),
        unit=directions[np.concatenate(order)],
    )
