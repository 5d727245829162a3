"""Courses of a whole record: piece by piece, by the prior that explains it best."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from armimpedance.joint.elbow.cascade.cells import Cells
from armimpedance.joint.elbow.cascade.found import Found, joined
from armimpedance.joint.elbow.cascade.jumps import Stretches, jumping, stretches_of
from armimpedance.joint.elbow.cascade.smooth import Strengths, smooth, strengths_of
from armimpedance.joint.elbow.cascade.task import Task

Prior = Literal["smooth", "jumps"]

#: Cells that are solved at once, and what they overlap their neighbours by.
PIECE: Final = 5000
OVERLAP: Final = 250
#: Cells from which hyperparameters are learnt, at most.
LEARNT_FROM: Final = 2500


@dataclass(frozen=True)
class Fitted:
    """Courses, the prior they have, and its hyperparameters."""

    found: Found
    prior: Prior
    of: Strengths | Stretches


def fitted(task: Task, cells: Cells, prior: Prior | None, before: Fitted | None = None) -> Fitted:
    """Courses under a prior; None: the one of greater marginal likelihood.

    Raises
    ------
    EstimationError
        The record does not determine them.
    """
    part = _part(task, cells)
    start = before.of if before is not None and isinstance(before.of, Strengths) else None
    strengths = strengths_of(part, start)
    task.tick()
    if prior == "smooth" or not task.in_time:
        return Fitted(_whole(task, cells, strengths), "smooth", strengths)
    stretches = stretches_of(part, strengths.noise, task.torn)
    task.tick()
    of: Strengths | Stretches = stretches
    if prior is None:
        by_jumps, by_walks = jumping(part, stretches).evidence, smooth(part, strengths).evidence
        of = stretches if by_jumps > by_walks else strengths
    return Fitted(_whole(task, cells, of), "jumps" if of is stretches else "smooth", of)


def _solve(cells: Cells, of: Strengths | Stretches) -> Found:
    return smooth(cells, of) if isinstance(of, Strengths) else jumping(cells, of)


def _part(task: Task, cells: Cells) -> Cells:
    """The middle of the longest strip, or what there is of a cycle."""
    lengths = np.diff(task.strips)
    longest = int(lengths.argmax())
    first, count = int(task.strips[longest]), int(lengths[longest])
    if count <= LEARNT_FROM:
        return cells.part(first, first + count)
    first += (count - LEARNT_FROM) // 2
    return cells.part(first, first + LEARNT_FROM)


def _whole(task: Task, cells: Cells, of: Strengths | Stretches) -> Found:
    if task.cyclic:
        return _cycle(cells, of)
    parts: list[tuple[Found, int, int]] = []
    for first, last in zip(task.strips[:-1].tolist(), task.strips[1:].tolist(), strict=True):
        pieces = max(-(-(last - first) // PIECE), 1)
        edges = np.linspace(first, last, pieces + 1).astype(int).tolist()
        for a, b in zip(edges[:-1], edges[1:], strict=True):
            low, high = max(a - OVERLAP, first), min(b + OVERLAP, last)
            parts.append((_solve(cells.part(low, high), of), a - low, b - low))
            task.tick()
    return joined(parts)


def _cycle(cells: Cells, of: Strengths | Stretches) -> Found:
    """A cycle between half a copy of itself on either side."""
    n = len(cells.rows)
    half = n // 2
    at = np.arange(-half, n + half) % n
    around = Cells(cells.width, cells.products[at], cells.rows[at])
    found = _solve(around, of)
    # what the copies say of I is not new
    more = float(cells.rows[at].sum() / cells.rows.sum())
    return Found(
        found.mean[half : half + n], found.variance[half : half + n], found.inertia,
        found.var_inertia * more, found.evidence, found.noise,
    )  # fmt: skip
