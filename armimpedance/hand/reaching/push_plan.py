"""Which push tells most, the shapes that are compared, and how many trials they need.

The pilot's free reaches say how much trials differ, its few pushed ones roughly what the arm is.
For each shape the response of that arm is put into the equation of `equation`; the precision of
its unknowns is the Cramer-Rao bound of trials whose undisturbed course is a Gaussian process.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import InputError, check_number
from armimpedance.core.records import Recording
from armimpedance.hand.reaching.course import (
    courses_of,
    inertia_rows,
    inertial_gradients,
    pushes_of,
)
from armimpedance.hand.reaching.equation import REFLEX_S, TOLD, equations_of, projected, regressors
from armimpedance.hand.reaching.fitted import instant_of, to_hand, turning
from armimpedance.hand.reaching.solve import PhaseSolution, precision_of, solve, weight_of
from armimpedance.hand.reaching.windows import (
    AFTER_S,
    LONGEST_S,
    SPACING_S,
    PhaseWindows,
    cut_phase,
)

# Shapes of pushes that a plan compares, and how a hand answers them.

#: Directions of the planned pushes, equally spaced.
DIRECTIONS: Final = 8
#: Steps in which an answer is followed (s).
STEP_S: Final = 0.001


@dataclass(frozen=True)
class PushShape:
    """A push along its direction, of size 1.

    `kind`: half-sine forces of alternating sign, or a displacement that goes out, holds and comes
    back.
    `parts_s`: how long each part lasts.
    """

    name: str
    kind: Literal["force", "displacement"]
    parts_s: tuple[float, ...]

    @property
    def duration_s(self) -> float:
        """From onset to end."""
        return sum(self.parts_s)

    def at(self, lag_s: FloatArray) -> FloatArray:
        """The push (S,) at times from its onset."""
        if self.kind == "displacement":
            out, hold, back = self.parts_s
            return _rise(lag_s / out) - _rise((lag_s - out - hold) / back)
        value, start, sign = np.zeros_like(lag_s), 0.0, 1.0
        for part in self.parts_s:
            u = (lag_s - start) / part
            value += sign * np.sin(np.pi * u) * ((u > 0) & (u < 1))
            start, sign = start + part, -sign
        return value


def _rise(u: FloatArray) -> FloatArray:
    """From 0 to 1 with the least jerk."""
    u = np.clip(u, 0.0, 1.0)
    return np.asarray(u**3 * (10 - 15 * u + 6 * u**2))


SHAPES: Final = (
    PushShape("pulse of 60 ms", "force", (0.06,)),
    PushShape("doublet of 2 x 45 ms", "force", (0.045, 0.045)),
    PushShape("doublet of 2 x 60 ms", "force", (0.06, 0.06)),
    PushShape("doublet of 2 x 80 ms", "force", (0.08, 0.08)),
    PushShape("doublet of 2 x 100 ms", "force", (0.1, 0.1)),
    PushShape("triplet of 3 x 60 ms", "force", (0.06, 0.06, 0.06)),
    PushShape("displacement of 160 ms", "displacement", (0.06, 0.04, 0.06)),
    PushShape("displacement of 250 ms", "displacement", (0.09, 0.07, 0.09)),
)


@dataclass(frozen=True)
class PushResponse:
    """What pushes of one shape and of the largest allowed size do to a hand.

    `displacement`, `velocity`, `acceleration` (n, S, 2): of n directions.
    `force_n`, `displacement_m`: the largest that the limb gives, and goes, in any direction.
    """

    displacement: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    force_n: float
    displacement_m: float


def respond_to(
    shape: PushShape,
    hand: FloatArray,
    robot_kg: float,
    limits: tuple[float, float],
    lag_s: FloatArray,
) -> PushResponse:
    """The answer of a hand with constant M, B, K (3, 2, 2) to pushes all around.

    `hand` (3, 2, 2), `limits` (largest push in N, largest displacement in m).
    `robot_kg`: what a pushed hand carries.
    `lag_s` (S,): when the answer is wanted.
    """
    fine = np.arange(0.0, lag_s[-1] + STEP_S / 2, STEP_S)
    angle = 2 * np.pi / DIRECTIONS * np.arange(DIRECTIONS)
    units = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    course = shape.at(fine)
    if shape.kind == "displacement":
        x = course[None, :, None] * units[:, None]
        v = np.gradient(x, STEP_S, axis=1)
        a = np.gradient(v, STEP_S, axis=1)
        size = limits[1]
    else:
        x, v, a = _swing(course, units, hand, robot_kg)
        size = min(limits[0], limits[1] / np.hypot(x[..., 0], x[..., 1]).max())
    x, v, a = size * x, size * v, size * a
    # F = M a + B v + K x, (2,)
    F = sum(part @ matrix.T for part, matrix in zip((a, v, x), hand, strict=True))
    keep = np.rint(lag_s / STEP_S).astype(int)
    return PushResponse(
        x[:, keep],
        v[:, keep],
        a[:, keep],
        float(np.hypot(F[..., 0], F[..., 1]).max()),
        float(np.hypot(x[..., 0], x[..., 1]).max()),
    )


def _swing(
    course: FloatArray, units: FloatArray, hand: FloatArray, robot_kg: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """``(M + m) a + B v + K x = u f(t)`` from rest: x, v, a of (n, S, 2), by steps of 1 ms."""
    from scipy.linalg import expm

    M, B, K = hand
    inverse = np.linalg.inv(M + robot_kg * np.eye(2))
    # state (x, v, f u) (6,): the push stands still over a step
    drift = np.zeros((6, 6))
    drift[:2, 2:4] = np.eye(2)
    drift[2:4] = np.hstack([-inverse @ K, -inverse @ B, inverse])
    step = expm(drift * STEP_S)[:4]
    state = np.zeros((len(course), len(units), 4))
    for s in range(1, len(course)):
        push = (course[s - 1] + course[s]) / 2 * units
        state[s] = np.hstack([state[s - 1], push]) @ step.T
    x, v = np.moveaxis(state[..., :2], 0, 1), np.moveaxis(state[..., 2:], 0, 1)
    push = course[None, :, None] * units[:, None]
    return x, v, (push - v @ B.T - x @ K.T) @ inverse.T


#: Trials that the table's intervals are for.
TRIALS: Final = 40
#: Rounds of all directions beyond which nobody plans.
MOST_ROUNDS: Final = 2**17
#: The share of the bound's information that the estimator reaches (docs/evidence/movement.md).
EFFICIENCY: Final = 0.8


@dataclass(frozen=True)
class PlannedPush:
    """One shape at its largest allowed size.

    `force_n`, `displacement_m`: largest force and displacement of the hand.
    `k_percent`: the error of K that `TRIALS` trials stay below in 95 of 100 experiments, in percent
    of the hand's K (Frobenius norms).
    `trials`: for the wanted error; a multiple of the directions.
    """

    shape: PushShape
    force_n: float
    displacement_m: float
    k_percent: float
    trials: int


@dataclass(frozen=True)
class MovementPlan(FrozenRecord):
    """What a pilot says of pushes at one phase, the best first.

    `stiffness` (2, 2): the hand's K as the pilot shows it.
    """

    condition: str
    phase: str
    wanted_percent: float
    stiffness: Annotated[FloatArray, "2 2"]
    pushes: tuple[PlannedPush, ...]


def plan_movement(
    pilot: Recording,
    *,
    k_percent: float = 10.0,
    phase: str | None = None,
    robot_kg: float = 1.0,
    max_force_n: float = 10.0,
    max_displacement_m: float = 0.01,
) -> MovementPlan:
    """Compare pushes of a moving hand by the trials that they need.

    Parameters
    ----------
    pilot : Recording
        Reaches of one condition, as `identify_movement` takes them: ten free and eight pushed ones
        are the least.
    k_percent : float
        Wanted error of K, which 95 of 100 experiments stay below.
    phase : str, optional
        Default: the first of the pilot.
    robot_kg : float
        Mass of robot and handle that the hand carries.
    max_force_n, max_displacement_m : float
        No push is larger.

    Returns
    -------
    MovementPlan
        The pushes, the best first.

    Raises
    ------
    InputError
        The pilot lacks something, or a number is not positive.
    NotIdentifiableError
        The pilot's pushes do not tell what the arm is.
    """
    for name, value in (
        ("k_percent", k_percent),
        ("robot_kg", robot_kg),
        ("max_force_n", max_force_n),
        ("max_displacement_m", max_displacement_m),
    ):
        check_number(value, f"{name} {value:g}", above=0)
    pushes = pushes_of(pilot)
    named = pushes.phases[0] if phase is None else phase
    if named not in pushes.phases:
        raise InputError(f"no phase {named!r}", expected=f"one of {', '.join(pushes.phases)}")
    conditions = pilot.trials["condition"].astype(str).to_numpy()
    condition = str(conditions[np.flatnonzero(pushes.rows(named))[0]])
    rows = np.flatnonzero(conditions == condition)
    courses = courses_of(pilot)
    found = solve(equations_of(cut_phase(courses, pushes, rows, named)))
    limits = (max_force_n, max_displacement_m)
    made = []
    for shape in SHAPES:
        window_s = min(shape.duration_s + AFTER_S, LONGEST_S)
        windows = cut_phase(courses, pushes, rows, named, window_s)
        made.append(_planned(shape, windows, found, robot_kg, limits, k_percent))
    weights, constant = to_hand(windows.arm, instant_of(windows))
    K = (weights @ found.theta[TOLD] + constant)[8:].reshape(2, 2)
    best = sorted(made, key=lambda push: push.k_percent)
    return MovementPlan(condition, named, k_percent, K, tuple(best))


def _planned(
    shape: PushShape,
    windows: PhaseWindows,
    found: PhaseSolution,
    robot_kg: float,
    limits: tuple[float, float],
    wanted: float,
) -> PlannedPush:
    equations, at = equations_of(windows), instant_of(windows)
    weights, constant = to_hand(windows.arm, at)
    hand = (weights @ found.theta[TOLD] + constant).reshape(3, 2, 2)
    response = respond_to(shape, hand, robot_kg, limits, windows.lag_s)
    X = _expected(windows, response)
    W, P = weight_of(equations, found.theta), precision_of(equations, found.theta, None)
    # information (p, p) of one trial, the mean over directions: X_n^T W X_n
    information = np.einsum("nrp,rs,nsq->pq", X, W, X) / len(X)

    def percent(trials: int) -> float:
        C = np.linalg.inv(trials * EFFICIENCY * information + P)[TOLD, TOLD]
        of_hand = weights[8:] @ C @ weights[8:].T
        return 100 * _largest_error(of_hand) / float(np.linalg.norm(hand[2]))

    return PlannedPush(
        shape, response.force_n, response.displacement_m, percent(TRIALS), _trials(percent, wanted)
    )


def _expected(windows: PhaseWindows, response: PushResponse) -> FloatArray:
    """Projected regressors (n, R, 31) of the response, the arm's turning as in the middle."""
    at, arm = instant_of(windows), windows.arm
    A, N = np.linalg.inv(arm.jacobian(at.angle)), arm.jacobian_rate(at.angle, at.rate)
    P = turning(arm, at)
    # dq = A dx, dqd = A dv - A N dq, dqdd = A da - A P dq - 2 A N dqd (`hand_level`)
    q = response.displacement @ A.T
    qd = response.velocity @ A.T - q @ (A @ N).T
    qdd = response.acceleration @ A.T - q @ (A @ P).T - 2 * qd @ (A @ N).T
    by_angle, by_rate = inertial_gradients(at.angle, at.rate, at.acceleration)
    Y = (
        np.einsum("ijp,nsj->nsip", by_angle, q)
        + np.einsum("ijp,nsj->nsip", by_rate, qd)
        + np.einsum("ijp,nsj->nsip", inertia_rows(at.angle), qdd)
    )
    late = np.zeros_like(q)
    back = round(REFLEX_S / SPACING_S)
    late[:, back:] = q[:, :-back]
    return projected(windows.lag_s, regressors(windows.lag_s, Y, q, qd, late))


def _largest_error(covariance: FloatArray) -> float:
    """What the length of an error of this covariance exceeds once in twenty times.

    Its square is a sum of chi-squares, near one of ``tr(C)^2 / tr(C^2)`` degrees of freedom.
    """
    from scipy.stats import chi2

    total, squares = float(np.trace(covariance)), float((covariance**2).sum())
    dof = total**2 / squares
    return float(np.sqrt(total / dof * chi2.ppf(0.95, dof)))


def _trials(percent: Callable[[int], float], wanted: float) -> int:
    """The fewest trials, in whole rounds of the directions; at most a million."""
    low, high = 0, 1
    while percent(DIRECTIONS * high) > wanted and high < MOST_ROUNDS:
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if percent(DIRECTIONS * middle) <= wanted else (middle, high)
    return DIRECTIONS * high
