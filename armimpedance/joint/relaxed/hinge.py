"""One hinge of a skeleton that moves freely while the other coordinates move as measured.

The generalised force of hinge j is ``H_j = I(t) qdd + B(t) qd + g(t, q)``. Its own rotation causes
no centrifugal torque about its own axis. The other coordinates act through one or two rotations by
q, so g is a trigonometric polynomial of degree 2 in q. Five angles and two unit motions determine
all coefficients.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, frozen_array
from armimpedance.core.skeleton import GRAVITY_M_S2

#: Steps of the forward simulation per sample.
SUBSTEPS: Final = 4

#: Five equally spaced angles determine 1, cos, sin, cos 2q, sin 2q.
_ANGLES: Final = 2 * np.pi * np.arange(5) / 5


@dataclass(frozen=True)
class HingeDynamics:
    """Coefficients of H_j, per trial.

    `coefficients` tuple of T (2 SUBSTEPS (S_t - 1) + 1, 7), on a grid of ``2 SUBSTEPS`` points per
    sample: I (kg m^2), B (N m s/rad), then g in N m: 1, cos q, sin q, cos 2q, sin 2q.
    `weights` tuple of T (S_t, 3, 5): g of the limb's weight only, if x, y or z pointed up.
    """

    coefficients: tuple[FloatArray, ...]
    weights: tuple[FloatArray, ...]

    def __post_init__(self) -> None:
        checked = tuple(frozen_array(c, "coefficients", (None, 7)) for c in self.coefficients)
        weights = tuple(frozen_array(w, "weights", (None, 3, 5)) for w in self.weights)
        object.__setattr__(self, "coefficients", checked)
        object.__setattr__(self, "weights", weights)

    def select(self, rows: list[int]) -> HingeDynamics:
        """Dynamics of these trials only."""
        parts = (self.coefficients, self.weights)
        return HingeDynamics(*(tuple(part[r] for r in rows) for part in parts))

    def pointing(self, up: str) -> HingeDynamics:
        """Dynamics if another axis than z (``x``, ``-x``, ``y``, ``-y`` or ``-z``) pointed up."""
        sign, axis = (-1 if up.startswith("-") else 1), "xyz".index(up[-1])
        parts = []
        for whole, weight in zip(self.coefficients, self.weights, strict=True):
            # (S, 5) at the samples, linear between them
            more = sign * weight[:, axis] - weight[:, 2]
            at = np.arange(len(whole)) / (2 * SUBSTEPS)
            grid = [np.interp(at, np.arange(len(more)), column) for column in more.T]
            parts.append(whole + np.column_stack([np.zeros((len(whole), 2)), *grid]))
        return HingeDynamics(tuple(parts), self.weights)

    def cut(self, edges: list[int]) -> HingeDynamics:
        """Cut a single trial at these samples; the first is 0, the last its number of samples."""
        per = 2 * SUBSTEPS
        parts = list(zip(edges[:-1], edges[1:], strict=True))
        whole, weight = self.coefficients[0], self.weights[0]
        return HingeDynamics(
            tuple(whole[per * a : per * (b - 1) + 1] for a, b in parts),
            tuple(weight[a:b] for a, b in parts),
        )


def hinge_coefficients(
    model: Any, joint: int, q: FloatArray, qd: FloatArray, qdd: FloatArray
) -> FloatArray:
    """Coefficients (N, 7) of H_joint from the motion (N, n) of all coordinates.

    `q`, `qd`, `qdd` (N, n).
    `joint`: number of the coordinate that is free; its own motion is not used.
    """
    import pinocchio as pin

    data = model.createData()
    q, qd, qdd = q.copy(), qd.copy(), qdd.copy()
    qd[:, joint] = qdd[:, joint] = 0.0
    at_angles = np.empty((len(q), 5))
    own = np.empty((len(q), 2))
    for i in range(len(q)):
        position, velocity, acceleration = q[i], qd[i], qdd[i]
        for a, angle in enumerate(_ANGLES):
            position[joint] = angle
            at_angles[i, a] = pin.rnea(model, data, position, velocity, acceleration)[joint]
        # at the last angle still: one unit of acceleration, then one unit of velocity
        acceleration[joint] = 1.0
        own[i, 0] = pin.rnea(model, data, position, velocity, acceleration)[joint]
        acceleration[joint], velocity[joint] = 0.0, 1.0
        own[i, 1] = pin.rnea(model, data, position, velocity, acceleration)[joint]
    own -= at_angles[:, -1:]
    return np.concatenate([own, _harmonics(at_angles)], axis=1)


def weight_harmonics(model: Any, joint: int, q: FloatArray) -> FloatArray:
    """Coefficients of g (N, 3, 5) of the limb's weight, if x, y or z pointed up, from coordinates
    (N, n).
    """
    import pinocchio as pin

    q = q.copy()
    at_angles = np.empty((len(q), 3, 5))
    for axis in range(3):
        turned = pin.Model(model)
        turned.gravity.linear = -GRAVITY_M_S2 * np.eye(3)[axis]
        data = turned.createData()
        for i, position in enumerate(q):
            for a, angle in enumerate(_ANGLES):
                position[joint] = angle
                torque = pin.computeGeneralizedGravity(turned, data, position)
                at_angles[i, axis, a] = torque[joint]
    return _harmonics(at_angles)


def _harmonics(at_angles: FloatArray) -> FloatArray:
    """Coefficients (..., 5) of torques (..., 5) at the five angles."""
    # g (..., 5) = h (..., 5) A^-T, A (5, 5) the harmonics at the five angles
    return at_angles @ np.linalg.inv(harmonics_at(_ANGLES)).T


def harmonics_at(q: FloatArray) -> FloatArray:
    """Harmonics ``1, cos q, sin q, cos 2q, sin 2q``, (..., 5)."""
    return np.stack([np.ones_like(q), np.cos(q), np.sin(q), np.cos(2 * q), np.sin(2 * q)], axis=-1)
