"""The regressor of a tree of segments: ``tau = Y(q, qd, qdd) phi``.

The six rows of a floating root are given as a wrench: force (N) and moment (N m) about the root's
origin, in the root's own frame. Its generalised forces are an invertible transformation of these;
as a wrench the rows have one unit each, so that weights by row mean something.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import pinocchio as pin

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.errors import InputError
from armimpedance.core.motion import WRENCH

#: Rows of the root's wrench.
ROOT_ROWS: Final = WRENCH
#: Below this cosine of the root's second turn, its three turns no longer span all rotations.
_LEAST_COSINE: Final = 1e-3


def root_rotation(q: FloatArray) -> FloatArray:
    """Rotation (S, 3, 3) of a floating root, columns its axes, from coordinates (S, n)."""
    (cz, cy, cx), (sz, sy, sx) = np.cos(q[:, 3:6]).T, np.sin(q[:, 3:6]).T
    R = [
        [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
        [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
        [-sy, cy * sx, cy * cx],
    ]
    return np.moveaxis(np.array(R), 2, 0)


def _turn_rates(q: FloatArray) -> FloatArray:
    """G (S, 3, 3): the root's angular velocity in its own frame from the rates of its turns."""
    (_, cy, cx), (_, sy, sx) = np.cos(q[:, 3:6]).T, np.sin(q[:, 3:6]).T
    zero, one = np.zeros(len(q)), np.ones(len(q))
    G = [[-sy, zero, one], [cy * sx, cx, zero], [cy * cx, -sx, zero]]
    return np.moveaxis(np.array(G), 2, 0)


def root_wrench(generalised: FloatArray, q: FloatArray) -> FloatArray:
    """The root's six generalised forces (S, 6, ...) as a wrench in its own frame.

    Raises
    ------
    InputError
        The root is pitched by 90 degrees, where its turns lose a direction.
    """
    if (np.abs(np.cos(q[:, 4])) < _LEAST_COSINE).any():
        sample = int(np.abs(np.cos(q[:, 4])).argmin())
        raise InputError(
            f"the root is pitched by 90 degrees in sample {sample} (counted from 0)",
            expected="a root frame that stays clear of it",
        )
    columns = generalised.reshape(len(q), 6, -1)
    wrench = np.empty_like(columns)
    # f (3,) in the root's frame = R^T f in the world's
    wrench[:, :3] = np.swapaxes(root_rotation(q), 1, 2) @ columns[:, :3]
    # tau (3,) = G^T (3, 3) n (3,)
    wrench[:, 3:] = np.linalg.solve(np.swapaxes(_turn_rates(q), 1, 2), columns[:, 3:])
    return wrench.reshape(generalised.shape)


def regressor(
    model: Any, q: FloatArray, qd: FloatArray, qdd: FloatArray, rows: IntArray | None = None
) -> FloatArray:
    """Y (S, R, 10 s) of a model from `limb.arm.skeleton_model`, for a floating or a fixed root.

    Parameters
    ----------
    model : pinocchio.Model
    q, qd, qdd : (S, n)
    rows : (R,) int, optional
        Which of the n rows; all by default. All of a floating root's six or none.

    Raises
    ------
    InputError
        A part of the root's rows is asked for, or the root is pitched by 90 degrees.
    """
    n, floating = model.nv, is_floating(model)
    chosen = np.arange(n) if rows is None else np.asarray(rows, dtype=np.int64)
    roots = np.flatnonzero(chosen < 6) if floating else np.empty(0, np.int64)
    if len(roots) and not np.array_equal(chosen[:6], np.arange(6)):
        raise InputError("a part of the root's rows", expected="all six of them first, or none")
    data = model.createData()
    Y = np.empty((len(q), len(chosen), 10 * (model.njoints - 1)))
    for i in range(len(q)):
        Y[i] = pin.computeJointTorqueRegressor(model, data, q[i], qd[i], qdd[i])[chosen]
    if len(roots):
        Y[:, :6] = root_wrench(Y[:, :6], q)
    return Y


def is_floating(model: Any) -> bool:
    """Whether the first joint has six coordinates: a floating root."""
    return bool(model.joints[1].nv == 6)
