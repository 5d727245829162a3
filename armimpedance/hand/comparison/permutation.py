"""Permutation tests of equal matrices: trials are exchanged within each disturbance.

Each trial is represented by its small equation ``b_t - A_t theta = 0``, so that a permutation costs
two solves of 3 k^2 unknowns without the samples. There are two statistics, for inertia, viscosity
and stiffness and for all three together:

- *T2*: the probability of Hotelling's T2 of the difference of the symmetric elements, with each
  group's own clustered covariance;
- *distance*: the squared affine-invariant distance over its expectation by chance under those
covariances (for all three matrices the sum).

Both are computed anew, covariances included, in every permutation. Exchanging trials gives both
groups the same noise; a plain difference then keeps its level only with equal numbers of trials. A
statistic whose distribution does not depend on the noise keeps it anyway (E. Chung and J. P. Romano
2013, Exact and asymptotically robust permutation tests, Ann Stat 41:484-507) and stays exact where
trials are exchangeable. T2 itself depends, with nine elements and a dozen noisy trials, on how well
its covariance is known; its probability does so to the next order only (R. Beran 1988, Prepivoting
test statistics, J Am Stat Assoc 83:687-697). See docs/evidence/compare.md for the measured levels.
"""

from __future__ import annotations

from math import comb
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import BoolArray, FloatArray, IntArray
from armimpedance.core.errors import InputError, NotIdentifiableError, check_number
from armimpedance.hand.comparison.matrix_test import (
    MATRIX_NAMES,
    MatrixTest,
    Statistics,
    distance_ratios,
    exceedance,
    symmetric,
    t2_chances,
    upper_elements,
)
from armimpedance.numerics.regression import WORST_CONDITION, TrialEquations

# Ratios of squared distances to their expectation, for two axes, in closed form.
# `distance` computes them by eigenvalues for any size. For two axes a few products are enough, so
# that a draw or a permutation costs a fraction of a microsecond.


def planar_statistics(first: FloatArray, second: FloatArray, covariance: FloatArray) -> FloatArray:
    """Ratios of M, B and K, and their sum, for R pairs of groups.

    `first`, `second` (R, 3, 3): elements 11, 12, 22 of each of the three matrices.
    `covariance` (R, 9, 9) or (9, 9): of the difference of all of them.
    Returns: (R, 4): nan if a matrix is not positive definite.
    """
    parts = [slice(3 * i, 3 * i + 3) for i in range(3)]
    ratios = [
        planar_ratios(first[:, i], second[:, i], covariance[..., part, part])
        for i, part in enumerate(parts)
    ]
    return np.column_stack([*ratios, np.sum(ratios, axis=0)])


def planar_ratios(first: FloatArray, second: FloatArray, covariance: FloatArray) -> FloatArray:
    """Squared affine-invariant distance over its expectation by chance, for R pairs of matrices.

    `first`, `second` (R, 3): elements 11, 12, 22 of the symmetric matrices.
    `covariance` (R, 3, 3) or (3, 3): of the difference of these elements.
    Returns: (R,): nan if one of the two is not positive definite.
    """
    a, b, c = np.ascontiguousarray(first.T)
    A, B, C = np.ascontiguousarray(second.T)
    # indefinite matrices divide by zero here; they are set to nan at the end
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
    Mohr's circle over ``exp(g)``, which keeps its digits if both eigenvalues are near 1.
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


#: Numbers in memory for one batch of permutations.
_BATCH_NUMBERS: Final = 2_000_000


def permutation_test(
    first: TrialEquations,
    second: TrialEquations,
    *,
    strata: tuple[ArrayLike, ArrayLike] | None = None,
    permutations: int = 1999,
    seed: int | np.random.SeedSequence = 0,
) -> tuple[MatrixTest, ...]:
    """Test equality of inertia, viscosity, stiffness, and all three, of two groups of trials.

    ``p = (1 + count)/(1 + permutations)``, where count is the number of permutations whose
    statistic is at least the data's. A permutation with a matrix that is not positive definite is
    included in the count.

    Parameters
    ----------
    first, second : TrialEquations
        Equations for M, B, K row by row, without the handle (`groups.without_handle`).
    strata : (T1,), (T2,), optional
        Disturbance of each trial: trials are exchanged within equal numbers only.
    permutations : int
    seed : int or SeedSequence

    Returns
    -------
    tuple of MatrixTest
        Inertia, viscosity, stiffness, all three together.

    Raises
    ------
    InputError
        A group of one trial, fewer than one permutation, or groups of different axes.
    NotIdentifiableError
        A permutation gives a group that does not determine its parameters.
    """
    _check(first, second, permutations)
    labels = None if strata is None else np.concatenate([np.asarray(s) for s in strata])
    member = np.arange(first.n_clusters + second.n_clusters) < first.n_clusters
    others = permuted_members(member, labels, permutations, np.random.default_rng(seed))
    statistics = statistics_of(
        np.concatenate([first.A, second.A]),
        np.concatenate([first.b, second.b]),
        np.vstack([member, others]),
    )
    return tuple(
        MatrixTest(
            matrix=name,
            distance=float(statistics.distance[0, i]) if i < 3 else float("nan"),
            p_distance=exceedance(statistics.ratio[:, i]),
            t2=float(statistics.t2[0, i]),
            p_t2=exceedance(-statistics.chance[:, i]),
        )
        for i, name in enumerate(MATRIX_NAMES)
    )


def permuted_members(
    member: BoolArray, strata: IntArray | None, count: int, rng: np.random.Generator
) -> BoolArray:
    """Masks (count, T) of the first group's trials in each of `count` permutations.

    Every stratum keeps its number of members of the first group.
    """
    labels = np.zeros(len(member), dtype=np.int64) if strata is None else strata
    result = np.empty((count, len(member)), dtype=bool)
    for label in np.unique(labels):
        inside = np.flatnonzero(labels == label)
        rows = np.broadcast_to(member[inside], (count, len(inside)))
        result[:, inside] = rng.permuted(rows, axis=1)
    return result


def arrangements(member: BoolArray, strata: IntArray | None) -> int:
    """Number of different permutations: no p value can be below its inverse."""
    labels = np.zeros(len(member), dtype=np.int64) if strata is None else strata
    total = 1
    for label in np.unique(labels):
        inside = member[labels == label]
        total *= comb(len(inside), int(inside.sum()))
    return total


def statistics_of(A: FloatArray, b: FloatArray, members: BoolArray) -> Statistics:
    """Statistics of assignments `members` (R, T) of trials with equations A (T, n, n), b (T, n).

    With two axes `distance` is that of the first assignment, the data's; for others it may be nan.
    """
    diagonal = np.abs(np.diagonal(A.sum(axis=0)))
    scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    scaled_A, scaled_b = A * scale[:, None] * scale, b * scale
    size = max(_BATCH_NUMBERS // b.size, 1)
    parts = [
        _batch(scaled_A, scaled_b, scale, members[start : start + size])
        for start in range(0, len(members), size)
    ]
    return Statistics(
        *(
            np.concatenate([getattr(part, name) for part in parts])
            for name in ("t2", "chance", "ratio", "distance")
        )
    )


def _batch(A: FloatArray, b: FloatArray, scale: FloatArray, members: BoolArray) -> Statistics:
    k = round(np.sqrt(len(scale) / 3))
    # symmetric elements (3 c,) = C (3 c, n) theta (n,)
    C = np.kron(np.eye(3), upper_elements(k)) * scale
    first, V1 = _solve_group(A, b, C, members)
    second, V2 = _solve_group(A, b, C, ~members)
    matrices = tuple((theta * scale).reshape(-1, 3, k, k) for theta in (first, second))
    dof = members.sum(axis=1) - 1, (~members).sum(axis=1) - 1
    difference = (second - first) @ C.T
    t2, chance = t2_chances(difference, (V1, V2), dof)
    # the first row may be the data, whose distance is reported; for others the ratio is enough
    exact = 1 if k == 2 else len(members)
    head = tuple(m[:exact] for m in matrices)
    ratio, distance = distance_ratios(head, (V1 + V2)[:exact])  # type: ignore[arg-type]
    if exact < len(members):
        elements = [m[exact:, :, [0, 0, 1], [0, 1, 1]] for m in map(symmetric, matrices)]
        rest = planar_statistics(elements[0], elements[1], (V1 + V2)[exact:])
        ratio = np.vstack([ratio, rest])
        distance = np.vstack([distance, np.full((len(rest), 3), np.nan)])
    return Statistics(t2, chance, ratio, distance)


def _solve_group(
    A: FloatArray, b: FloatArray, C: FloatArray, members: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Parameters (R, n) and clustered covariance of C theta, (R, m, m), of R sets of trials."""
    T, n = b.shape
    w = members.astype(np.float64)
    # (sum_t w_t A_t) (n, n) theta (n,) = sum_t w_t b_t (n,), for all assignments
    inverse = _inverse((w @ A.reshape(T, n * n)).reshape(-1, n, n))
    theta = (inverse @ (w @ b)[..., None])[..., 0]
    scores = b - (theta @ A.reshape(T * n, n).T).reshape(-1, T, n)
    moved = scores @ (C @ inverse).swapaxes(-1, -2)
    count = w.sum(axis=1)
    moved *= (w * np.sqrt(count / (count - 1))[:, None])[..., None]
    # V (m, m) = N/(N - 1) sum_t (C H^-1 s_t)(C H^-1 s_t)^T, CR1
    return theta, moved.swapaxes(-1, -2) @ moved


def _inverse(total: FloatArray) -> FloatArray:
    """Inverses of a stack (R, n, n) with diagonals near 1."""
    try:
        inverse = np.asarray(np.linalg.inv(total), dtype=np.float64)
    except np.linalg.LinAlgError:
        inverse = np.full_like(total, np.inf)
    norms = np.abs(total).sum(axis=-2).max(axis=-1) * np.abs(inverse).sum(axis=-2).max(axis=-1)
    if not (norms < WORST_CONDITION).all():
        raise NotIdentifiableError(
            "exchanging trials between the groups leaves one that does not determine its "
            "parameters: more trials are needed, or direction_deg in trials.csv for every trial"
        )
    return np.asarray(inverse)


def _check(first: TrialEquations, second: TrialEquations, permutations: int) -> None:
    if min(first.n_clusters, second.n_clusters) < 2:
        raise InputError("a group of one trial", expected="two trials or more in each group")
    if len(first.names) != len(second.names):
        raise InputError("groups with different numbers of axes", expected="the same number")
    check_number(permutations, f"{permutations} permutations", low=1)
