"""The affine-invariant distance between positive-definite matrices, and its expected square.

``d(A, B) = || log(A^-1/2 B A^-1/2) ||_F``, the root of the summed squares of the logarithms of the
eigenvalues of ``A^-1 B``: the same in every frame and unit, ``d(A, B) = d(A^-1, B^-1)``
(Pennec, Fillard and Ayache 2006, A Riemannian framework for tensor computing, Int J Comput Vis
66:41-66). A matrix that is half as stiff is as far away as one that is twice as stiff.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError


def affine_invariant_distance(first: ArrayLike, second: ArrayLike) -> FloatArray:
    """Distance of the symmetric parts of matrices (..., k, k), (...,).

    nan where one of the two is not positive definite: it has no place among such matrices.

    Raises
    ------
    InputError
        Matrices that are not square or not of the same size.
    """
    A, B = (symmetric(np.asarray(m, dtype=np.float64)) for m in (first, second))
    if A.shape[-2:] != B.shape[-2:]:
        raise InputError(f"matrices {A.shape[-2:]} and {B.shape[-2:]}", expected="the same size")
    A, B = np.broadcast_arrays(A, B)
    known = is_positive_definite(A) & is_positive_definite(B)
    result = np.full(known.shape, np.nan)
    if known.any():
        # L^-1 B L^-T (k, k) with A = L L^T has the eigenvalues of A^-1 B
        inverse = np.linalg.inv(np.linalg.cholesky(A[known]))
        between = inverse @ B[known] @ inverse.swapaxes(-1, -2)
        values = np.linalg.eigvalsh(symmetric(between))
        result[known] = np.sqrt((np.log(np.maximum(values, np.finfo(float).tiny)) ** 2).sum(-1))
    return result


def expected_square(middle: ArrayLike, covariance: ArrayLike) -> FloatArray:
    """Expected squared distance, to first order, of two matrices that differ by chance alone.

    ``E tr(P^-1 D P^-1 D)`` for a difference D whose elements have this covariance.

    Parameters
    ----------
    middle : (..., k, k)
        P, positive definite.
    covariance : (..., c, c)
        Covariance of the c = k (k + 1)/2 elements ``D_ij, i <= j`` (`upper_elements`).

    Returns
    -------
    (...,)
    """
    metric = metric_at(np.asarray(middle, dtype=np.float64))
    return np.asarray(np.einsum("...ef,...fe->...", metric, np.asarray(covariance)))


def metric_at(middle: FloatArray) -> FloatArray:
    """``g_ef = tr(P^-1 E_e P^-1 E_f)`` (..., c, c): the squared distance near P (..., k, k).

    E_e is the symmetric matrix of which the element e of `upper_elements` is one.
    """
    P = symmetric(middle)
    basis = _symmetric_basis(P.shape[-1])
    moved = np.linalg.inv(P)[..., None, :, :] @ basis
    return np.asarray(np.einsum("...eij,...fji->...ef", moved, moved))


def symmetric(matrices: FloatArray) -> FloatArray:
    """Symmetric part of matrices (..., k, k)."""
    return (matrices + matrices.swapaxes(-1, -2)) / 2


def is_positive_definite(matrices: FloatArray) -> np.ndarray:
    """Whether the symmetric part of each is positive definite, (...,)."""
    return np.asarray(np.linalg.eigvalsh(symmetric(matrices))[..., 0] > 0)


def upper_elements(k: int) -> FloatArray:
    """Map (c, k^2) from A (k^2,), row by row, to the elements i <= j of its symmetric part."""
    basis = _symmetric_basis(k)
    # the element ij of the symmetric part is half the sum of A_ij and A_ji
    return np.asarray(basis / basis.sum(axis=(1, 2), keepdims=True)).reshape(len(basis), k * k)


def _symmetric_basis(k: int) -> FloatArray:
    """Symmetric matrices (c, k, k) of which one element i <= j is one, the others zero."""
    rows, columns = np.triu_indices(k)
    basis = np.zeros((len(rows), k, k))
    basis[np.arange(len(rows)), rows, columns] = 1.0
    basis[np.arange(len(rows)), columns, rows] = 1.0
    return basis
