"""Courses of a change over a session, and the change of M, B and K along each course.

    theta_t = theta + w_t D g

`theta_t` (p,) is M, B, K of trial t row by row. `w_t` is the course: 0 before a change and 1 from
it on, 1 in one set alone, or rising from 0 to 1. D (p, k) holds the parts of theta that a change
scales, so that g (k,) are relative changes. All conditions share g, each has its own theta.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
import pandas as pd

from armimpedance.core.arrays import BoolArray, FloatArray, IntArray
from armimpedance.core.records import Recording
from armimpedance.hand.still.doubts.model import Model

#: Fewest trials before and after a change.
FEWEST_BESIDE: Final = 8
#: A course is not fitted if its information is less than this share of the information with theta
#: known.
LEAST_TOLD: Final = 1e-5
#: Largest number of places of a change that are tried.
MOST_COURSES: Final = 128
#: Columns of the trial table that give the order of the trials, the coarsest first.
ORDER: Final = ("day", "set", "block")


@dataclass(frozen=True, eq=False)
class SessionCourse:
    """Course of a change over the session.

    `kind`: from a trial on, in one set alone, or growing over the session.
    `first`: the trial at which it begins, counted in the session's order from 0.
    `weight` (N,): w of every trial of the recording, in the trial table's order.
    `where`: in words.
    """

    kind: Literal["from", "alone", "drift"]
    first: int
    weight: FloatArray
    where: str


@dataclass(frozen=True, eq=False)
class Part:
    """Equations of the trials of one condition, and the terms that a change adds to them.

    `rows` (T,): its trials in the recording. `scaled` D (p, 3 d).
    `inverse` (p, p) of ``sum_t A_t``; `residual` (T, p) ``b_t - A_t theta``.
    """

    rows: IntArray
    A: FloatArray
    b: FloatArray
    theta: FloatArray
    scaled: FloatArray
    inverse: FloatArray

    @classmethod
    def of(cls, model: Model, rows: IntArray, theta: FloatArray | None = None) -> Part:
        """Build the part from a model; changes are relative to `theta`, by default the model's."""
        A, b, d = model.equations.A, model.equations.b, model.equation.axes
        inverse = np.linalg.inv(A.sum(axis=0))
        # sum_t A_t (p, p) theta (p,) = sum_t b_t
        solved = inverse @ b.sum(axis=0)
        return cls(rows, A, b, solved, rows_scaled(solved if theta is None else theta, d), inverse)

    @property
    def residual(self) -> FloatArray:
        """Residuals (T, p) of the trials' equations at the common theta."""
        return np.asarray(self.b - self.A @ self.theta)


def rows_scaled(theta: FloatArray, d: int) -> FloatArray:
    """D (3 d^2, 3 d): column X d + i is row i of matrix X of theta."""
    scaled = np.zeros((3, d, d, 3, d))
    for matrix, values in enumerate(theta.reshape(3, d, d)):
        for axis in range(d):
            scaled[matrix, axis, :, matrix, axis] = values[axis]
    return scaled.reshape(3 * d * d, 3 * d)


@dataclass(frozen=True, eq=False)
class CourseFit:
    """Numbers g (k,) of one course, their covariance and the shift of each condition's theta."""

    sizes: FloatArray
    covariance: FloatArray
    shifts: tuple[FloatArray, ...]

    @property
    def z(self) -> FloatArray:
        """Sizes in standard errors."""
        return np.asarray(self.sizes / np.sqrt(np.diag(self.covariance)))


def fit_course(parts: Sequence[Part], weight: FloatArray, pattern: FloatArray) -> CourseFit | None:
    """g of one course of weight (N,); see `fit_courses`."""
    return fit_courses(parts, weight[None], pattern)[0]


def fit_courses(
    parts: Sequence[Part], weights: FloatArray, pattern: FloatArray
) -> list[CourseFit | None]:
    """Estimate g of C courses together with theta of every condition.

    None for a course that the trials do not determine.
    `weights` (C, N): each course's w of every trial.
    `pattern` (3 d, k): which of the scaled rows change together.
    """
    k = pattern.shape[1]
    H, u, coupled = np.zeros((len(weights), k, k)), np.zeros((len(weights), k)), []
    along = [_Along.of(part, pattern) for part in parts]
    for part, products in zip(parts, along, strict=True):
        w = weights[:, part.rows]
        R, S = np.tensordot(w, products.AD, axes=1), np.tensordot(w, products.DA, axes=1)
        # [sum A, sum w A D; sum w D^T A, sum w^2 D^T A D] [shift; g] = [0; sum w D^T r]
        H += np.tensordot(w**2, products.DAD, axes=1) - S @ part.inverse @ R
        u += w @ products.Dr
        coupled.append(part.inverse @ R)
    determined = np.flatnonzero(_determined(H, along))
    inverse = np.linalg.inv(H[determined])
    g = inverse @ u[determined, :, None]
    shifts = [-(change[determined] @ g)[..., 0] for change in coupled]
    covariance = inverse * _excess(parts, along, weights[determined], g[..., 0], shifts)
    fits: list[CourseFit | None] = [None] * len(weights)
    for i, course in enumerate(determined):
        own = tuple(change[i] for change in shifts)
        fits[course] = CourseFit(g[i, :, 0], covariance[i], own)
    return fits


@dataclass(frozen=True, eq=False)
class _Along:
    """Products of a part's trials with a pattern, the same for every course.

    `AD` (T, p, k) A_t D; `DA` (T, k, p); `DAD` (T, k, k); `Dr` (T, k).
    """

    AD: FloatArray
    DA: FloatArray
    DAD: FloatArray
    Dr: FloatArray

    @classmethod
    def of(cls, part: Part, pattern: FloatArray) -> _Along:
        D = part.scaled @ pattern
        AD = part.A @ D
        return cls(AD, D.T @ part.A, D.T @ AD, part.residual @ D)

    @property
    def known(self) -> FloatArray:
        """Information of these trials about g with theta known: the diagonal of ``D^T A D``."""
        return np.asarray(np.einsum("tkk->k", self.DAD))


def _determined(H: FloatArray, along: Sequence[_Along]) -> BoolArray:
    """True for each of C courses that the trials determine, from its information H (C, k, k).

    H is compared with the information with theta known. Instruments make H slightly asymmetric; its
    inverse has positive variances where its symmetric part is positive.
    """
    full = np.sum([np.abs(products.known) for products in along], axis=0)
    if not (full > 0).all():
        return np.zeros(len(H), dtype=bool)
    scaled = H / np.sqrt(np.outer(full, full))
    return np.asarray(np.linalg.eigvalsh((scaled + scaled.mT) / 2)[:, 0] > LEAST_TOLD)


def _excess(
    parts: Sequence[Part],
    along: Sequence[_Along],
    weights: FloatArray,
    g: FloatArray,
    shifts: Sequence[FloatArray],
) -> FloatArray:
    """Squared ratio of the scatter of trials to that expected from their noise, (C, k, k).

    One ratio from all trials: one from the few trials after a late change would be rough. `g` (C,
    k) of the courses `weights` (C, N); `shifts` (C, p) of each part.
    """
    squares = np.zeros_like(g)
    for part, products, shift in zip(parts, along, shifts, strict=True):
        w, T = weights[:, part.rows, None], len(part.rows)
        # D^T (r - A shift - w A D g) of each trial, (C, T, k)
        moved = np.moveaxis(products.DA @ shift.T, -1, 0) + w * np.moveaxis(
            products.DAD @ g.T, -1, 0
        )
        free = T / max(T - part.scaled.shape[1], 1)
        squares += free * ((products.Dr - moved) ** 2).sum(axis=1)
    scale = np.sqrt(squares / np.sum([products.known for products in along], axis=0))
    return np.asarray(scale[:, :, None] * scale[:, None, :])


def in_order(recording: Recording) -> IntArray:
    """Rows of the trials in the order of measurement, as far as the table shows it."""
    columns = [name for name in ORDER if name in recording.trials]
    if not columns:
        return np.arange(recording.n_trials)
    table = recording.trials[columns].reset_index(drop=True)
    return table.sort_values(columns, kind="stable", na_position="last").index.to_numpy()


def courses_of(recording: Recording) -> Iterator[SessionCourse]:
    """Yield changes from each trial on, changes in each set alone, and a linear drift."""
    order, n = in_order(recording), recording.n_trials
    place = np.empty(n, dtype=int)
    place[order] = np.arange(n)
    last = n - FEWEST_BESIDE
    for first in range(FEWEST_BESIDE, last + 1, max(1, (last - FEWEST_BESIDE) // MOST_COURSES)):
        name = trial_name(recording, order, first)
        yield SessionCourse("from", first, (place >= first).astype(float), f"from trial {name} on")
    for column in ORDER:
        if column in recording.trials:
            yield from _sets(recording.trials[column], column, place)
    yield SessionCourse("drift", 0, place / max(n - 1, 1), "from the first trial to the last")


def _sets(labels: pd.Series, column: str, place: IntArray) -> Iterator[SessionCourse]:
    """Yield the sets that have trials of other sets before and after them."""
    for label in labels.dropna().unique():
        alone = (labels == label).to_numpy()
        inside = place[alone]
        between = inside.min() > 0 and inside.max() < len(place) - 1
        if between and min(alone.sum(), (~alone).sum()) >= FEWEST_BESIDE:
            shown = f"{label:g}" if isinstance(label, float) else str(label)
            yield SessionCourse(
                "alone", int(inside.min()), alone.astype(float), f"in {column} {shown} alone"
            )


def trial_name(recording: Recording, order: IntArray, place: int) -> str:
    """Number of the trial; its place in the order is added if the numbers do not rise."""
    numbers, rising = trial_numbers(recording, order)
    return str(numbers[place]) + ("" if rising else f" (number {place + 1} of {len(order)})")


def trial_numbers(recording: Recording, order: IntArray) -> tuple[IntArray, bool]:
    """Numbers of the trials in the order of the session, and True if they rise."""
    table = recording.trials
    numbers = table["trial"].to_numpy()[order] if "trial" in table else order + 1
    return numbers, bool(np.all(np.diff(numbers) > 0))


def together(d: int) -> FloatArray:
    """Pattern (3 d, 3) with one number each for M, B and K of all axes."""
    return np.kron(np.eye(3), np.ones((d, 1))).astype(float)


def rows_of_gain(d: int, axis: int | None) -> FloatArray:
    """Pattern (3 d, 1): rows of M, B and K scaled by a gain of one axis; of all axes if None."""
    scaled = np.ones(d) if axis is None else (np.arange(d) == axis).astype(float)
    return np.tile(scaled, 3)[:, None]


@dataclass(frozen=True, eq=False)
class Tried:
    """A fitted course and one inertia in it: that of all axes (`axis` None), or of one.

    `number`: index of that inertia among the fit's numbers.
    """

    course: SessionCourse
    axis: int | None
    fit: CourseFit

    @property
    def number(self) -> int:
        """Index of the change of that inertia among the fit's numbers."""
        return self.axis or 0

    @property
    def z(self) -> float:
        """The change of that inertia in standard errors."""
        return float(self.fit.z[self.number])


def tried_courses(recording: Recording, parts: Sequence[Part]) -> list[Tried]:
    """Fits of every course that the trials determine."""
    d, courses = parts[0].scaled.shape[1] // 3, list(courses_of(recording))
    weights = np.array([course.weight for course in courses])
    whole = fit_courses(parts, weights, together(d))
    apart = fit_courses(parts, weights, np.eye(3 * d))
    tried = []
    for course, pooled, by_axis in zip(courses, whole, apart, strict=True):
        if pooled is not None and by_axis is not None:
            tried.append(Tried(course, None, pooled))
            tried += [Tried(course, axis, by_axis) for axis in range(d if d > 1 else 0)]
    return tried
