"""Check of the session: one limb and one rig from the first trial to the last.

The inertia of a limb at one place does not change while a person is measured; stiffness does, with
fatigue and attention. So the trials are tested for a change of M over the session (`courses`). B
and K have numbers of their own in the test, and their change is not reported as an error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Final, Literal

import numpy as np
from scipy.special import stdtrit
from scipy.stats import chi2

from armimpedance.core.arrays import BoolArray, FloatArray, IntArray
from armimpedance.core.conventions import axis_name
from armimpedance.core.errors import EstimationError
from armimpedance.core.findings import Finding
from armimpedance.core.records import Recording
from armimpedance.hand.still.doubts.courses import (
    FEWEST_BESIDE,
    CourseFit,
    Part,
    SessionCourse,
    fit_course,
    fit_courses,
    in_order,
    rows_of_gain,
    together,
    trial_numbers,
    tried_courses,
)
from armimpedance.hand.still.doubts.model import Model

#: Significance level of a change for one course. It is low because some hundred courses that
#: resemble each other are tried (`benchmarks/broken_assumptions.py`).
LEVEL_OF_CHANGE: Final = 5e-5
#: Iterations that refer a change to the matrices before it.
STEPS: Final = 3
#: Conditions nearer to each other than this have one inertia (m, rad). Smaller relative differences
#: than LEAST_UNLIKE are not reported, and of more conditions only those with most trials are
#: compared.
SAME_PLACE: Final = {"hand": 0.01, "joint": 0.05}
LEAST_UNLIKE: Final = 0.03
MOST_CONDITIONS: Final = 8
#: Explanations are rejected if chance alone exceeds their misfit with a probability below this.
UNLIKE: Final = 0.001
#: Drop of the squared statistic that bounds the place of a change (95 %, one number).
_DROP: Final = 3.84


@dataclass(frozen=True, eq=False)
class SessionChange:
    """The change of a session that explains most.

    `sizes` (3 d,): parts by which M, then B, then K of each axis of force change.
    `covariance` (3 d, 3 d): of these.
    `z`: the largest statistic, of M of all axes or of one.
    `limit`: critical value of the statistic.
    `least`: detection limit of a change in the middle of the session.
    `fading`: statistic of K of all axes, the largest over the courses, and the relative change.
    `between`: first and last trial, counted from 0, at which a lasting change may have begun.
    """

    course: SessionCourse
    sizes: FloatArray
    covariance: FloatArray
    z: float
    limit: float
    least: float
    fading: tuple[float, float]
    between: tuple[int, int]

    @property
    def seen(self) -> bool:
        """True if the change is significant."""
        return abs(self.z) > self.limit


def change_of(
    recording: Recording, models: Sequence[tuple[IntArray, Model]]
) -> SessionChange | None:
    """The change that explains most of a session; None if no course can be fitted.

    `models`: each condition's trials, as rows of the recording, and its fit.
    """
    if not models:
        return None
    parts = [Part.of(model, rows) for rows, model in models]
    d = models[0][1].equation.axes
    dof = max(sum(len(part.rows) - 3 * d for part in parts), 1)
    limit = float(stdtrit(dof, 1 - LEVEL_OF_CHANGE / 2))
    tried = tried_courses(recording, parts)
    if not tried:
        return None
    best = max(tried, key=lambda candidate: abs(candidate.z))
    whole = [candidate for candidate in tried if candidate.axis is None]
    middle = recording.n_trials / 2
    usual = min(whole, key=lambda o: (o.course.kind != "from", abs(o.course.first - middle)))
    fading = max(whole, key=lambda candidate: abs(candidate.fit.z[2])).fit
    pattern = _pattern(_refined(models, best.course))
    course, between = _placed(
        parts, [candidate.course for candidate in whole], best.course, pattern
    )
    exact = _refined(models, course)
    return SessionChange(
        course=course,
        sizes=exact.sizes,
        covariance=exact.covariance,
        z=best.z,
        limit=limit,
        least=limit * float(np.sqrt(usual.fit.covariance[0, 0])),
        fading=(float(fading.z[2]), float(fading.sizes[2])),
        between=between,
    )


def _refined(models: Sequence[tuple[IntArray, Model]], course: SessionCourse) -> CourseFit:
    """Fit the change relative to M, B and K before it instead of their mean."""
    single = np.eye(3 * models[0][1].equation.axes)
    parts = [Part.of(model, rows) for rows, model in models]
    last = fit_course(parts, course.weight, single)
    fit = last
    for _ in range(STEPS):
        if fit is None:
            break
        last = fit
        before = [part.theta + shift for part, shift in zip(parts, last.shifts, strict=True)]
        parts = [
            Part.of(model, rows, theta) for (rows, model), theta in zip(models, before, strict=True)
        ]
        fit = fit_course(parts, course.weight, single)
    if last is None:
        raise EstimationError("a course that was fitted cannot be fitted again")
    return last


def _pattern(fit: CourseFit) -> FloatArray:
    """Rows (3 d, k) that the likeliest cause changes; M, B and K separately for another limb."""
    cause, axis, _, _ = cause_of(fit)
    d = len(fit.sizes) // 3
    if cause == "limb":
        return together(d)
    return rows_of_gain(d, axis)


def _placed(
    parts: Sequence[Part],
    courses: Sequence[SessionCourse],
    best: SessionCourse,
    pattern: FloatArray,
) -> tuple[SessionCourse, tuple[int, int]]:
    """Course with this pattern that explains most, and the range of its first trial (95 %)."""
    if best.kind != "from":
        return best, (best.first, best.first)
    begun = [candidate for candidate in courses if candidate.kind == "from"]
    fits = fit_courses(parts, np.array([candidate.weight for candidate in begun]), pattern)
    explained = [
        (float(fit.sizes @ np.linalg.inv(fit.covariance) @ fit.sizes), course)
        for fit, course in zip(fits, begun, strict=True)
        if fit is not None
    ]
    most, course = max(explained, key=lambda candidate: candidate[0])
    near = [candidate.first for size, candidate in explained if size >= most - _DROP]
    return course, (min(near), max(near))


# Cause of a change: its pattern over M, B and K and over the axes of force.

Cause = Literal["gain", "channel", "sign", "limb"]


def cause_of(change: SessionChange | CourseFit) -> tuple[Cause, int | None, float, float]:
    """Simplest explanation compatible with the data; its axis, relative change and standard error.

    A gain of the force scales M, B and K alike, that of a channel the rows of its axis. It is
    another limb if they change differently.
    """
    d = len(change.sizes) // 3
    patterns: list[tuple[int | None, FloatArray]] = [(None, np.ones(3 * d))]
    patterns += [
        (axis, np.tile(np.arange(d) == axis, 3) * 1.0) for axis in range(d if d > 1 else 0)
    ]
    misfits = [(_explained(change, pattern), axis) for axis, pattern in patterns]
    (misfit, part, error), axis = min(misfits, key=lambda one: one[0][0])
    if misfit > chi2.isf(UNLIKE, 3 * d - 1):
        inertia = np.repeat([1.0, 0.0, 0.0], d)
        _, part, error = _explained(change, inertia, of_inertia=True)
        return "limb", None, part, error
    if axis is not None and abs(part + 2) < 0.5:
        return "sign", axis, part, error
    return ("gain" if axis is None else "channel"), axis, part, error


def _explained(
    change: SessionChange | CourseFit, pattern: FloatArray, *, of_inertia: bool = False
) -> tuple[float, float, float]:
    """Misfit of ``g = part * pattern``, the part and its standard error."""
    scaled: BoolArray = pattern > 0 if of_inertia else np.ones(len(pattern), dtype=bool)
    weight = np.linalg.inv(change.covariance[np.ix_(scaled, scaled)])
    g, x = change.sizes[scaled], pattern[scaled]
    precision = float(x @ weight @ x)
    part = float(x @ weight @ g) / precision
    residual = g - part * x
    return float(residual @ weight @ residual), part, precision**-0.5


def check_session(
    recording: Recording, models: Sequence[tuple[IntArray, Model]]
) -> tuple[Finding, ...]:
    """The finding "session": does M stay the same from the first trial to the last?

    `models`: each condition's trials, as rows of the recording, and its fit.
    Returns: one; "cannot tell" if no condition has trials before and after a change.
    """
    change = change_of(recording, models)
    if change is None and (unlike := _unlike_conditions(recording, models)) is not None:
        return (Finding("session", "warning", unlike),)
    if change is None:
        text = (
            f"no condition has {FEWEST_BESIDE} trials early and late in the session to hold "
            "against each other"
        )
        return (Finding("session", "cannot tell", text),)
    smallest = f"a change of M by {100 * change.least:.2g} % in the middle"
    if change.seen:
        return (Finding("session", "warning", _changed(recording, change), smallest),)
    if (unlike := _unlike_conditions(recording, models)) is not None:
        return (Finding("session", "warning", unlike, smallest),)
    return (Finding("session", "ok", _steady(change), smallest),)


def _unlike_conditions(
    recording: Recording, models: Sequence[tuple[IntArray, Model]]
) -> str | None:
    """Message on two conditions at one place whose inertia differs; None if all are alike."""
    limit, differences = stdtrit(np.inf, 1 - LEVEL_OF_CHANGE / 2), []
    for (rows, first_model), (others, second_model) in combinations(models[:MOST_CONDITIONS], 2):
        if _distance(recording, rows, others) > SAME_PLACE[recording.kind]:
            continue
        q = first_model.equation.axes**2
        M, change = (
            first_model.parameters[:q],
            second_model.parameters[:q] - first_model.parameters[:q],
        )
        weight = np.linalg.inv(first_model.covariance[:q, :q] + second_model.covariance[:q, :q])
        # M_other - M_one (q,) = g M_one (q,), weighted by its covariance
        precision = float(M @ weight @ M)
        g, error = float(M @ weight @ change) / precision, precision**-0.5
        if abs(g) > max(limit * error, LEAST_UNLIKE):
            differences.append((abs(g) / error, g, error, rows, others))
    if not differences:
        return None
    _, g, error, rows, others = max(differences, key=lambda first_model: first_model[0])
    first, second = (recording.trials["condition"].iloc[each[0]] for each in (rows, others))
    return (
        f"inertia of {second} is {100 * g:+.0f} % (sd {100 * error:.0f}) beside that of {first} at "
        "the same place: another gain of the sensor, another person or something else in the hand"
    )


def _distance(recording: Recording, rows: IntArray, others: IntArray) -> float:
    """Distance between the limb's places in two groups of trials, m or rad."""
    first, second = (
        np.median([recording.position[recording.offsets[row]] for row in group], axis=0)
        for group in (rows, others)
    )
    return float(np.linalg.norm(second - first))


def _steady(change: SessionChange) -> str:
    """Message that M stays, with the change of K."""
    z, part = change.fading
    if abs(z) <= change.limit:
        return "inertia is the same from the first trial to the last"
    way = "falls" if part < 0 else "grows"
    return (
        f"inertia stays the same while stiffness {way} by some {100 * abs(part):.0f} %: fatigue, "
        "attention or posture; K is the mean"
    )


def _changed(recording: Recording, change: SessionChange) -> str:
    """Message on the cause of the change, its size and place, and what to do."""
    cause, axis, part, error = cause_of(change)
    how = f"by {100 * part:+.0f} % (sd {100 * error:.0f})"
    where = change.course.where
    along = "" if axis is None else f" along {axis_name(recording.kind, axis)}"
    if change.course.kind == "from" and change.between[0] < change.between[1]:
        numbers, rising = trial_numbers(recording, in_order(recording))
        early, late = (numbers[p] if rising else p + 1 for p in change.between)
        where += f" ({'' if rising else 'number '}{early} to {late})"
    if cause == "sign":
        return (
            f"the force{along} has the other sign {where}: turn it back in those trials, or leave "
            "them out"
        )
    if cause == "limb":
        return (
            f"inertia changes {how} {where}, and B and K otherwise: another person, another "
            "posture or something else in the hand; estimate the parts apart (`--by`)"
        )
    what = "a gain of the sensor, or another person" if axis is None else "one channel's gain"
    return (
        f"the force{along} changes {how} {where}, M, B and K alike: {what}; find out which is "
        "right, and estimate the parts apart (`--by`)"
    )


# Course of M, B and K over the session, for plots.

#: Fewest trials in a block, and largest number of blocks.
FEWEST_IN_BLOCK: Final = 6
MOST_BLOCKS: Final = 12


@dataclass(frozen=True, eq=False)
class SessionBlocks:
    """M, B and K of n blocks of trials in the order of the session, as parts of the session's.

    `first`, `last` (n,): places of each block's first and last trial, from 1.
    `sizes`, `sd` (n, 3): M, B and K, each as one number of all axes; NaN where a block has no trial
    that could be fitted.
    """

    first: IntArray
    last: IntArray
    sizes: FloatArray
    sd: FloatArray


def blocks_of(recording: Recording, models: Sequence[tuple[IntArray, Model]]) -> SessionBlocks:
    """M, B and K in blocks of a session; `models`: each condition's trials as rows, and its fit."""
    order, parts = in_order(recording), [Part.of(model, rows) for rows, model in models]
    count = int(np.clip(len(order) // FEWEST_IN_BLOCK, 1, MOST_BLOCKS))
    places = np.array_split(np.arange(1, len(order) + 1), count)
    sizes = np.array([_sizes(parts, order[block - 1]) for block in places])
    first, last = (np.array([block[i] for block in places]) for i in (0, -1))
    return SessionBlocks(first, last, sizes[..., 0], sizes[..., 1] * _scatter(parts))


def _sizes(parts: Sequence[Part], rows: IntArray) -> FloatArray:
    """M, B and K of some trials relative to their conditions', and standard errors, (3, 2)."""
    H, u = np.zeros((3, 3)), np.zeros(3)
    for part in parts:
        inside, D = np.isin(part.rows, rows), part.scaled @ together(part.scaled.shape[1] // 3)
        # H x = u: sum D^T A_t D x = sum D^T b_t
        H += D.T @ part.A[inside].sum(axis=0) @ D
        u += D.T @ part.b[inside].sum(axis=0)
    if np.linalg.matrix_rank(H) != 3:
        return np.full((3, 2), np.nan)
    inverse = np.linalg.inv(H)
    return np.stack([inverse @ u, np.sqrt(np.diag(inverse))], axis=1)


def _scatter(parts: Sequence[Part]) -> float:
    """Ratio of the scatter of trials to that expected from their noise: at least 1."""
    squares = free = 0.0
    for part in parts:
        T, d = len(part.rows), part.scaled.shape[1] // 3
        D = part.scaled @ together(d)
        expected = np.einsum("pk,tpq,qk->k", D, part.A, D)
        squares += float((((part.residual @ D) ** 2).sum(axis=0) / expected).sum())
        free += 3 * max(T - 3 * d, 1) / T
    return float(np.sqrt(max(squares / free, 1.0)))
