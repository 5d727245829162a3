"""What follows from an estimate and stands in every table: intervals, parts, principal values."""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import group_name
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.ellipses import FIELDS, Ellipse, Which, ellipse_of
from armimpedance.hand.levels import antisymmetric_part
from armimpedance.numerics.regression import t_factor


def condition_of(estimate: ImpedanceEstimate) -> str:
    """The group in words: the condition alone, or all columns by name.

    Parameters
    ----------
    estimate : ImpedanceEstimate
        The estimate of the group.

    Returns
    -------
    str
        The name of the group.
    """
    return group_name(estimate.keys)


def is_recording_of_joints(estimate: ImpedanceEstimate) -> bool:
    """Whether `position` and `force` are angle and torque.

    They are when the device itself turned joints: then the level is joint from the start, and
    there is neither a shoulder in the hand's frame nor an arm posture beside the position. An
    estimate that was mapped from the hand carries the joint angles that it was mapped with.

    Parameters
    ----------
    estimate : ImpedanceEstimate
        The estimate of a group.

    Returns
    -------
    bool
        True where the device turned joints, False where the hand was moved.
    """
    mapped = estimate.joint_angles is not None or estimate.shoulder_m is not None
    return estimate.level == "joint" and not mapped


def half_widths(estimate: ImpedanceEstimate) -> FloatArray:
    """Half-widths of the 95 % intervals of M, B, K, (3, k, k).

    Parameters
    ----------
    estimate : ImpedanceEstimate
        The estimate of a group, with k axes.

    Returns
    -------
    (3, k, k) ndarray
        The half-widths, in the units of the matrices.
    """
    return t_factor(estimate.dof) * estimate.sd


def antisymmetric(estimate: ImpedanceEstimate, symbol: str) -> tuple[float, float]:
    """Antisymmetric part ``(A_12 - A_21) / 2`` of a 2 x 2 matrix and its standard error.

    Parameters
    ----------
    estimate : ImpedanceEstimate
        The estimate that holds the matrix; it has two axes.
    symbol : {"M", "B", "K"}
        Which matrix.

    Returns
    -------
    value, sd : float
        The antisymmetric part and its standard error, in the unit of the matrix.
    """
    part, row = antisymmetric_part(estimate), "MBK".index(symbol)
    return float(part.value[row, 0]), float(part.sd[row, 0])


def principal_values(estimate: ImpedanceEstimate, field: Which) -> tuple[FloatArray, FloatArray]:
    """Eigenvalues of the symmetric part, the largest first, and their 95 % half-widths, (k,) each.

    First order: ``dl = v^T dA v`` for the eigenvector v of l.

    Parameters
    ----------
    estimate : ImpedanceEstimate
        The estimate that holds the matrix, with k axes.
    field : {"inertia", "viscosity", "stiffness"}
        Which matrix.

    Returns
    -------
    values, half_widths : (k,) ndarray
        The eigenvalues and their half-widths, in the unit of the matrix.
    """
    k, i = estimate.k, FIELDS.index(field)
    matrix = getattr(estimate, field)
    values, vectors = np.linalg.eigh((matrix + matrix.T) / 2)
    weights = np.einsum("in,jn->nij", vectors, vectors).reshape(k, k * k)
    block = slice(i * k * k, (i + 1) * k * k)
    covariance = weights @ estimate.covariance[block, block] @ weights.T
    half = t_factor(estimate.dof) * np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return values[::-1], half[::-1]


def ellipse_values(
    estimate: ImpedanceEstimate, field: Which, with_handle: bool = False
) -> dict[str, tuple[float, float, float]]:
    """Size, orientation_deg and shape as (value, low, high) at 95 %; empty: no ellipse.

    Parameters
    ----------
    estimate : ImpedanceEstimate
        The estimate whose ellipse is told.
    field : {"inertia", "viscosity", "stiffness"}
        Which matrix.
    with_handle : bool
        The inertia is taken as measured, with the mass between sensor and hand.

    Returns
    -------
    dict
        Under each of the three names its value and its lower and upper 95 % limit.
    """
    ellipse = ellipse_of(estimate, field, with_handle=with_handle)
    return {} if ellipse is None else limits_of(ellipse)


def limits_of(ellipse: Ellipse) -> dict[str, tuple[float, float, float]]:
    """Size, orientation_deg and shape of an ellipse with a covariance: value, low, high at 95 %."""
    values = np.array([ellipse.size, ellipse.orientation_rad, ellipse.shape])
    table = np.column_stack([values, ellipse.interval()])
    table[1] = np.degrees(table[1])
    names = ("size", "orientation_deg", "shape")
    return {n: (float(v), float(a), float(b)) for n, (v, a, b) in zip(names, table, strict=True)}
