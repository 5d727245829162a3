"""What a test of two groups' matrices returns, and the correction for many pairs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.hand.comparison.distance import (
    affine_invariant_distance,
    expected_square,
    is_positive_definite,
)
from armimpedance.hand.comparison.hotelling import hotelling

#: The four hypotheses of a pair: each matrix the same, and all three.
MATRIX_NAMES: Final = ("inertia", "viscosity", "stiffness", "all")


@dataclass(frozen=True)
class MatrixTest:
    """How far two groups' matrices are apart, and how often chance makes them so.

    Attributes
    ----------
    matrix : {"inertia", "viscosity", "stiffness", "all"}
    distance : float
        Affine-invariant; nan where a matrix is not positive definite, and for "all".
    p_distance : float
        nan as `distance`; for "all" of the summed squares over their expectations.
    t2 : float
        Hotelling's ``d^T V^-1 d`` of the symmetric elements; nan with fewer trials than elements.
    p_t2 : float
    p_distance_adjusted, p_t2_adjusted : float
        Holm, over all pairs that were compared.
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

    Attributes
    ----------
    t2, chance : (R, 4)
        Hotelling's T2 and its probability; nan where there are too few trials.
    ratio : (R, 4)
        Squared distance over its expectation by chance; nan where a matrix has no distance.
    distance : (R, 3)
        Affine-invariant.
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

    Parameters
    ----------
    matrices : two of (R, 3, k, k)
        Inertia, viscosity, stiffness of each group.
    difference : (R, 3 c)
        Differences of the c symmetric elements of each matrix.
    covariances : two of (R, 3 c, 3 c)
        Covariances of the symmetric elements of each group.
    dof : two of (R,)
    """
    t2, chance = t2_chances(difference, covariances, dof)
    ratio, distance = distance_ratios(matrices, covariances[0] + covariances[1])
    return Statistics(t2, chance, ratio, distance)


def t2_chances(
    difference: FloatArray,
    covariances: tuple[FloatArray, FloatArray],
    dof: tuple[FloatArray | float, FloatArray | float],
) -> tuple[FloatArray, FloatArray]:
    """`Statistics.t2` and `Statistics.chance`, (R, 4), of what `statistics_between` takes."""
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
            each = (np.broadcast_to(dof[0], len(t2))[rows], np.broadcast_to(dof[1], len(t2))[rows])
            block = (covariances[0][rows, part, part], covariances[1][rows, part, part])
            t2[rows, i], chance[rows, i] = hotelling(difference[rows, part], block, each)
    return t2, chance


def distance_ratios(
    matrices: tuple[FloatArray, FloatArray], total: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """`Statistics.ratio` (R, 4) and `Statistics.distance` (R, 3).

    Parameters
    ----------
    matrices : two of (R, 3, k, k)
    total : (R, 3 c, 3 c)
        Covariance of the difference of the symmetric elements.
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
    known = np.isfinite(distance[:, i]) & is_positive_definite(middle)
    result = np.full(len(distance), np.nan)
    result[known] = distance[known, i] ** 2 / expected_square(middle[known], covariance[known])
    return result


def exceedance(statistic: FloatArray) -> float:
    """``(1 + count)/(1 + R)`` of R others at least as large as the first one, the data's.

    Others that do not exist count as larger; where the data's does not exist the answer is nan.
    """
    observed, others = statistic[0], statistic[1:]
    if not np.isfinite(observed):
        return float("nan")
    # up to rounding a tie is a tie
    beyond = np.isnan(others) | (others >= observed - 1e-9 * abs(observed))
    return float((1 + beyond.sum()) / (1 + len(others)))


def holm(p: ArrayLike) -> FloatArray:
    """Adjusted p values (n,) that hold the level for all n hypotheses together.

    S. Holm (1979), A simple sequentially rejective multiple test procedure, Scand J Stat 6:65-70.
    nan stays nan and is not counted.
    """
    values = np.asarray(p, dtype=np.float64)
    result = np.full(values.shape, np.nan)
    known = np.flatnonzero(np.isfinite(values))
    order = known[np.argsort(values[known], kind="stable")]
    steps = len(order) - np.arange(len(order))
    result[order] = np.minimum(np.maximum.accumulate(values[order] * steps), 1.0)
    return result


def adjusted(tests: list[tuple[MatrixTest, ...]]) -> list[tuple[MatrixTest, ...]]:
    """The tests of several pairs with p values adjusted over the pairs, each matrix by itself."""
    table = [list(pair) for pair in tests]
    for i in range(len(MATRIX_NAMES)):
        distance = holm([pair[i].p_distance for pair in table])
        t2 = holm([pair[i].p_t2 for pair in table])
        for pair, p, q in zip(table, distance, t2, strict=True):
            pair[i] = replace(pair[i], p_distance_adjusted=float(p), p_t2_adjusted=float(q))
    return [tuple(pair) for pair in table]
