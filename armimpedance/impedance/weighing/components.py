"""Variance components: a covariance as a sum of known shapes, each with an unknown size.

``Sigma = F + sum_j S_j (x) C_j`` with C_j (n, n) over time known, S_j (d, d) over axes unknown,
positive semidefinite, F fixed. Gaussian likelihood, by the minorise-maximise iteration of Zhou,
Hu, Zhou & Lange, "MM algorithms for variance components models", J Comput Graph Stat 28 (2019)
350-361: each step keeps S_j positive semidefinite and never lowers the likelihood.
"""

from __future__ import annotations

import numpy as np

from armimpedance.arrays import BoolArray, FloatArray
from armimpedance.errors import InputError


def fit_components(
    moment: FloatArray,
    shapes: FloatArray,
    fixed: FloatArray,
    *,
    isotropic: BoolArray,
    start: FloatArray | None = None,
    steps: int = 25,
) -> FloatArray:
    """Sizes S_j (J, d, d) of the components.

    Parameters
    ----------
    moment : (d n, d n)
        Mean of ``r r^T`` over trials, axis by axis: rows ``[axis 1, modes], [axis 2, modes] ...``.
    shapes : (J, n, n)
        C_j, positive semidefinite; together with `fixed` they must make Sigma regular.
    fixed : (d n, d n)
        F.
    isotropic : (J,) bool
        Components whose S_j is a multiple of the identity.
    start : (J, d, d), optional
        Default: an equal share of the total variance for each.
    steps : int
        Iterations; their number is fixed so that the same data give the same bits.

    Raises
    ------
    InputError
        Shapes that do not belong together.
    """
    J, n, _ = shapes.shape
    d = len(moment) // n
    if moment.shape != (d * n, d * n) or fixed.shape != moment.shape or len(isotropic) != J:
        raise InputError(f"moment {moment.shape}, shapes {shapes.shape}, fixed {fixed.shape}")
    sizes = _equal_shares(moment, shapes, fixed, d) if start is None else start
    flat = shapes.reshape(J, n * n)
    for _ in range(steps):
        V: FloatArray = np.asarray(np.linalg.inv(total_covariance(sizes, shapes, fixed)))
        # gradient of -2 log likelihood in S_j: tr over time of C_j (V - V R V)
        expected = _traces(flat, V, d, isotropic)
        observed = _traces(flat, V @ moment @ V, d, isotropic)
        sizes = _step(sizes, expected, observed)
    return sizes


def total_covariance(sizes: FloatArray, shapes: FloatArray, fixed: FloatArray) -> FloatArray:
    """``F + sum_j S_j (x) C_j``, (d n, d n)."""
    J, n, _ = shapes.shape
    d = sizes.shape[1]
    # (d d, J) (J, n n) -> [a, b, i, j] -> [a, i, b, j]
    blocks = (sizes.reshape(J, d * d).T @ shapes.reshape(J, n * n)).reshape(d, d, n, n)
    return fixed + blocks.transpose(0, 2, 1, 3).reshape(d * n, d * n)


def _equal_shares(moment: FloatArray, shapes: FloatArray, fixed: FloatArray, d: int) -> FloatArray:
    excess = max(float(np.trace(moment - fixed)), 1e-6 * float(np.trace(moment))) / d
    share = excess / len(shapes) / np.maximum(np.trace(shapes, axis1=1, axis2=2), 1e-300)
    return np.asarray(share[:, None, None] * np.eye(d))


def _traces(flat: FloatArray, matrix: FloatArray, d: int, isotropic: BoolArray) -> FloatArray:
    """``[j, a, b] = sum_ik C_j[i, k] matrix[a, i, b, k]``, (J, d, d), symmetric."""
    n = len(matrix) // d
    blocks = matrix.reshape(d, n, d, n).transpose(0, 2, 1, 3).reshape(d * d, n * n)
    found = (flat @ blocks.T).reshape(-1, d, d)
    found = (found + found.transpose(0, 2, 1)) / 2
    mean = np.trace(found[isotropic], axis1=1, axis2=2) / d
    found[isotropic] = mean[:, None, None] * np.eye(d)
    return found


def _step(sizes: FloatArray, expected: FloatArray, observed: FloatArray) -> FloatArray:
    """Twice the step of the iteration along the geodesic: ``S' S^-1 S'``.

    The plain step is the symmetric S' with ``S' E S' = S O S``; for a single component the doubled
    one is the solution itself.
    """
    root = _root(expected)
    back = np.linalg.inv(root)
    moved = back @ _root(root @ sizes @ observed @ sizes @ root) @ back
    moved = (moved + moved.transpose(0, 2, 1)) / 2
    traces = np.trace(sizes, axis1=1, axis2=2)[:, None, None]
    regular = sizes + (1e-9 * traces + 1e-300) * np.eye(sizes.shape[1])
    doubled = moved @ np.linalg.solve(regular, moved)
    return np.asarray((doubled + doubled.transpose(0, 2, 1)) / 2)


def _root(stack: FloatArray) -> FloatArray:
    """Symmetric square roots of positive semidefinite matrices (J, d, d)."""
    if stack.shape[1] == 2:
        return _root_of_two(stack)
    values, vectors = np.linalg.eigh((stack + stack.transpose(0, 2, 1)) / 2)
    floor = 1e-14 * np.abs(values).max(axis=1, keepdims=True) + 1e-300
    roots = np.sqrt(np.maximum(values, floor))
    return np.asarray((vectors * roots[:, None, :]) @ vectors.transpose(0, 2, 1))


def _root_of_two(stack: FloatArray) -> FloatArray:
    """The same for d = 2: ``(A + sqrt(det A) I) / sqrt(tr A + 2 sqrt(det A))``."""
    trace = stack[:, 0, 0] + stack[:, 1, 1]
    det = stack[:, 0, 0] * stack[:, 1, 1] - stack[:, 0, 1] * stack[:, 1, 0]
    # rounding may leave a vanishing eigenvalue negative
    inner = np.sqrt(np.maximum(det, 1e-28 * trace**2 + 1e-300))
    result = (stack + stack.transpose(0, 2, 1)) / 2
    result[:, 0, 0] += inner
    result[:, 1, 1] += inner
    return np.asarray(result / np.sqrt(trace + 2 * inner)[:, None, None])
