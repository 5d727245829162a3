"""The instant of a jump within its cells, from the samples themselves.

The search for jumps sees cells, and the cells in which a jump lies belong to neither side. Where
it is sure that there is one, the raw samples about it say when: before it they follow the values of
the one side, after it those of the other. At a cell's centre the courses are those of either side,
by the probability that the jump was later or earlier.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.joint.elbow.cascade.found import Found
from armimpedance.joint.elbow.cascade.noise import autoregression, whitened
from armimpedance.joint.elbow.cascade.rows import raw_rows
from armimpedance.joint.elbow.cascade.task import Task

#: A cell may begin a stretch with this probability; a jump is sure with that over its cells.
MAYBE: Final = 1e-3
SURE: Final = 0.9
#: Cells over which a jump may be uncertain: over more of them their mean is as good.
MOST_CELLS: Final = 12
#: Cells between two jumps that may be one, whose noise remembers longer than the torn cells.
NEAR: Final = 4
#: Over the noise's own scatter, what a single jump may leave.
TOO_MUCH: Final = 5.0
#: Samples on either side from which the noise is learnt, s.
NOISE_S: Final = 0.1


@dataclass(frozen=True)
class _Place:
    """Cells [low, high) of a strip in which a jump lies, and the trials that know of it."""

    low: int
    high: int
    start: int
    trials: range


def sharpened(task: Task, found: Found) -> Found:
    """Courses at the centres of cells, the cells of sure jumps divided at the jump's instant.

    Parameters
    ----------
    task : Task
        In time.
    found : Found
        Of jumps, with `begins`.
    """
    mean, variance = found.mean.copy(), found.variance.copy()
    for place in _places(task, found):
        a, b = place.low - 1, place.high
        ends = np.stack([found.mean[a], found.mean[b]])
        errors = np.stack([found.variance[a], found.variance[b]])
        at = _later(task, found, place, ends)
        if at is None:
            continue
        later = np.stack([at, 1 - at], axis=1)
        cells = slice(place.low, place.high)
        mean[cells] = later @ ends
        spread = (later.prod(axis=1))[:, None] * (ends[1] - ends[0]) ** 2
        variance[cells] = later @ errors + spread
    return replace(found, mean=mean, variance=variance)


def _places(task: Task, found: Found) -> Iterator[_Place]:
    """Where a jump is sure, and to either side something stays."""
    torn = task.torn
    for row, (first, last) in enumerate(zip(task.strips[:-1], task.strips[1:], strict=True)):
        begins = np.array(found.begins[first:last])
        begins[0] = 0.0
        maybe = np.flatnonzero(begins > MAYBE)
        if not len(maybe):
            continue
        trials = range(len(task.data.trials)) if task.aligned else range(row, row + 1)
        for run in np.split(maybe, np.flatnonzero(np.diff(maybe) > torn + NEAR) + 1):
            low, high = int(run[0]), int(run[-1]) + torn
            inside = low > 1 and high < last - first - 1
            mass = float(begins[run].sum())
            if inside and high - low <= MOST_CELLS + torn and mass > SURE:
                yield _Place(int(first) + low, int(first) + high, int(first), trials)


@dataclass(frozen=True)
class _Left:
    """What either side's values leave of one trial's torque over a place: (S,) each, its noise."""

    within: IntArray
    before: FloatArray
    after: FloatArray
    noise: FloatArray
    power: float

    def squares(self, jump: float | None, cells: range) -> FloatArray:
        """White squares over the power, (2, b - a): of either side, or of both about a jump."""
        parts = [self.before, self.after]
        if jump is not None:
            parts = [np.where(self.within < jump, self.before, self.after)]
        inside = (self.within >= cells.start) & (self.within < cells.stop)
        return np.stack([whitened(x, self.noise)[inside] ** 2 for x in parts]) / self.power


def _later(task: Task, found: Found, place: _Place, ends: FloatArray) -> FloatArray | None:
    """Probability that the jump is later than each cell's centre; None: it is no single jump."""
    each = round(task.width * task.data.rate_hz) * task.data.every
    cells = range((place.low - place.start) * each, (place.high - place.start) * each)
    left = [x for t in place.trials if (x := _leftover(task, found, t, cells, ends)) is not None]
    if not left:
        return None
    either = np.sum([x.squares(None, cells) for x in left], axis=0)
    # the jump is before sample k: the samples up to there follow the first side
    score = np.concatenate([[0.0], np.cumsum(either[1] - either[0]) / 2])
    best = cells.start + int(score.argmax())
    loss = float(np.sum([x.squares(best, cells) for x in left]))
    count = len(left) * len(cells)
    if loss > count + TOO_MUCH * np.sqrt(2 * count):
        return None
    weight = np.exp(score - score.max())
    weight /= weight.sum()
    centres = np.arange(len(cells) // each) * each + each / 2
    return np.array([weight[np.arange(len(weight)) >= c].sum() for c in centres])


def _leftover(task: Task, found: Found, trial: int, cells: range, ends: FloatArray) -> _Left | None:
    """Of one trial, with the noise learnt on either side; None where it ends before."""
    margin = round(NOISE_S * task.samples.sample_rate_hz)
    between = (cells.start - margin, cells.stop + margin)
    rows = raw_rows(task.samples, task.data, trial, between, task.aligned)
    if rows is None:
        return None
    one = task.pathway
    parts = [rows.motion[:, 1], rows.motion[:, 2]]
    parts += [] if one is None else [one.of_rate(rows.motion[:, 1], rows.rate_hz)]
    columns = np.stack([*parts, np.ones(len(rows.torque)), rows.motion[:, 0]], axis=1)
    before, after = (rows.torque - columns @ np.append(end, found.inertia) for end in ends)
    at = rows.within
    beside = (at >= between[0]) & ((at < cells.start) | (at >= cells.stop))
    known = np.where(at < cells.start, before, after)
    noise = autoregression(np.where(beside, known, np.nan))
    early = whitened(before, noise)[beside & (at < cells.start)]
    late = whitened(after, noise)[(at >= cells.stop + len(noise))]
    power = float(np.mean(np.concatenate([early, late]) ** 2))
    return _Left(at, before, after, noise, max(power, 1e-300))
