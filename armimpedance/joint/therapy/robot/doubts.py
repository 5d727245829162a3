"""Test that motor torques and drawings belong to one robot, and torques and angles to one clock.

Whole sweeps, from rest to rest, contain more information than their steady parts: inertia torque
comes with the acceleration, and weight changes with the angle. Whole sweeps of each axis are fitted
with

    motor(t + d) = s rigid(t) + friction + (a polynomial of the angle)

above the static range. d is the delay of the recorded torque after the angle; s is 1 if the torques
are the motors' and the bodies those of the drawings. A wrong gain of the motors and a wrong factor
of all masses have the same effect on s; only a known weight separates them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.findings import Finding
from armimpedance.core.records import Recording
from armimpedance.joint.therapy.robot.steady import EVERY_S, SmoothTrial, smooth_trials
from armimpedance.joint.therapy.robot.sweeps import AxisSweeps
from armimpedance.joint.therapy.robot.therapy_robot import TherapyRobot, friction_sign
from armimpedance.numerics.regression import t_factor

#: Largest tried delay, its step, and a delay's error besides the scatter of its sweeps, s.
LONGEST_S: Final = 0.1
STEP_S: Final = 0.005
OWN_S: Final = 0.001
#: Largest standard error of an axis' delay for its use, s.
WORST_S: Final = 0.01
#: Least number of sweeps of an axis.
FEWEST: Final = 4
#: Error of s on an axis besides the scatter of its sweeps, from friction outside the law.
OWN_SCALE: Final = 0.005
#: Confidence level of a departure, and standard error above which s is not known.
LEVEL: Final = 0.998
UNKNOWN: Final = 0.1
#: Least angle (rad) from rest at which an axis slides; before that, bristles bend.
SLIPS_RAD: Final = float(np.deg2rad(1.0))


def robot_doubts(
    recording: Recording, robot: TherapyRobot, axes: Sequence[AxisSweeps]
) -> tuple[Finding, ...]:
    """Findings "delay" and "drawings or gain" from whole sweeps.

    `robot`: adjusted as in the recording.
    `axes`: in the order of the robot's axes.
    """
    from armimpedance.joint.therapy.robot.therapy_robot import robot_bodies

    bodies = robot_bodies(robot)
    sweeps = np.flatnonzero(recording.trials["condition"].astype(str) == "sweep")
    chosen = recording.select(sweeps)
    of_axis = chosen.trials["axis"].to_numpy(dtype=int) - 1
    every = max(round(EVERY_S * recording.sample_rate_hz), 1)
    shifts = np.arange(-LONGEST_S, LONGEST_S + STEP_S / 2, STEP_S)
    steps = np.round(shifts * recording.sample_rate_hz).astype(int)
    rows: list[list[tuple[FloatArray, FloatArray]]] = [[] for _ in axes]
    for smooth in smooth_trials(chosen):
        axis = int(of_axis[smooth.row])
        spring = axis == robot.spring_axis
        rows_of_sweep = _rows(smooth, axes[axis], bodies, steps, every, 4 if spring else 1)
        if rows_of_sweep is not None:
            rows[axis].append(rows_of_sweep)
    results = [_axis(parts, shifts, every / recording.sample_rate_hz) for parts in rows]
    valid = [result for result in results if result is not None]
    return _delay(valid), _scale(valid)


def _rows(
    smooth: SmoothTrial,
    sweeps: AxisSweeps,
    bodies: Any,
    steps: Any,
    every: int,
    order: int,
) -> tuple[FloatArray, FloatArray] | None:
    """Columns (N, 4 + order) of a sweep, and the motor torque at every shift (N, D)."""
    axis, margin = sweeps.axis, int(np.abs(steps).max())
    k = np.arange(margin, len(smooth.q) - margin, every)
    if len(k) == 0:
        return None
    moves = np.abs(smooth.qd[k, axis]) > sweeps.lowest_used_rad_s
    k = k[moves & (np.abs(smooth.q[k, axis] - smooth.q[0, axis]) > SLIPS_RAD)]
    if len(k) == 0:
        return None
    q, qd = smooth.q[k, axis], smooth.qd[k, axis]
    rigid = bodies.torque(smooth.q[k], smooth.qd[k], smooth.qdd[k])[:, axis]
    angles = [q**p for p in range(order + 1)]
    W = np.stack([rigid, friction_sign(qd, sweeps.rise_rad_s), qd, *angles], axis=1)
    return W, smooth.motor[k[:, None] + steps, axis]


@dataclass(frozen=True)
class _Told:
    """Result of one axis: delay (s) and s, each with its standard error, and degrees of freedom."""

    delay: float
    delay_sd: float
    scale: float
    scale_sd: float
    dof: int


def _axis(
    parts: Sequence[tuple[FloatArray, FloatArray]], shifts: FloatArray, every_s: float
) -> _Told | None:
    """Delay and s from the sweeps of one axis; None if they are too few."""
    if len(parts) < FEWEST:
        return None
    W, Y = (np.concatenate(x) for x in zip(*parts, strict=True))
    if len(W) <= W.shape[1] or np.linalg.matrix_rank(W / np.linalg.norm(W, axis=0)) < W.shape[1]:
        return None
    # motor (N, D) = [rigid, sign, v, 1, q, ...] (N, c) [s, tau_c, k_v, ...] (c, D), D delays
    Q, R = np.linalg.qr(W)
    back = np.linalg.inv(R)
    theta = back @ (Q.T @ Y)
    squares = ((Y - W @ theta) ** 2).sum(axis=0)
    best = int(np.clip(np.argmin(squares), 1, len(shifts) - 2))
    low, middle, high = squares[best - 1 : best + 2]
    bend = max(low - 2 * middle + high, 1e-300)
    delay = shifts[best] + STEP_S * float(np.clip((low - high) / (2 * bend), -1.0, 1.0))
    fitted = theta[:, best]
    residual = [y[:, best] - w @ fitted for w, y in parts]
    of_s = [w @ (back @ back.T)[0] for w, _ in parts]
    # change of the model's torque per second of delay, orthogonal to the columns
    slope = np.concatenate([np.gradient(w @ fitted, every_s) for w, _ in parts])
    slope -= Q @ (Q.T @ slope)
    of_d = np.split(slope / float(slope @ slope), np.cumsum([len(w) for w, _ in parts])[:-1])
    dof = len(parts) - 2
    return _Told(delay, _spread(of_d, residual), float(fitted[0]), _spread(of_s, residual), dof)


def _spread(weights: Sequence[FloatArray], residual: Sequence[FloatArray]) -> float:
    """Standard error of ``sum weights residual`` over independent sweeps.

    Two degrees of freedom are counted for the fit: few clusters show too little scatter.
    """
    scores = np.array([w @ e for w, e in zip(weights, residual, strict=True)])
    return float(np.sqrt(len(scores) / (len(scores) - 2) * (scores**2).sum()))


def _delay(results: Sequence[_Told]) -> Finding:
    precise = [result for result in results if result.delay_sd < WORST_S]
    if not precise:
        message = (
            "sweeps that neither set out nor come to rest do not show whether the torque is on the "
            "angle's clock, and a delay passes for viscous friction: record whole sweeps"
        )
        return Finding("delay", "cannot tell", message)
    delays = np.array([result.delay for result in precise])
    # the median axis, since the friction of one axis may rise differently from the law
    middle = int(np.argsort(delays)[len(delays) // 2])
    delay, sd = float(np.median(delays)), float(np.hypot(precise[middle].delay_sd, OWN_S))
    least = t_factor(precise[middle].dof, LEVEL) * sd
    smallest = f"{1e3 * least:.0f} ms"
    if abs(delay) < least:
        message = f"torque {1e3 * delay:+.1f} ms late on the motion, no more than friction makes"
        return Finding("delay", "ok", message, smallest)
    late = "late on" if delay > 0 else "ahead of"
    message = (
        f"motor torques are {1e3 * abs(delay):.0f} ms {late} the motion (axes: "
        f"{', '.join(f'{1e3 * d:.0f}' for d in delays)}): viscous friction is wrong by that times "
        "the slope of cables and spring; record both on one clock"
    )
    return Finding("delay", "warning", message, smallest)


def _scale(results: Sequence[_Told]) -> Finding:
    name = "drawings or gain"
    scales = [(one.scale, float(np.hypot(one.scale_sd, OWN_SCALE))) for one in results]
    weight = np.array([sd**-2 for _, sd in scales])
    sd = float(weight.sum() ** -0.5) if scales else float("inf")
    if sd > UNKNOWN:
        message = (
            "no axis shows its weight or inertia well enough to hold the motors' gain against the "
            "drawings: sweep wider and faster, or hang a known weight on the robot"
        )
        return Finding(name, "cannot tell", message)
    s = float((weight * np.array([one for one, _ in scales])).sum() / weight.sum())
    least = t_factor(sum(one.dof for one in results), LEVEL) * sd
    smallest = f"{100 * least:.1f} %"
    if abs(s - 1) < least:
        return Finding(name, "ok", f"motors show {s:.3f} times the drawings' bodies", smallest)
    message = (
        f"weight and inertia of the links stand {s:.3f} times (sd {sd:.3f}) as large in the motor "
        "torques as the drawings have them: the motors' gain is off, and all results by as much, "
        "or masses are, and cables and spring are wrong; a known weight hung on the robot tells"
    )
    return Finding(name, "warning", message, smallest)
