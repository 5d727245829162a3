"""Stiffness and rest angle of one axis from its passive repetitions, (20)-(21).

``S_h = tau_motor - tau_r - M_h qdd - G_h = k_s q + offset``. The source averages the repetitions'
separate fits. A common fit of all samples gives the same if the repetitions cover the same angles,
and is better if they do not. If the axis was moved in both directions, a torque that changes its
sign with the direction is fitted as well, for friction that the robot's model misses. If it was
moved in one direction only, a viscous resistance looks like another rest angle; its effect is
computed separately.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.joint.therapy.arm.movements import MovementTorques
from armimpedance.joint.therapy.arm.repeatability import (
    Scatter,
    fluctuation_covariance,
    noise_density,
    scatter_of,
)
from armimpedance.joint.therapy.robot.steady import least_speed
from armimpedance.numerics.regression import Fit, fit, pool, ragged_factors

#: Samples in which the axis does not slide are left out, except those faster than this share of the
#: peak speed.
FAST_SHARE: Final = 0.3
#: Mean rigid torque of the arm from which an axis counts as loaded by its weight, N m.
NO_WEIGHT_NM: Final = 2.0


@dataclass(frozen=True)
class AxisFit:
    """Result of the passive movements about one axis.

    `mass_gradient` (2,), `robot_gradient` (2, p), `range_rad` (2,).
    `fit`: k_s, offset and, if the axis moved both ways, half the difference between the directions.
    `single` (R, 2): k_s and offset of every repetition.
    `covariance` (2, 2): covariance of (k_s, offset) from the scatter between repetitions.
    `noise_density`: N m^2 s.
    `speed_gradient` (2,): change of k_s and offset per 1 N m s/rad of a viscosity of the arm, which
    is not modelled.
    `viscosity`, `viscosity_sd`: coefficient of the speed in the residual torque, N m s/rad, and its
    standard error.
    `inertia`, `inertia_sd`: missing share of the inertia of robot and arm, and its standard error;
    0 and infinite about an axis that is loaded by weight, which hides it.
    `arm_inertia`: the arm's share of the inertial torque (rms).
    `one_way`: True if the axis was moved in one direction only.
    `weight_Nm`, `elastic_Nm`: means of the arm's rigid torque, which is its weight, and of ``k_s q
    + offset``.
    `arm_rms_Nm`: root mean square of the arm's whole torque.
    `residual_rms_Nm`: root mean square about every repetition's own line.
    `left_out`: share of the samples that were too slow.
    """

    fit: Fit
    single: FloatArray
    scatter: Scatter
    covariance: FloatArray
    noise_density: float
    mass_gradient: FloatArray
    robot_gradient: FloatArray
    speed_gradient: FloatArray
    viscosity: float
    viscosity_sd: float
    inertia: float
    inertia_sd: float
    arm_inertia: float
    one_way: bool
    weight_Nm: float
    elastic_Nm: float
    arm_rms_Nm: float
    residual_rms_Nm: float
    range_rad: FloatArray
    left_out: float

    @property
    def carried(self) -> float:
        """Share of the arm's weight that the residual torque compensates; 0 without weight."""
        if abs(self.weight_Nm) < NO_WEIGHT_NM:
            return 0.0
        return -self.elastic_Nm / self.weight_Nm


def _viscosity(
    speed: Sequence[FloatArray], torque: Sequence[FloatArray], variance: float
) -> dict[str, Any]:
    """Viscosity b and its sd from speed and torque orthogonal to the other columns."""
    square = sum(float(v @ v) for v in speed)
    # b = sum v' s' / sum v'^2
    b = sum(float(v @ s) for v, s in zip(speed, torque, strict=True)) / square
    return {"viscosity": b, "viscosity_sd": float(np.sqrt(variance / square))}


def fit_axis(movements: Sequence[MovementTorques], rise_rad_s: float) -> AxisFit:
    """Fit k_s and offset of one axis.

    `movements`: about the same axis; two or more of every movement.
    `rise_rad_s`: speed v_s of the axis' friction.
    Raises NotIdentifiableError: a repetition at a single angle.
    Raises InputError: a repetition without sufficiently fast samples.
    """
    sliding = [sliding_samples(m, rise_rad_s) for m in movements]
    pairs = list(zip(movements, sliding, strict=True))
    q, S = [m.q[rows] for m, rows in pairs], [(m.support - m.rigid_arm)[rows] for m, rows in pairs]
    lines = [np.stack([x, np.ones_like(x)], axis=1) for x in q]
    single = np.stack([_line(w, s) for w, s in zip(lines, S, strict=True)])
    residual = [s - w @ line for s, w, line in zip(S, lines, single, strict=True)]
    rate = movements[0].sample_rate_hz
    scatter = scatter_of(
        single,
        [f"{m.movement} {direction_of(m):g}" for m in movements],
        fluctuation_covariance(lines, residual, rate),
        np.concatenate(q),
    )
    W = _with_direction(lines, movements)
    fitted, gradients, parts = _solve(W, S, movements, sliding)
    density = noise_density(residual, rate)
    speeds = [m.qd[rows] for m, rows in pairs]
    remaining = [s - w @ fitted.parameters for s, w in zip(S, W, strict=True)]
    beside = [v - w @ gradients[:, -1] for v, w in zip(speeds, W, strict=True)]
    rigid = np.concatenate([m.rigid_arm[rows] for m, rows in pairs])
    loaded = abs(float(rigid.mean())) >= NO_WEIGHT_NM
    inertia = (0.0, np.inf, 0.0) if loaded else _inertia(W, remaining, movements, sliding)
    return AxisFit(
        fit=fitted,
        single=single,
        scatter=scatter,
        # C (2, 2) = sum_t P_t V P_t^T, the repetitions' own fits enter theta = sum_t P_t theta_t
        covariance=np.einsum("tij,jk,tlk->il", parts, scatter.covariance, parts),
        noise_density=density,
        mass_gradient=-gradients[:2, 0],
        robot_gradient=-gradients[:2, 1:-1],
        speed_gradient=gradients[:2, -1],
        **_viscosity(beside, remaining, density * rate),
        inertia=inertia[0],
        inertia_sd=inertia[1],
        arm_inertia=inertia[2],
        one_way=len({direction_of(m) for m in movements}) < 2,
        **_sizes(rigid, np.concatenate(lines) @ fitted.parameters[:2], residual),
        **_covered(np.concatenate(q), movements),
    )


def _sizes(
    rigid: FloatArray, elastic: FloatArray, residual: Sequence[FloatArray]
) -> dict[str, Any]:
    """Sizes of the torques: the arm's weight, its elastic torque, both, and the residual."""
    return {
        "weight_Nm": float(rigid.mean()),
        "elastic_Nm": float(elastic.mean()),
        "arm_rms_Nm": float(np.sqrt(((rigid + elastic) ** 2).mean())),
        "residual_rms_Nm": float(np.sqrt((np.concatenate(residual) ** 2).mean())),
    }


def _covered(angles: FloatArray, movements: Sequence[MovementTorques]) -> dict[str, Any]:
    """Range of the used angles, and the share of samples that were not used."""
    left_out = 1 - len(angles) / sum(len(m.q) for m in movements)
    return {"range_rad": np.array([angles.min(), angles.max()]), "left_out": left_out}


def _inertia(
    W: Sequence[FloatArray],
    residual: Sequence[FloatArray],
    movements: Sequence[MovementTorques],
    kept: Sequence[slice],
) -> tuple[float, float, float]:
    """Missing share of the inertial torque, its standard error, and the arm's share of that torque.

    `residual` (S_t,): of the elastic torque after the columns W.
    """
    rigid = [m.rigid_arm[rows] for m, rows in zip(movements, kept, strict=True)]
    J = [a + m.robot_inertia[r] for a, m, r in zip(rigid, movements, kept, strict=True)]
    columns, whole, torque = (np.concatenate(x) for x in (W, J, residual))
    # residual (N,) = J' (N,) e, J' the inertial torque orthogonal to the columns W (N, c)
    own = whole - columns @ np.linalg.lstsq(columns, whole, rcond=None)[0]
    aside = float(own @ own)
    e = float(own @ torque) / aside
    ends = np.cumsum([len(j) for j in J])[:-1]
    density = noise_density(np.split(torque - e * own, ends), movements[0].sample_rate_hz)
    share = float(np.sqrt((np.concatenate(rigid) ** 2).sum() / (whole**2).sum()))
    return e, float(np.sqrt(density * movements[0].sample_rate_hz / aside)), share


def sliding_samples(movement: MovementTorques, rise_rad_s: float) -> slice:
    """Samples from the first to the last in which the axis slides (see `FAST_SHARE`).

    Raises InputError: there are almost none.
    """
    speed = np.abs(movement.qd)
    fast = np.flatnonzero(speed >= min(least_speed(rise_rad_s), FAST_SHARE * float(speed.max())))
    if len(fast) < 10 or not speed.max() > 0:
        raise InputError(f"trial {movement.trial}: axis {movement.axis + 1} hardly moves")
    return slice(int(fast[0]), int(fast[-1]) + 1)


def direction_of(movement: MovementTorques) -> float:
    """Direction of a movement: 1 if the angle grows, -1 if it falls."""
    return float(np.sign(movement.q[-1] - movement.q[0]))


def _line(w: FloatArray, s: FloatArray) -> FloatArray:
    """Stiffness k_s and offset (2,) of one repetition, (21)."""
    # S (S_t, 1) = [q, 1] (S_t, 2) (k_s, offset) (2,)
    factors = ragged_factors([w], [s[:, None]], regressors=("k_s", "offset"), outputs=("S_h",))
    return pool(factors).coefficients[:, 0]


def _with_direction(
    lines: list[FloatArray], movements: Sequence[MovementTorques]
) -> list[FloatArray]:
    signs = [direction_of(m) for m in movements]
    if len(set(signs)) < 2:
        return lines
    return [np.column_stack([w, np.full(len(w), s)]) for w, s in zip(lines, signs, strict=True)]


def _solve(
    W: list[FloatArray],
    S: list[FloatArray],
    movements: Sequence[MovementTorques],
    kept: list[slice],
) -> tuple[Fit, FloatArray, FloatArray]:
    """The fit, its gradients by mass, theta and speed (c, 1 + p + 1), and P_t (R, 2, 2)."""
    names = ("k_s", "offset", "direction")[: W[0].shape[1]]
    units = ("rad", "", "")[: len(names)]
    # S (N, 1) = [q, 1, direction] (N, c) (k_s, offset, h) (c,)
    factors = ragged_factors(
        W, [s[:, None] for s in S], regressors=names, outputs=("S_h",), regressor_units=units
    )
    fitted = fit(
        factors,
        covariance="cr1",
        parameter_names=names,
        parameter_units=("N m/rad", "N m", "N m")[: len(names)],
    )
    others = [
        np.column_stack([m.rigid_arm[rows], m.robot_gradient[rows], m.qd[rows]])
        for m, rows in zip(movements, kept, strict=True)
    ]
    p = others[0].shape[1]
    # the same regression of the torques that are subtracted in S_h (the arm's rigid torque and
    # d tau_r / d theta), and of the speed, for a viscous arm
    beside = ragged_factors(
        W, others, regressors=names, outputs=tuple(f"part_{i}" for i in range(p))
    )
    gradients = pool(beside).coefficients
    grams = factors.r[:, :, : len(names)].transpose(0, 2, 1) @ factors.r[:, :, : len(names)]
    # P_t (2, 2) = (sum W^T W)^-1 W_t^T [q, 1]_t, first two rows
    parts = np.linalg.solve(grams.sum(axis=0), grams[:, :, :2])[:, :2]
    return fitted, gradients, parts
