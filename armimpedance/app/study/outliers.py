"""Who is far from the others: median and MAD, with each session's own error taken off.

Session i has the value ``x_i`` with the standard error ``e_i``. Centre: the median. Spread between
people: the tau at which half of the ``(x_i - median)^2 / (tau^2 + e_i^2)`` are below the median of
chi^2 with one degree of freedom, which without errors is 1.4826 MAD; 0 where the errors explain
all. How far a session is: ``z_i = (x_i - median) / sqrt(tau^2 + e_i^2)``: who was measured badly is
not named for it.

A spread found by the MAD of n people is known with about a third of n - 1 degrees of freedom (its
efficiency is .37), so z is held against Student's t with as many.

All values of a session are looked at: its p is its least one times their number (Bonferroni).
Those sessions are named that Benjamini and Hochberg (1995) would call findings at 5 % among all
sessions. In a cohort of alike people the chance that anybody is named is about 5 %: measured were
.5 % for 10 people, up to 6 % for 30, 5 % for 100 and 8 % for 300, errors 0 to 3 times as large as
what people differ by. Of several that are named about one in twenty is by chance. It is sessions
that are counted, not values: one person with a hundred values far away would otherwise let others
be named for little.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import stdtr
from scipy.stats import chi2

from armimpedance.app.study.strips import Strip
from armimpedance.core.arrays import FloatArray

#: Fewer say too little of their own spread.
FEWEST: Final = 8
LEVEL: Final = 0.05
#: Degrees of freedom of the MAD of n values, over n - 1.
EFFICIENCY: Final = 1 / 3
_HALF: Final = float(chi2.median(1))


@dataclass(frozen=True)
class Outlier:
    """A value far from those of the others.

    Attributes
    ----------
    strip : Strip
    row : int
        In the strip.
    middle : float
        Median of all, as the table would have it.
    spreads : float
        How many spreads it lies above, or below.
    p : float
        Before the number of looks is allowed for.
    """

    strip: Strip
    row: int
    middle: float
    spreads: float
    p: float

    @property
    def session(self) -> int:
        """Number of the session."""
        return int(self.strip.sessions[self.row])


def far_from_others(strips: Sequence[Strip]) -> list[Outlier]:
    """The values that chance does not explain, of sessions that are named; the farthest first.

    Parameters
    ----------
    strips : sequence of Strip
        Those of fewer than `FEWEST` sessions are passed over.

    Returns
    -------
    list of Outlier
    """
    found = [one for strip in strips for one in _scored(strip)]
    own: dict[int, list[Outlier]] = {}
    for one in found:
        own.setdefault(one.session, []).append(one)
    limit = _limit(
        np.array([len(values) * min(one.p for one in values) for values in own.values()])
    )
    named = (one for values in own.values() for one in values if len(values) * one.p <= limit)
    return sorted(named, key=lambda one: (one.p, -abs(one.spreads)))


def _scored(strip: Strip) -> list[Outlier]:
    """Every value of a strip; none where too few sessions have it."""
    if len(strip.sessions) < FEWEST:
        return []
    centre, z = robust_scores(strip.scaled, strip.errors)
    p = 2 * stdtr(EFFICIENCY * (len(z) - 1), -np.abs(z))
    middle = strip.told(centre)
    return [Outlier(strip, row, middle, float(z[row]), float(p[row])) for row in range(len(z))]


def robust_scores(values: FloatArray, errors: FloatArray) -> tuple[float, FloatArray]:
    """The median, and how many spreads each value lies from it.

    Parameters
    ----------
    values, errors : (n,)

    Returns
    -------
    centre : float
    z : (n,)
        Zero where nothing differs at all.
    """
    centre = float(np.median(values))
    squares, own = (values - centre) ** 2, errors**2
    between = _between(squares, own)
    spread = np.sqrt(between + own)
    with np.errstate(divide="ignore", invalid="ignore"):
        z = np.where(values == centre, 0.0, (values - centre) / spread)
    return centre, z


def _between(squares: FloatArray, own: FloatArray) -> float:
    """The tau^2 >= 0 at which the median of squares/(tau^2 + own) is that of chi^2."""

    def middle(between: float) -> float:
        with np.errstate(divide="ignore", invalid="ignore"):
            return float(np.median(np.nan_to_num(squares / (between + own), posinf=np.inf)))

    if middle(0.0) <= _HALF:
        return 0.0
    low, high = 0.0, float(np.median(squares)) / _HALF
    for _ in range(60):
        between = (low + high) / 2
        low, high = (between, high) if middle(between) > _HALF else (low, between)
    return high


def _limit(p: FloatArray) -> float:
    """The largest p that is a finding; below every p where none is."""
    ordered = np.sort(p)
    passed = np.flatnonzero(ordered <= LEVEL * np.arange(1, len(p) + 1) / max(len(p), 1))
    return float(ordered[passed[-1]]) if len(passed) else -1.0
