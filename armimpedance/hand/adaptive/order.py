"""The next pushes, in an order that nobody foresees, with rests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.hand.planning import Profile

#: Orders that are tried for one without too many pushes alike.
_TRIES: Final = 200


@dataclass(frozen=True)
class Comfort:
    """What a person can bear and must not foresee.

    Attributes
    ----------
    most_alike : int
        At most so many pushes along the same way after each other.
    pause_s : (least, most)
        Before each push, uniformly between them.
    rest_every : int
        After so many pushes of the session there is a rest.
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
        The course along the direction.
    pause_s : float
        Before it.
    """

    condition: str
    direction: tuple[float, ...]
    profile: Profile
    pause_s: float

    @property
    def direction_deg(self) -> float:
        """Counter-clockwise from +x, of a push in the plane."""
        degrees = float(np.rad2deg(np.arctan2(self.direction[1], self.direction[0])) % 360)
        return round(degrees, 6) % 360


def shared_out(counts: Sequence[IntArray], pushes: int) -> list[IntArray]:
    """So many pushes in the proportions of counts, (L,) of each condition: largest remainders."""
    flat = np.concatenate(counts).astype(float)
    pushes = min(pushes, int(flat.sum()))
    exact = flat * (pushes / max(flat.sum(), 1.0))
    whole = np.floor(exact).astype(int)
    order = np.argsort(-(exact - whole), kind="stable")
    whole[order[: pushes - int(whole.sum())]] += 1
    return np.split(whole, np.cumsum([len(one) for one in counts])[:-1])


def ways(lines: FloatArray, counts: IntArray, rng: np.random.Generator) -> FloatArray:
    """Unit vectors (n, d): of each line as many one way as the other, an odd one by chance."""
    made = []
    for line, count in zip(lines, counts, strict=True):
        signs = np.tile([1.0, -1.0], int(count) // 2)
        if count % 2:
            signs = np.append(signs, rng.choice([1.0, -1.0]))
        made.append(signs[:, None] * line)
    return np.concatenate(made)


def in_random_order(units: FloatArray, most_alike: int, rng: np.random.Generator) -> FloatArray:
    """A random order with at most so many alike after each other, where one was found."""
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
    """How many pushes along the same way follow each other at most."""
    if not len(units):
        return 0
    same = np.all(np.abs(np.diff(units, axis=0)) < 1e-9, axis=1).tolist()
    run = longest = 1
    for one in same:
        run = run + 1 if one else 1
        longest = max(longest, run)
    return longest


def pauses(count: int, done: int, comfort: Comfort, rng: np.random.Generator) -> FloatArray:
    """Pause before each push (s), with a rest after every `rest_every` of the session."""
    made = rng.uniform(*comfort.pause_s, size=count)
    numbers = done + np.arange(count)
    made[(numbers > 0) & (numbers % comfort.rest_every == 0)] += comfort.rest_s
    return np.round(made, 3)
