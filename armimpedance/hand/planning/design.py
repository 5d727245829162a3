"""Design a disturbance: the smooth return-to-start course that needs the fewest trials.

``x = A s^3 (1 - s)^3 q(s)`` with q in Legendre polynomials: the motion, its rows in the impedance
equation and the limits on displacement and acceleration are linear in q's coefficients c, the
information is quadratic. The logarithm of ``tr(W C(c))``, C the bound on the covariance, is
minimised with its exact gradient, by sequential quadratic programming from several starts.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import EstimationError, InputError, check_number
from armimpedance.core.progress import Progress
from armimpedance.hand.planning.precision import equation_rows, modal_motion
from armimpedance.hand.planning.profile import (
    Profile,
    Shape,
    designed_shape,
    polynomial_shape,
    rounded_ends,
)
from armimpedance.hand.planning.setting import Setting, follow
from armimpedance.hand.still import inverse_information

#: Points at which displacement and acceleration are limited.
_CHECKS: Final = np.linspace(0.0, 1.0, 161)
#: Largest relative excess over a limit, between these points, of a polynomial of this order.
_SLACK: Final = 3e-3
#: Assumed size of a reflex, as a share of K, if its unknown delay has to be estimated.
_REFLEX_SHARE: Final = 0.25


@dataclass(frozen=True)
class Limits:
    """Limits of a disturbance.

    Attributes
    ----------
    amplitude_m, duration_s : float
    acceleration : float
        Largest commanded acceleration (m/s^2); inf for no limit.
    """

    amplitude_m: float = 0.005
    duration_s: float = 0.3
    acceleration: float = 5.3

    def __post_init__(self) -> None:
        most = f"at most {self.acceleration:g} m/s^2"
        check_number(self.acceleration, most, above=0, high=np.inf)


@dataclass(frozen=True)
class Goal:
    """Purpose of the disturbance: K, or K separated from a reflex.

    Attributes
    ----------
    delays_s : tuple of float
        Delays of the reflex; empty for no reflex. With several, the mean over them is minimised.
    delay_known : bool
        If False, the delay is one more unknown.
    """

    delays_s: tuple[float, ...] = ()
    delay_known: bool = True


@dataclass(frozen=True)
class Design(FrozenRecord):
    """A designed profile, its coefficients and its precision.

    `coefficients` (degree + 1,): coefficients of q, as given to `designed_shape`.
    `relative_sd`: root of the goal, per trial: with n trials it falls as 1/sqrt(n). For K alone the
    sd of its symmetric part (Frobenius) relative to K.
    """

    profile: Profile
    coefficients: Annotated[FloatArray, "j"]
    relative_sd: float


def design(
    setting: Setting,
    limits: Limits | None = None,
    goal: Goal | None = None,
    *,
    degree: int = 5,
    starts: int = 12,
    seed: int = 0,
    name: str = "designed",
    progress: Progress | None = None,
) -> Design:
    """Design a disturbance; the same arguments give the same profile.

    Parameters
    ----------
    setting : Setting
    limits : Limits
    goal : Goal
    degree : int
        Degree of q.
    starts : int
        Random first guesses.
    seed : int
    name : str
        Name of the shape.
    progress : function (done, all), optional
        Called after each start.

    Returns
    -------
    Design

    Raises
    ------
    InputError
        If no course keeps to the limits.
    EstimationError
        If no start converged.
    """
    from scipy.optimize import LinearConstraint, minimize

    search: Any = minimize
    limits, goal = limits or Limits(), goal or Goal()
    check_limits(limits)
    problem = _Problem(setting, limits, goal, degree)
    rows = problem.limited
    rng = np.random.default_rng(np.random.SeedSequence(seed))
    best: tuple[float, FloatArray] | None = None
    for start in range(starts):
        first = rng.standard_normal(degree + 1)
        first /= (rows @ first).max()
        done = search(
            problem.value_and_gradient,
            first,
            jac=True,
            method="SLSQP",
            constraints=LinearConstraint(rows, -np.inf, 1.0),
            options={"maxiter": 300, "ftol": 1e-9},
        )
        scaled = done.x / (rows @ done.x).max()
        value = problem.value_and_gradient(scaled)[0]
        if np.isfinite(value) and (best is None or value < best[0]):
            best = (value, scaled)
        if progress is not None:
            progress(start + 1, starts)
    if best is None:
        raise EstimationError("no start led to a disturbance that separates the parameters")
    return _finished(best[1], limits, name, np.exp(best[0] / 2))


def _finished(c: FloatArray, limits: Limits, name: str, relative_sd: float) -> Design:
    """Scale the course to the limits, with the first large excursion forwards."""
    shape = designed_shape(name, c)
    x = shape.at(_CHECKS)[0]
    if x[np.argmax(np.abs(x) > 0.5)] < 0:
        c, shape = -c, designed_shape(name, -c)
    # the peak may lie between the points at which it was evaluated
    allowed = (1 - 1e-5) * limits.acceleration * limits.duration_s**2 / shape.peak_curvature
    peak = float(np.abs(polynomial_shape("", rounded_ends(c)).at(_CHECKS)[0]).max())
    amplitude = min(limits.amplitude_m, allowed, peak * limits.amplitude_m * (1 + _SLACK))
    return Design(Profile(shape, amplitude, limits.duration_s), c, float(relative_sd))


class _Problem:
    """Rows of the impedance equation and of the limits for each coefficient."""

    def __init__(self, setting: Setting, limits: Limits, goal: Goal, degree: int) -> None:
        self.setting, self.limits, self.goal = setting, limits, goal
        lag = setting.lags(limits.duration_s)
        self.modes = setting.modes(limits.duration_s)
        basis = [polynomial_shape("", rounded_ends(row)) for row in np.eye(degree + 1)]
        profiles = [Profile(shape, limits.amplitude_m, limits.duration_s) for shape in basis]
        course = np.stack([profile.at(lag) for profile in profiles], axis=1)
        # (J, axis of the command, d, S)
        self.displacement = follow(
            setting.servo, setting.arm.parameters, course, setting.sample_rate_hz
        )
        rate, delays = setting.sample_rate_hz, goal.delays_s
        self.motion = modal_motion(self.displacement, self.modes, rate, delays)
        self.limited = _limit_rows(basis, limits)

    @cached_property
    def weight(self) -> FloatArray:
        """Inverse covariance of the noise; the encoder's share is that of a plain bump."""
        bump = self.displacement[0]
        V = np.linalg.inv(self.setting.covariance(bump, self.limits.duration_s))
        return np.asarray((V + V.T) / 2)

    @cached_property
    def rows(self) -> list[FloatArray]:
        """Rows (J, d, d n, p) for each delay of the goal, or one set without a reflex."""
        if not self.goal.delays_s:
            return [equation_rows(self.motion)]
        return [self._rows_with_reflex(i) for i in range(len(self.goal.delays_s))]

    def _rows_with_reflex(self, number: int) -> FloatArray:
        motion = np.concatenate([self.motion[:3], self.motion[3 + number][None]])
        rows = equation_rows(motion)
        if self.goal.delay_known:
            return rows
        # R x(t - tau) by tau: -R x'(t - tau), R a share of K
        rate = self.setting.sample_rate_hz
        late = modal_motion(self.displacement, self.modes, rate, [self.goal.delays_s[number]])
        later = modal_motion(
            self.displacement, self.modes, rate, [self.goal.delays_s[number] + 1e-3]
        )
        slope = (later[3] - late[3]) / 1e-3
        R = _REFLEX_SHARE * self.setting.arm.stiffness
        column = np.einsum("ik,jakn->jain", R, slope)
        return np.concatenate([rows, column.reshape(*rows.shape[:-1], 1)], axis=-1)

    def value_and_gradient(self, c: FloatArray) -> tuple[float, FloatArray]:
        """``log tr(W C)``, mean over delays, and its gradient by c."""
        parts = [self._trace(c, rows) for rows in self.rows]
        total = sum(value for value, _ in parts)
        slope = np.sum([gradient for _, gradient in parts], axis=0)
        return float(np.log(total / len(parts))), slope / total

    def _trace(self, c: FloatArray, rows: FloatArray) -> tuple[float, FloatArray]:
        G = np.tensordot(c, rows, axes=1)
        VG = self.weight @ G
        total = (G.transpose(0, 2, 1) @ VG).sum(axis=0) / len(G)
        C = inverse_information((total + total.T) / 2)
        W = goal_weight(self.setting.arm.stiffness, len(C))
        # d tr(W C) = -tr(C W C dI), dI = 1/2 sum_a (dG^T V G + G^T V dG)
        S = C @ W @ C
        half = VG @ S
        gradient = -2 * np.einsum("japq,apq->j", rows, half) / len(G)
        return float(np.trace(W @ C)), gradient


def goal_weight(stiffness: FloatArray, parameters: int) -> FloatArray:
    """W (p, p): ``tr(W C)`` is the variance of K's symmetric part, and of R's, relative to K."""
    d = len(stiffness)
    swap = np.eye(d * d).reshape(d, d, d, d).transpose(1, 0, 2, 3).reshape(d * d, d * d)
    symmetric = (np.eye(d * d) + swap) / 2
    scale = float(((stiffness + stiffness.T) ** 2).sum() / 4)
    W = np.zeros((parameters, parameters))
    for start in range(2 * d * d, parameters - d * d + 1, d * d):
        block = slice(start, start + d * d)
        W[block, block] = symmetric / scale
    return W


def _limit_rows(basis: list[Shape], limits: Limits) -> FloatArray:
    """Rows whose product with the coefficients must not exceed 1, (L, J)."""
    values = np.stack([shape.at(_CHECKS) for shape in basis], axis=-1)
    # the profiles already have the amplitude as a factor
    rows = [values[0]]
    if np.isfinite(limits.acceleration):
        bend = limits.amplitude_m / limits.duration_s**2 / limits.acceleration
        rows.append(bend * values[2])
    both = np.concatenate(rows)
    return np.concatenate([both, -both])


def shortest_duration(amplitude_m: float, acceleration: float) -> float:
    """Shortest duration of any return-to-start excursion with this amplitude and acceleration, s.

    Full acceleration outwards for a quarter, inwards for a half, outwards for a quarter:
    ``amplitude = acceleration (T/4)^2``.
    """
    return float(4 * np.sqrt(amplitude_m / acceleration))


def check_limits(limits: Limits) -> None:
    """Refuse limits that no course keeps.

    Raises InputError: names the binding limit.
    """
    Profile(designed_shape("", [1.0]), limits.amplitude_m, limits.duration_s)
    shortest = shortest_duration(limits.amplitude_m, limits.acceleration)
    if limits.duration_s < shortest:
        raise InputError(
            f"no course of {1e3 * limits.amplitude_m:g} mm in {limits.duration_s:g} s stays below "
            f"{limits.acceleration:g} m/s^2",
            expected=f"more than {shortest:.3f} s, or more acceleration, or less amplitude",
        )
