"""Where something was measured: the convex hull of points, in the plane of two angles or of more.

Few points may lie on a line, or be one: the hull is then a segment or a point, and what is close
to it counts as inside.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import nnls

from armimpedance.core.arrays import BoolArray, FloatArray, FrozenRecord, frozen_array
from armimpedance.core.errors import InputError

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
        """Whether points (..., n) are inside, or outside by no more than the tolerance."""
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
