"""Courses that are constant between jumps: the exact average over all placements of the jumps.

Between two jumps all courses are constant. The values of each stretch are drawn from one normal
distribution; its mean and spread are estimated from the record (empirical Bayes), as is the rate
of jumps. P. Fearnhead's recursion (2006) sums over every placement: forward over the starts of the
present stretch, without the very unlikely ones, and backward over its end. Mean and variance thus
include the uncertainty of the time of each jump.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.joint.elbow.cascade.rows import (
    Cells,
    CourseEstimates,
    autoregression,
    raw_rows,
    whitened,
)
from armimpedance.joint.elbow.cascade.task import CascadeTask

#: Largest number of starts of the present stretch that are kept ...
STARTS: Final = 40
#: ... and their least probability relative to the likeliest.
HOPELESS: Final = 1e-7
#: Stretches of a smaller probability are left out of the average.
RARE: Final = 1e-5
#: Rounds in which mean, spread and rate are estimated.
ROUNDS: Final = 3
#: Prior of the spread, over the size of a course, and the number of stretches that it counts as.
BEFORE: Final = (0.5, 0.3)
#: Spread of I between stretches, over its size: practically none.
STILL: Final = 1e-3


@dataclass(frozen=True)
class Stretches:
    """Hyperparameters of courses that jump.

    `mean`, `spread` (m + 1,): of the values in stretches, I last.
    `rate`: jumps per cell.
    `noise`: variance of the white noise.
    `torn`: number of cells after a jump that belong to neither stretch, since the jump lies within
    them or the noise's autoregression reaches across it.
    """

    mean: FloatArray
    spread: FloatArray
    rate: float
    noise: float
    torn: int = 1


@dataclass(frozen=True)
class _Averaged:
    """Stretches (R,) with their probabilities, and the log evidence.

    A stretch begins at cell `first`; its cells from `whole` to `last` are not torn by a jump.
    """

    first: IntArray
    whole: IntArray
    last: IntArray
    weight: FloatArray
    evidence: float


def stretches_of(cells: Cells, noise: float, torn: int = 1) -> Stretches:
    """Estimate mean, spread, rate and noise from the record."""
    p = cells.courses + 1
    total = cells.products.sum(axis=0)
    A, b = total[:p, :p], total[:p, -1]
    d = 1 / np.sqrt(np.maximum(np.diag(A), 1e-300))
    mean = d * (np.linalg.pinv(A * d[:, None] * d, rcond=1e-10) @ (d * b))
    n = max(int(cells.rows.sum()), 1)
    size = np.maximum(np.abs(mean), 0.02 * np.sqrt(total[-1, -1] / np.maximum(np.diag(A), 1e-300)))
    spread = BEFORE[0] * size
    spread[-1] = STILL * size[-1]
    of = Stretches(mean, spread, min(max(2.0 / n, cells.width), 0.02), noise, torn)
    for _ in range(ROUNDS):
        of = _learnt(cells, of, size)
    return of


def jumping(cells: Cells, of: Stretches) -> CourseEstimates:
    """Mean and variance of the courses, averaged over all placements of the jumps."""
    n, m = len(cells.rows), cells.courses
    averaged = _averaged(cells, of)
    means, covariances, W = _stretches(cells, of, averaged)
    centre = np.linalg.inv(W)
    # the uncertainty of the common mean is part of every stretch's
    pull = _pull(cells, of, averaged)
    variances = np.einsum("rij,jk,rik->ri", pull, centre, pull)
    variances += np.einsum("rii->ri", covariances)
    first, last, w = averaged.first, averaged.last, averaged.weight[:, None]
    sums = np.zeros((n + 1, 2 * (m + 1) + 1))
    added = np.concatenate([w * means, w * (variances + means**2), w], axis=1)
    # a torn cell belongs half to the stretch before and half to the one after
    past_torn = np.minimum(last + of.torn, n)
    for at, sign in ((first, 0.5), (averaged.whole, 0.5), (last, -0.5), (past_torn, -0.5)):
        np.add.at(sums, at, sign * added)
    sums = np.cumsum(sums, axis=0)[:n]
    sums /= sums[:, -1:]
    mean = sums[:, : m + 1]
    variance = np.maximum(sums[:, m + 1 : -1] - mean**2, variances.min(axis=0))
    return CourseEstimates(
        mean[:, :m],
        variance[:, :m],
        float(of.mean[-1]),
        float(centre[-1, -1]),
        averaged.evidence,
        of.noise,
        np.asarray(np.bincount(first, averaged.weight, n), np.float64),
    )


def _learnt(cells: Cells, of: Stretches, size: FloatArray) -> Stretches:
    """One round: estimate mean, spread, rate and noise from the average over placements."""
    averaged = _averaged(cells, of)
    means, covariances, W = _stretches(cells, of, averaged)
    w = averaged.weight
    information = _totals(cells, averaged)
    A, b = information[:, :-1, :-1] / of.noise, information[:, :-1, -1] / of.noise
    S = np.diag(of.spread**2)
    # information of a stretch on the common mean: (S + A^-1)^-1 = (1 + A S)^-1 A
    seen = np.linalg.solve(np.eye(len(S)) + A @ S, b[..., None])[..., 0]
    mean = np.linalg.solve(W, (w[:, None] * seen).sum(axis=0))
    square = (w[:, None] * (np.einsum("rii->ri", covariances) + (means - mean) ** 2)).sum(axis=0)
    square += BEFORE[1] * (BEFORE[0] * size) ** 2
    spread = np.sqrt(square / (w.sum() + BEFORE[1]))
    spread[-1] = STILL * size[-1]
    total = information[:, -1, -1]
    quadratic = np.einsum("ri,rij,rj->r", means, information[:, :-1, :-1], means)
    loss = total - 2 * np.einsum("ri,ri->r", means, information[:, :-1, -1]) + quadratic
    loss += np.einsum("rij,rji->r", information[:, :-1, :-1], covariances)
    count = np.concatenate([[0], np.cumsum(cells.rows)])
    rows = count[averaged.last] - count[averaged.whole]
    noise = float((w * loss).sum() / max((w * rows).sum(), 1))
    rate = (max(w.sum() - 1, 0) + 0.5) / len(cells.rows)
    return Stretches(mean, spread, float(np.clip(rate, 1e-7, 0.2)), noise, of.torn)


def _totals(cells: Cells, averaged: _Averaged) -> FloatArray:
    """Sums of products (R, p + 1, p + 1) of stretches."""
    sums = np.concatenate([np.zeros((1, *cells.products.shape[1:])), cells.products]).cumsum(axis=0)
    return np.asarray(sums[averaged.last] - sums[averaged.whole])


def _stretches(
    cells: Cells, of: Stretches, averaged: _Averaged
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Posterior means (R, p), covariances (R, p, p), and information (p, p) of the common mean."""
    total = _totals(cells, averaged) / of.noise
    A, b = total[:, :-1, :-1], total[:, :-1, -1]
    s = of.spread
    scaled = np.eye(len(s)) + A * s[:, None] * s
    inverse = np.linalg.inv(scaled)
    covariance = inverse * s[:, None] * s
    moved = b - A @ of.mean
    means = of.mean + (covariance @ moved[..., None])[..., 0]
    W = (averaged.weight[:, None, None] * (A - A @ covariance @ A)).sum(axis=0)
    return means, covariance, W


def _pull(cells: Cells, of: Stretches, averaged: _Averaged) -> FloatArray:
    """Dependence (R, p, p) of a stretch's values on the common mean: ``(1 + S A)^-1``."""
    A = _totals(cells, averaged)[:, :-1, :-1] / of.noise
    S = np.diag(of.spread**2)
    return np.asarray(np.linalg.inv(np.eye(len(S)) + S @ A))


def _backward(
    kept: Sequence[tuple[IntArray, FloatArray]],
) -> tuple[IntArray, IntArray, FloatArray]:
    """First and last cell of the stretches, and their probability.

    `kept`: for each cell as the last of a stretch, its possible starts and their probabilities.
    """
    n = len(kept)
    ends = np.zeros(n + 1)
    ends[n] = 1.0
    stretches = []
    for t in range(n, 0, -1):
        if ends[t] < RARE:
            continue
        begun, part = kept[t - 1]
        share = ends[t] * part
        ends[begun] += share
        big = share > RARE
        stretches.append((begun[big], np.full(int(big.sum()), t), share[big]))
    first, last, weight = (np.concatenate(x) for x in zip(*stretches, strict=True))
    return first, last, weight


def _averaged(cells: Cells, of: Stretches) -> _Averaged:
    """Fearnhead's recursion forward, then ends and starts of stretches backward."""
    n, p = len(cells.rows), cells.courses + 1
    s, rate = of.spread, of.rate
    # columns scaled by the spread; torque without the part that the mean explains
    T = np.zeros((p + 1, p + 1))
    T[:p, :p] = np.diag(s)
    T[:p, p], T[p, p] = -of.mean, 1.0
    Q = np.einsum("ki,nkl,lj->nij", T, cells.products / of.noise, T)
    sums = np.concatenate([np.zeros((1, p + 1, p + 1)), Q]).cumsum(axis=0)
    torn = _torn(cells.rows, Q[:, p, p])
    starts, before = np.zeros(1, dtype=np.int64), np.zeros(1)
    kept: list[tuple[IntArray, FloatArray]] = []
    stay = np.log1p(-rate)
    for t in range(1, n + 1):
        whole = _whole(starts, t, of.torn)
        total = sums[t] - sums[whole]
        total[:, range(p), range(p)] += 1.0
        # Cholesky of ((1 + A, b), (b', c)) gives the determinant and b' (1 + A)^-1 b
        total[:, p, p] += 1.0 + np.abs(total[:, p, p])
        L = np.linalg.cholesky(total)
        diagonal = L[:, range(p + 1), range(p + 1)]
        gain = (L[:, p, :p] ** 2).sum(axis=1)
        weight = before + (t - starts - 1) * stay
        weight += 0.5 * gain - np.log(diagonal[:, :p]).sum(axis=1) + torn[whole] - torn[starts]
        top = weight.max()
        part = np.exp(weight - top)
        good = part > HOPELESS
        if good.sum() > STARTS:
            good[np.argsort(part)[: len(part) - STARTS]] = False
        starts, before, part = starts[good], before[good], part[good]
        sum_ = float(part.sum())
        kept.append((starts, part / sum_))
        new = top + np.log(sum_) + np.log(rate)
        starts, before = np.append(starts, t), np.append(before, new)
    evidence = float(new - np.log(rate)) - 0.5 * float(sums[n][p, p])
    evidence -= 0.5 * float(cells.rows.sum()) * np.log(2 * np.pi * of.noise)
    first, last, weight = _backward(kept)
    return _Averaged(first, _whole(first, last, of.torn), last, weight, evidence)


def _whole(first: IntArray, last: IntArray | int, torn: int) -> IntArray:
    """First cell of each stretch after its torn cells; the record's first stretch has none."""
    return np.asarray(np.where(first > 0, np.minimum(first + torn, last), 0))


def _torn(rows: IntArray, squares: FloatArray) -> FloatArray:
    """Running sum (n + 1,) of the cost of a torn cell: its noise is as large as the whole
    signal."""
    ratio = max(squares.sum() / max(rows.sum(), 1), 1.0)
    cost = 0.5 * squares * (1 - 1 / ratio) - 0.5 * rows * np.log(ratio)
    return np.concatenate([[0.0], np.cumsum(cost)])


# The instant of a jump within its cells, from the samples themselves.
#
# The search for jumps works on cells, and the cells of a jump belong to neither side. If a jump is
# certain, the raw samples about it determine its time: before it they follow the values of the
# stretch before, after it those of the stretch after. At a cell's centre the courses are the mean
# of both sides, weighted by the probability that the jump was later or earlier.

#: Probability from which a cell may begin a stretch, and sum from which a jump is certain.
MAYBE: Final = 1e-3
SURE: Final = 0.9
#: Largest number of cells for which the time of a jump is refined.
MOST_CELLS: Final = 12
#: Candidate cells this near, beyond the torn ones, may be one jump: the noise has a long memory.
NEAR: Final = 4
#: Largest misfit of a single jump, in standard deviations of the noise's sum of squares.
TOO_MUCH: Final = 5.0
#: Length on either side from which the noise is estimated, s.
NOISE_S: Final = 0.1


@dataclass(frozen=True)
class _Place:
    """Cells [low, high) of a strip in which a jump lies, and the trials that it affects."""

    low: int
    high: int
    start: int
    trials: range


def sharpened(task: CascadeTask, estimates: CourseEstimates) -> CourseEstimates:
    """Refine the courses in the cells of certain jumps, from the time of the jump.

    `task`: with cells of time.
    `estimates`: courses that jump, with `begins`.
    """
    mean, variance = estimates.mean.copy(), estimates.variance.copy()
    for place in _places(task, estimates):
        a, b = place.low - 1, place.high
        ends = np.stack([estimates.mean[a], estimates.mean[b]])
        errors = np.stack([estimates.variance[a], estimates.variance[b]])
        at = _later(task, estimates, place, ends)
        if at is None:
            continue
        later = np.stack([at, 1 - at], axis=1)
        cells = slice(place.low, place.high)
        mean[cells] = later @ ends
        spread = (later.prod(axis=1))[:, None] * (ends[1] - ends[0]) ** 2
        variance[cells] = later @ errors + spread
    return replace(estimates, mean=mean, variance=variance)


def _places(task: CascadeTask, estimates: CourseEstimates) -> Iterator[_Place]:
    """Yield the places where a jump is certain and both sides have constant cells."""
    torn = task.torn
    for row, (first, last) in enumerate(zip(task.strips[:-1], task.strips[1:], strict=True)):
        begins = np.array(estimates.begins[first:last])
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
    """Residuals of one trial's torque over a place: with the values before and after a jump.

    `within`: sample numbers (S,). `before`, `after`: residuals (S,). `noise`: autoregression.
    `power`: variance of the whitened noise.
    """

    within: IntArray
    before: FloatArray
    after: FloatArray
    noise: FloatArray
    power: float

    def squares(self, jump: float | None, cells: range) -> FloatArray:
        """Whitened squares over the power: (2, n) for both sides' values, or (1, n) with a jump."""
        parts = [self.before, self.after]
        if jump is not None:
            parts = [np.where(self.within < jump, self.before, self.after)]
        inside = (self.within >= cells.start) & (self.within < cells.stop)
        return np.stack([whitened(x, self.noise)[inside] ** 2 for x in parts]) / self.power


def _later(
    task: CascadeTask, estimates: CourseEstimates, place: _Place, ends: FloatArray
) -> FloatArray | None:
    """Probability that the jump is later than each cell's centre; None: not a single jump."""
    per_cell = round(task.width * task.data.rate_hz) * task.data.every
    cells = range((place.low - place.start) * per_cell, (place.high - place.start) * per_cell)
    residuals = [
        x for t in place.trials if (x := _leftover(task, estimates, t, cells, ends)) is not None
    ]
    if not residuals:
        return None
    either = np.sum([x.squares(None, cells) for x in residuals], axis=0)
    # with the jump before sample k, the samples before k follow the first side
    score = np.concatenate([[0.0], np.cumsum(either[1] - either[0]) / 2])
    best = cells.start + int(score.argmax())
    loss = float(np.sum([x.squares(best, cells) for x in residuals]))
    count = len(residuals) * len(cells)
    if loss > count + TOO_MUCH * np.sqrt(2 * count):
        return None
    weight = np.exp(score - score.max())
    weight /= weight.sum()
    centres = np.arange(len(cells) // per_cell) * per_cell + per_cell / 2
    return np.array([weight[np.arange(len(weight)) >= c].sum() for c in centres])


def _leftover(
    task: CascadeTask, estimates: CourseEstimates, trial: int, cells: range, ends: FloatArray
) -> _Left | None:
    """Residuals of one trial, with the noise estimated on either side; None if it ends before."""
    margin = round(NOISE_S * task.samples.sample_rate_hz)
    between = (cells.start - margin, cells.stop + margin)
    rows = raw_rows(task.samples, task.data, trial, between, task.aligned)
    if rows is None:
        return None
    pathway = task.pathway
    parts = [rows.motion[:, 1], rows.motion[:, 2]]
    parts += [] if pathway is None else [pathway.of_rate(rows.motion[:, 1], rows.rate_hz)]
    columns = np.stack([*parts, np.ones(len(rows.torque)), rows.motion[:, 0]], axis=1)
    before, after = (rows.torque - columns @ np.append(end, estimates.inertia) for end in ends)
    at = rows.within
    beside = (at >= between[0]) & ((at < cells.start) | (at >= cells.stop))
    residual = np.where(at < cells.start, before, after)
    noise = autoregression(np.where(beside, residual, np.nan))
    early = whitened(before, noise)[beside & (at < cells.start)]
    late = whitened(after, noise)[(at >= cells.stop + len(noise))]
    power = float(np.mean(np.concatenate([early, late]) ** 2))
    return _Left(at, before, after, noise, max(power, 1e-300))
