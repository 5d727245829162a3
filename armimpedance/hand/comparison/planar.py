"""Squared distances over chance of matrices of two axes, in closed form.

What `distance` computes by eigenvalues for matrices of any size: for two axes each is a handful of
products, so that a draw or a permutation costs a fraction of a microsecond.
"""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import FloatArray


def planar_statistics(first: FloatArray, second: FloatArray, covariance: FloatArray) -> FloatArray:
    """The ratios of M, B and K, and their sum, of R pairs of groups.

    Parameters
    ----------
    first, second : (R, 3, 3)
        Elements 11, 12, 22 of each of the three matrices.
    covariance : (R, 9, 9) or (9, 9)
        Of the difference of all of them.

    Returns
    -------
    (R, 4)
        nan where a matrix is not positive definite.
    """
    parts = [slice(3 * i, 3 * i + 3) for i in range(3)]
    ratios = [
        planar_ratios(first[:, i], second[:, i], covariance[..., part, part])
        for i, part in enumerate(parts)
    ]
    return np.column_stack([*ratios, np.sum(ratios, axis=0)])


def planar_ratios(first: FloatArray, second: FloatArray, covariance: FloatArray) -> FloatArray:
    """Squared affine-invariant distance over its expectation by chance, of R pairs of matrices.

    Parameters
    ----------
    first, second : (R, 3)
        Elements 11, 12, 22 of the symmetric matrices.
    covariance : (R, 3, 3) or (3, 3)
        Of the difference of these elements.

    Returns
    -------
    (R,)
        nan where one of the two is not positive definite.
    """
    a, b, c = np.ascontiguousarray(first.T)
    A, B, C = np.ascontiguousarray(second.T)
    # what is not definite divides by zero; it is put right at the end
    with np.errstate(all="ignore"):
        det, DET = a * c - b * b, A * C - B * B
        squared = _squared_distance((a, b, det), (A, B, C), DET / det)
        expected = _expected_square((a + A) / 2, (b + B) / 2, (c + C) / 2, covariance)
        definite = (a > 0) & (det > 0) & (A > 0) & (DET > 0)
        return np.where(definite, squared / expected, np.nan)


def _squared_distance(
    first: tuple[FloatArray, FloatArray, FloatArray],
    second: tuple[FloatArray, FloatArray, FloatArray],
    ratio: FloatArray,
) -> FloatArray:
    """``log^2 l1 + log^2 l2``, l the eigenvalues of L^-1 B L^-T, L L^T the first matrix.

    ``log l = g +- h``: ``exp(2 g)`` is the ratio of the determinants, ``sinh h`` the radius of
    Mohr's circle over ``exp(g)``, which keeps its digits where both eigenvalues are one.
    """
    a, b, det = first
    A, B, C = second
    slope = b / a
    m11, m12 = A / a, (B - A * slope) / np.sqrt(det)
    m22 = (C - (2 * B - A * slope) * slope) * a / det
    g = np.log(ratio) / 2
    h = np.arcsinh(np.hypot((m11 - m22) / 2, m12) / np.sqrt(ratio))
    return np.asarray(2 * (g * g + h * h))


def _expected_square(
    p: FloatArray, q: FloatArray, r: FloatArray, covariance: FloatArray
) -> FloatArray:
    """``E tr(P^-1 D P^-1 D)``, P = [[p, q], [q, r]]; see `distance.expected_square`."""
    det = p * r - q * q
    u, v, w = r / det, -q / det, p / det
    V = np.moveaxis(covariance, (-2, -1), (0, 1))
    own = u * u * V[0, 0] + w * w * V[2, 2] + 2 * (u * w + v * v) * V[1, 1]
    return np.asarray(own + 2 * v * (v * V[0, 2] + 2 * u * V[0, 1] + 2 * w * V[1, 2]))
