"""Is it one limb and one rig from the first trial to the last? The session is its own witness.

The inertia of a limb at one place does not change while a person is measured; stiffness does, with
fatigue and attention. So the trials are asked whether M changes in their course:

    theta_t = theta + w_t D g

`theta_t` (p,) M, B, K of trial t row by row; `w_t` the course: 0 before a change and 1 from it on,
1 in one set alone, or rising from 0 to 1; D (p, k) the parts of theta that a change scales, so that
g (k,) are changes as parts. B and K have numbers of their own in it: their change is no alarm. All
conditions share g, each has its own theta.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Final, Literal

import numpy as np
import pandas as pd
from scipy.special import stdtrit
from scipy.stats import chi2

from armimpedance.core.arrays import BoolArray, FloatArray, IntArray
from armimpedance.core.conventions import AXES
from armimpedance.core.errors import EstimationError
from armimpedance.core.findings import Finding
from armimpedance.core.records import Recording
from armimpedance.hand.still.doubts.model import Model
from armimpedance.hand.still.doubts.odds import odds_of, tails

#: A change is named where chance alone makes as much of one course less often than this: some
#: hundred courses, which resemble each other, are tried. Measured: see `docs/what_goes_wrong.md`.
LEVEL_OF_CHANGE: Final = 5e-5
#: Trials before and after a change that are wanted at least.
FEWEST_BESIDE: Final = 8
#: Places of a change that are tried at most.
MOST_COURSES: Final = 128
#: Times that a change is told in parts of what was before it.
STEPS: Final = 3
#: Columns of the trial table that tell the order of the trials, the coarsest first.
ORDER: Final = ("day", "set", "block")
#: Conditions nearer to each other than this have one inertia (m, rad); smaller parts of it between
#: them are not named, and of more conditions only those with most trials are held against others.
SAME_PLACE: Final = {"hand": 0.01, "joint": 0.05}
LEAST_UNLIKE: Final = 0.03
MOST_CONDITIONS: Final = 8
#: Explanations that chance would make worse than this less often are dropped.
UNLIKE: Final = 0.001
#: Drop of the squared statistic that bounds the place of a change (95 %, one number).
_DROP: Final = 3.84


@dataclass(frozen=True, eq=False)
class Course:
    """When a change holds.

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
class Change:
    """The change that explains most.

    `sizes` (3 d,): parts by which M, then B, then K of each axis of force change.
    `covariance` (3 d, 3 d): of these.
    `z`: the largest statistic, of M of all axes or of one.
    `axis`: that axis; None: of all.
    `limit`: what chance alone does not reach.
    `least`: the smallest change in the middle of the session that would have been named.
    `fading`: statistic of K of all axes, the largest over the courses, and its part.
    `between`: trials, counted from 0, between which a change that holds on began.
    """

    course: Course
    sizes: FloatArray
    covariance: FloatArray
    z: float
    axis: int | None
    limit: float
    least: float
    fading: tuple[float, float]
    between: tuple[int, int]

    @property
    def seen(self) -> bool:
        """Whether it is more than chance."""
        return abs(self.z) > self.limit


@dataclass(frozen=True, eq=False)
class _Part:
    """One condition: equations of its trials, and what a change adds to them.

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
    def of(cls, model: Model, rows: IntArray, theta: FloatArray | None = None) -> _Part:
        """Of the trials of a model; changes are parts of `theta`, by default of the model's."""
        A, b, d = model.equations.A, model.equations.b, model.equation.axes
        inverse = np.linalg.inv(A.sum(axis=0))
        # sum_t A_t (p, p) theta (p,) = sum_t b_t
        solved = inverse @ b.sum(axis=0)
        return cls(rows, A, b, solved, rows_scaled(solved if theta is None else theta, d), inverse)

    @property
    def residual(self) -> FloatArray:
        """What the trials' equations leave of the common theta, (T, p)."""
        return np.asarray(self.b - self.A @ self.theta)


def rows_scaled(theta: FloatArray, d: int) -> FloatArray:
    """D (3 d^2, 3 d): column X d + i is row i of matrix X of theta."""
    scaled = np.zeros((3, d, d, 3, d))
    for matrix, values in enumerate(theta.reshape(3, d, d)):
        for axis in range(d):
            scaled[matrix, axis, :, matrix, axis] = values[axis]
    return scaled.reshape(3 * d * d, 3 * d)


@dataclass(frozen=True, eq=False)
class _Fit:
    """Numbers g (k,) of one course, their covariance and the shift of each condition's theta."""

    sizes: FloatArray
    covariance: FloatArray
    shifts: tuple[FloatArray, ...]

    @property
    def z(self) -> FloatArray:
        """Sizes in standard errors."""
        return np.asarray(self.sizes / np.sqrt(np.diag(self.covariance)))


def fit_course(parts: Sequence[_Part], weight: FloatArray, pattern: FloatArray) -> _Fit | None:
    """g of a course, with every condition's theta free beside it; None where no trial tells it.

    `pattern` (3 d, k): which of the scaled rows change together.
    """
    k = pattern.shape[1]
    H, u, coupled = np.zeros((k, k)), np.zeros(k), []
    for part in parts:
        w, D = weight[part.rows], part.scaled @ pattern
        S = D.T @ np.tensordot(w, part.A, axes=1)
        R = np.tensordot(w, part.A, axes=1) @ D
        # [sum A, sum w A D; sum w D^T A, sum w^2 D^T A D] [shift; g] = [0; sum w D^T r]
        H += D.T @ np.tensordot(w**2, part.A, axes=1) @ D - S @ part.inverse @ R
        u += D.T @ (w @ part.residual)
        coupled.append(part.inverse @ R)
    diagonal = np.abs(np.diag(H))
    if diagonal.min() <= 1e-9 * _known(parts, pattern).min():
        return None
    inverse = np.linalg.inv(H)
    g = inverse @ u
    shifts = tuple(-each @ g for each in coupled)
    return _Fit(g, inverse * _excess(parts, weight, pattern, g, shifts), shifts)


def _known(parts: Sequence[_Part], pattern: FloatArray) -> FloatArray:
    """What all trials would tell of g if theta were known: the diagonal of ``sum D^T A D``."""
    found = np.zeros(pattern.shape[1])
    for part in parts:
        D = part.scaled @ pattern
        found += np.abs(np.diag(D.T @ part.A.sum(axis=0) @ D))
    return found


def _excess(
    parts: Sequence[_Part],
    weight: FloatArray,
    pattern: FloatArray,
    g: FloatArray,
    shifts: Sequence[FloatArray],
) -> FloatArray:
    """By how much trials differ more than their noise makes them, squared: (k, k).

    One measure of all trials: that of the few beside a late change is rough.
    """
    k = len(g)
    found, expected = np.zeros(k), np.zeros(k)
    for part, shift in zip(parts, shifts, strict=True):
        w, D = weight[part.rows], part.scaled @ pattern
        changed = part.residual - part.A @ shift - w[:, None] * (part.A @ D @ g)
        T = len(part.rows)
        free = T / max(T - part.scaled.shape[1], 1)
        found += free * ((changed @ D) ** 2).sum(axis=0)
        expected += np.einsum("pk,tpq,qk->k", D, part.A, D)
    scale = np.sqrt(found / expected)
    return np.outer(scale, scale)


def in_order(recording: Recording) -> IntArray:
    """The trials' rows in the order in which they were made, as far as the table tells it."""
    columns = [name for name in ORDER if name in recording.trials]
    if not columns:
        return np.arange(recording.n_trials)
    table = recording.trials[columns].reset_index(drop=True)
    return table.sort_values(columns, kind="stable", na_position="last").index.to_numpy()


def courses_of(recording: Recording) -> Iterator[Course]:
    """Changes from each trial on, in each set alone, and one that grows."""
    order, n = in_order(recording), recording.n_trials
    place = np.empty(n, dtype=int)
    place[order] = np.arange(n)
    last = n - FEWEST_BESIDE
    for first in range(FEWEST_BESIDE, last + 1, max(1, (last - FEWEST_BESIDE) // MOST_COURSES)):
        name = _trial(recording, order, first)
        yield Course("from", first, (place >= first).astype(float), f"from trial {name} on")
    for column in ORDER:
        if column in recording.trials:
            yield from _sets(recording.trials[column], column, place)
    yield Course("drift", 0, place / max(n - 1, 1), "from the first trial to the last")


def _sets(labels: pd.Series, column: str, place: IntArray) -> Iterator[Course]:
    """Sets that others come before and after."""
    for label in labels.dropna().unique():
        alone = (labels == label).to_numpy()
        inside = place[alone]
        between = inside.min() > 0 and inside.max() < len(place) - 1
        if between and min(alone.sum(), (~alone).sum()) >= FEWEST_BESIDE:
            shown = f"{label:g}" if isinstance(label, float) else str(label)
            yield Course(
                "alone", int(inside.min()), alone.astype(float), f"in {column} {shown} alone"
            )


def _trial(recording: Recording, order: IntArray, place: int) -> str:
    """The trial's number; its place in the order, too, where numbers do not rise."""
    numbers, rising = _numbers(recording, order)
    return str(numbers[place]) + ("" if rising else f", the {place + 1}. of {len(order)},")


def _numbers(recording: Recording, order: IntArray) -> tuple[IntArray, bool]:
    """The trials' numbers in the order of the session, and whether they rise."""
    table = recording.trials
    numbers = table["trial"].to_numpy()[order] if "trial" in table else order + 1
    return numbers, bool(np.all(np.diff(numbers) > 0))


def change_of(recording: Recording, models: Sequence[tuple[IntArray, Model]]) -> Change | None:
    """The change that explains most of a session; None where no course can be asked.

    `models`: each condition's trials, as rows of the recording, and its fit.
    """
    if not models:
        return None
    parts = [_Part.of(model, rows) for rows, model in models]
    d = models[0][1].equation.axes
    dof = max(sum(len(part.rows) - 3 * d for part in parts), 1)
    limit = float(stdtrit(dof, 1 - LEVEL_OF_CHANGE / 2))
    tried = list(_tried(recording, parts))
    if not tried:
        return None
    best = max(tried, key=lambda one: abs(one.z))
    whole = [one for one in tried if one.axis is None]
    middle = recording.n_trials / 2
    usual = min(whole, key=lambda o: (o.course.kind != "from", abs(o.course.first - middle)))
    fading = max(whole, key=lambda one: abs(one.fit.z[2])).fit
    exact = _refined(models, best.course)
    return Change(
        course=best.course,
        sizes=exact.sizes,
        covariance=exact.covariance,
        z=best.z,
        axis=best.axis,
        limit=limit,
        least=limit * float(np.sqrt(usual.fit.covariance[0, 0])),
        fading=(float(fading.z[2]), float(fading.sizes[2])),
        between=_between(tried, best),
    )


@dataclass(frozen=True, eq=False)
class _Tried:
    """A course with the inertia of all axes in it (`axis` None), or of one.

    `number`: which of the fit's numbers is that inertia.
    """

    course: Course
    axis: int | None
    fit: _Fit

    @property
    def number(self) -> int:
        """Which of the fit's numbers is the change of that inertia."""
        return self.axis or 0

    @property
    def z(self) -> float:
        """That change in standard errors."""
        return float(self.fit.z[self.number])


def _tried(recording: Recording, parts: Sequence[_Part]) -> Iterator[_Tried]:
    """Every course that the trials can tell something of."""
    d = parts[0].scaled.shape[1] // 3
    together, single = np.kron(np.eye(3), np.ones((d, 1))), np.eye(3 * d, dtype=float)
    for course in courses_of(recording):
        whole = fit_course(parts, course.weight, np.asarray(together, dtype=float))
        apart = fit_course(parts, course.weight, single)
        if whole is not None and apart is not None:
            yield _Tried(course, None, whole)
            yield from (_Tried(course, axis, apart) for axis in range(d if d > 1 else 0))


def _refined(models: Sequence[tuple[IntArray, Model]], course: Course) -> _Fit:
    """The change in parts of M, B and K before it, not of their mean."""
    single = np.eye(3 * models[0][1].equation.axes)
    parts = [_Part.of(model, rows) for rows, model in models]
    best = fit_course(parts, course.weight, single)
    found = best
    for _ in range(STEPS):
        if found is None:
            break
        best = found
        before = [part.theta + shift for part, shift in zip(parts, best.shifts, strict=True)]
        parts = [
            _Part.of(model, rows, theta)
            for (rows, model), theta in zip(models, before, strict=True)
        ]
        found = fit_course(parts, course.weight, single)
    if best is None:
        raise EstimationError("a course that was fitted cannot be fitted again")
    return best


def _between(tried: Sequence[_Tried], best: _Tried) -> tuple[int, int]:
    """First and last trial at which the change may have begun, 95 %."""
    near = [
        one.course.first
        for one in tried
        if one.axis == best.axis
        and one.course.kind == best.course.kind == "from"
        and one.z**2 >= best.z**2 - _DROP
    ]
    first = best.course.first
    return (min(near), max(near)) if near else (first, first)


# What a gain that may have changed makes wrong.

#: Probability beforehand that a gain of the force changes in a session, and its usual part.
BEFOREHAND: Final = 0.05
USUAL_CHANGE: Final = 0.1
#: Changes less likely than this are left out.
_UNLIKELY: Final = 1e-4


@dataclass(frozen=True, eq=False)
class PossibleGain:
    """A gain that may have changed, with its probability and its mean square.

    `pattern` (3 d, 1): the rows of M, B and K that it scales.
    """

    weight: FloatArray
    pattern: FloatArray
    probability: float
    square: float


def possible_gains(
    recording: Recording, models: Sequence[tuple[IntArray, Model]]
) -> list[PossibleGain]:
    """The changes of a gain that the session does not exclude, by what its inertia says."""
    parts = [_Part.of(model, rows) for rows, model in models]
    tried = list(_tried(recording, parts)) if parts else []
    if not tried:
        return []
    told = []
    for one in tried:
        error2 = float(one.fit.covariance[one.number, one.number])
        told.append(odds_of(float(one.fit.sizes[one.number]), error2, USUAL_CHANGE**2))
    odds = np.array([each for each, _ in told]) + np.log(BEFOREHAND / len(tried) / (1 - BEFOREHAND))
    top = max(0.0, float(odds.max()))
    weight = np.exp(odds - top)
    likely = weight / (weight.sum() + np.exp(-top))
    wider = tails(float(likely.sum()))
    return [
        PossibleGain(one.course.weight, _rows(parts, one.axis), float(p) * wider, square)
        for one, p, (_, square) in zip(tried, likely, told, strict=True)
        if p > _UNLIKELY
    ]


def _rows(parts: Sequence[_Part], axis: int | None) -> FloatArray:
    """The rows of M, B and K that a gain of all axes or of one scales, (3 d, 1)."""
    d = parts[0].scaled.shape[1] // 3
    some = np.ones(d) if axis is None else (np.arange(d) == axis).astype(float)
    return np.tile(some, 3)[:, None]


def wrong_by_gains(gains: Sequence[PossibleGain], rows: IntArray, model: Model) -> FloatArray:
    """What they make wrong in one group, (2 gains, 3 d^2), in roots of mean squares.

    Nobody knows which gain was right, that before the change or that from it on: half each.
    """
    part = _Part.of(model, rows)
    errors = []
    for gain in gains:
        D = part.scaled @ gain.pattern
        # theta = theta_before + (sum A)^-1 sum w A D g = theta_after - D g + the same
        before = part.inverse @ np.tensordot(gain.weight[rows], part.A, axes=1) @ D
        root = np.sqrt(gain.probability * gain.square / 2)
        errors += [root * before[:, 0], root * (before - D)[:, 0]]
    return np.array(errors).reshape(-1, len(part.theta))


# What a change is: its pattern over M, B and K and over the axes of force.

Cause = Literal["gain", "channel", "sign", "limb"]


def cause_of(change: Change) -> tuple[Cause, int | None, float, float]:
    """The simplest explanation that the numbers allow; its axis, its part and standard error.

    A gain of the force scales M, B and K alike, one of a channel those of its axis; a limb is
    another one where they go different ways.
    """
    d = len(change.sizes) // 3
    explained: list[tuple[int | None, FloatArray]] = [(None, np.ones(3 * d))]
    explained += [
        (axis, np.tile(np.arange(d) == axis, 3) * 1.0) for axis in range(d if d > 1 else 0)
    ]
    found = [(_explained(change, pattern), axis) for axis, pattern in explained]
    (misfit, part, error), axis = min(found, key=lambda one: one[0][0])
    if misfit > chi2.isf(UNLIKE, 3 * d - 1):
        inertia = np.repeat([1.0, 0.0, 0.0], d)
        _, part, error = _explained(change, inertia, of_inertia=True)
        return "limb", None, part, error
    if axis is not None and abs(part + 2) < 0.5:
        return "sign", axis, part, error
    return ("gain" if axis is None else "channel"), axis, part, error


def _explained(
    change: Change, pattern: FloatArray, *, of_inertia: bool = False
) -> tuple[float, float, float]:
    """Misfit of ``g = part * pattern``, the part and its standard error."""
    some: BoolArray = pattern > 0 if of_inertia else np.ones(len(pattern), dtype=bool)
    weight = np.linalg.inv(change.covariance[np.ix_(some, some)])
    g, x = change.sizes[some], pattern[some]
    known = float(x @ weight @ x)
    part = float(x @ weight @ g) / known
    left = g - part * x
    return float(left @ weight @ left), part, known**-0.5


def check_session(
    recording: Recording, models: Sequence[tuple[IntArray, Model]]
) -> tuple[Finding, ...]:
    """The finding "session": whether M stays from the first trial to the last.

    `models`: each condition's trials, as rows of the recording, and its fit.
    Returns: one; "cannot tell" where no condition has trials before and after a change.
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
    """Two conditions at one place whose inertia differs; None where all are alike."""
    limit, found = stdtrit(np.inf, 1 - LEVEL_OF_CHANGE / 2), []
    for (rows, one), (others, other) in combinations(models[:MOST_CONDITIONS], 2):
        if _distance(recording, rows, others) > SAME_PLACE[recording.kind]:
            continue
        q = one.equation.axes**2
        M, change = one.parameters[:q], other.parameters[:q] - one.parameters[:q]
        weight = np.linalg.inv(one.covariance[:q, :q] + other.covariance[:q, :q])
        # M_other - M_one (q,) = g M_one (q,), weighted by its covariance
        known = float(M @ weight @ M)
        g, error = float(M @ weight @ change) / known, known**-0.5
        if abs(g) > max(limit * error, LEAST_UNLIKE):
            found.append((abs(g) / error, g, error, rows, others))
    if not found:
        return None
    _, g, error, rows, others = max(found, key=lambda one: one[0])
    first, second = (recording.trials["condition"].iloc[each[0]] for each in (rows, others))
    return (
        f"inertia of {second} is {100 * g:+.0f} % (sd {100 * error:.0f}) beside that of {first} at "
        "the same place: another gain of the sensor, another person or something else in the hand"
    )


def _distance(recording: Recording, rows: IntArray, others: IntArray) -> float:
    """How far apart the limb was in two groups of trials, m or rad."""
    first, second = (
        np.median([recording.position[recording.offsets[row]] for row in each], axis=0)
        for each in (rows, others)
    )
    return float(np.linalg.norm(second - first))


def _steady(change: Change) -> str:
    """M stays; what K does."""
    z, part = change.fading
    if abs(z) <= change.limit:
        return "inertia is the same from the first trial to the last"
    way = "falls" if part < 0 else "grows"
    return (
        f"inertia stays the same while stiffness {way} by some {100 * abs(part):.0f} %: fatigue, "
        "attention or posture; K is the mean"
    )


def _changed(recording: Recording, change: Change) -> str:
    """What changed, by how much, where, and what to do."""
    cause, axis, part, error = cause_of(change)
    how = f"by {100 * part:+.0f} % (sd {100 * error:.0f})"
    where, along = change.course.where, "" if axis is None else f" along {AXES[axis]}"
    if change.course.kind == "from" and change.between[0] < change.between[1]:
        numbers, rising = _numbers(recording, in_order(recording))
        early, late = (numbers[p] if rising else f"{p + 1}." for p in change.between)
        where += f" ({early} to {late})"
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
