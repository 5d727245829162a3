"""Ellipsoids of impedance in space: half-axes, size, axes, with intervals.

The ellipsoid of a matrix A is the locus of ``A u``, |u| = 1. Half-axes are the eigenvalues of the
symmetric part, its size is the volume ``4/3 pi l1 l2 l3``; both have intervals on a log scale. The
confidence region of an axis needs no derivatives, as that of an ellipse's orientation (Fieller): a
direction u belongs to it if ``A u`` minus its part along u, which is linear in A, may be zero by an
F test of two degrees of freedom. If two half-axes are nearly equal, the axes may have any
direction.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import fdtri, stdtrit

from armimpedance.core.arrays import FloatArray, frozen_array
from armimpedance.core.errors import InputError, check_level
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.ellipses.geometry import FIELDS, NotPositiveDefiniteError, Which

#: Angles by which an axis is turned in the search, rad.
_TURNS: Final = np.radians(np.arange(0.5, 90.5, 0.5))
#: Degrees of freedom that are used for infinitely many.
_MANY: Final = 1e7


@dataclass(frozen=True)
class Ellipsoid:
    """The ellipsoid of a positive definite 3x3 matrix.

    Attributes
    ----------
    matrix : (3, 3)
        Symmetric.
    semi_axes : (3,)
        Eigenvalues, the largest first, in the matrix' unit.
    axes : (3, 3)
        Directions of the half-axes, as columns.
    covariance : (9, 9)
        Covariance of the matrix' elements, row by row.
    dof : float
    """

    matrix: FloatArray
    semi_axes: FloatArray
    axes: FloatArray
    covariance: FloatArray
    dof: float

    @property
    def size(self) -> float:
        """Volume ``4/3 pi l1 l2 l3``, in the matrix' unit cubed."""
        return float(4 / 3 * np.pi * np.prod(self.semi_axes))

    @property
    def shape(self) -> FloatArray:
        """``l2/l1`` and ``l3/l1``, (2,)."""
        return self.semi_axes[1:] / self.semi_axes[0]

    @property
    def directions(self) -> FloatArray:
        """The axes as rows (3, 3), each turned so that its largest component is positive."""
        rows = self.axes.T
        largest = np.abs(rows).argmax(axis=1)
        return np.asarray(rows * np.sign(rows[np.arange(3), largest])[:, None])

    def interval(self, level: float = 0.95) -> FloatArray:
        """Limits (low, high) of the three half-axes and of the size, (4, 2).

        Raises
        ------
        InputError
            The level is not between 0 and 1.
        """
        check_level(level)
        t = float(stdtrit(self.dof, (1 + level) / 2))
        weights = np.stack([np.outer(v, v).ravel() / li for v, li in self._pairs()])
        # d log l_i = v_i^T dA v_i / l_i; d log size is their sum
        weights = np.vstack([weights, weights.sum(axis=0)])
        sd = np.sqrt(np.maximum(np.einsum("iw,wx,ix->i", weights, self.covariance, weights), 0))
        values = np.append(self.semi_axes, self.size)[:, None]
        return np.asarray(values * np.exp(np.minimum(t * sd, 300.0)[:, None] * [-1.0, 1.0]))

    def may_be_axis(self, direction: ArrayLike, level: float = 0.95) -> bool:
        """True if a direction (3,) may be one of the axes."""
        u = np.asarray(direction, dtype=float)
        return bool(self._off_axis(u[None] / np.linalg.norm(u), level)[0] <= 1)

    def turns(self, level: float = 0.95) -> FloatArray:
        """Largest angle (rad) by which each axis may turn towards each of the two others, (3, 2).

        The others are in the order of the half-axes; ``pi/2`` if any angle is possible.
        """
        return np.stack([self.turns_of(i, level) for i in range(3)])

    def turns_of(self, i: int, level: float = 0.95) -> FloatArray:
        """One row of `turns`, (2,), for axis i; 0 is the longest."""
        largest = []
        for j in (j for j in range(3) if j != i):
            turned = [
                np.cos(_TURNS)[:, None] * self.axes[:, i]
                + sign * np.sin(_TURNS)[:, None] * self.axes[:, j]
                for sign in (-1.0, 1.0)
            ]
            largest.append(max(self._reach(directions, level) for directions in turned))
        return np.array(largest)

    def _reach(self, turned: FloatArray, level: float) -> float:
        out = self._off_axis(turned, level) > 1
        return float(_TURNS[int(out.argmax())]) if out.any() else float(np.pi / 2)

    def _pairs(self) -> zip[tuple[FloatArray, float]]:
        return zip(self.axes.T, self.semi_axes, strict=True)

    def _off_axis(self, u: FloatArray, level: float) -> FloatArray:
        """Squared distance of directions (n, 3) from an axis, relative to the limit by chance."""
        check_level(level)
        limit = 2 * float(fdtri(2, min(self.dof, _MANY), level))
        S = (np.eye(9) + _TRANSPOSE) / 2
        covariance = S @ self.covariance @ S.T
        # two directions across each u, (n, 2, 3), and A u along them, w (n, 2)
        across = np.linalg.svd(u[:, None])[2][:, 1:]
        w = np.einsum("nai,ij,nj->na", across, self.matrix, u)
        by = np.einsum("nai,nj->naij", across, u).reshape(len(u), 2, 9)
        spread = by @ covariance @ by.transpose(0, 2, 1)
        scale = np.trace(spread, axis1=1, axis2=2) + 1e-300
        inverse = np.linalg.pinv(spread / scale[:, None, None], rcond=1e-12)
        return np.asarray(np.einsum("na,nab,nb->n", w, inverse, w) / scale / limit)


#: Map from vec of a matrix to vec of its transpose.
_TRANSPOSE: Final = np.eye(9).reshape(3, 3, 9).transpose(1, 0, 2).reshape(9, 9)


def ellipsoid_of_matrix(matrix: ArrayLike, covariance: ArrayLike, dof: float = np.inf) -> Ellipsoid:
    """The ellipsoid of a matrix' symmetric part.

    Parameters
    ----------
    matrix : (3, 3)
        Stiffness, viscosity or inertia, SI.
    covariance : (9, 9)
        Covariance of the matrix' elements, row by row.
    dof : float
        Degrees of freedom of the covariance; inf = known.

    Returns
    -------
    Ellipsoid

    Raises
    ------
    NotPositiveDefiniteError
        The symmetric part is not positive definite.
    """
    elements = frozen_array(matrix, "matrix", (3, 3))
    symmetric = (elements + elements.T) / 2
    values, vectors = np.linalg.eigh(symmetric)
    if not values[0] > 1e-13 * abs(values[-1]):
        listed = ", ".join(f"{v:.4g}" for v in values)
        raise NotPositiveDefiniteError(f"no ellipsoid: eigenvalues {listed} are not all positive")
    frozen_covariance = frozen_array(covariance, "covariance", (9, 9))
    return Ellipsoid(
        symmetric, values[::-1].copy(), vectors[:, ::-1].copy(), frozen_covariance, dof
    )


def ellipsoid_of(estimate: ImpedanceEstimate, which: Which) -> Ellipsoid | None:
    """The ellipsoid of an estimate's stiffness, viscosity or inertia.

    Parameters
    ----------
    estimate : ImpedanceEstimate
    which : {"inertia", "viscosity", "stiffness"}
        Matrix of the ellipsoid.

    Returns
    -------
    Ellipsoid or None
        None for an estimate of other than three axes, or if the matrix' symmetric part is not
        positive definite.

    Raises
    ------
    InputError
        Unknown `which`.
    """
    if which not in FIELDS:
        raise InputError(f"no such matrix: {which!r}", expected=", ".join(FIELDS))
    if estimate.k != 3:
        return None
    block = slice(9 * FIELDS.index(which), 9 * FIELDS.index(which) + 9)
    try:
        covariance = estimate.covariance[block, block]
        return ellipsoid_of_matrix(getattr(estimate, which), covariance, estimate.dof)
    except NotPositiveDefiniteError:
        return None
