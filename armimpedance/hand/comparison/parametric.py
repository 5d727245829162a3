"""The same tests where only estimates with their covariance are left, no trials to exchange."""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.comparison.distance import upper_elements
from armimpedance.hand.comparison.matrix_test import (
    MATRIX_NAMES,
    MatrixTest,
    distance_ratios,
    exceedance,
    statistics_between,
)
from armimpedance.hand.comparison.planar import planar_statistics


def parametric_test(
    first: ImpedanceEstimate,
    second: ImpedanceEstimate,
    *,
    draws: int = 1999,
    seed: int | np.random.SeedSequence = 0,
) -> tuple[MatrixTest, ...]:
    """Test that two independent estimates are of the same matrices.

    T2 against its F distribution (`hotelling`); the distance against pairs drawn from the two
    covariances about one common value (t distributed), as the null hypothesis has it.

    Parameters
    ----------
    first, second : ImpedanceEstimate
        Independent of each other.
    draws : int
        Pairs drawn for the distance.
    seed : int or SeedSequence

    Returns
    -------
    tuple of MatrixTest
        Inertia, viscosity, stiffness, all three together.

    Raises
    ------
    InputError
        Estimates of different axes, or without an error.
    """
    if first.k != second.k:
        raise InputError("groups with different numbers of axes", expected="the same number")
    pair, k = (first, second), first.k
    (x1, V1), (x2, V2) = (symmetric_elements(e) for e in pair)
    check_errors(V1 + V2)
    # The value (c,) from which both are least far: x0 = x1 + V1 (V1 + V2)^-1 (x2 - x1)
    common = x1 + V1 @ np.linalg.lstsq(V1 + V2, x2 - x1, rcond=None)[0]
    found = statistics_between(
        (matrices_of(x1[None], k), matrices_of(x2[None], k)),
        (x2 - x1)[None],
        (V1[None], V2[None]),
        (first.dof, second.dof),
    )
    rng = np.random.default_rng(seed)
    drawn = [_draw(common, V, e.dof, draws, rng) for V, e in zip((V1, V2), pair, strict=True)]
    ratio = np.vstack([found.ratio, _ratios(drawn[0], drawn[1], V1 + V2, k)])
    return tuple(
        MatrixTest(
            matrix=name,
            distance=float(found.distance[0, i]) if i < 3 else float("nan"),
            p_distance=exceedance(ratio[:, i]),
            t2=float(found.t2[0, i]),
            p_t2=float(found.chance[0, i]),
        )
        for i, name in enumerate(MATRIX_NAMES)
    )


def symmetric_elements(estimate: ImpedanceEstimate) -> tuple[FloatArray, FloatArray]:
    """Symmetric elements of M, B, K of an estimate, (3 c,), and their covariance, (3 c, 3 c)."""
    C = np.kron(np.eye(3), upper_elements(estimate.k))
    return C @ estimate.parameters, C @ estimate.covariance @ C.T


def check_errors(total: FloatArray) -> None:
    """Refuse differences (..., 3 c, 3 c) of which one element has no error.

    Raises
    ------
    InputError
    """
    if not (np.diagonal(total, axis1=-2, axis2=-1) > 0).all():
        raise InputError(
            "an estimate without an error: its covariance is zero",
            expected="results of `armimpedance estimate` on two trials or more",
        )


def _ratios(one: FloatArray, two: FloatArray, total: FloatArray, k: int) -> FloatArray:
    """`Statistics.ratio` of pairs drawn, elements (R, 3 c) of both and their covariance."""
    if k != 2:
        stack = np.broadcast_to(total, (len(one), *total.shape))
        return distance_ratios((matrices_of(one, k), matrices_of(two, k)), stack)[0]
    return planar_statistics(one.reshape(-1, 3, 3), two.reshape(-1, 3, 3), total)


def _draw(
    centre: FloatArray, covariance: FloatArray, dof: float, draws: int, rng: np.random.Generator
) -> FloatArray:
    """Multivariate t about a centre (c,), (draws, c)."""
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0))
    normal = rng.standard_normal((draws, len(centre))) @ root.T
    wide = np.sqrt(rng.chisquare(dof, draws) / dof) if np.isfinite(dof) else np.ones(draws)
    return centre + normal / wide[:, None]


def matrices_of(elements: FloatArray, k: int) -> FloatArray:
    """Symmetric matrices (R, 3, k, k) of their elements i <= j (R, 3 c)."""
    rows, columns = np.triu_indices(k)
    parts = elements.reshape(len(elements), 3, len(rows))
    result = np.empty((len(elements), 3, k, k))
    result[..., rows, columns] = parts
    result[..., columns, rows] = parts
    return result
