"""Which motions excite the dynamics: the condition of the column-scaled base regressor.

The greedy choice starts from the motion of the lowest condition and adds the one that lowers it
most; what is left over serves cross-validation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import InputError
from armimpedance.joint.body.base_parameters import BaseParameters
from armimpedance.joint.body.equations import BodyEquations

#: Singular values below this part of the largest count as none.
_NOTHING = 1e-12


@dataclass(frozen=True)
class MotionChoice(FrozenRecord):
    """Motions in the order in which they were chosen.

    Attributes
    ----------
    chosen : tuple of int
        Rows of the trial table (from 0).
    motions : tuple of str
        Names of these motions.
    conditions : tuple of float
        Condition of the regressor after each of them was added.
    alone : (T,)
        Condition of every motion by itself; inf where it shows fewer parameters.
    """

    chosen: tuple[int, ...]
    motions: tuple[str, ...]
    conditions: tuple[float, ...]
    alone: Annotated[FloatArray, "T nan"]

    @property
    def rest(self) -> tuple[int, ...]:
        """The trials left for cross-validation."""
        return tuple(t for t in range(len(self.alone)) if t not in self.chosen)


def motion_conditions(equations: BodyEquations, base: BaseParameters) -> FloatArray:
    """Condition of every motion's column-scaled base regressor.

    Parameters
    ----------
    equations : BodyEquations
    base : BaseParameters

    Returns
    -------
    (T,)
        inf where a motion shows fewer parameters.
    """
    return np.array([_condition(r)[1] for r in _triangles(equations, base)])


def scaled_condition(equations: BodyEquations, base: BaseParameters) -> float:
    """Condition of the column-scaled base regressor of all motions together."""
    b = base.rank
    return _condition(_triangles(equations, base).reshape(-1, b))[1]


def choose_motions(
    equations: BodyEquations, base: BaseParameters, *, most: int = 4
) -> MotionChoice:
    """Add the motion that lowers the condition most, until `most` or no gain.

    Parameters
    ----------
    equations : BodyEquations
    base : BaseParameters
    most : int
        As many motions at most.

    Returns
    -------
    MotionChoice

    Raises
    ------
    InputError
        No motions asked for.
    """
    if most < 1:
        raise InputError(f"{most} motions asked for", expected="one or more")
    triangles = _triangles(equations, base)
    alone = np.array([_condition(r)[1] for r in triangles])
    chosen: list[int] = []
    reached: list[tuple[int, float]] = []
    so_far = np.empty((0, base.rank))
    while len(chosen) < min(most, len(triangles)):
        left = [t for t in range(len(triangles)) if t not in chosen]
        tried = [_condition(np.concatenate([so_far, triangles[t]])) for t in left]
        best = min(range(len(left)), key=lambda i: tried[i])
        if reached and tried[best] >= reached[-1]:
            break
        chosen.append(left[best])
        reached.append(tried[best])
        both = np.concatenate([so_far, triangles[left[best]]])
        so_far = np.asarray(np.linalg.qr(both, mode="r"))
    return MotionChoice(
        tuple(chosen),
        tuple(equations.motions[t] for t in chosen),
        tuple(condition for _, condition in reached),
        alone,
    )


def _triangles(equations: BodyEquations, base: BaseParameters) -> FloatArray:
    """Triangles (T, b, b) of the base regressor of every motion, all rows as they are."""
    b = base.rank
    # W_base (R S, b) = W[:, leading]
    stack = equations.r[..., base.leading].reshape(equations.n_trials, -1, b)
    return np.asarray(np.linalg.qr(stack, mode="r"))


def _condition(stack: FloatArray) -> tuple[int, float]:
    """Directions that are not shown, and the condition, of a column-scaled stack (n, b)."""
    lengths = np.linalg.norm(stack, axis=0)
    s = np.linalg.svd(stack / np.where(lengths > 0, lengths, 1.0), compute_uv=False)
    lost = int((s <= _NOTHING * s[0]).sum())
    return lost, float("inf") if lost else float(s[0] / s[-1])
