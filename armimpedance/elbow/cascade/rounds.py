"""Fit, learn the noise from what is left, and fit again."""

from __future__ import annotations

from typing import Final

from armimpedance.elbow.cascade.fit import Fitted, Prior, fitted
from armimpedance.elbow.cascade.method import Courses
from armimpedance.elbow.cascade.task import Task

ROUNDS: Final = 2
_TOLD: Final = {
    "smooth": "smooth courses (integrated random walks), their strengths by marginal likelihood",
    "jumps": "courses that stay and jump, averaged over all placements of the jumps",
}


def in_rounds(task: Task, prior: Prior | None = None, rounds: int = ROUNDS) -> Courses:
    """Courses under a prior; None: the one of greater marginal likelihood.

    Raises
    ------
    EstimationError
        The record does not determine them.
    """
    made: Fitted = fitted(task, task.cells(), prior)
    for _ in range(rounds - 1):
        task = task.learnt(made.found)
        made = fitted(task, task.cells(), prior, made)
    return Courses(made.found, task, (_TOLD[made.prior],))
