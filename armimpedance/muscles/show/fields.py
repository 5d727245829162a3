"""Size, orientation and shape of the hand's ellipses in many places. Without matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from armimpedance.core.arrays import FloatArray, frozen_array
from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.ellipses import Ellipse, ellipse_of
from armimpedance.muscles.models import HandPrediction, matrix
from armimpedance.numerics.regression import t_factor

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
    A, covariance = matrix(getattr(hand, which)), hand.element_covariance(which)
    a, b, c = A[:, 0, 0], A[:, 1, 1], (A[:, 0, 1] + A[:, 1, 0]) / 2
    mean, radius = (a + b) / 2, np.hypot((a - b) / 2, c)
    # where `ellipse` refuses
    known = mean - radius > 1e-13 * mean
    major, minor = (np.where(known, axis, np.nan) for axis in (mean + radius, mean - radius))
    size, axis = np.pi * major * minor, _half_circle(np.arctan2(c, (a - b) / 2) / 2)
    turned = _half_circle(axis - hand.reference_angle_rad)
    sd = _sd_of_size(a, b, c, np.asarray(covariance))
    return EllipseField(
        size=size,
        orientation_deg=np.where(known, np.rad2deg(turned), np.nan),
        shape=minor / major,
        size_half_width=t_factor(hand.dof) * sd / size,
    )


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


def _sd_of_size(a: FloatArray, b: FloatArray, c: FloatArray, covariance: FloatArray) -> FloatArray:
    """Standard deviation (P,) of ``pi (a b - c^2)``, to first order.

    The covariance (P, 4, 4) is that of the matrix' elements, row by row.
    """
    gradient = np.pi * np.stack([b, -c, -c, a], axis=-1)
    variance = np.einsum("pi,pij,pj->p", gradient, covariance, gradient)
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))


def _half_circle(angle: FloatArray) -> FloatArray:
    """The same axes in (-pi/2, pi/2]."""
    return np.asarray(np.pi / 2 - np.mod(np.pi / 2 - angle, np.pi))


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
