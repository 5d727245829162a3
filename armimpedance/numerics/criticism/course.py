"""Whether the inertia of a limb changes in a session, by the estimates of its parts.

Inertia does not change while a person is measured. A number in part i of the session (a trial, a
block of trials), known to s_i, is ``y (1 + g w_i)``, w the course of a change: 0 before a part and
1 from it on, or rising from 0 to 1. g is the change as a part of what was before.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.findings import Finding

#: A change is told from this many standard errors and from this part on; some ten are tried.
SIGNIFICANT: Final = 4.0
LEAST: Final = 0.03
#: Parts of a change by which numbers that are scaled alike may differ.
NEARLY: Final = 0.2
#: Below this change a number has the other sign.
TURNED: Final = -1.5
#: Fewer trials say nothing of a course.
FEWEST: Final = 3


@dataclass(frozen=True)
class TrialsChange:
    """The change that explains most: its part of the first number, standard error and course.

    `first`: the trial from which on it holds, counted from 0; None: it grows from first to last.
    `others` (p - 1,), `others_sd`: parts by which the other numbers change along the same course.
    `limit`: standard errors that chance does not reach in all that was tried.
    """

    size: float
    error: float
    first: int | None
    others: FloatArray
    others_sd: FloatArray
    limit: float = SIGNIFICANT

    @property
    def least(self) -> float:
        """The smallest part that is more than chance, and matters."""
        return max(self.limit * self.error, LEAST)

    @property
    def seen(self) -> bool:
        """Whether it is more than chance, and matters."""
        return abs(self.size) > self.least

    @property
    def alike(self) -> bool:
        """Whether the other numbers change by the same part, within its errors or nearly."""
        apart, allowed = np.abs(self.others - self.size), 3 * np.hypot(self.others_sd, self.error)
        return bool((apart < np.maximum(allowed, NEARLY * abs(self.size))).all())


def change_over_trials(values: FloatArray, sd: FloatArray) -> TrialsChange | None:
    """The change of the first of p numbers over n trials.

    Parameters
    ----------
    values, sd : (n, p)
        Numbers of each trial in the order of the session, and their standard errors.

    Returns
    -------
    TrialsChange or None
        None with fewer than three trials, or where a number is not finite.

    Examples
    --------
    >>> import numpy as np
    >>> from armimpedance.numerics.criticism import change_over_trials
    >>> found = change_over_trials(np.array([[1.0], [1.0], [2.0], [2.0]]), np.full((4, 1), 0.01))
    >>> found.first, round(found.size, 2)
    (2, 1.0)
    """
    if len(values) < FEWEST or not (np.isfinite(sd).all() and np.isfinite(values).all()):
        return None
    tried = []
    for first, w in _courses(len(values)):
        change, error, before = _along(values, sd, w)
        tried.append((abs(change[0]) / error[0], first, change / before, error / np.abs(before)))
    _, first, g, error = max(tried, key=lambda one: one[0])
    return TrialsChange(float(g[0]), float(error[0]), first, g[1:], error[1:])


def _courses(n: int) -> Iterator[tuple[int | None, FloatArray]]:
    """Where a change may begin, and w (n,)."""
    for first in range(1, n):
        yield first, (np.arange(n) >= first).astype(float)
    yield None, np.linspace(0.0, 1.0, n)


def _along(
    values: FloatArray, sd: FloatArray, w: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Changes (p,), their standard errors, which what is left between parts makes larger, and y."""
    weight = sd**-2
    whole = weight.sum(axis=0)
    # w and values (n, p) about their weighted means: sum u w~ y~ = change sum u w~^2, u the weights
    middle, mean = (weight * w[:, None]).sum(axis=0) / whole, (weight * values).sum(axis=0) / whole
    moved, about = w[:, None] - middle, values - mean
    known = (weight * moved**2).sum(axis=0)
    change = (weight * moved * about).sum(axis=0) / known
    left = (weight * (about - change * moved) ** 2).sum(axis=0) / max(len(w) - 2, 1)
    return change, np.sqrt(np.maximum(left, 1.0) / known), mean - change * middle


def sizes_beside(
    values: FloatArray, covariance: FloatArray, whole: FloatArray
) -> tuple[float, float]:
    """By which factor x the whole's numbers become a part's, ``values = x whole``.

    Parameters
    ----------
    values : (k,)
        Of the part.
    covariance : (k, k)
        Of `values`.
    whole : (k,)

    Returns
    -------
    tuple of float
        x by weighted least squares, and its standard error.

    Examples
    --------
    >>> import numpy as np
    >>> from armimpedance.numerics.criticism import sizes_beside
    >>> sizes_beside(np.array([2.0, 4.0]), 0.05 * np.eye(2), np.array([1.0, 2.0]))[0]
    2.0
    """
    weight = np.linalg.inv(covariance)
    known = float(whole @ weight @ whole)
    return float(whole @ weight @ values) / known, known**-0.5


@dataclass(frozen=True)
class SessionWords:
    """What the parts of a session are, and what may have changed where their inertia does."""

    part: str
    symbol: str
    gain: str
    limb: str


#: Of a hand that a robot moves.
HAND_WORDS: Final = SessionWords(
    "part",
    "M",
    "a gain of the sensor, or another person",
    "another person, another posture or something else in the hand",
)


def check_inertia_over(
    labels: Sequence[str],
    series: Mapping[str, tuple[FloatArray, FloatArray]],
    words: SessionWords,
) -> tuple[Finding, ...]:
    """The finding "session"; none where there are fewer than three parts.

    Parameters
    ----------
    labels : (n,) sequence of str
        Names of the parts in the order of the session.
    series : mapping of str to (n, 3), (n, 3)
        Inertia, viscosity and stiffness of every part with their errors: of all axes (""), and of
        single axes of force by their names.
    words : SessionWords

    Returns
    -------
    tuple of Finding

    Examples
    --------
    >>> import numpy as np
    >>> from armimpedance.numerics.criticism import HAND_WORDS, check_inertia_over
    >>> halved = np.array([[1.0], [1.0], [1.0], [0.5], [0.5]]) * np.ones(3)
    >>> (one,) = check_inertia_over("abcde", {"": (halved, np.full((5, 3), 0.01))}, HAND_WORDS)
    >>> one.message.split(",")[0]
    'M changes by -50 % (sd 1) from d on'
    """
    asked = ((axis, change_over_trials(*numbers)) for axis, numbers in series.items())
    found = {axis: change for axis, change in asked if change is not None}
    if not found:
        return ()
    return clearest_finding(found, labels, words)


def clearest_finding(
    found: Mapping[str, TrialsChange], labels: Sequence[str], words: SessionWords
) -> tuple[Finding, ...]:
    """The finding "session" of the changes that explain most.

    Parameters
    ----------
    found : mapping of str to TrialsChange
        Of all axes (""), and of single axes by their names.
    labels : sequence of str
        Of the parts that a change may begin with.
    words : SessionWords

    Returns
    -------
    tuple of Finding
        One.
    """
    axis = _whose(found)
    change = found[axis]
    over = f"from the first {words.part} to the last"
    smallest = f"{100 * found[''].least:.2g} % of {words.symbol}"
    if not change.seen:
        text = f"inertia is the same {over}"
        return (Finding("session", "ok", text, smallest),)
    where = over if change.first is None else f"from {labels[change.first]} on"
    along = f" along {axis}" if axis else ""
    if change.size < TURNED:
        text = f"the sign of {words.symbol}{along} turns {where}: that of a channel was turned"
        return (Finding("session", "warning", text, smallest),)
    cause = words.limb
    if change.alike:
        cause = "B and K alike: " + ("one channel's gain" if axis else words.gain)
    text = (
        f"{words.symbol}{along} changes by {100 * change.size:+.0f} % (sd "
        f"{100 * change.error:.0f}) {where}, {cause}; fit the {words.part}s apart"
    )
    return (Finding("session", "warning", text, smallest),)


def _whose(found: Mapping[str, TrialsChange]) -> str:
    """Whose change is told: that of all axes where each of them shares it, else the clearest."""
    whole = found[""]
    shared = all(
        abs(one.size - whole.size) < 3 * np.hypot(one.error, whole.error) for one in found.values()
    )
    if whole.seen and whole.alike and shared:
        return ""
    return max(found, key=lambda axis: abs(found[axis].size) / found[axis].error)
