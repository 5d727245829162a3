"""Unpredictable order of the next pushes, with rests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.hand.planning import Profile

#: Number of random orders tried for one without too many equal pushes in a row.
_TRIES: Final = 200


@dataclass(frozen=True)
class Comfort:
    """Limits for the comfort of the person, and against anticipation.

    Attributes
    ----------
    most_alike : int
        Largest number of pushes in the same direction in a row.
    pause_s : (least, most)
        Limits of the uniformly distributed pause before each push.
    rest_every : int
        Number of pushes of the session between rests.
    rest_s : float
    """

    most_alike: int = 2
    pause_s: tuple[float, float] = (1.0, 2.0)
    rest_every: int = 40
    rest_s: float = 60.0


@dataclass(frozen=True)
class Push:
    """One push to do next.

    Attributes
    ----------
    condition : str
    direction : (d,) tuple of float
        Unit vector.
    profile : Profile
        Course along the direction.
    pause_s : float
        Pause before it.
    """

    condition: str
    direction: tuple[float, ...]
    profile: Profile
    pause_s: float

    @property
    def direction_deg(self) -> float:
        """Angle counter-clockwise from +x, for a push in the plane."""
        degrees = float(np.rad2deg(np.arctan2(self.direction[1], self.direction[0])) % 360)
        return round(degrees, 6) % 360


def shared_out(counts: Sequence[IntArray], pushes: int) -> list[IntArray]:
    """Distribute pushes in proportion to counts, (L,) for each condition: largest remainders."""
    flat = np.concatenate(counts).astype(float)
    pushes = min(pushes, int(flat.sum()))
    exact = flat * (pushes / max(flat.sum(), 1.0))
    whole = np.floor(exact).astype(int)
    order = np.argsort(-(exact - whole), kind="stable")
    whole[order[: pushes - int(whole.sum())]] += 1
    return np.split(whole, np.cumsum([len(condition_counts) for condition_counts in counts])[:-1])


def ways(lines: FloatArray, counts: IntArray, rng: np.random.Generator) -> FloatArray:
    """Unit vectors (n, d): both directions of each line equally often, an odd one at random."""
    units = []
    for line, count in zip(lines, counts, strict=True):
        signs = np.tile([1.0, -1.0], int(count) // 2)
        if count % 2:
            signs = np.append(signs, rng.choice([1.0, -1.0]))
        units.append(signs[:, None] * line)
    return np.concatenate(units)


def in_random_order(units: FloatArray, most_alike: int, rng: np.random.Generator) -> FloatArray:
    """A random order with at most so many equal pushes in a row, or the best that was tried."""
    best, fewest = units, len(units) + 1
    for _ in range(_TRIES):
        order = units[rng.permutation(len(units))]
        alike = longest_run(order)
        if alike <= most_alike:
            return order
        if alike < fewest:
            best, fewest = order, alike
    return best


def longest_run(units: FloatArray) -> int:
    """Largest number of pushes in the same direction in a row."""
    if not len(units):
        return 0
    same = np.all(np.abs(np.diff(units, axis=0)) < 1e-9, axis=1).tolist()
    run = longest = 1
    for is_same in same:
        run = run + 1 if is_same else 1
        longest = max(longest, run)
    return longest


def pauses(count: int, done: int, comfort: Comfort, rng: np.random.Generator) -> FloatArray:
    """Pause before each push (s), with a rest after every `rest_every` of the session."""
    pauses_s = rng.uniform(*comfort.pause_s, size=count)
    numbers = done + np.arange(count)
    pauses_s[(numbers > 0) & (numbers % comfort.rest_every == 0)] += comfort.rest_s
    return np.round(pauses_s, 3)
