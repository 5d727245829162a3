"""Whether a number that does not change in a session does, by its estimates of single trials.

The logarithm l_i of the number in trial i, known to s_i, is ``l + g w_i``, w the course of a
change: 0 before a trial and 1 from it on, or rising from 0 to 1. g is the change as a part.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray

#: A change is told from this many standard errors and from this part on; some ten are tried.
SIGNIFICANT: Final = 4.0
LEAST: Final = 0.03
#: Fewer trials say nothing of a course.
FEWEST: Final = 3


@dataclass(frozen=True)
class TrialsChange:
    """The change that explains most: its part of the first number, standard error and course.

    `first`: the trial from which on it holds, counted from 0; None: it grows from first to last.
    `others` (p - 1,), `others_sd`: parts by which the other numbers change along the same course.
    """

    size: float
    error: float
    first: int | None
    others: FloatArray
    others_sd: FloatArray

    @property
    def least(self) -> float:
        """The smallest part that is more than chance, and matters."""
        return max(SIGNIFICANT * self.error, LEAST)

    @property
    def seen(self) -> bool:
        """Whether it is more than chance, and matters."""
        return abs(self.size) > self.least

    @property
    def alike(self) -> bool:
        """Whether the other numbers change by the same part, within three standard errors."""
        apart = np.abs(np.log1p(self.others) - np.log1p(self.size))
        return bool((apart < 3 * np.hypot(self.others_sd, self.error)).all())


def change_over_trials(values: FloatArray, sd: FloatArray) -> TrialsChange | None:
    """The change of the first of p numbers over n trials.

    Parameters
    ----------
    values, sd : (n, p)
        Positive numbers of each trial in the order of the session, and their standard errors.

    Returns
    -------
    TrialsChange or None
        None with fewer than three trials, or where a number is not positive.

    Examples
    --------
    >>> import numpy as np
    >>> from armimpedance.numerics.criticism import change_over_trials
    >>> found = change_over_trials(np.array([[1.0], [1.0], [2.0], [2.0]]), np.full((4, 1), 0.01))
    >>> found.first, round(found.size, 2)
    (2, 1.0)
    """
    if len(values) < FEWEST or not (np.isfinite(sd).all() and (values > 0).all()):
        return None
    tried = []
    for first, w in _courses(len(values)):
        g, error = _along(np.log(values), sd / values, w)
        tried.append((abs(g[0]) / error[0], first, g, error))
    _, first, g, error = max(tried, key=lambda one: one[0])
    parts = np.expm1(g)
    return TrialsChange(float(parts[0]), float(error[0]), first, parts[1:], error[1:])


def _courses(n: int) -> Iterator[tuple[int | None, FloatArray]]:
    """Where a change may begin, and w (n,)."""
    for first in range(1, n):
        yield first, (np.arange(n) >= first).astype(float)
    yield None, np.linspace(0.0, 1.0, n)


def _along(logs: FloatArray, sd: FloatArray, w: FloatArray) -> tuple[FloatArray, FloatArray]:
    """g (p,) and its standard error, which what is left between trials makes larger."""
    weight = sd**-2
    middle = weight.sum(axis=0)
    # w and l (n, p) about their weighted means: sum u w~ l~ = g sum u w~^2, u the weights
    moved = w[:, None] - (weight * w[:, None]).sum(axis=0) / middle
    about = logs - (weight * logs).sum(axis=0) / middle
    known = (weight * moved**2).sum(axis=0)
    g = (weight * moved * about).sum(axis=0) / known
    left = (weight * (about - g * moved) ** 2).sum(axis=0) / max(len(w) - 2, 1)
    return g, np.sqrt(np.maximum(left, 1.0) / known)
