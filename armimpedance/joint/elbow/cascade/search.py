"""Search for the reflex: delay, low-pass and side of greatest marginal likelihood.

The courses are fitted again with every pathway that is tried, so that a change of K or of the gain
is not mistaken for another delay. Coarse courses are enough for this comparison.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from typing import Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.elbow.cascade.fit import (
    Strengths,
    in_rounds,
    scales_of,
    smooth_means,
    strengths_of,
)
from armimpedance.joint.elbow.cascade.rows import Cells
from armimpedance.joint.elbow.cascade.task import (
    MOST_ROWS,
    ORDERS,
    SIDES,
    CascadeTask,
    Pathway,
    beginning,
)

#: Scanned delays, s, and cut-offs of the low-pass, Hz; limits of both for the search.
DELAYS_S: Final = np.arange(0.015, 0.126, 0.01)
CUTOFFS_HZ: Final = (3.0, 8.0)
LIMITS: Final = ((0.005, 0.2), (0.7, 40.0))
#: Relative distance from a limit within which the maximum may lie beyond it.
CLOSE: Final = 0.05
#: Width of the coarse cells, s.
COARSE_S: Final = 0.2
#: Intensity of the gain before it is estimated, s^-1.5.
INTENSITY: Final = 2.0
#: Gain in log likelihood from which a reflex is detected.
SEEN: Final = 12.0


@dataclass(frozen=True)
class Searched:
    """The likeliest reflex.

    `gained`: rise of the log marginal likelihood by it.
    """

    pathway: Pathway
    gained: float

    @property
    def at_limit(self) -> bool:
        """True if delay or cut-off lies at a limit of the search."""
        values = np.log([self.pathway.delay_s, self.pathway.cutoff_hz])
        low, high = np.log(LIMITS).T
        return bool(((values < low + CLOSE) | (values > high - CLOSE)).any())

    @property
    def seen(self) -> bool:
        """True if the reflex is detected."""
        return self.gained > SEEN


def searched(task: CascadeTask) -> Searched:
    """Search for the likeliest reflex.

    Raises EstimationError: the record does not determine the courses.
    """
    coarse = _Coarse(_beginning(task))
    without = coarse.tuned(None)
    scores = {}
    for side in SIDES:
        for delay, cutoff in product(DELAYS_S, CUTOFFS_HZ):
            path = Pathway(float(delay), cutoff, 2, side)
            scores[path] = coarse.evidence(path)
        task.tick()
    coarse.tuned(max(scores, key=lambda path: scores[path]))
    ends = []
    # the best side may depend on a delay between the scanned ones
    for side in SIDES:
        near = {path: score for path, score in scores.items() if path.side == side}
        ends.append(_refined(coarse, max(near, key=lambda path: near[path])))
        task.tick()
    best = max(ends, key=lambda e: e[0])[1]
    ends += [_refined(coarse, replace(best, order=order)) for order in ORDERS if order != 2]
    _, pathway = max(ends, key=lambda e: e[0])
    return Searched(pathway, coarse.tuned(pathway) - without)


def _refined(coarse: _Coarse, start: Pathway) -> tuple[float, Pathway]:
    """Log likelihood and pathway of its maximum near a start."""
    from scipy.optimize import minimize

    def loss(x: Any) -> float:
        at = at_place(start, x)
        return np.inf if at is None else -coarse.evidence(at)

    x0 = np.array([start.delay_s, np.log(start.cutoff_hz)])
    simplex = x0 + np.array([[0, 0], [0.008, 0], [0, -0.4]])
    options: Any = {"initial_simplex": simplex, "maxfev": 50, "xatol": 2e-4, "fatol": 0.05}
    end: Any = minimize(loss, x0, method="Nelder-Mead", options=options)
    return -float(end.fun), at_place(start, end.x) or start


def at_place(kind: Pathway, x: FloatArray) -> Pathway | None:
    """Pathway at (delay, log cut-off); None outside the limits of the search."""
    delay, cutoff = float(x[0]), float(np.exp(x[1]))
    inside = all(a <= v <= b for v, (a, b) in zip((delay, cutoff), LIMITS, strict=True))
    return replace(kind, delay_s=delay, cutoff_hz=cutoff) if inside else None


def _beginning(task: CascadeTask) -> CascadeTask:
    """The first rows of a long record, in coarse cells of time."""
    rows, data = task.rows, task.data
    last = int(np.searchsorted(rows.offsets, MOST_ROWS, side="left"))
    last = min(max(last, 1), len(rows.offsets) - 1)
    stop = min(int(rows.offsets[last]), MOST_ROWS)
    offsets = np.append(rows.offsets[:last], stop)
    short = replace(rows, offsets=offsets, torque=rows.torque[:stop], motion=rows.motion[:stop])
    per = max(round(COARSE_S * data.rate_hz), 1)
    used = task.cell[:stop] >= 0
    number = np.arange(stop) // per
    cell = np.where(used, number, -1)
    strips = np.array([0, int(number[-1]) + 1])
    return replace(task, rows=short, cell=cell, strips=strips, width=per / data.rate_hz)


class _Coarse:
    """Marginal likelihoods of pathways with coarse courses."""

    def __init__(self, task: CascadeTask) -> None:
        self._task = task
        self._strengths = strengths_of(self._cells(None))

    def tuned(self, pathway: Pathway | None) -> float:
        """Estimate the hyperparameters with this pathway; return its log marginal likelihood."""
        cells = self._cells(pathway)
        self._strengths = strengths_of(cells)
        return smooth_means(cells, self._strengths)[0]

    def evidence(self, pathway: Pathway) -> float:
        """Logarithm of the marginal likelihood."""
        cells, of = self._cells(pathway), self._strengths
        intensity = of.intensity
        if len(intensity) < cells.courses:
            # the reflex's gain is the column before the offset
            intensity = np.insert(intensity, -1, INTENSITY)
        return smooth_means(cells, Strengths(intensity, scales_of(cells), of.noise))[0]

    def _cells(self, pathway: Pathway | None) -> Cells:
        return replace(self._task, pathway=pathway).cells()


# Refinement of the pathway with fine courses.
#
# Coarse courses are constant in each of their cells. The error that this makes in K and in the gain
# biases delay and low-pass by more than their standard errors. Here both are optimised again with
# fine courses and their noise, starting from the result of the search.

#: First steps of the search, and steps for the curvature: s, logarithm of the cut-off.
FIRST: Final = (7e-4, 0.015)
STEPS: Final = (3e-4, 0.006)
#: Largest number of likelihoods that the search computes.
MOST: Final = 40


@dataclass(frozen=True)
class Refined:
    """The pathway of greatest likelihood.

    `covariance` (2, 2): of delay (s) and of the logarithm of the cut-off.
    `moved` (2, m): derivative of the courses' means by either.
    """

    pathway: Pathway
    covariance: FloatArray
    moved: FloatArray


def refined(start: Pathway, task: CascadeTask) -> Refined:
    """Optimise delay and cut-off of a pathway with fine courses.

    Raises EstimationError: the record does not determine the courses.
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
    """Log likelihood of a pathway with fine courses, and the courses' means."""

    def __init__(self, task: CascadeTask) -> None:
        self._task = task
        self._strengths = strengths_of(task.cells())

    def __call__(self, pathway: Pathway) -> tuple[float, FloatArray]:
        return smooth_means(replace(self._task, pathway=pathway).cells(), self._strengths)


def _around(best: Pathway, beside: _Beside) -> Refined:
    """Covariance from the curvature of the likelihood, and the derivative of the courses' means."""
    x, steps = np.array([best.delay_s, np.log(best.cutoff_hz)]), np.diag(STEPS)

    def value(dx: FloatArray) -> tuple[float, FloatArray]:
        return beside(at_place(best, x + dx) or best)

    centre, up, down = value(0 * x)[0], [value(d) for d in steps], [value(-d) for d in steps]
    H = np.diag([2 * centre - u[0] - d[0] for u, d in zip(up, down, strict=True)])
    along, across = steps.sum(axis=0), steps[0] - steps[1]
    cross = value(along)[0] + value(-along)[0] - value(across)[0] - value(-across)[0]
    H[0, 1] = H[1, 0] = -cross / 4
    w, v = np.linalg.eigh(H)
    # if the likelihood is flat, the standard error is limited to ten steps
    inverse = (v / np.maximum(w, 1e-2)) @ v.T
    slopes = [(u[1] - d[1]) / (2 * h) for u, d, h in zip(up, down, STEPS, strict=True)]
    return Refined(best, inverse * np.outer(STEPS, STEPS), np.stack(slopes))
