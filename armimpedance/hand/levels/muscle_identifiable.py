"""What one joint stiffness says of the stiffnesses of the muscles.

K_j of two joints, the curvature term taken off, gives three numbers ``y = A k`` for m muscles,
k >= 0: column i of A (3, m) is ``g_s^2, g_s g_e, g_e^2`` of muscle i. Determined are the
combinations ``c k`` with c in the row space of A, and nothing else; of every other combination K_j
says a range only, which linear programs find: least and largest ``c k`` with ``A k = y, k >= 0``.

Limits of the ranges come from the programs' duals. Any p with ``A^T p <= c`` gives ``c k >= p y``
for every feasible k (weak duality), so ``p y`` less its error is a lower limit for all feasible k,
whatever the true y is. At the measured y the program's own p gives the sharpest; the least ``c k``
is convex in y, so the limit errs on the safe side where another p would hold. The same for the
largest, with signs turned. Viscosity is the same without the curvature term.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray, frozen_array
from armimpedance.core.errors import InputError
from armimpedance.hand.levels.muscle_cone import MuscleCone
from armimpedance.hand.levels.muscle_share import MuscleShare


def muscle_share(
    joint_matrix: ArrayLike,
    covariance: ArrayLike,
    G: ArrayLike,
    muscles: Sequence[str],
    *,
    curvature: ArrayLike | None = None,
    dof: float = np.inf,
) -> MuscleShare:
    """What K_j (or B_j) says of the muscles.

    Parameters
    ----------
    joint_matrix : (n, n)
        N m/rad or N m s/rad; its symmetric part counts.
    covariance : (n^2, n^2)
        Covariance of its elements row by row.
    G : (m, n)
        Moment arms dL/dq, m.
    muscles : (m,) sequence of str
    curvature : (n, n), optional
        ``sum_n f_n d2L_n`` (`hand.levels.curvature_term`), taken off; counts as known.
    dof : float
        Degrees of freedom of the t distribution for limits; inf = normal.

    Raises
    ------
    InputError
        Shapes that do not belong together, or a muscle without any moment arm.
    EstimationError
        A linear program ended without an optimum.
    """
    arms: FloatArray = frozen_array(G, "G", (len(muscles), None))
    n = arms.shape[1]
    K: FloatArray = frozen_array(joint_matrix, "joint matrix", (n, n))
    own = K if curvature is None else K - frozen_array(curvature, "curvature", (n, n))
    spread: FloatArray = frozen_array(covariance, "covariance", (n * n, n * n))
    if not np.abs(arms).max(axis=1).all():
        name = muscles[int(np.argmin(np.abs(arms).max(axis=1)))]
        raise InputError(f"muscle {name} has no moment arm at this posture", expected="some")
    pairs = [(i, j) for i in range(n) for j in range(i, n)]
    to_elements = _symmetric_elements(n, pairs)
    A = np.array([arms[:, i] * arms[:, j] for i, j in pairs])
    return MuscleCone(
        muscles=tuple(str(name) for name in muscles),
        A=A,
        y=to_elements @ own.ravel(),
        covariance=to_elements @ spread @ to_elements.T,
        dof=dof,
    ).share(_element_names(n, pairs), _groups(arms, pairs))


def _symmetric_elements(n: int, pairs: list[tuple[int, int]]) -> FloatArray:
    """Elements (p,) of the symmetric part from a matrix row by row (n^2,)."""
    rows = np.zeros((len(pairs), n * n))
    for row, (i, j) in zip(rows, pairs, strict=True):
        row[i * n + j] += 0.5
        row[j * n + i] += 0.5
    return rows


def _element_names(n: int, pairs: list[tuple[int, int]]) -> list[str]:
    letters = "se" if n == 2 else "".join(str(i + 1) for i in range(n))
    return [letters[i] + letters[j] for i, j in pairs]


def _groups(arms: FloatArray, pairs: list[tuple[int, int]]) -> dict[str, FloatArray]:
    """Coefficients of each group's part in each element, where it has one."""
    n = arms.shape[1]
    names, spans = _element_names(n, pairs), arms != 0
    joints = ("shoulder", "elbow") if n == 2 else tuple(f"joint_{i + 1}" for i in range(n))
    members = {joint: spans[:, j] & (spans.sum(axis=1) == 1) for j, joint in enumerate(joints)}
    members["two_joint" if n == 2 else "multi_joint"] = spans.sum(axis=1) > 1
    found = {}
    for group, who in members.items():
        for name, (i, j) in zip(names, pairs, strict=True):
            part = np.where(who, arms[:, i] * arms[:, j], 0.0)
            if part.any():
                found[f"{group}_{name}"] = part
    return found
