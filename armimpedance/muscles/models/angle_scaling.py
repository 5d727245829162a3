"""Joint angles scaled to [-1, 1] over a workspace.

Powers of angles in radians are nearly dependent; scaled, the condition of the regressor falls by
orders of magnitude (docs/muscles/posture.md), and a posture is inside of the box if all numbers
are.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import InputError, NotIdentifiableError

#: Half ranges below this (rad, half a degree) are the measuring error of the angles themselves.
LEAST_HALF_RANGE_RAD = 0.009

#: A posture may be outside of a stated box by this much (rad): rounding of angles in files.
_BOX_ROUNDING_RAD = 1e-3

JOINTS = ("shoulder", "elbow")
#: Angles of which a grid is made at most, and the power of two of the points of more.
_MOST_IN_A_GRID = 4
_SOBOL_POWER = 9


def joint_names(n: int) -> tuple[str, ...]:
    """Shoulder and elbow, or as many numbers as there are joints."""
    return JOINTS if n == 2 else tuple(f"joint {j}" for j in range(1, n + 1))


def angle_columns(n: int) -> tuple[str, ...]:
    """Columns of joint angles in a table: ``q_shoulder_rad, q_elbow_rad``, or ``q_1_rad ...``.

    Parameters
    ----------
    n : int
        Number of joints.

    Returns
    -------
    tuple of str
    """
    if n == 2:
        return tuple(f"q_{joint}_rad" for joint in JOINTS)
    return tuple(f"q_{j}_rad" for j in range(1, n + 1))


@dataclass(frozen=True)
class AngleScaling(FrozenRecord):
    """``u = (theta - centre) / half_range``, joint by joint.

    Attributes
    ----------
    box : (n, 2)
        rad; of each joint, such as shoulder and elbow, the lowest and the highest angle.
    """

    box: Annotated[FloatArray, "n 2"]

    def __post_init__(self) -> None:
        super().__post_init__()
        for joint, (low, high) in zip(joint_names(len(self.box)), self.box, strict=True):
            if not high > low:
                raise InputError(
                    f"a workspace with {joint} angles from {low:.4g} to {high:.4g} rad",
                    expected="the lowest angle first, then a larger one",
                )

    @classmethod
    def of(cls, joint_angles: FloatArray) -> AngleScaling:
        """The scaling whose box just holds the measured postures (P, n), rad.

        A joint that did not move gets the least range, so that a constant can still be fitted.
        """
        low, high = joint_angles.min(axis=0), joint_angles.max(axis=0)
        centre, half = (low + high) / 2, np.maximum((high - low) / 2, LEAST_HALF_RANGE_RAD)
        return cls(np.stack([centre - half, centre + half], axis=1))

    @property
    def centre(self) -> FloatArray:
        """(n,), rad."""
        return np.asarray(self.box.mean(axis=1))

    @property
    def half_range(self) -> FloatArray:
        """(n,), rad."""
        return np.asarray((self.box[:, 1] - self.box[:, 0]) / 2)

    def scaled(self, joint_angles: ArrayLike) -> FloatArray:
        """Scaled angles (..., n) of joint angles (..., n) in rad."""
        return np.asarray((np.asarray(joint_angles, dtype=float) - self.centre) / self.half_range)

    def angles(self, scaled: ArrayLike) -> FloatArray:
        """Joint angles (..., n) in rad of scaled ones (..., n)."""
        return np.asarray(self.centre + np.asarray(scaled, dtype=float) * self.half_range)

    def grid(self, count: int) -> FloatArray:
        """Joint angles (count^n, n) in rad that cover the box, its edges included.

        A grid of more than four angles has too many points: they are the box' corners and Sobol's
        points inside.
        """
        n = len(self.box)
        if n > _MOST_IN_A_GRID:
            from scipy.stats.qmc import Sobol

            corners = np.array(list(product((-1.0, 1.0), repeat=n)))
            inside = Sobol(n, scramble=False).random_base2(_SOBOL_POWER)
            return self.angles(np.vstack([corners, 2 * inside - 1]))
        u = np.linspace(-1.0, 1.0, count)
        return self.angles(np.stack(np.meshgrid(*[u] * n, indexing="ij"), axis=-1).reshape(-1, n))


def stated_scaling(
    box: ArrayLike, joint_angles: FloatArray, labels: tuple[str, ...]
) -> AngleScaling:
    """The scaling of a stated workspace, which must hold all measured postures.

    Parameters
    ----------
    box : (2, 2)
        rad; of shoulder and elbow the lowest and the highest angle.
    joint_angles : (P, 2)
    labels : (P,) tuple of str

    Raises
    ------
    InputError
        Not such a box, or a measured posture is outside of it.
    """
    scaling = AngleScaling(np.asarray(box, dtype=float))
    low, high = scaling.box.T
    outside = (joint_angles < low - _BOX_ROUNDING_RAD) | (joint_angles > high + _BOX_ROUNDING_RAD)
    if outside.any():
        row, joint = (int(i) for i in np.argwhere(outside)[0])
        raise InputError(
            f"{labels[row]}: {JOINTS[joint]} at {np.rad2deg(joint_angles[row, joint]):.1f} degrees "
            "is outside of the stated workspace",
            expected=f"{np.rad2deg(low[joint]):.1f} to {np.rad2deg(high[joint]):.1f} degrees",
        )
    return scaling


def require_spread(joint_angles: FloatArray, order: int) -> None:
    """Refuse postures (P, 2) that are one posture, on a line, or where one joint did not move.

    Raises
    ------
    NotIdentifiableError
        Naming the joints.
    """
    half = np.ptp(joint_angles, axis=0) / 2
    still = [j for j, h in zip(JOINTS, half, strict=True) if h < LEAST_HALF_RANGE_RAD]
    if not still:
        _refuse_line(joint_angles, order)
        return
    deg = ", ".join(f"{j} {np.rad2deg(2 * h):.2g} deg" for j, h in zip(JOINTS, half, strict=True))
    what = "all postures are the same" if len(still) == 2 else f"the {still[0]} did not move"
    raise NotIdentifiableError(
        f"{what} (range: {deg}): nothing is known of moment arms over posture; order 0 only",
        tuple(still),
    )


def _refuse_line(joint_angles: FloatArray, order: int) -> None:
    """Postures that leave a line by less than angles are measured tell nothing across it."""
    away = joint_angles - joint_angles.mean(axis=0)
    # the smallest mean square distance from any line through the middle
    across = np.linalg.svd(away, compute_uv=False)[-1] / np.sqrt(len(away))
    if len(away) > 2 and across < LEAST_HALF_RANGE_RAD / 2:
        raise NotIdentifiableError(
            f"all {len(away)} postures are on a line (within {np.rad2deg(across):.2g} deg): rank "
            f"{2 * order + 1} of {(2 * order + 1) * (order + 1)}, terms of the shoulder's and of "
            "the elbow's angle cannot be told apart; order 0 only, or add postures off the line",
            ("s", "e"),
        )
