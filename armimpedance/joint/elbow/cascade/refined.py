"""The pathway once more, beside courses as fine as the record allows.

The search's coarse courses stay constant in each of their cells; what they thereby miss of K and of
the gain leans on delay and low-pass, by more than either's standard error. Here both move beside
the fine courses and their noise, from the search's end on.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.elbow.cascade.answer import Pathway
from armimpedance.joint.elbow.cascade.rounds import in_rounds
from armimpedance.joint.elbow.cascade.search import at_place
from armimpedance.joint.elbow.cascade.smooth import smooth_means, strengths_of
from armimpedance.joint.elbow.cascade.task import Task, beginning

#: First steps of the search, and those over which the curvature is read: s, log of the cut-off.
FIRST: Final = (7e-4, 0.015)
STEPS: Final = (3e-4, 0.006)
#: Likelihoods that are worked out at most on the way.
MOST: Final = 40


@dataclass(frozen=True)
class Refined:
    """The pathway of greatest likelihood.

    Attributes
    ----------
    pathway : Pathway
    covariance : (2, 2)
        Of delay (s) and of the logarithm of the cut-off.
    moved : (2, m)
        How far the courses' means go with either.
    """

    pathway: Pathway
    covariance: FloatArray
    moved: FloatArray


def refined(start: Pathway, task: Task) -> Refined:
    """The same pathway with delay and cut-off of greatest likelihood beside fine courses.

    Raises
    ------
    EstimationError
        The record does not determine the courses.
    """
    from scipy.optimize import minimize

    beside = _Beside(in_rounds(replace(beginning(task), pathway=start), "smooth").task)

    def loss(x: Any) -> float:
        at = at_place(start, x)
        return np.inf if at is None else -beside(at)[0]

    x0 = np.array([start.delay_s, np.log(start.cutoff_hz)])
    simplex = x0 + np.array([[0, 0], [FIRST[0], 0], [0, -FIRST[1]]])
    options: Any = {"initial_simplex": simplex, "maxfev": MOST, "xatol": 2e-5, "fatol": 0.02}
    end: Any = minimize(loss, x0, method="Nelder-Mead", options=options)
    task.tick()
    return _around(at_place(start, end.x) or start, beside)


class _Beside:
    """Likelihood of a pathway beside fine courses, and the courses' means."""

    def __init__(self, task: Task) -> None:
        self._task = task
        self._strengths = strengths_of(task.cells())

    def __call__(self, pathway: Pathway) -> tuple[float, FloatArray]:
        return smooth_means(replace(self._task, pathway=pathway).cells(), self._strengths)


def _around(best: Pathway, beside: _Beside) -> Refined:
    """Inverse curvature of the likelihood, and what either does to the courses' means."""
    x, steps = np.array([best.delay_s, np.log(best.cutoff_hz)]), np.diag(STEPS)

    def value(dx: FloatArray) -> tuple[float, FloatArray]:
        return beside(at_place(best, x + dx) or best)

    centre, up, down = value(0 * x)[0], [value(d) for d in steps], [value(-d) for d in steps]
    H = np.diag([2 * centre - u[0] - d[0] for u, d in zip(up, down, strict=True)])
    both, across = steps.sum(axis=0), steps[0] - steps[1]
    cross = value(both)[0] + value(-both)[0] - value(across)[0] - value(-across)[0]
    H[0, 1] = H[1, 0] = -cross / 4
    w, v = np.linalg.eigh(H)
    # where the likelihood is flat, nothing is known beyond ten steps
    inverse = (v / np.maximum(w, 1e-2)) @ v.T
    gone = [(u[1] - d[1]) / (2 * h) for u, d, h in zip(up, down, STEPS, strict=True)]
    return Refined(best, inverse * np.outer(STEPS, STEPS), np.stack(gone))
