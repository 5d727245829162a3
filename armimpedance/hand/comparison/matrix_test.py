"""Tests of two groups' matrices: distance, Hotelling, correction for many pairs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtrc, fdtrc

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError

# The affine-invariant distance between positive-definite matrices, and its expected square.
#
# ``d(A, B) = || log(A^-1/2 B A^-1/2) ||_F``, the root of the summed squares of the logarithms of
# the eigenvalues of ``A^-1 B``: the same in every frame and unit, ``d(A, B) = d(A^-1, B^-1)``
# (Pennec, Fillard and Ayache 2006, A Riemannian framework for tensor computing, Int J Comput Vis
# 66:41-66). A matrix that is half as stiff is as far away as one that is twice as stiff.


def affine_invariant_distance(first: ArrayLike, second: ArrayLike) -> FloatArray:
    """Distance of the symmetric parts of matrices (..., k, k), (...,).

    nan if one of the two is not positive definite.

    Raises InputError: matrices that are not square or not of the same size.
    """
    A, B = (symmetric(np.asarray(m, dtype=np.float64)) for m in (first, second))
    if A.shape[-2:] != B.shape[-2:]:
        raise InputError(f"matrices {A.shape[-2:]} and {B.shape[-2:]}", expected="the same size")
    A, B = np.broadcast_arrays(A, B)
    definite = is_positive_definite(A) & is_positive_definite(B)
    result = np.full(definite.shape, np.nan)
    if definite.any():
        # L^-1 B L^-T (k, k) with A = L L^T has the eigenvalues of A^-1 B
        inverse = np.linalg.inv(np.linalg.cholesky(A[definite]))
        between = inverse @ B[definite] @ inverse.swapaxes(-1, -2)
        values = np.linalg.eigvalsh(symmetric(between))
        result[definite] = np.sqrt((np.log(np.maximum(values, np.finfo(float).tiny)) ** 2).sum(-1))
    return result


def expected_square(middle: ArrayLike, covariance: ArrayLike) -> FloatArray:
    """Expected squared distance, to first order, of two matrices that differ by chance alone.

    ``E tr(P^-1 D P^-1 D)`` for a difference D whose elements have this covariance.

    `middle` (..., k, k): P, positive definite.
    `covariance` (..., c, c): covariance of the c = k (k + 1)/2 elements ``D_ij, i <= j``
    (`upper_elements`).
    Returns: (...,).
    """
    metric = metric_at(np.asarray(middle, dtype=np.float64))
    return np.asarray(np.einsum("...ef,...fe->...", metric, np.asarray(covariance)))


def metric_at(middle: FloatArray) -> FloatArray:
    """``g_ef = tr(P^-1 E_e P^-1 E_f)`` (..., c, c): the squared distance near P (..., k, k).

    E_e is the symmetric matrix whose element e of `upper_elements` is 1.
    """
    P = symmetric(middle)
    basis = _symmetric_basis(P.shape[-1])
    moved = np.linalg.inv(P)[..., None, :, :] @ basis
    return np.asarray(np.einsum("...eij,...fji->...ef", moved, moved))


def symmetric(matrices: FloatArray) -> FloatArray:
    """Symmetric part of matrices (..., k, k)."""
    return (matrices + matrices.swapaxes(-1, -2)) / 2


def is_positive_definite(matrices: FloatArray) -> np.ndarray:
    """True if the symmetric part of each matrix is positive definite, (...,)."""
    return np.asarray(np.linalg.eigvalsh(symmetric(matrices))[..., 0] > 0)


def upper_elements(k: int) -> FloatArray:
    """Map (c, k^2) from A (k^2,), row by row, to the elements i <= j of its symmetric part."""
    basis = _symmetric_basis(k)
    # the element ij of the symmetric part is half the sum of A_ij and A_ji
    return np.asarray(basis / basis.sum(axis=(1, 2), keepdims=True)).reshape(len(basis), k * k)


def _symmetric_basis(k: int) -> FloatArray:
    """Symmetric matrices (c, k, k) with one element i <= j equal to 1, the others 0."""
    rows, columns = np.triu_indices(k)
    basis = np.zeros((len(rows), k, k))
    basis[np.arange(len(rows)), rows, columns] = 1.0
    basis[np.arange(len(rows)), columns, rows] = 1.0
    return basis


# Hotelling's test of two means with unequal covariances, for stacks of differences.

#: Largest ``1/(1 - R^2)`` of one element on the others; above it an inverse is dominated by
#: rounding.
LARGEST_INFLATION: Final = 1e12


def hotelling(
    difference: FloatArray,
    covariances: tuple[FloatArray, FloatArray],
    dof: tuple[FloatArray | float, FloatArray | float],
) -> tuple[FloatArray, FloatArray]:
    """``T2 = d^T (V1 + V2)^-1 d`` and the probability that chance exceeds it.

    ``(nu - p + 1)/(nu p) T2`` is taken to follow F with p and nu - p + 1 degrees of freedom, nu
    after K. Krishnamoorthy and J. Yu (2004), Modified Nel and Van der Merwe test for the
    multivariate Behrens-Fisher problem, Stat Probab Lett 66:161-169. In one dimension it is
    Welch's t test.

    `difference` (..., p).
    `covariances` two of (..., p, p): covariances of the two means.
    `dof` two of (...,): degrees of freedom of each covariance; inf if it is known.
    Returns: `T2`, `probability` (...,): nan if the sum of the covariances is singular: some
    direction has no spread.
    """
    total = covariances[0] + covariances[1]
    variance = np.diagonal(total, axis1=-2, axis2=-1)
    sd = np.sqrt(np.where(variance > 0, variance, 1.0))
    # unit diagonal: kg and N/m differ by orders of magnitude
    units = sd[..., :, None] * sd[..., None, :]
    inverse = _inverse(total / units)
    z = difference / sd
    # T2 (...) = z^T (...,p) inverse (..., p, p) z (..., p)
    T2 = np.einsum("...i,...ij,...j->...", z, inverse, z)
    p = difference.shape[-1]
    shares = [covariance / units @ inverse for covariance in covariances]
    spread = [
        np.einsum("...ij,...ji->...", U, U) + np.trace(U, axis1=-2, axis2=-1) ** 2 for U in shares
    ]
    rate = sum(s / f for s, f in zip(spread, dof, strict=True))
    exact = np.broadcast_to(rate == 0, T2.shape)
    nu = (p + p * p) / np.where(exact, 1.0, rate)
    # with few trials: at least one degree of freedom, so that a p value exists
    second = np.maximum(nu - p + 1, 1.0)
    return T2, np.where(exact, chdtrc(p, T2), fdtrc(p, second, T2 * second / (nu * p)))


def _inverse(correlation: FloatArray) -> FloatArray:
    """Inverses of correlation matrices (..., p, p); nan if a matrix is singular."""
    eye = np.eye(correlation.shape[-1])
    regular = np.linalg.det(correlation) != 0
    inverse = np.linalg.inv(np.where(regular[..., None, None], correlation, eye))
    # its diagonal is 1/(1 - R^2) of each element on the others
    inflation = np.diagonal(inverse, axis1=-2, axis2=-1)
    regular &= ((inflation > 0) & (inflation < LARGEST_INFLATION)).all(axis=-1)
    return np.where(regular[..., None, None], inverse, np.nan)


#: The four hypotheses of a pair: equality of each matrix, and of all three.
MATRIX_NAMES: Final = ("inertia", "viscosity", "stiffness", "all")


@dataclass(frozen=True)
class MatrixTest:
    """Difference of two groups' matrices, and its p values.

    `distance`: affine-invariant; nan if a matrix is not positive definite, and for "all".
    `p_distance`: nan like `distance`; for "all" that of the summed squares over their expectations.
    `t2`: Hotelling's ``d^T V^-1 d`` of the symmetric elements; nan with fewer trials than elements.
    `p_distance_adjusted`, `p_t2_adjusted`: by Holm, over all compared pairs.
    """

    matrix: str
    distance: float
    p_distance: float
    t2: float
    p_t2: float
    p_distance_adjusted: float = float("nan")
    p_t2_adjusted: float = float("nan")


@dataclass(frozen=True)
class Statistics:
    """Statistics of R pairs of groups; columns: inertia, viscosity, stiffness, all.

    `t2`, `chance` (R, 4): Hotelling's T2 and its probability; nan if there are too few trials.
    `ratio` (R, 4): squared distance over its expectation by chance; nan if a matrix has no
    distance.
    `distance` (R, 3): affine-invariant.
    """

    t2: FloatArray
    chance: FloatArray
    ratio: FloatArray
    distance: FloatArray


def statistics_between(
    matrices: tuple[FloatArray, FloatArray],
    difference: FloatArray,
    covariances: tuple[FloatArray, FloatArray],
    dof: tuple[FloatArray | float, FloatArray | float],
) -> Statistics:
    """All statistics of pairs of groups.

    `dof` two of (R,).
    `matrices` two of (R, 3, k, k): inertia, viscosity, stiffness of each group.
    `difference` (R, 3 c): differences of the c symmetric elements of each matrix.
    `covariances` two of (R, 3 c, 3 c): covariances of the symmetric elements of each group.
    """
    t2, chance = t2_chances(difference, covariances, dof)
    ratio, distance = distance_ratios(matrices, covariances[0] + covariances[1])
    return Statistics(t2, chance, ratio, distance)


def t2_chances(
    difference: FloatArray,
    covariances: tuple[FloatArray, FloatArray],
    dof: tuple[FloatArray | float, FloatArray | float],
) -> tuple[FloatArray, FloatArray]:
    """`Statistics.t2` and `Statistics.chance`, (R, 4); arguments as in `statistics_between`."""
    c = difference.shape[1] // 3
    parts = [slice(c * i, c * i + c) for i in range(3)] + [slice(0, 3 * c)]
    t2, chance = np.full((2, len(difference), 4), np.nan)
    for i, part in enumerate(parts):
        enough = np.broadcast_to(dof[0] + np.asarray(dof[1]) >= part.stop - part.start, len(t2))
        if enough.all():
            block = (covariances[0][:, part, part], covariances[1][:, part, part])
            t2[:, i], chance[:, i] = hotelling(difference[:, part], block, dof)
        elif enough.any():
            rows = np.flatnonzero(enough)
            dof_of_rows = (
                np.broadcast_to(dof[0], len(t2))[rows],
                np.broadcast_to(dof[1], len(t2))[rows],
            )
            block = (covariances[0][rows, part, part], covariances[1][rows, part, part])
            t2[rows, i], chance[rows, i] = hotelling(difference[rows, part], block, dof_of_rows)
    return t2, chance


def distance_ratios(
    matrices: tuple[FloatArray, FloatArray], total: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """`Statistics.ratio` (R, 4) and `Statistics.distance` (R, 3).

    `matrices` two of (R, 3, k, k).
    `total` (R, 3 c, 3 c): covariance of the difference of the symmetric elements.
    """
    distance = affine_invariant_distance(*matrices)
    c = total.shape[-1] // 3
    ratio = np.full((len(distance), 4), np.nan)
    for i in range(3):
        part = slice(c * i, c * i + c)
        ratio[:, i] = _over_chance(matrices, total[:, part, part], distance, i)
    ratio[:, 3] = ratio[:, :3].sum(axis=1)
    return ratio, distance


def _over_chance(
    matrices: tuple[FloatArray, FloatArray], covariance: FloatArray, distance: FloatArray, i: int
) -> FloatArray:
    """Squared distance over its expectation by chance (`distance.expected_square`), (R,)."""
    middle = (matrices[0][:, i] + matrices[1][:, i]) / 2
    valid = np.isfinite(distance[:, i]) & is_positive_definite(middle)
    result = np.full(len(distance), np.nan)
    result[valid] = distance[valid, i] ** 2 / expected_square(middle[valid], covariance[valid])
    return result


def exceedance(statistic: FloatArray) -> float:
    """p value ``(1 + count)/(1 + R)``: count of R others not below the first value, the data's.

    Missing others count as larger; without the data's value the result is nan.
    """
    observed, others = statistic[0], statistic[1:]
    if not np.isfinite(observed):
        return float("nan")
    # values that differ by rounding only are ties
    beyond = np.isnan(others) | (others >= observed - 1e-9 * abs(observed))
    return float((1 + beyond.sum()) / (1 + len(others)))


def holm(p: ArrayLike) -> FloatArray:
    """Adjusted p values (n,) that keep the level for all n hypotheses together.

    S. Holm (1979), A simple sequentially rejective multiple test procedure, Scand J Stat 6:65-70.
    nan stays nan and is not counted.
    """
    values = np.asarray(p, dtype=np.float64)
    result = np.full(values.shape, np.nan)
    valid = np.flatnonzero(np.isfinite(values))
    order = valid[np.argsort(values[valid], kind="stable")]
    steps = len(order) - np.arange(len(order))
    result[order] = np.minimum(np.maximum.accumulate(values[order] * steps), 1.0)
    return result


def adjusted(tests: list[tuple[MatrixTest, ...]]) -> list[tuple[MatrixTest, ...]]:
    """Adjust the p values of several pairs over the pairs, separately for each matrix."""
    table = [list(pair) for pair in tests]
    for i in range(len(MATRIX_NAMES)):
        distance = holm([pair[i].p_distance for pair in table])
        t2 = holm([pair[i].p_t2 for pair in table])
        for pair, p, q in zip(table, distance, t2, strict=True):
            pair[i] = replace(pair[i], p_distance_adjusted=float(p), p_t2_adjusted=float(q))
    return [tuple(pair) for pair in table]
