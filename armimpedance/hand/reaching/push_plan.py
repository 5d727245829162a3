"""Plan of pushes: comparison of their shapes, and the number of trials that each needs.

The pilot's free reaches give the scatter of trials, its few pushed ones a rough estimate of the
arm. For each shape the response of that arm is inserted into the equation of `equation`. The
precision of its unknowns is the Cramer-Rao bound for trials whose undisturbed course is a Gaussian
process.
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
from armimpedance.hand.reaching.equation import (
    REFLEX_S,
    REPORTED,
    equations_of,
    projected,
    regressors,
)
from armimpedance.hand.reaching.fitted import instant_of, to_hand, turning
from armimpedance.hand.reaching.solve import PhaseSolution, precision_of, solve, weight_of
from armimpedance.hand.reaching.windows import (
    AFTER_S,
    LONGEST_S,
    SPACING_S,
    PhaseWindows,
    cut_phase,
)

# Shapes of pushes that a plan compares, and the response of a hand to them.

#: Directions of the planned pushes, equally spaced.
DIRECTIONS: Final = 8
#: Time step of the simulated response (s).
STEP_S: Final = 0.001


@dataclass(frozen=True)
class PushShape:
    """A push along its direction, of size 1.

    `kind`: half-sine forces of alternating sign, or a displacement that goes out, stays and comes
    back.
    `parts_s`: duration of each part.
    """

    name: str
    kind: Literal["force", "displacement"]
    parts_s: tuple[float, ...]

    @property
    def duration_s(self) -> float:
        """Time from onset to end, s."""
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
    """Minimum-jerk course from 0 to 1."""
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
    """Response of a hand to pushes of one shape and of the largest allowed size.

    `displacement`, `velocity`, `acceleration` (n, S, 2): for n directions.
    `force_n`, `displacement_m`: largest force by the limb, and largest displacement, in any
    direction.
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
    """Simulate the response of a hand with constant M, B, K to pushes in all directions.

    `hand` (3, 2, 2), `limits` (largest push in N, largest displacement in m).
    `robot_kg`: mass that a pushed hand carries.
    `lag_s` (S,): times of the response.
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
    """Solve ``(M + m) a + B v + K x = u f(t)`` from rest in steps of 1 ms: x, v, a (n, S, 2)."""
    from scipy.linalg import expm

    M, B, K = hand
    inverse = np.linalg.inv(M + robot_kg * np.eye(2))
    # state (x, v, f u) (6,): the push is constant over a step
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


#: Number of trials for the intervals in the table.
TRIALS: Final = 40
#: Largest number of rounds of all directions.
MOST_ROUNDS: Final = 2**17
#: Efficiency of the estimator relative to the bound (docs/evidence/movement.md).
EFFICIENCY: Final = 0.8


@dataclass(frozen=True)
class PlannedPush:
    """One shape at its largest allowed size.

    `force_n`, `displacement_m`: largest force and displacement of the hand.
    `k_percent`: the error of K that `TRIALS` trials stay below in 95 of 100 experiments, in percent
    of the hand's K (Frobenius norms).
    `trials`: number for the wanted error; a multiple of the directions.
    """

    shape: PushShape
    force_n: float
    displacement_m: float
    k_percent: float
    trials: int


@dataclass(frozen=True)
class MovementPlan(FrozenRecord):
    """Planned pushes at one phase, the best first.

    `stiffness` (2, 2): the hand's K estimated from the pilot.
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
        Reaches of one condition, as for `identify_movement`: at least ten free and eight pushed
        ones.
    k_percent : float
        Required error of K, which 95 of 100 experiments stay below.
    phase : str, optional
        Default: the first of the pilot.
    robot_kg : float
        Mass of robot and handle that the hand carries.
    max_force_n, max_displacement_m : float
        Limits of the pushes.

    Returns
    -------
    MovementPlan
        The pushes, the best first.

    Raises
    ------
    InputError
        The pilot lacks data, or a number is not positive.
    NotIdentifiableError
        The pilot's pushes do not determine the arm's impedance.
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
    solution = solve(equations_of(cut_phase(courses, pushes, rows, named)))
    limits = (max_force_n, max_displacement_m)
    planned = []
    for shape in SHAPES:
        window_s = min(shape.duration_s + AFTER_S, LONGEST_S)
        windows = cut_phase(courses, pushes, rows, named, window_s)
        planned.append(_planned(shape, windows, solution, robot_kg, limits, k_percent))
    weights, constant = to_hand(windows.arm, instant_of(windows))
    K = (weights @ solution.theta[REPORTED] + constant)[8:].reshape(2, 2)
    best = sorted(planned, key=lambda push: push.k_percent)
    return MovementPlan(condition, named, k_percent, K, tuple(best))


def _planned(
    shape: PushShape,
    windows: PhaseWindows,
    solution: PhaseSolution,
    robot_kg: float,
    limits: tuple[float, float],
    wanted: float,
) -> PlannedPush:
    equations, at = equations_of(windows), instant_of(windows)
    weights, constant = to_hand(windows.arm, at)
    hand = (weights @ solution.theta[REPORTED] + constant).reshape(3, 2, 2)
    response = respond_to(shape, hand, robot_kg, limits, windows.lag_s)
    X = _expected(windows, response)
    W, P = weight_of(equations, solution.theta), precision_of(equations, solution.theta, None)
    # information (p, p) of one trial, the mean over directions: X_n^T W X_n
    information = np.einsum("nrp,rs,nsq->pq", X, W, X) / len(X)

    def percent(trials: int) -> float:
        C = np.linalg.inv(trials * EFFICIENCY * information + P)[REPORTED, REPORTED]
        of_hand = weights[8:] @ C @ weights[8:].T
        return 100 * _largest_error(of_hand) / float(np.linalg.norm(hand[2]))

    return PlannedPush(
        shape, response.force_n, response.displacement_m, percent(TRIALS), _trials(percent, wanted)
    )


def _expected(windows: PhaseWindows, response: PushResponse) -> FloatArray:
    """Projected regressors (n, R, 31) of the response, with the arm's turning as in the middle."""
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
    """Length that an error of this covariance exceeds once in twenty times.

    Its square is a sum of chi-squares, approximately one of ``tr(C)^2 / tr(C^2)`` degrees of
    freedom.
    """
    from scipy.stats import chi2

    total, squares = float(np.trace(covariance)), float((covariance**2).sum())
    dof = total**2 / squares
    return float(np.sqrt(total / dof * chi2.ppf(0.95, dof)))


def _trials(percent: Callable[[int], float], wanted: float) -> int:
    """Smallest number of trials, in whole rounds of the directions; at most a million."""
    low, high = 0, 1
    while percent(DIRECTIONS * high) > wanted and high < MOST_ROUNDS:
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if percent(DIRECTIONS * middle) <= wanted else (middle, high)
    return DIRECTIONS * high
