"""Forward simulation of passive hinges, many at once, with dry friction in closed form.

``I(t) qdd + B(t) qd + g(t, q) = -(k (q - q_r) + h qd + f s [+ K (q - q_r)^2])`` with s the sign of
qd. Between reversals s is constant and a step is plain Runge-Kutta. In the step where qd passes
zero, s is the mean of the sign along a velocity that is linear from one end to the other: a
quadratic in s with one root in (-1, 1), which at qd = 0 is the friction that holds the joint
still. No step chatters, and the motion stays a smooth function of the parameters.
"""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.relaxed.hinge import SUBSTEPS
from armimpedance.joint.relaxed.terms import Terms


def simulate_swings(
    coefficients: FloatArray,
    parameters: FloatArray,
    start: FloatArray,
    terms: Terms,
    sample_rate_hz: float,
) -> FloatArray:
    """Angles and velocities (S, 2, B) of B swings.

    Parameters
    ----------
    coefficients : (2 SUBSTEPS (S - 1) + 1, 7, B)
        Coefficients of the hinge, as in `HingeDynamics`.
    parameters : (p, B)
        Parameters of the columns of `terms`.
    start : (2, B)
        Angle and velocity at the first sample.
    terms : Terms
    sample_rate_hz : float
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
            # v1(s) = free - kick s, and q1 moves by half a step of the same change
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
    """``-(tau_passive + B qd + g(q)) / I`` for coefficients (7, B)."""
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

    With r the sign before, ``s = r (|before| - |after|) / (|before| + |after|)`` where the velocity
    turns; put ``after = free - kick s`` in.
    """
    r = np.where(before >= 0, 1.0, -1.0)
    v, a = np.abs(before), r * free
    # kick s^2 + (v - a + kick) s - (v + a) = 0 for s towards r
    linear = v - a + kick
    root = np.sqrt(np.maximum(linear**2 + 4 * kick * (v + a), 0.0))
    # the form that keeps its digits as kick goes to zero
    lower = linear + np.where(linear >= 0, root, -root)
    safe = np.where(lower == 0, 1.0, lower)
    first = 2 * (v + a) / safe
    other = np.where(kick == 0, first, -lower / (2 * np.where(kick == 0, 1.0, kick)))
    s = np.where(np.abs(first) <= 1, first, other)
    # at rest friction holds against what it can
    hold = np.where(kick > 0, free / np.where(kick == 0, 1.0, kick), np.sign(free))
    return np.asarray(np.clip(np.where(v == 0, hold, r * s), -1.0, 1.0))
