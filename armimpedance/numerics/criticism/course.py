"""Check for a change of the limb's inertia during a session, from estimates of its parts.

Inertia does not change while a person is measured. A parameter in part i of the session (a trial, a
block of trials), with standard error s_i, is modelled as ``y (1 + g w_i)``. w is the course of the
change: 0 before some part and 1 from it on, or rising from 0 to 1. g is the relative change.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.findings import Finding

#: A change is reported above this many standard errors, since some ten courses are tried, and
#: above this relative size.
SIGNIFICANT: Final = 4.0
LEAST: Final = 0.03
#: Share of a change by which the changes of parameters that are scaled alike may differ.
NEARLY: Final = 0.2
#: Below this relative change a parameter has reversed its sign.
TURNED: Final = -1.5
#: Fewest trials for a course.
FEWEST: Final = 3


@dataclass(frozen=True)
class TrialsChange:
    """The most significant change: relative change of the first parameter, standard error, course.

    `first`: the first trial after the change, counted from 0; None: it grows from first to last.
    `others` (p - 1,), `others_sd`: relative changes of the other parameters along the same course.
    `limit`: significance limit in standard errors, for all courses that were tried.
    """

    size: float
    error: float
    first: int | None
    others: FloatArray
    others_sd: FloatArray
    limit: float = SIGNIFICANT

    @property
    def least(self) -> float:
        """Detection limit: the smallest relative change that is significant and matters."""
        return max(self.limit * self.error, LEAST)

    @property
    def seen(self) -> bool:
        """True if the change is significant and matters."""
        return abs(self.size) > self.least

    @property
    def alike(self) -> bool:
        """True if the other parameters change by the same share, within errors or nearly."""
        distance, allowed = (
            np.abs(self.others - self.size),
            3 * np.hypot(self.others_sd, self.error),
        )
        return bool((distance < np.maximum(allowed, NEARLY * abs(self.size))).all())


def change_over_trials(values: FloatArray, sd: FloatArray) -> TrialsChange | None:
    """Return the most significant change of the first of p parameters over n trials.

    Parameters
    ----------
    values, sd : (n, p)
        Parameters of each trial in the order of the session, and their standard errors.

    Returns
    -------
    TrialsChange or None
        None with fewer than three trials, or if a number is not finite.

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
    candidates = []
    for first, w in _courses(len(values)):
        change, error, before = _along(values, sd, w)
        candidates.append(
            (abs(change[0]) / error[0], first, change / before, error / np.abs(before))
        )
    _, first, g, error = max(candidates, key=lambda candidate: candidate[0])
    return TrialsChange(float(g[0]), float(error[0]), first, g[1:], error[1:])


def _courses(n: int) -> Iterator[tuple[int | None, FloatArray]]:
    """Yield the first part after the change (None: a ramp) and its course w (n,)."""
    for first in range(1, n):
        yield first, (np.arange(n) >= first).astype(float)
    yield None, np.linspace(0.0, 1.0, n)


def _along(
    values: FloatArray, sd: FloatArray, w: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Changes (p,), their standard errors (enlarged by scatter), and initial values y (p,)."""
    weight = sd**-2
    total = weight.sum(axis=0)
    # w and values (n, p) about their weighted means: sum u w~ y~ = change sum u w~^2, u the weights
    middle, mean = (weight * w[:, None]).sum(axis=0) / total, (weight * values).sum(axis=0) / total
    course, deviation = w[:, None] - middle, values - mean
    information = (weight * course**2).sum(axis=0)
    change = (weight * course * deviation).sum(axis=0) / information
    scatter = (weight * (deviation - change * course) ** 2).sum(axis=0) / max(len(w) - 2, 1)
    return change, np.sqrt(np.maximum(scatter, 1.0) / information), mean - change * middle


def sizes_beside(
    values: FloatArray, covariance: FloatArray, whole: FloatArray
) -> tuple[float, float]:
    """Estimate the factor x between a part's parameters and the whole's, ``values = x whole``.

    Parameters
    ----------
    values : (k,)
        Parameters of the part.
    covariance : (k, k)
        Covariance of `values`.
    whole : (k,)
        Parameters of the whole.

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
    information = float(whole @ weight @ whole)
    return float(whole @ weight @ values) / information, information**-0.5


@dataclass(frozen=True)
class SessionWords:
    """Terms of a topic for a change of inertia: part of a session, symbol, possible causes."""

    part: str
    symbol: str
    gain: str
    limb: str


#: Terms for a hand that a robot moves.
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
    """Return the finding "session"; none if there are fewer than three parts.

    Parameters
    ----------
    labels : (n,) sequence of str
        Names of the parts in the order of the session.
    series : mapping of str to (n, 3), (n, 3)
        Inertia, viscosity and stiffness of every part and their errors: over all axes (""), and for
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
    tested = ((axis, change_over_trials(*numbers)) for axis, numbers in series.items())
    changes = {axis: change for axis, change in tested if change is not None}
    if not changes:
        return ()
    return clearest_finding(changes, labels, words)


def clearest_finding(
    found: Mapping[str, TrialsChange], labels: Sequence[str], words: SessionWords
) -> tuple[Finding, ...]:
    """Return the finding "session" on the most significant change.

    Parameters
    ----------
    found : mapping of str to TrialsChange
        Changes over all axes (""), and of single axes by their names.
    labels : sequence of str
        Names of the parts that a change may begin with.
    words : SessionWords

    Returns
    -------
    tuple of Finding
        One.
    """
    axis = _changed_axis(found)
    change = found[axis]
    over = f"from the first {words.part} to the last"
    smallest = f"{100 * found[''].least:.2g} % of {words.symbol}"
    if not change.seen:
        text = f"inertia is the same {over}"
        return (Finding("session", "ok", text, smallest),)
    extent = over if change.first is None else f"from {labels[change.first]} on"
    along = f" along {axis}" if axis else ""
    if change.size < TURNED:
        text = f"the sign of {words.symbol}{along} turns {extent}: that of a channel was turned"
        return (Finding("session", "warning", text, smallest),)
    cause = words.limb
    if change.alike:
        cause = "B and K alike: " + ("one channel's gain" if axis else words.gain)
    text = (
        f"{words.symbol}{along} changes by {100 * change.size:+.0f} % (sd "
        f"{100 * change.error:.0f}) {extent}, {cause}; fit the {words.part}s apart"
    )
    return (Finding("session", "warning", text, smallest),)


def _changed_axis(found: Mapping[str, TrialsChange]) -> str:
    """Axis whose change is reported: "" if all axes share it, else the most significant."""
    whole = found[""]
    shared = all(
        abs(change.size - whole.size) < 3 * np.hypot(change.error, whole.error)
        for change in found.values()
    )
    if whole.seen and whole.alike and shared:
        return ""
    return max(found, key=lambda axis: abs(found[axis].size) / found[axis].error)
