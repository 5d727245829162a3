"""Muscle tensions for a joint torque: static optimisation.

``tau = -G^T f`` (Tsuji (1997), eq. (6)) does not determine the tensions if there are more muscles
than joints. Least effort: the smallest sum of squared activations ``a_i = f_i / max_i`` in 0..1.
With measured activations: the nearest to those in the same norm. The problem's dual has one unknown
for each joint and is solved by a damped Newton method, all conditions at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linprog

from armimpedance.core.arrays import BoolArray, FloatArray, frozen_array
from armimpedance.core.errors import EstimationError, InputError

#: Largest residual torque, relative to the torque of the strongest muscle.
TOLERANCE: Final = 1e-10
_MOST_STEPS: Final = 200
_MOST_HALVINGS: Final = 60


def tensions_for(
    torque: ArrayLike,
    G: ArrayLike,
    max_tension: ArrayLike,
    *,
    activation: ArrayLike | None = None,
    labels: Sequence[str] | None = None,
) -> FloatArray:
    """Tensions (..., m) in N with ``tau = -G^T f``, of least effort or nearest to `activation`.

    Parameters
    ----------
    torque : (..., n)
        Torque that the muscles bear, N m.
    G : (..., m, n)
        Moment arms dL/dq, m; leading axes as those of `torque`, or none.
    max_tension : (m,)
        N at full activation.
    activation : (..., m), optional
        Measured activations, 0..1.
    labels : sequence of str, optional
        Name of each condition in messages; default ``row 1`` and so on.

    Returns
    -------
    (..., m)

    Raises
    ------
    InputError
        A torque that no tensions in 0..max produce; the message names the row and the possible
        share.
    EstimationError
        The iteration ended without a solution.
    """
    tau = np.asarray(torque, dtype=float)
    batch, n = tau.shape[:-1], tau.shape[-1]
    top = frozen_array(max_tension, "max_tension", (None,))
    m = len(top)
    if not (top > 0).all():
        raise InputError("a maximum tension that is not positive", expected="more than 0 N")
    arms = np.broadcast_to(np.asarray(G, dtype=float), (*batch, m, n)).reshape(-1, m, n)
    desired = np.zeros(m) if activation is None else np.asarray(activation, dtype=float)
    start = np.broadcast_to(desired, (*batch, m)).reshape(-1, m)
    tau = tau.reshape(-1, n)
    if not all(np.isfinite(part).all() for part in (tau, arms, start)):
        raise InputError("a torque, moment arm or activation is not finite", expected="numbers")
    problem = _Dual(-np.swapaxes(arms * top[:, None], -1, -2), tau, start)
    solved, met = _maximise(problem)
    for row in np.flatnonzero(~met):
        name = f"row {row + 1}" if labels is None else labels[int(row)]
        raise _cannot(name, problem.A[row], tau[row], problem.scale[row])
    return (solved * top).reshape(*batch, m)


@dataclass(frozen=True)
class _Dual:
    """Minimise ``|a - a0|^2 / 2`` with ``A a = tau``, 0 <= a <= 1, for P rows at once.

    For multipliers y the best a is ``clip(a0 + A^T y)``; the dual's gradient is ``tau - A a``.
    """

    A: FloatArray
    tau: FloatArray
    start: FloatArray

    @property
    def scale(self) -> FloatArray:
        """Largest torque of a single muscle in each row, (P,)."""
        return np.maximum(np.abs(self.A).max(axis=(1, 2)), np.finfo(float).tiny)

    def select(self, rows: BoolArray) -> _Dual:
        return _Dual(self.A[rows], self.tau[rows], self.start[rows])

    def activation(self, y: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Activations (P, m), and True for those strictly between their limits."""
        wanted = self.start + np.einsum("pnm,pn->pm", self.A, y)
        return np.clip(wanted, 0.0, 1.0), (wanted > 0) & (wanted < 1)

    def gradient(self, a: FloatArray) -> FloatArray:
        return self.tau - np.einsum("pnm,pm->pn", self.A, a)

    def value(self, y: FloatArray) -> FloatArray:
        a, _ = self.activation(y)
        distance = np.sum((a - self.start) ** 2, axis=1) / 2
        return distance + np.sum(y * self.gradient(a), axis=1)


def _maximise(problem: _Dual) -> tuple[FloatArray, BoolArray]:
    """Activations (P, m), and True for rows in which they produce the torque."""
    P, n = problem.tau.shape
    y, activations = np.zeros((P, n)), np.zeros((P, problem.A.shape[-1]))
    met = np.zeros(P, dtype=bool)
    for _ in range(_MOST_STEPS):
        part = problem.select(~met)
        a, free = part.activation(y[~met])
        residual = part.gradient(a)
        done = np.abs(residual).max(axis=1) <= TOLERANCE * part.scale
        activations[~met] = a
        step = _newton_step(part, free, residual)
        y[~met] = np.where(done[:, None], y[~met], _line_search(part, y[~met], step, residual))
        met[~met] = done
        if met.all():
            break
    return activations, met


def _newton_step(part: _Dual, free: BoolArray, residual: FloatArray) -> FloatArray:
    """Newton step of ``H step = tau - A a``, H (n, n) of the free muscles, damped far away."""
    A, n = part.A, part.tau.shape[1]
    H = np.einsum("pim,pm,pjm->pij", A, free.astype(float), A)
    size = part.scale**2
    far = np.minimum(np.linalg.norm(residual, axis=1) / part.scale, 1.0)
    damping = size * np.maximum(1e-4 * far**2, 1e-14)
    H = H + damping[:, None, None] * np.eye(n)
    return np.asarray(np.linalg.solve(H, residual[..., None])[..., 0])


def _line_search(part: _Dual, y: FloatArray, step: FloatArray, residual: FloatArray) -> FloatArray:
    """Halve the steps that raise the dual by less than a quarter of the linear prediction."""
    value, slope = part.value(y), np.sum(step * residual, axis=1)
    length = np.ones(len(y))
    for _ in range(_MOST_HALVINGS):
        # near the solution the predicted rise is below rounding: take the whole step
        rise = part.value(y + length[:, None] * step) - value
        short = rise < 0.25 * length * slope - 1e-13 * np.abs(value)
        if not short.any():
            break
        length = np.where(short, length / 2, length)
    return y + length[:, None] * step


def _cannot(name: str, A: FloatArray, tau: FloatArray, scale: float) -> Exception:
    """Error for a row without a solution: the torque is out of reach, or the iteration failed."""
    share = largest_share(A, tau, scale)
    if share >= 1:
        return EstimationError(f"{name}: static optimisation ended without a solution")
    shown = ", ".join(f"{value:.3g}" for value in tau)
    return InputError(
        f"{name}: no tensions of these muscles make the torque ({shown}) N m",
        expected=f"at most {100 * share:.3g} % of it"
        if share > 1e-9
        else "a torque in a direction that the muscles can pull in",
    )


def largest_share(A: FloatArray, tau: FloatArray, scale: float) -> float:
    """Largest s with ``A a = s tau``, 0 <= a <= 1: a linear program over a (m,) and s."""
    m = A.shape[1]
    solved = linprog(
        np.append(np.zeros(m), -1.0),
        A_eq=np.hstack([A, -tau[:, None]]) / scale,
        b_eq=np.zeros(len(tau)),
        bounds=[(0, 1)] * m + [(0, None)],
        method="highs",
    )
    if solved.status != 0 or solved.x is None:
        raise EstimationError(f"the muscles' feasible set was not determined: {solved.message}")
    return float(solved.x[-1])
