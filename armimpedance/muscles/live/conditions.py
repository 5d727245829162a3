"""Where the live hand is to be known, and the conditions that a person can hold there."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Annotated

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import EstimationError, InputError
from armimpedance.hand.levels import tensions_for
from armimpedance.limb.arm import Arm, MuscularArm

#: Angles of a workspace's grid per joint, in the plane and of more joints.
_ANGLES, _FEW = 5, 3


@dataclass(frozen=True)
class Conditions(FrozenRecord):
    """C conditions that a person can hold.

    Attributes
    ----------
    joint_angles : (C, n)
        rad.
    level : (C,)
        Activation that all muscles are near to.
    force : (C, d)
        By the hand, N.
    activation : (C, m)
        Nearest to the level that bear the force and the arm's weight.
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
    kept, found = [], []
    for row, (x, own, F) in enumerate(zip(q, level, force, strict=True)):
        tau, G = arm.posture(x).torque_under(F), muscles.paths.moment_arms(x)
        near = np.full(len(muscles.max_tension), own)
        try:
            tension = tensions_for(tau, G, muscles.max_tension, activation=near)
        except (InputError, EstimationError):
            continue
        kept.append(row)
        found.append(tension / muscles.max_tension)
    if not kept:
        raise InputError("no condition that the muscles can bear", expected="less force")
    return Conditions(q[kept], level[kept], force[kept], np.array(found))


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
