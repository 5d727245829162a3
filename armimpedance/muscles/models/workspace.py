"""A workspace of joint angles: scaled to [-1, 1], and where something was measured.

Powers of angles in radians are nearly dependent; scaled, the condition of the regressor falls by
orders of magnitude (docs/explanation/posture_models.md), and a posture is inside of the box if all
numbers are.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Annotated, Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import nnls

from armimpedance.core.arrays import BoolArray, FloatArray, FrozenRecord, frozen_array
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

    `joint_angles` (P, 2), `labels` (P,) tuple of str.
    `box` (2, 2): rad; of shoulder and elbow the lowest and the highest angle.
    Raises InputError: not such a box, or a measured posture is outside of it.
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

    Raises NotIdentifiableError: naming the joints.
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


# Where something was measured: the convex hull of points, in the plane of two angles or of more.
#
# Few points may lie on a line, or be one: the hull is then a segment or a point, and what is close
# to it counts as inside.

#: How far outside of the hull still counts as inside, in scaled angles: one hundredth of the
#: workspace's width, which for a width of 60 degrees is about the error of a measured angle.
TOLERANCE = 0.02
#: Weight of the sum of a mean's weights against its distance: what is left of it is 1e-6.
_SURE_SUM = 1e3


@dataclass(frozen=True)
class Region(FrozenRecord):
    """A convex polygon, which may be a segment or a point, or a body of more dimensions.

    Attributes
    ----------
    vertices : (V, n)
        In the plane counter-clockwise.
    tolerance : float
        How far outside still counts as inside, in the units of the vertices.
    """

    vertices: Annotated[FloatArray, "v n"]
    tolerance: float = TOLERANCE

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.vertices) == 0:
            raise InputError("a region without points", expected="one point or more")
        if not (np.isfinite(self.tolerance) and self.tolerance >= 0):
            raise InputError(f"a tolerance of {self.tolerance}", expected="0 or more")

    @classmethod
    def of(cls, points: ArrayLike, *, tolerance: float = TOLERANCE) -> Region:
        """The convex hull of points (P, n)."""
        return cls(_hull(frozen_array(points, "points", (None, None))), tolerance)

    def nearest(self, points: ArrayLike) -> FloatArray:
        """The points (..., n) of the region that are nearest to `points` (..., n)."""
        p = np.asarray(points, dtype=float)
        if self.vertices.shape[1] != 2:
            flat = p.reshape(-1, self.vertices.shape[1])
            return np.array([self._nearest_of_many(one) for one in flat]).reshape(p.shape)
        start, end = self.vertices, np.roll(self.vertices, -1, axis=0)
        edge, away = end - start, p[..., None, :] - start
        # foot of the perpendicular on each edge (..., V, 2), held between the edge's ends
        length2 = np.maximum((edge**2).sum(axis=-1), np.finfo(float).tiny)
        along = np.clip((away * edge).sum(axis=-1) / length2, 0.0, 1.0)
        feet = start + along[..., None] * edge
        gap = ((p[..., None, :] - feet) ** 2).sum(axis=-1)
        best = np.take_along_axis(feet, gap.argmin(axis=-1)[..., None, None], axis=-2)[..., 0, :]
        left = edge[:, 0] * away[..., 1] - edge[:, 1] * away[..., 0] >= 0
        inside = left.all(axis=-1) & (len(self.vertices) > 2)
        return np.where(np.asarray(inside)[..., None], p, best)

    def _nearest_of_many(self, point: FloatArray) -> FloatArray:
        """The nearest mean of vertices: ``|V^T w - p|`` least, w >= 0, sum of w = 1."""
        W = np.vstack([self.vertices.T, np.full(len(self.vertices), _SURE_SUM)])
        weights = nnls(W, np.append(point, _SURE_SUM))[0]
        return np.asarray(weights @ self.vertices / weights.sum())

    def contains(self, points: ArrayLike) -> BoolArray:
        """Return True for points (..., n) that are inside, or outside within the tolerance."""
        p = np.asarray(points, dtype=float)
        return np.asarray(np.linalg.norm(p - self.nearest(p), axis=-1) <= self.tolerance)


#: A hull of more dimensions has too many sides; all points together span the same.
_MOST_DIMENSIONS: Final = 4


def _hull(points: FloatArray) -> FloatArray:
    """Vertices (V, n) of the hull, in the plane counter-clockwise; of points on a line its ends."""
    from scipy.spatial import ConvexHull, QhullError

    different = np.unique(points, axis=0)
    if points.shape[1] > _MOST_DIMENSIONS:
        return different
    try:
        return np.asarray(different[ConvexHull(different).vertices])
    except QhullError:
        # flat in more dimensions: the points themselves span the same hull
        if points.shape[1] != 2:
            return different
        # fewer than three, or on a line: sorted by both coordinates, the ends come first and last
        return different[[0, -1]] if len(different) > 1 else different
