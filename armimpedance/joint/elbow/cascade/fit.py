"""Courses of a whole record: piece by piece, by the prior that explains it best."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.joint.elbow.cascade.jumps import Stretches, jumping, sharpened, stretches_of
from armimpedance.joint.elbow.cascade.rows import Cells, FoundCourses, joined
from armimpedance.joint.elbow.cascade.smooth import Strengths, smooth, strengths_of
from armimpedance.joint.elbow.cascade.task import CascadeCourses, CascadeTask, beginning

Prior = Literal["smooth", "jumps"]

#: Cells that are solved at once, and what they overlap their neighbours by.
PIECE: Final = 5000
OVERLAP: Final = 250
#: Cells from which hyperparameters are learnt, at most.
LEARNT_FROM: Final = 2500


@dataclass(frozen=True)
class FittedCourses:
    """Courses, the prior they have, and its hyperparameters."""

    found: FoundCourses
    prior: Prior
    of: Strengths | Stretches


def fitted(
    task: CascadeTask, cells: Cells, prior: Prior | None, before: FittedCourses | None = None
) -> FittedCourses:
    """Courses under a prior; None: the one of greater marginal likelihood.

    Raises EstimationError: the record does not determine them.
    """
    part = _part(task, cells)
    start = before.of if before is not None and isinstance(before.of, Strengths) else None
    strengths = strengths_of(part, start)
    task.tick()
    if prior == "smooth" or not task.in_time:
        return FittedCourses(_whole(task, cells, strengths), "smooth", strengths)
    stretches = stretches_of(part, strengths.noise, task.torn)
    task.tick()
    of: Strengths | Stretches = stretches
    if prior is None:
        by_jumps, by_walks = jumping(part, stretches).evidence, smooth(part, strengths).evidence
        of = stretches if by_jumps > by_walks else strengths
    return FittedCourses(_whole(task, cells, of), "jumps" if of is stretches else "smooth", of)


def _solve(cells: Cells, of: Strengths | Stretches) -> FoundCourses:
    return smooth(cells, of) if isinstance(of, Strengths) else jumping(cells, of)


def _part(task: CascadeTask, cells: Cells) -> Cells:
    """The middle of the longest strip, or what there is of a cycle."""
    lengths = np.diff(task.strips)
    longest = int(lengths.argmax())
    first, count = int(task.strips[longest]), int(lengths[longest])
    if count <= LEARNT_FROM:
        return cells.part(first, first + count)
    first += (count - LEARNT_FROM) // 2
    return cells.part(first, first + LEARNT_FROM)


def _whole(task: CascadeTask, cells: Cells, of: Strengths | Stretches) -> FoundCourses:
    if task.cyclic:
        return _cycle(cells, of)
    parts: list[tuple[FoundCourses, int, int]] = []
    for first, last in zip(task.strips[:-1].tolist(), task.strips[1:].tolist(), strict=True):
        pieces = max(-(-(last - first) // PIECE), 1)
        edges = np.linspace(first, last, pieces + 1).astype(int).tolist()
        for a, b in zip(edges[:-1], edges[1:], strict=True):
            low, high = max(a - OVERLAP, first), min(b + OVERLAP, last)
            parts.append((_solve(cells.part(low, high), of), a - low, b - low))
            task.tick()
    return joined(parts)


def _cycle(cells: Cells, of: Strengths | Stretches) -> FoundCourses:
    """A cycle between half a copy of itself on either side."""
    n = len(cells.rows)
    half = n // 2
    at = np.arange(-half, n + half) % n
    around = Cells(cells.width, cells.products[at], cells.rows[at])
    found = _solve(around, of)
    # what the copies say of I is not new
    more = float(cells.rows[at].sum() / cells.rows.sum())
    return FoundCourses(
        found.mean[half : half + n], found.variance[half : half + n], found.inertia,
        found.var_inertia * more, found.evidence, found.noise,
    )  # fmt: skip


# Fit, learn the noise from what is left, and fit again.
#
# Courses that are fitted beside white noise follow a slow torque of the subject's own, and what
# they leave of it looks white: the rounds then stay where they began. So they begin at white noise
# and at slow noise, and the start whose end explains the record better is taken.

ROUNDS: Final = 2
#: Corner of the slow noise at which the rounds may begin, Hz.
OWN_HZ: Final = 3.0
#: The logarithm of the likelihood by which it must be better.
BETTER: Final = 5.0
_TOLD: Final = {
    "smooth": "smooth courses (integrated random walks), their strengths by marginal likelihood",
    "jumps": "courses that stay and jump, averaged over all placements of the jumps",
}


def in_rounds(
    task: CascadeTask, prior: Prior | None = None, rounds: int = ROUNDS
) -> CascadeCourses:
    """Courses under a prior; None: the one of greater marginal likelihood.

    Raises EstimationError: the record does not determine them.
    """
    task = replace(task, noise=_first_noise(task))
    made: FittedCourses = fitted(task, task.cells(), prior)
    for _ in range(rounds - 1):
        task = task.learnt(made.found)
        made = fitted(task, task.cells(), prior, made)
    found = sharpened(task, made.found) if made.prior == "jumps" else made.found
    return CascadeCourses(found, task, (_TOLD[made.prior],))


def _first_noise(task: CascadeTask) -> FloatArray:
    """White, or slow where smooth courses explain the record's beginning better from there on."""
    short = beginning(task)
    slow = np.array([1.0, -np.exp(-2 * np.pi * OWN_HZ / task.rows.rate_hz)])
    white = np.ones(1)
    return slow if _end(short, slow) > _end(short, white) + BETTER else white


def _end(task: CascadeTask, noise: FloatArray) -> float:
    """Logarithm of the likelihood in the second round of smooth courses."""
    task = replace(task, noise=noise)
    first = fitted(task, task.cells(), "smooth")
    task = task.learnt(first.found)
    return fitted(task, task.cells(), "smooth", first).found.evidence


# Least squares over realizations, trials of one course: each cell or segment by itself.


def over_realizations(task: CascadeTask, segment_s: float) -> CascadeCourses:
    """I, B, K and gain by least squares over all trials, in a segment about every cell.

    `task`: aligned trials.
    `segment_s`: length of the segments; 0: a cell.
    """
    cells = task.cells()
    n, m = len(cells.rows), cells.courses
    half = round(segment_s / cells.width / 2)
    sums = np.concatenate([np.zeros((1, m + 2, m + 2)), cells.products]).cumsum(axis=0)
    count = np.concatenate([[0], np.cumsum(cells.rows)])
    at = np.arange(n)
    low, high = np.maximum(at - half, 0), np.minimum(at + half + 1, n)
    total, rows = sums[high] - sums[low], count[high] - count[low]
    values, variances = _least_squares(total, rows)
    known = np.asarray(np.isfinite(values).all(axis=1))
    weight = 1 / variances[known, m]
    # neighbouring segments share their rows
    shared = max(float(rows[known].sum() / max(cells.rows.sum(), 1)), 1.0)
    found = FoundCourses(
        mean=_filled(values[:, :m], known),
        variance=_filled(variances[:, :m], known),
        inertia=float(weight @ values[known, m] / weight.sum()),
        var_inertia=float(shared / weight.sum()),
        evidence=0.0,
        noise=0.0,
    )
    length = segment_s or cells.width
    trials = len(task.data.trials)
    note = f"least squares over {trials} realizations in segments of {1e3 * length:.3g} ms"
    return CascadeCourses(found, task, (note,))


def _least_squares(total: FloatArray, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values and variances (n, p) of sums of products (n, p + 1, p + 1); NaN where too few rows."""
    p = total.shape[1] - 1
    A, b = total[:, :p, :p], total[:, :p, p]
    d = 1 / np.sqrt(np.maximum(np.einsum("nii->ni", A), 1e-300))
    good = rows > 2 * p
    values, variances = (np.full((len(total), p), np.nan) for _ in range(2))
    inverse = np.linalg.pinv(A[good] * d[good][:, :, None] * d[good][:, None, :], hermitian=True)
    inverse *= d[good][:, :, None] * d[good][:, None, :]
    values[good] = (inverse @ b[good][..., None])[..., 0]
    left = total[good, p, p] - np.einsum("ni,ni->n", values[good], b[good])
    noise = np.maximum(left, 0) / (rows[good] - p)
    variances[good] = np.einsum("nii->ni", inverse) * noise[:, None]
    return values, variances


def _filled(values: FloatArray, known: BoolArray) -> FloatArray:
    """The ends, where there are no rows, as their nearest neighbours."""
    at = np.flatnonzero(known)
    nearest = at[np.abs(np.arange(len(values))[:, None] - at).argmin(axis=1)]
    return np.asarray(values[nearest])
