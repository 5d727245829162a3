"""Variance components: a covariance as a sum of known shapes, each with an unknown size.

``Sigma = F + sum_j S_j (x) C_j`` with C_j (n, n) over time known, S_j (d, d) over axes unknown,
positive semidefinite, F fixed. Gaussian likelihood, by the minorise-maximise iteration of Zhou,
Hu, Zhou & Lange, "MM algorithms for variance components models", J Comput Graph Stat 28 (2019)
350-361: each step keeps S_j positive semidefinite and never lowers the likelihood.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.linalg import lapack

from armimpedance.core.arrays import BoolArray, FloatArray, by_axis
from armimpedance.core.errors import InputError
from armimpedance.core.records import Window

#: Rounds of the fit to noise that is equal in all axes: more of them gain little.
_ROUNDS: Final = 3
#: Largest extrapolation in that fit, in steps.
_LONGEST: Final = 8.0
#: Largest change of the logarithm of a size in one step.
_MOST: Final = 20.0
#: Signs of the elements of an adjugate of two rows.
_ADJUGATE: Final = np.array([[1.0, -1.0], [-1.0, 1.0]])


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

    `moment` (d n, d n): mean of ``r r^T`` over trials, axis by axis: rows ``[axis 1, modes], [axis
    2, modes] ...``.
    `shapes` (J, n, n): C_j, positive semidefinite; together with `fixed` they must make Sigma
    regular.
    `fixed` (d n, d n): F.
    `isotropic` (J,) bool: components whose S_j is a multiple of the identity.
    `start` (J, d, d): default: sizes for noise that is equal in all axes.
    `steps`: iterations; their number is fixed so that the same data give the same bits.
    Raises InputError: shapes that do not belong together.
    """
    J, n, _ = shapes.shape
    d = len(moment) // n
    if moment.shape != (d * n, d * n) or fixed.shape != moment.shape or len(isotropic) != J:
        raise InputError(f"moment {moment.shape}, shapes {shapes.shape}, fixed {fixed.shape}")
    flat = shapes.reshape(J, n * n)
    if start is None:
        alike = _alike(_mean_axis(moment, d), flat, _mean_axis(fixed, d))
        start = alike[:, None, None] * np.eye(d)
    sizes = start
    for _ in range(steps):
        V = _inverse(total_covariance(sizes, shapes, fixed))[0]
        # gradient of -2 log likelihood in S_j: tr over time of C_j (V - V R V)
        expected, observed = _traces(flat, (V, V @ moment @ V), d, isotropic)
        sizes = _step(sizes, expected, observed)
    return sizes


def total_covariance(sizes: FloatArray, shapes: FloatArray, fixed: FloatArray) -> FloatArray:
    """``F + sum_j S_j (x) C_j``, (d n, d n)."""
    J, n, _ = shapes.shape
    d = sizes.shape[1]
    # (d d, J) (J, n n) -> [a, b, i, j] -> [a, i, b, j]
    blocks = (sizes.reshape(J, d * d).T @ shapes.reshape(J, n * n)).reshape(d, d, n, n)
    return fixed + blocks.transpose(0, 2, 1, 3).reshape(d * n, d * n)


def _inverse(covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Inverse (m, m) of a covariance, and logarithms whose sum is half its log determinant."""
    factor, failed = lapack.dpotrf(covariance.T, lower=1)
    if failed:
        # Rounding has made an eigenvalue of a nearly singular matrix zero or negative.
        values = np.abs(np.linalg.eigvalsh(covariance))
        return np.asarray(np.linalg.inv(covariance)), np.log(values + 1e-300) / 2
    logarithms = np.log(factor.diagonal())
    half = lapack.dpotri(factor, lower=1, overwrite_c=1)[0]
    # the other half holds zeros
    whole = half + half.T
    whole.flat[:: len(whole) + 1] /= 2
    return whole, logarithms


def _mean_axis(matrix: FloatArray, d: int) -> FloatArray:
    """Mean (n, n) over axes of the blocks on the diagonal of (d n, d n)."""
    n = len(matrix) // d
    return np.asarray(np.einsum("aiaj->ij", matrix.reshape(d, n, d, n)) / d)


def _alike(moment: FloatArray, flat: FloatArray, fixed: FloatArray) -> FloatArray:
    """Sizes (J,) for noise that is equal and independent in all axes, as a start.

    The same iteration on (n, n), where it costs an eighth. The extrapolation follows from two steps
    and the change between them (SQUAREM: Varadhan & Roland, Scand J Stat 35 (2008) 335-353, on the
    logarithms). If it does not increase the likelihood, two plain steps are taken.
    """

    def judged(sizes: FloatArray) -> tuple[float, FloatArray]:
        """Return -2 log likelihood, and the logarithm of the factor of the step for each size."""
        V, logarithms = _inverse(fixed + (sizes @ flat).reshape(fixed.shape))
        expected, observed = np.stack([V, V @ moment @ V]).reshape(2, -1) @ flat.T
        change = np.log(np.maximum(observed, 1e-300) / np.maximum(expected, 1e-300))
        return 2 * logarithms.sum() + float(np.vdot(V, moment)), np.clip(change, -_MOST, _MOST)

    sizes = _equal_shares(moment, flat, fixed)
    for _ in range(_ROUNDS):
        first = judged(sizes)[1]
        once = sizes * np.exp(first)
        loss, second = judged(once)
        bend = second - first
        length = float(np.linalg.norm(first)) / max(float(np.linalg.norm(bend)), 1e-300)
        length = min(max(length, 1.0), _LONGEST)
        step = np.clip(2 * length * first + length**2 * bend, -_MOST, _MOST)
        extrapolated = sizes * np.exp(step)
        extrapolated_loss, third = judged(extrapolated)
        sizes = extrapolated * np.exp(third) if extrapolated_loss <= loss else once * np.exp(second)
    return sizes


def _equal_shares(moment: FloatArray, flat: FloatArray, fixed: FloatArray) -> FloatArray:
    """Sizes (J,) that share the variance evenly."""
    n = len(moment)
    excess = max(float(np.trace(moment - fixed)), 1e-6 * float(np.trace(moment)))
    traces = flat[:, :: n + 1].sum(axis=1)
    return np.asarray(excess / len(flat) / np.maximum(traces, 1e-300))


def _traces(
    flat: FloatArray, matrices: tuple[FloatArray, ...], d: int, isotropic: BoolArray
) -> FloatArray:
    """Traces ``[m, j, a, b] = sum_ik C_j[i, k] matrix[m, a, i, b, k]`` of symmetric matrices."""
    n = len(matrices[0]) // d
    pairs = [(a, b) for a in range(d) for b in range(a, d)]
    blocks = np.empty((len(matrices), len(pairs), n, n))
    for own, matrix in zip(blocks, matrices, strict=True):
        for block, (a, b) in zip(own, pairs, strict=True):
            block[:] = matrix[a * n : (a + 1) * n, b * n : (b + 1) * n]
    sums = (blocks.reshape(-1, n * n) @ flat.T).reshape(len(matrices), len(pairs), -1)
    traces = np.empty((len(matrices), len(flat), d, d))
    for pair, (a, b) in enumerate(pairs):
        traces[:, :, a, b] = traces[:, :, b, a] = sums[:, pair]
    mean = np.einsum("mjaa->mj", traces) / d
    alike = mean[:, :, None, None] * np.eye(d)
    return np.where(isotropic[:, None, None], alike, traces)


def _step(sizes: FloatArray, expected: FloatArray, observed: FloatArray) -> FloatArray:
    """Twice the step of the iteration along the geodesic: ``S' S^-1 S'``.

    The plain step is the symmetric S' with ``S' E S' = S O S``; for a single component the doubled
    step is the solution itself.
    """
    middle = _middle_of_two if sizes.shape[1] == 2 else _middle
    moved = middle(expected, sizes @ observed @ sizes)
    size = np.einsum("jaa->j", sizes)[:, None, None] + 1e-300
    regular = sizes / size + 1e-9 * np.eye(sizes.shape[1])
    doubled = moved @ np.linalg.solve(regular, moved / size)
    return np.asarray((doubled + doubled.transpose(0, 2, 1)) / 2)


def _middle(expected: FloatArray, target: FloatArray) -> FloatArray:
    """Symmetric X (J, d, d) with ``X E X = T``, the geometric mean of E^-1 and T."""
    root = _root(expected)
    back = np.linalg.inv(root)
    moved = back @ _root(root @ target @ root) @ back
    return np.asarray((moved + moved.transpose(0, 2, 1)) / 2)


def _middle_of_two(expected: FloatArray, target: FloatArray) -> FloatArray:
    """The same for d = 2: ``(sqrt(det T / det E) adj E + T) / sqrt(tr E T + 2 sqrt(det E det T))``.

    By the theorem of Cayley and Hamilton, as for the root of a matrix of two rows.
    """
    roots = []
    for stack in (expected, target):
        first, last = stack[:, 0, 0], stack[:, 1, 1]
        # rounding may leave a vanishing eigenvalue negative
        least = 1e-28 * (first + last) ** 2 + 1e-300
        roots.append(np.sqrt(np.maximum(first * last - stack[:, 0, 1] * stack[:, 1, 0], least)))
    adjugate = expected[:, ::-1, ::-1] * _ADJUGATE
    below = np.einsum("jab,jba->j", expected, target) + 2 * roots[0] * roots[1]
    ratio = roots[1] / roots[0]
    return np.asarray((ratio[:, None, None] * adjugate + target) / np.sqrt(below)[:, None, None])


def _root(stack: FloatArray) -> FloatArray:
    """Symmetric square roots of positive semidefinite matrices (J, d, d)."""
    values, vectors = np.linalg.eigh((stack + stack.transpose(0, 2, 1)) / 2)
    floor = 1e-14 * np.abs(values).max(axis=1, keepdims=True) + 1e-300
    roots = np.sqrt(np.maximum(values, floor))
    return np.asarray((vectors * roots[:, None, :]) @ vectors.transpose(0, 2, 1))


# Is there any noise for weights? Simulations may have none, a measurement always has some.

#: A trial is silent if the force before the onset changes by less than this share of the response.
#: The noise of force sensors and of people is some hundreds of times as large.
SILENT: Final = 1e-4


def is_silent(window: Window) -> bool:
    """True if the force of every trial is constant before the onset, without any noise.

    Weights from residuals would then follow the misfit of the model, such as the curvature of the
    limb's law, as if it were noise.
    """
    rest = window.lag_s <= 0
    if rest.sum() < 3:
        return False
    force = by_axis(window.force)[np.tile(window.usable, window.axes)]
    force -= force[:, rest].mean(axis=1, keepdims=True)
    away = np.abs(force, out=force)
    return bool(away[:, rest].max() < SILENT * away.max())
