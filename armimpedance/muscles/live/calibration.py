"""Which postures, levels and directions a calibration of the live stiffness needs.

Each condition is a posture, a level of co-contraction and a force by the hand, at which K and B of
the joints are measured. What the live hand is then wrong by follows from the covariance of the
muscles' parameters about a typical person, ``(sum J^T R^-1 J + prior^-1)^-1``: conditions are taken
one by one, each the one that lowers the mean error most over places anywhere in the workspace.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import EstimationError, InputError
from armimpedance.hand.levels import tensions_for
from armimpedance.limb.arm import Arm, MuscularArm
from armimpedance.muscles.live.inputs import Elbow, arm_for, moving_for
from armimpedance.muscles.models import (
    TypicalMuscles,
    congruence,
    elements,
    hand_motion,
    kept_elements,
    matrix,
    triple,
    typical_muscles,
)

# Where the live hand is to be known, and the conditions that a person can hold there.

#: Angles of a workspace's grid per joint, in the plane and of more joints.
_ANGLES, _FEW = 5, 3


@dataclass(frozen=True)
class Conditions(FrozenRecord):
    """C conditions that a person can hold.

    `joint_angles` (C, n): rad.
    `level` (C,): activation that all muscles are near to.
    `force` (C, d): by the hand, N.
    `activation` (C, m): nearest to the level that bear the force and the arm's weight.
    """

    joint_angles: Annotated[FloatArray, "c n"]
    level: Annotated[FloatArray, "c"]
    force: Annotated[FloatArray, "c d"]
    activation: Annotated[FloatArray, "c m"]

    def __len__(self) -> int:
        return len(self.level)

    def select(self, rows: object) -> Conditions:
        """These conditions only."""
        at = np.asarray(rows)
        parts = (self.joint_angles, self.level, self.force, self.activation)
        return Conditions(*(part[at] for part in parts))


def holdable(
    arm: Arm, muscles: MuscularArm, q: FloatArray, level: FloatArray, force: FloatArray
) -> Conditions:
    """Those of C conditions that the muscles can bear.

    Parameters
    ----------
    arm : Arm
    muscles : MuscularArm
    q, level, force : (C, n), (C,), (C, d)

    Returns
    -------
    Conditions

    Raises
    ------
    InputError
        The muscles bear none of them.
    """
    kept, holds = [], []
    for row, (x, own, F) in enumerate(zip(q, level, force, strict=True)):
        tau, G = arm.posture(x).torque_under(F), muscles.paths.moment_arms(x)
        near = np.full(len(muscles.max_tension), own)
        try:
            tension = tensions_for(tau, G, muscles.max_tension, activation=near)
        except (InputError, EstimationError):
            continue
        kept.append(row)
        holds.append(tension / muscles.max_tension)
    if not kept:
        raise InputError("no condition that the muscles can bear", expected="less force")
    return Conditions(q[kept], level[kept], force[kept], np.array(holds))


@dataclass(frozen=True)
class Workspace:
    """Where the hand is to be known, and what a person is asked to do there.

    Attributes
    ----------
    box : (n, 2)
        rad.
    levels : tuple of float
        Of co-contraction, 0..1.
    force_N : float
        By the hand along each axis and back; 0: none.
    """

    box: FloatArray
    levels: tuple[float, ...] = (0.03, 0.1, 0.2)
    force_N: float = 8.0

    def candidates(self, axes: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Postures, levels and forces: every combination of a grid."""
        n = len(self.box)
        count = _ANGLES if n == 2 else _FEW
        grid = product(*(np.linspace(low, high, count) for low, high in self.box))
        forces = [np.zeros(axes)]
        if self.force_N:
            # no zero with a sign
            forces += [s * self.force_N * e + 0.0 for e in np.eye(axes) for s in (1.0, -1.0)]
        every = list(product(grid, self.levels, forces))
        q, level, force = zip(*every, strict=True)
        return np.array(q), np.array(level), np.array(force)

    def places(self, axes: int, rng: np.random.Generator, count: int) -> tuple[FloatArray, ...]:
        """Postures, levels and forces drawn anywhere inside."""
        q = rng.uniform(self.box[:, 0], self.box[:, 1], (count, len(self.box)))
        level = rng.uniform(min(self.levels), max(self.levels), count)
        return q, level, rng.uniform(-self.force_N, self.force_N, (count, axes))


#: Candidates that are looked at.
_MOST: Final = 700
#: Places of the workspace at which the error is foretold.
PLACES: Final = 60


@dataclass(frozen=True)
class CalibrationWish:
    """The wanted error of the live stiffness, and the time and errors of a condition.

    Attributes
    ----------
    error_percent : float
        Of the hand's K (Frobenius norm, root mean square over the workspace).
    minutes : float
        The calibration is no longer.
    condition_s : float
        Time that one condition takes.
    condition_percent : float
        Standard error of an element of K and B from one condition, of the geometric mean of its
        joints' own.
    activation_percent : float
        Standard error of an activation, of itself: in the calibration, and live.
    """

    error_percent: float = 10.0
    minutes: float = 5.0
    condition_s: float = 12.0
    condition_percent: float = 6.0
    activation_percent: float = 10.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"{name} {value:g}", expected="more than 0")
        if self.most < 1:
            raise InputError(
                f"conditions of {self.condition_s:g} s in {self.minutes:g} minutes",
                expected="time for one",
            )

    @property
    def most(self) -> int:
        """Conditions that the time allows."""
        return int(self.minutes * 60 / self.condition_s + 1e-9)


@dataclass(frozen=True)
class CalibrationPlan:
    """Conditions in the order of what they gain.

    Attributes
    ----------
    wish : CalibrationWish
    conditions : Conditions
    expected_percent : (C + 1,)
        Error of the live K before the first condition and after each.
    floor_percent : float
        What the errors of the activations alone make of it, however long the calibration is.
    """

    wish: CalibrationWish
    conditions: Conditions
    expected_percent: FloatArray
    floor_percent: float

    @property
    def met(self) -> bool:
        """True if the wanted error is reached within the time."""
        return bool(self.expected_percent[-1] <= self.wish.error_percent)

    @property
    def minutes(self) -> float:
        """Time of the conditions."""
        return len(self.conditions) * self.wish.condition_s / 60


def plan_calibration(
    muscles: MuscularArm,
    recording: object,
    wish: CalibrationWish,
    workspace: Workspace,
    *,
    elbow: Elbow | None = None,
    seed: int = 0,
    moment_arm_order: int = 1,
) -> CalibrationPlan:
    """The conditions, one by one, until the wanted error is reached or the time is over.

    Parameters
    ----------
    muscles : MuscularArm
        Moment arms as anatomy has them.
    recording : Arm, Recording, Subject or path
        Whose arm it is.
    wish : CalibrationWish
    workspace : Workspace
    elbow : {"held", "free"}, optional
        In space, as for `Live`.
    seed : int
        Seed of the places, and of which candidates are looked at where there are too many.
    moment_arm_order : int
        Of the corrections, as for `fit_muscle_model`.

    Returns
    -------
    CalibrationPlan

    Raises
    ------
    InputError
        Another number of joints than the muscles', or forces that no muscles bear.
    """
    arm = arm_for(recording, muscles.paths.joints)
    moving = moving_for(recording, arm.joints, elbow)
    rng = np.random.default_rng(seed)
    q, level, force = workspace.candidates(arm.axes)
    if len(q) > _MOST:
        some = np.sort(rng.choice(len(q), _MOST, replace=False))
        q, level, force = q[some], level[some], force[some]
    offered = holdable(arm, muscles, q, level, force)
    asked = holdable(arm, muscles, *workspace.places(arm.axes, rng, PLACES))
    typical = typical_muscles(
        muscles, offered.joint_angles, offered.activation, moment_arm_order=moment_arm_order
    )
    rows = _rows(typical, offered, wish, moving)
    hand, alone = _hand(typical, asked, arm, wish, moving)
    chosen, expected = _taken(typical, rows, hand, alone, wish)
    return CalibrationPlan(
        wish, offered.select(chosen), 100 * np.sqrt(expected), 100 * float(np.sqrt(alone))
    )


def _rows(
    typical: TypicalMuscles, at: Conditions, wish: CalibrationWish, moving: tuple[int, ...]
) -> tuple[FloatArray, FloatArray]:
    """Slopes (C, 2 E, p) of K and B by the parameters, and covariances (C, 2 E, 2 E)."""
    form, x = typical.equations.at(at.joint_angles, at.activation), typical.values
    kept = kept_elements(form.equations.layout.joints, moving)
    i, j = elements(len(moving))
    E = len(i)
    slopes, R = [], np.zeros((len(at), 2 * E, 2 * E))
    for k, which in enumerate("KB"):
        value, slope = form.stiffness(x) if which == "K" else form.viscosity(x)
        size = np.sqrt(np.abs(np.einsum("cii->ci", matrix(value[:, kept]))))
        own = slice(k * E, (k + 1) * E)
        spread = form.by_activation(x, which)[:, kept] * at.activation[:, None]
        spread = spread * wish.activation_percent / 100
        sd = wish.condition_percent / 100 * size[:, i] * size[:, j]
        R[:, own, own] = spread @ spread.transpose(0, 2, 1) + sd[..., None] ** 2 * np.eye(E)
        slopes.append(slope[:, kept])
    return np.concatenate(slopes, axis=1), R


def _hand(
    typical: TypicalMuscles,
    at: Conditions,
    arm: Arm,
    wish: CalibrationWish,
    moving: tuple[int, ...],
) -> tuple[FloatArray, float]:
    """The hand's relative squared error: the part by the parameters, and that of activations.

    Returns: `by_parameters` (p, p): S: the mean squared error is ``tr(S C)``, C the parameters'
    covariance.
    """
    q, x = at.joint_angles, typical.values
    form, kept = typical.equations.at(q, at.activation), kept_elements(arm.joints, moving)
    K, slope = form.stiffness(x)
    bend = np.array([arm.jacobian_derivative(one) for one in q])
    weight_gradient = np.array([arm.gravity_gradient(one) for one in q])
    added = triple(np.einsum("pk,pkij->pij", at.force, bend) + weight_gradient)
    loaded = (K + added)[:, kept]
    J = np.array([arm.jacobian(one) for one in q])[:, :, list(moving)]
    T = congruence(hand_motion(J, loaded))
    # the Frobenius norm counts elements beside the diagonal twice
    i, j = elements(arm.axes)
    hand = np.einsum("pij,pj->pi", T, loaded)
    norm = np.linalg.norm(matrix(hand), axis=(1, 2))
    weight = np.where(i == j, 1.0, np.sqrt(2.0)) / norm[:, None]
    S = weight[..., None] * (T @ slope[:, kept])
    spread = form.by_activation(x, "K")[:, kept] * at.activation[:, None]
    alone = weight[..., None] * (T @ spread) * wish.activation_percent / 100
    by_parameters = np.einsum("pea,peb->ab", S, S) / len(q)
    return np.asarray(by_parameters), float((alone**2).sum() / len(q))


def _taken(
    typical: TypicalMuscles,
    rows: tuple[FloatArray, FloatArray],
    S: FloatArray,
    alone: float,
    wish: CalibrationWish,
) -> tuple[list[int], FloatArray]:
    """Numbers of the conditions taken, and the mean squared error before and after each."""
    slopes, R = rows
    p = slopes.shape[2]
    C = np.diag(typical.prior_sd[:p] ** 2)
    wide = np.zeros((p, p))
    wide[: len(S), : len(S)] = S
    chosen: list[int] = []
    expected = [float((wide * C).sum()) + alone]
    while len(chosen) < wish.most and expected[-1] > (wish.error_percent / 100) ** 2:
        # C' = C - C J^T (R + J C J^T)^-1 J C lowers tr(S C) by tr((R + J C J^T)^-1 J C S C J^T)
        moved = slopes @ C
        total = R + moved @ slopes.transpose(0, 2, 1)
        gained = moved @ wide @ moved.transpose(0, 2, 1)
        best = int(np.einsum("cii->c", np.linalg.solve(total, gained)).argmax())
        C = C - moved[best].T @ np.linalg.solve(total[best], moved[best])
        C = (C + C.T) / 2
        chosen.append(best)
        expected.append(float((wide * C).sum()) + alone)
    return chosen, np.array(expected)
