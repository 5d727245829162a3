"""Fit, learn the noise from what is left, and fit again.

Courses that are fitted beside white noise follow a slow torque of the subject's own, and what they
leave of it looks white: the rounds then stay where they began. So they begin at white noise and at
slow noise, and the start whose end explains the record better is taken.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.elbow.cascade.fit import Fitted, Prior, fitted
from armimpedance.joint.elbow.cascade.instants import sharpened
from armimpedance.joint.elbow.cascade.method import Courses
from armimpedance.joint.elbow.cascade.task import Task, beginning

ROUNDS: Final = 2
#: Corner of the slow noise at which the rounds may begin, Hz.
OWN_HZ: Final = 3.0
#: The logarithm of the likelihood by which it must be better.
BETTER: Final = 5.0
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
    task = replace(task, noise=_first_noise(task))
    made: Fitted = fitted(task, task.cells(), prior)
    for _ in range(rounds - 1):
        task = task.learnt(made.found)
        made = fitted(task, task.cells(), prior, made)
    found = sharpened(task, made.found) if made.prior == "jumps" else made.found
    return Courses(found, task, (_TOLD[made.prior],))


def _first_noise(task: Task) -> FloatArray:
    """White, or slow where smooth courses explain the record's beginning better from there on."""
    short = beginning(task)
    slow = np.array([1.0, -np.exp(-2 * np.pi * OWN_HZ / task.rows.rate_hz)])
    white = np.ones(1)
    return slow if _end(short, slow) > _end(short, white) + BETTER else white


def _end(task: Task, noise: FloatArray) -> float:
    """Logarithm of the likelihood in the second round of smooth courses."""
    task = replace(task, noise=noise)
    first = fitted(task, task.cells(), "smooth")
    task = task.learnt(first.found)
    return fitted(task, task.cells(), "smooth", first).found.evidence
