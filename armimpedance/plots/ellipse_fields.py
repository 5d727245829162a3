"""Size, orientation and shape of the hand's ellipses in many places. Without matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from armimpedance.arrays import FloatArray, frozen_array
from armimpedance.ellipses import Ellipse, NotPositiveDefiniteError, ellipse, ellipse_of
from armimpedance.errors import InputError
from armimpedance.muscles import HandPrediction, matrix
from armimpedance.records import ImpedanceEstimate
from armimpedance.regression import t_factor

Predicted = Literal["stiffness", "viscosity"]


@dataclass(frozen=True)
class EllipseField:
    """Ellipses in P places; nan where a matrix is not positive definite.

    Attributes
    ----------
    size : (P,)
        Area, in the matrix' unit squared.
    orientation_deg : (P,)
        Major axis, counter-clockwise from the line shoulder -> hand, in (-90, 90].
    shape : (P,)
        Minor over major axis.
    size_half_width : (P,)
        Half the 95 % interval of the size as a part of it: of its logarithm, to first order.
    """

    size: FloatArray
    orientation_deg: FloatArray
    shape: FloatArray
    size_half_width: FloatArray


def predicted_field(hand: HandPrediction, which: Predicted) -> EllipseField:
    """Ellipses of predicted stiffness or viscosity."""
    matrices, covariance = matrix(getattr(hand, which)), hand.element_covariance(which)
    found: list[Ellipse | None] = []
    for A, C, line in zip(matrices, covariance, hand.reference_angle_rad, strict=True):
        try:
            found.append(ellipse(A, reference_angle_rad=float(line), covariance=C, dof=hand.dof))
        except NotPositiveDefiniteError:
            found.append(None)
    return _field(found)


def measured_field(estimates: Sequence[ImpedanceEstimate], which: Predicted) -> EllipseField:
    """Ellipses of estimates of the hand.

    Raises
    ------
    InputError
        An estimate of another level.
    """
    for estimate in estimates:
        if estimate.level != "hand":
            raise InputError(f"an estimate of level {estimate.level}", expected="level hand")
    return _field([ellipse_of(estimate, which) for estimate in estimates])


def turned_near(angle_deg: FloatArray, centre_deg: float) -> FloatArray:
    """The same axes as angles within 90 degrees of a centre: no jumps where they wrap round."""
    return np.asarray(centre_deg + 90 - np.mod(90 - (angle_deg - centre_deg), 180))


def mean_axis_deg(angle_deg: FloatArray) -> float:
    """Mean direction of axes (which repeat after 180 degrees), nan left out."""
    known = angle_deg[np.isfinite(angle_deg)]
    return float(np.rad2deg(np.angle(np.exp(2j * np.deg2rad(known)).sum())) / 2)


def _field(found: Sequence[Ellipse | None]) -> EllipseField:
    rows = [_numbers(one) for one in found]
    columns = np.array(rows, dtype=float).reshape(-1, 4).T
    names = ("size", "orientation_deg", "shape", "size_half_width")
    return EllipseField(**dict(zip(names, columns, strict=True)))


def _numbers(one: Ellipse | None) -> tuple[float, float, float, float]:
    if one is None:
        return (np.nan,) * 4
    half = np.nan
    if one.element_covariance is not None:
        C = frozen_array(one.element_covariance, "covariance", (3, 3))
        half = t_factor(one.dof) * np.sqrt(max(one.gradient[0] @ C @ one.gradient[0], 0)) / one.size
    return one.size, float(np.rad2deg(one.orientation_rad)), one.shape, float(half)
