"""Moment arms known on a grid of shoulder and elbow angles, splines in between."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import RectBivariateSpline
from scipy.sparse import csr_array, diags_array, eye_array, kron, vstack
from scipy.sparse.linalg import lsqr

from armimpedance.core.arrays import FloatArray, FrozenRecord, frozen_array
from armimpedance.core.errors import InputError
from armimpedance.limb.arm.polynomial_paths import check_angles

#: Fewer angles than these along a joint do not hold a cubic spline.
LEAST_ANGLES: Final = 4
#: Arms that no length has may be this part of the arms themselves: stiffness goes with their
#: square, and 20 % of it is as much as the source's missing force term makes at 30 N. White errors
#: of 1 mm in arms of 40 mm stay at 2 %.
LARGEST_INCONSISTENCY: Final = 0.1
_JOINTS: Final = ("shoulder", "elbow")


@dataclass(frozen=True)
class TablePaths(FrozenRecord):
    """m muscles over shoulder and elbow, cubic splines through a table.

    `muscles` (m,) tuple of str.
    `shoulder`, `elbow` (a,), (b,): the grid's angles, increasing, rad.
    `arms` (m, a, b, 2): ``G = dL/dq`` at the grid, m.
    `inconsistency` (m,): how far (rms, m) the arms are from the nearest ones that a length has.
    Raises InputError: fewer than 4 angles along a joint, or moment arms that no length has.
    """

    muscles: Annotated[tuple[str, ...], "m"]
    shoulder: Annotated[FloatArray, "a"]
    elbow: Annotated[FloatArray, "b"]
    arms: Annotated[FloatArray, "m a b 2"]
    inconsistency: FloatArray = field(init=False)
    # not a tuple by its annotation: it is made after the other fields are checked
    _splines: Any = field(init=False, repr=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in _JOINTS:
            angles = getattr(self, name)
            if len(angles) < LEAST_ANGLES or not (np.diff(angles) > 0).all():
                raise InputError(
                    f"{len(angles)} angles of the {name}",
                    expected=f"at least {LEAST_ANGLES}, increasing",
                )
        put = object.__setattr__
        splines = tuple(
            tuple(RectBivariateSpline(self.shoulder, self.elbow, arm[..., j]) for j in (0, 1))
            for arm in self.arms
        )
        put(self, "_splines", splines)
        apart = [_inconsistency(self.shoulder, self.elbow, pair) for pair in splines]
        put(self, "inconsistency", frozen_array(apart, "inconsistency", (len(self.muscles),)))
        self._check_consistent()

    def _check_consistent(self) -> None:
        sizes = np.sqrt(np.mean(np.sum(self.arms**2, axis=-1), axis=(1, 2)))
        for name, apart, size in zip(self.muscles, self.inconsistency, sizes, strict=True):
            if apart > LARGEST_INCONSISTENCY * size:
                raise InputError(
                    f"muscle {name}: no length has these moment arms (they miss by "
                    f"{1e3 * apart:.2g} mm rms of {1e3 * size:.2g} mm: dG_shoulder/dq_elbow and "
                    "dG_elbow/dq_shoulder differ)",
                    expected=f"at most {100 * LARGEST_INCONSISTENCY:g} %",
                )

    @property
    def joints(self) -> int:
        """Number of joints, 2."""
        return 2

    @property
    def angle_range(self) -> FloatArray:
        """First and last angle of the table, (2, 2), rad."""
        return np.array([[a[0], a[-1]] for a in (self.shoulder, self.elbow)])

    def moment_arms(self, q: ArrayLike) -> FloatArray:
        """``G = dL/dq``, m, (..., m, 2).

        Raises InputError: a posture outside of the table.
        """
        angles = self._inside(q)
        arms = [[spline.ev(*angles) for spline in pair] for pair in self._splines]
        return np.moveaxis(np.array(arms), (0, 1), (-2, -1))

    def curvature(self, q: ArrayLike) -> FloatArray:
        """``d2L/dq2``, m, (..., m, 2, 2): the splines' slopes, their symmetric part.

        Raises InputError: a posture outside of the table.
        """
        angles = self._inside(q)
        slopes = [
            [[spline.ev(*angles, dx=1 - j, dy=j) for j in (0, 1)] for spline in pair]
            for pair in self._splines
        ]
        # dG_i/dq_j, (..., m, i, j)
        C = np.moveaxis(np.array(slopes), (0, 1, 2), (-3, -2, -1))
        return (C + np.swapaxes(C, -1, -2)) / 2

    def _inside(self, q: ArrayLike) -> tuple[FloatArray, FloatArray]:
        angles = check_angles(q, 2)
        for j, (low, high) in enumerate(self.angle_range):
            outside = (angles[..., j] < low - 1e-9) | (angles[..., j] > high + 1e-9)
            if outside.any():
                raise InputError(
                    f"{_JOINTS[j]} at {np.rad2deg(angles[..., j][outside].flat[0]):.1f} degrees is "
                    "outside of the table of moment arms",
                    expected=f"{np.rad2deg(low):.1f} to {np.rad2deg(high):.1f} degrees",
                )
        return angles[..., 0], angles[..., 1]


def _inconsistency(
    shoulder: FloatArray, elbow: FloatArray, splines: tuple[RectBivariateSpline, ...]
) -> float:
    """How far (rms, m) a muscle's arms are from the nearest that a length at the nodes has.

    Along each edge of the grid the length changes by the integral of the arm; around a mesh the
    four changes must cancel. Nearest: least squares over the edges, each weighing the same.
    """
    a, b = len(shoulder), len(elbow)
    across = _mean_arms(lambda x: splines[0](x, elbow), shoulder)
    along = _mean_arms(lambda x: splines[1](shoulder, x).T, elbow).T
    # W (edges, nodes) L (nodes,) = mean arms (edges,)
    W = vstack([kron(_slopes(shoulder), eye_array(b)), kron(eye_array(a), _slopes(elbow))])
    means = np.concatenate([across.ravel(), along.ravel()])
    length = lsqr(csr_array(W), means, atol=1e-12, btol=1e-12)[0]
    return float(np.sqrt(np.mean((W @ length - means) ** 2)))


def _mean_arms(arm: Callable[[FloatArray], FloatArray], nodes: FloatArray) -> FloatArray:
    """Mean arm between neighbouring nodes; Simpson's rule is exact for a cubic spline."""
    at, between = arm(nodes), arm((nodes[:-1] + nodes[1:]) / 2)
    return (at[:-1] + 4 * between + at[1:]) / 6


def _slopes(nodes: FloatArray) -> csr_array:
    """Differences of neighbours over their distance, (nodes - 1, nodes)."""
    inverse = 1 / np.diff(nodes)
    shape = (len(nodes) - 1, len(nodes))
    return csr_array(diags_array(np.stack([-inverse, inverse]), offsets=[0, 1], shape=shape))
