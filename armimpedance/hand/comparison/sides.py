"""What a change takes of one group alone: values, variances and the limits of its ellipse."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Final, Self

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, IntArray
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.comparison.distance import upper_elements
from armimpedance.hand.ellipses import FIELDS, Ellipse, Which, ellipse_of

LEVEL: Final = 0.95


@dataclass(frozen=True, eq=False)
class EllipseSide:
    """The ellipses of G groups; nan where a matrix has none.

    Attributes
    ----------
    size, size_variance : (G,)
        The variance is that of its logarithm, to first order; so is that of the shape.
    shape, shape_variance : (G,)
    log_shape : (G, 3)
        Logarithm of the shape and of its 95 % limits.
    angle : (G, 3)
        Orientation in rad and its 95 % limits.
    angle_variance : (G,)
    circular : (G,)
        Whether a circle cannot be ruled out.
    """

    size: FloatArray
    size_variance: FloatArray
    shape: FloatArray
    shape_variance: FloatArray
    log_shape: FloatArray
    angle: FloatArray
    angle_variance: FloatArray
    circular: BoolArray

    def taken(self, rows: IntArray) -> Self:
        """Those of the groups of these numbers."""
        return type(self)(*(getattr(self, field.name)[rows] for field in fields(self)))


@dataclass(frozen=True, eq=False)
class Side:
    """One matrix of G groups.

    Attributes
    ----------
    values, variances : (G, c)
        Of the elements of the symmetric part.
    dof : (G,)
    ellipse : EllipseSide or None
        Of matrices of two axes.
    """

    values: FloatArray
    variances: FloatArray
    dof: FloatArray
    ellipse: EllipseSide | None

    def taken(self, rows: IntArray) -> Self:
        """That of the groups of these numbers."""
        part = None if self.ellipse is None else self.ellipse.taken(rows)
        return type(self)(self.values[rows], self.variances[rows], self.dof[rows], part)


def side_of(estimates: Sequence[ImpedanceEstimate]) -> tuple[Side, ...]:
    """Inertia, viscosity and stiffness of estimates of one level and number of axes."""
    return tuple(_side(estimates, field) for field in FIELDS)


def _side(estimates: Sequence[ImpedanceEstimate], field: Which) -> Side:
    k, i = estimates[0].k, FIELDS.index(field)
    C, block = upper_elements(k), slice(i * k * k, (i + 1) * k * k)
    values = np.array([C @ getattr(e, field).ravel() for e in estimates])
    variances = np.array([np.diag(C @ e.covariance[block, block] @ C.T) for e in estimates])
    dof = np.array([e.dof for e in estimates])
    planar = _ellipses([ellipse_of(e, field) for e in estimates]) if k == 2 else None
    return Side(values, variances, dof, planar)


def _ellipses(found: Sequence[Ellipse | None]) -> EllipseSide:
    rows = [_ellipse(each) for each in found]
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    return EllipseSide(*columns)


def _ellipse(of: Ellipse | None) -> tuple[float | FloatArray, ...]:
    """The entries of one group, in the order of `EllipseSide`."""
    if of is None:
        nan, three = float("nan"), np.full(3, np.nan)
        return nan, nan, nan, nan, three, three, nan, False
    limits = of.interval(LEVEL)
    with np.errstate(divide="ignore"):
        log_shape = np.log([of.shape, *limits[2]])
    return (
        of.size,
        _variance(of, 0) / of.size**2,
        of.shape,
        _variance(of, 2) / of.shape**2,
        log_shape,
        np.array([of.orientation_rad, *limits[1]]),
        _variance(of, 1),
        of.may_be_circular(LEVEL),
    )


def _variance(of: Ellipse, row: int) -> float:
    """Variance of size (0), orientation (1) or shape (2), to first order; nan of a circle."""
    covariance = of.covariance
    return float("nan") if covariance is None else float(max(covariance[row, row], 0.0))
