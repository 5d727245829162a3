"""The outline of a force ellipse in polar form, with its confidence band. Without matplotlib."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import MATRICES
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.ellipses import Which, locus
from armimpedance.numerics.regression import t_factor


def outline_radius(
    matrix: ArrayLike, covariance: ArrayLike, angle_rad: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Distance of a force ellipse's outline from its centre, and its standard error.

    `matrix` (2, 2): its symmetric part A is positive definite; the outline is the locus of ``A u``,
    |u| = 1.
    `covariance` (4, 4): of the matrix, row by row.
    `angle_rad` (n,): directions from the centre.
    Returns `radius`, `sd` (n,).
    """
    a = np.asarray(matrix, dtype=float)
    inverse = np.linalg.inv((a + a.T) / 2)
    angle = np.asarray(angle_rad, dtype=float)
    e = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    w = e @ inverse
    # |A^-1 e| r = 1, w = A^-1 e (n, 2)
    radius = 1 / np.linalg.norm(w, axis=-1)
    # dr = r^3 (A^-1 w)^T dA w, dA the symmetric part of the matrix' change
    weights = radius[:, None, None] ** 3 * np.einsum("ni,nj->nij", w @ inverse, w)
    weights = ((weights + weights.transpose(0, 2, 1)) / 2).reshape(-1, 4)
    variance = np.einsum("ni,ij,nj->n", weights, np.asarray(covariance, dtype=float), weights)
    return radius, np.sqrt(np.maximum(variance, 0.0))


def confidence_band(
    estimate: ImpedanceEstimate, which: Which, n: int = 361
) -> tuple[FloatArray, FloatArray]:
    """Inner and outer outline of the 95 % band of an estimate's ellipse, (n, 2) each, closed.

    Pointwise along each direction from the centre, first order; the inner one ends at the centre.

    Parameters
    ----------
    estimate : ImpedanceEstimate
        Of two axes.
    which : {"stiffness", "viscosity", "inertia"}
        The matrix whose ellipse it is.
    n : int
        Points on each outline.

    Returns
    -------
    inner, outer : (n, 2) ndarray
        From the centre, in the unit of the matrix.
    """
    i = list(MATRICES).index(which)
    # Directions of the locus' own points: close together where a thin ellipse bends.
    x, y = locus(getattr(estimate, which), n).T
    angle = np.arctan2(y, x)
    covariance = estimate.covariance[4 * i : 4 * i + 4, 4 * i : 4 * i + 4]
    radius, sd = outline_radius(getattr(estimate, which), covariance, angle)
    half = t_factor(estimate.dof) * sd
    e = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return np.maximum(radius - half, 0.0)[:, None] * e, (radius + half)[:, None] * e
