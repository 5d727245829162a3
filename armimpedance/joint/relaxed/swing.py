"""Forward simulation of passive hinges, many at once, with dry friction in closed form.

``I(t) qdd + B(t) qd + g(t, q) = -(k (q - q_r) + h qd + f s [+ K (q - q_r)^2])`` with s the sign of
qd. Between reversals s is constant and a step is plain Runge-Kutta. In the step where qd passes
zero, s is the mean of the sign along a velocity that is linear over the step. This gives a
quadratic in s with one root in (-1, 1); at qd = 0 it is the friction that holds the joint
still. The sign does not chatter, and the motion is a smooth function of the parameters.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.core.errors import EstimationError, InputError
from armimpedance.joint.relaxed.equations import Equations, Terms, parallel_equations
from armimpedance.joint.relaxed.hinge import SUBSTEPS
from armimpedance.joint.relaxed.linear import TwoFits, solve_linear
from armimpedance.joint.relaxed.samples import PassiveSamples
from armimpedance.joint.relaxed.state_noise import StateSteps
from armimpedance.numerics.regression import Fit


def simulate_swings(
    coefficients: FloatArray,
    parameters: FloatArray,
    start: FloatArray,
    terms: Terms,
    sample_rate_hz: float,
) -> FloatArray:
    """Simulate B swings: angles and velocities (S, 2, B).

    `coefficients` (2 SUBSTEPS (S - 1) + 1, 7, B): coefficients of the hinge, as in `HingeDynamics`.
    `parameters` (p, B): parameters of the columns of `terms`.
    `start` (2, B): angle and velocity at the first sample.
    """
    step = 1 / (SUBSTEPS * sample_rate_hz)
    points = (len(coefficients) - 1) // 2
    q, v = start[0].copy(), start[1].copy()
    states = np.empty((points // SUBSTEPS + 1, 2, q.size))
    states[0] = start
    friction = terms.columns.index("f") if terms.friction else None
    strength = 0.0 if friction is None else parameters[friction]
    kick = strength * step / coefficients[::2, 0]
    for i in range(points):
        at = coefficients[2 * i : 2 * i + 3]
        sign = np.sign(v)
        q1, v1 = _step(q, v, sign, at, parameters, terms, step)
        turned = v * v1 <= 0
        if turned.any():
            # v1(s) = free - kick s, and q1 changes by half a step times the same change
            mean = _mean_sign(v, v1 + kick[i] * sign, kick[i])
            change = np.where(turned, kick[i] * (sign - mean), 0.0)
            q1, v1 = q1 + step / 2 * change, v1 + change
        q, v = q1, v1
        if (i + 1) % SUBSTEPS == 0:
            states[(i + 1) // SUBSTEPS] = q, v
    return states


def _step(
    q: FloatArray,
    v: FloatArray,
    sign: FloatArray,
    at: FloatArray,
    x: FloatArray,
    terms: Terms,
    step: float,
) -> tuple[FloatArray, FloatArray]:
    """One step of the classical Runge-Kutta method with a constant sign of friction."""
    k1 = _acceleration(q, v, sign, at[0], x, terms)
    k2 = _acceleration(q + step / 2 * v, v + step / 2 * k1, sign, at[1], x, terms)
    half = q + step / 2 * v + step**2 / 4 * k1
    k3 = _acceleration(half, v + step / 2 * k2, sign, at[1], x, terms)
    whole = q + step * v + step**2 / 2 * k2
    k4 = _acceleration(whole, v + step * k3, sign, at[2], x, terms)
    q1 = q + step * v + step**2 / 6 * (k1 + k2 + k3)
    return q1, v + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


def _acceleration(
    q: FloatArray, v: FloatArray, sign: FloatArray, at: FloatArray, x: FloatArray, terms: Terms
) -> FloatArray:
    """Acceleration ``-(tau_passive + B qd + g(q)) / I`` for coefficients (7, B)."""
    c, s = np.cos(q), np.sin(q)
    gravity = at[2] + at[3] * c + at[4] * s + at[5] * (c * c - s * s) + at[6] * (2 * s * c)
    about = q - terms.reference
    passive = x[0] * about + x[1] * v
    for j, name in enumerate(terms.columns):
        if name == "f":
            passive = passive + x[j] * sign
        elif name == "offset":
            passive = passive + x[j]
        elif name in ("K", "C"):
            passive = passive + x[j] * about ** (2 if name == "K" else 3)
    return -(passive + at[1] * v + gravity) / at[0]


def _mean_sign(before: FloatArray, free: FloatArray, kick: FloatArray) -> FloatArray:
    """Mean s of the sign along a velocity from `before` to ``free - kick s``.

    With r the sign before, ``s = r (|before| - |after|) / (|before| + |after|)`` if the velocity
    changes its sign; ``after = free - kick s`` is substituted.
    """
    r = np.where(before >= 0, 1.0, -1.0)
    v, a = np.abs(before), r * free
    # kick s^2 + (v - a + kick) s - (v + a) = 0 for s towards r
    linear = v - a + kick
    root = np.sqrt(np.maximum(linear**2 + 4 * kick * (v + a), 0.0))
    # the form that is accurate as kick goes to zero
    lower = linear + np.where(linear >= 0, root, -root)
    safe = np.where(lower == 0, 1.0, lower)
    first = 2 * (v + a) / safe
    second = np.where(kick == 0, first, -lower / (2 * np.where(kick == 0, 1.0, kick)))
    s = np.where(np.abs(first) <= 1, first, second)
    # at rest, friction balances the other torques up to its strength
    hold = np.where(kick > 0, free / np.where(kick == 0, 1.0, kick), np.sign(free))
    return np.asarray(np.clip(np.where(v == 0, hold, r * s), -1.0, 1.0))


# Output error of a hinge: the swing simulated with the parameters is fitted to the measured one.
#
# The hinge moves by its equation with the other coordinates as measured. The measured angle,
# unfiltered, is this motion plus noise, so no derivative or sign of a noisy signal is used. Noise
# of the other coordinates also drives the hinge at random. A white random torque describes this;
# its size is chosen by the residual likelihood, and it whitens the residual. Without it the fit is
# plain output error; if it is large, the fit uses the model over a few samples only. All trials are
# fitted together, each with its own initial angle and velocity. The search is Gauss-Newton on steps
# of one sample about the likeliest motion so far, starting from the `parallel` estimate.

_MOST_STEPS: Final = 30

#: Steps of the numerical derivatives: parameters in standard errors, angle (rad), velocity (rad/s)
#: and torque (N m).
_DIFFERENCE: Final = 1.0
_STATE_DIFFERENCES: Final = (1e-5, 1e-4)
_TORQUE_DIFFERENCE: Final = 1e-3

#: Tried motions by the random torque in a step, over the noise of the angle: none, and 21 sizes.
_PUSHES: Final = np.concatenate([[0.0], 10 ** np.linspace(-4, 1, 21)])

#: The search has converged when its step, in standard errors along its own direction, is below
#: this, or below a billionth of the parameters.
_STILL: Final = 0.02
_STILL_EXACT: Final = 1e-9
#: After the last step this suffices: a reversal that barely happens can prevent convergence.
_STILL_ENOUGH: Final = 0.5


@dataclass(frozen=True)
class Swings:
    """Steps of the hinge from sample to sample; T trials of at most S samples.

    `measured` (S, T), `seen` (S, T) bool.
    `coefficients` (2 SUBSTEPS + 1, 7, (S - 1) T): for every step from one sample to the next.
    """

    coefficients: FloatArray
    measured: FloatArray
    seen: BoolArray
    terms: Terms
    sample_rate_hz: float

    def step(self, x: FloatArray, states: FloatArray, torque: float = 0.0) -> FloatArray:
        """States (S - 1, T, 2) one sample after each of `states` (S, T, 2), with an additional
        torque.
        """
        S, T, _ = states.shape
        count = (S - 1) * T
        at = self.coefficients
        if torque:
            at = at.copy()
            at[:, 2] -= torque
        parameters = np.repeat(x[:, None], count, axis=1)
        begin = states[:-1].reshape(count, 2).T
        ends = simulate_swings(at, parameters, begin, self.terms, self.sample_rate_hz)[-1]
        return ends.T.reshape(S - 1, T, 2)


class Linear(NamedTuple):
    """The steps about a motion, linear in the state, the push and the p parameters.

    `by_parameters` (S - 1, T, 2, p). `jump` (S - 1, T, 2): end of a step less the next state.
    """

    steps: StateSteps
    by_parameters: FloatArray
    jump: FloatArray


class SwingSolution(NamedTuple):
    """Result of a Gauss-Newton step: fit of the white rows, and the likeliest motion (S, T, 2)."""

    fit: Fit
    states: FloatArray


def solve_swing(samples: PassiveSamples, terms: Terms) -> TwoFits:
    """Fit the swing of a single joint with known hinge dynamics.

    Raises EstimationError: the simulated swing does not converge to the measured one.
    Raises NotIdentifiableError, InputError: as `solve_linear`, which gives the `parallel` start.
    """
    fit, _ = settled(samples, terms)
    return TwoFits(fit, fit)


def settled(samples: PassiveSamples, terms: Terms) -> SwingSolution:
    """Fit a single joint's swing; return the fit and the likeliest states.

    Raises EstimationError, NotIdentifiableError, InputError: as `solve_swing`.
    """
    fit = solve_linear(parallel_equations(samples, terms), samples.sample_rate_hz).classical
    swings = swings_of(samples, terms)
    states = np.stack([_padded(samples, s[:, 0]) for s in (samples.q, samples.qd)], axis=-1)
    length = np.inf
    for _ in range(_MOST_STEPS):
        x = fit.parameters
        fit, states = _gauss_newton(swings, x, states, linearised(swings, x, states, fit.sd))
        if not (np.isfinite(fit.parameters).all() and np.isfinite(states).all()):
            raise EstimationError(f"{samples.joints[0]}: the simulated swing runs away")
        change = fit.parameters - x
        length = _length(change, fit)
        if length <= _STILL or (np.abs(change) <= _STILL_EXACT * np.abs(x)).all():
            return SwingSolution(fit, states)
    if length <= _STILL_ENOUGH:
        return SwingSolution(fit, states)
    raise EstimationError(
        f"{samples.joints[0]}: the simulated swing did not settle in {_MOST_STEPS} steps"
    )


def swings_of(samples: PassiveSamples, terms: Terms) -> Swings:
    """Steps of all trials from sample to sample."""
    if samples.hinges is None:
        raise InputError("no skeleton to simulate", expected="samples from a motion recording")
    parts = samples.hinges[0].coefficients
    per, S = 2 * SUBSTEPS, int(np.diff(samples.offsets).max())
    # (points, 7, T), shorter trials repeat their last row; then (points of a step, 7, S - 1, T)
    padded = np.stack(
        [np.pad(c, ((0, per * (S - 1) + 1 - len(c)), (0, 0)), mode="edge") for c in parts], axis=2
    )
    at = per * np.arange(S - 1) + np.arange(per + 1)[:, None]
    steps = padded[at].transpose(0, 2, 1, 3).reshape(per + 1, 7, -1)
    seen = np.arange(S)[:, None] < np.diff(samples.offsets)
    return Swings(
        steps, _padded(samples, samples.measured_q[:, 0]), seen, terms, samples.sample_rate_hz
    )


def _padded(samples: PassiveSamples, signal: FloatArray) -> FloatArray:
    """Arrange a signal (N,) as (S, T), one column per trial; shorter trials repeat their last
    value.
    """
    parts = [signal[s] for s in samples.slices()]
    longest = max(map(len, parts))
    return np.stack([np.pad(part, (0, longest - len(part)), mode="edge") for part in parts], axis=1)


def linearised(swings: Swings, x: FloatArray, states: FloatArray, sd: FloatArray) -> Linear:
    """Linearise the steps about states (S, T, 2) and parameters (p,)."""
    ends = swings.step(x, states)
    columns = []
    for i, step in enumerate(_STATE_DIFFERENCES):
        moved = states.copy()
        moved[..., i] += step
        columns.append((swings.step(x, moved) - ends) / step)
    push = (swings.step(x, states, _TORQUE_DIFFERENCE) - ends) / _TORQUE_DIFFERENCE
    slopes = []
    for j, step in enumerate(np.maximum(_DIFFERENCE * sd, 1e-7)):
        slopes.append((swings.step(x + step * (np.arange(len(x)) == j), states) - ends) / step)
    if not np.isfinite(ends).all():
        raise EstimationError("the simulated swing runs away")
    steps = StateSteps(np.stack(columns, axis=-1), push, swings.seen)
    return Linear(steps, np.stack(slopes, axis=-1), ends - states[1:])


def _gauss_newton(
    swings: Swings, x: FloatArray, states: FloatArray, linear: Linear
) -> SwingSolution:
    """Parameters, starts and motion that fit the linearised steps best, with the likeliest push."""
    S, T, p = *swings.measured.shape, len(x)
    residual = swings.measured - states[..., 0]
    # columns: residual, then the effects of p parameters and two starts, with the sign of W
    measured, start = np.zeros((S, T, 1 + p + 2)), np.zeros((T, 2, 1 + p + 2))
    measured[..., 0] = residual
    start[:, [0, 1], [1 + p, 2 + p]] = -1.0
    inputs = np.zeros((S - 1, T, 2, 1 + p + 2))
    inputs[..., 0], inputs[..., 1 : 1 + p] = linear.jump, -linear.by_parameters
    ratios = push_ratios(linear)
    rows, lost = linear.steps.whiten(measured, inputs, start, ratios)
    best = int(np.argmin(_criterion(rows, lost, int(swings.seen.sum()), p)))
    equations, moves = _equations(swings, rows[best], x)
    fit = equations.fit("classical", 2)
    change = fit.parameters - x
    begin = np.stack([alone - along @ change for alone, along in moves])
    inputs = linear.jump + linear.by_parameters @ change
    motion = linear.steps.smooth(residual, inputs, begin, float(ratios[best]))
    return SwingSolution(fit, states + motion)


def push_ratios(linear: Linear) -> FloatArray:
    """Tried variances (V,) of a random torque over that of the angle's noise."""
    return np.asarray((_PUSHES / np.median(np.abs(linear.steps.push[..., 0]))) ** 2)


def _criterion(rows: FloatArray, lost: FloatArray, count: int, p: int) -> FloatArray:
    """Minus twice the residual log likelihood (V,) of white rows (V, T, S, 1 + p + 2)."""
    Q, R = np.linalg.qr(rows[..., 1 + p :])
    free = rows[..., : 1 + p] - Q @ (Q.swapaxes(-1, -2) @ rows[..., : 1 + p])
    # [W, Y] = Z R: R gives the determinant of W, and its last entry the residual
    ordered = np.roll(free.reshape(len(rows), -1, 1 + p), -1, axis=-1)
    own = np.abs(np.diagonal(np.linalg.qr(ordered, mode="r"), axis1=-2, axis2=-1))
    starts = np.abs(np.diagonal(R, axis1=-2, axis2=-1))
    tiny = np.finfo(np.float64).tiny
    volume = 2 * np.log(own[:, :p]).sum(axis=-1) + 2 * np.log(starts).sum(axis=(-1, -2))
    dof = count - p - 2 * rows.shape[1]
    return np.asarray(2 * dof * np.log(own[:, p] + tiny) + lost + volume)


def _equations(
    swings: Swings, rows: FloatArray, x: FloatArray
) -> tuple[Equations, list[tuple[FloatArray, FloatArray]]]:
    """White rows (T, S, 1 + p + 2) as a regression, and per trial the dependence of the start."""
    W, Y, moves = [], [], []
    p = len(x)
    for trial, seen in zip(rows, swings.seen.T, strict=True):
        e, w_x, w_start = np.split(trial[seen], [1, 1 + p], axis=1)
        # e (S,) = W_x (S, p) dx + W_start (S, 2) ds: the start is projected out of each trial
        Q, R = np.linalg.qr(w_start)
        moves.append((np.linalg.solve(R, Q.T @ e)[:, 0], np.linalg.solve(R, Q.T @ w_x)))
        W.append(w_x - Q @ (Q.T @ w_x))
        Y.append(e - Q @ (Q.T @ e) + W[-1] @ x[:, None])
    return Equations(swings.terms.columns, swings.terms.column_units, tuple(W), tuple(Y)), moves


def _length(change: FloatArray, fit: Fit) -> float:
    """Length ``sqrt(dx^T C^-1 dx)`` of a step (p,), in standard errors along its direction."""
    # C^-1 (p, p) = R^T R / sigma^2
    sigma = max(fit.residual_sd, np.finfo(np.float64).tiny)
    return float(np.linalg.norm(fit.triangle @ change) / sigma)
