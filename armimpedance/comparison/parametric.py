"""The same tests where only estimates with their covariance are left, no trials to exchange."""

from __future__ import annotations

import numpy as np

from armimpedance.arrays import FloatArray
from armimpedance.comparison.distance import upper_elements
from armimpedance.comparison.matrix_test import (
    MATRIX_NAMES,
    MatrixTest,
    exceedance,
    statistics_between,
)
from armimpedance.errors import InputError
from armimpedance.records import ImpedanceEstimate


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
    C = np.kron(np.eye(3), upper_elements(k))
    x1, x2 = (C @ e.parameters for e in pair)
    V1, V2 = (C @ e.covariance @ C.T for e in pair)
    if not (np.diagonal(V1 + V2) > 0).all():
        raise InputError(
            "an estimate without an error: its covariance is zero",
            expected="results of `armimpedance estimate` on two trials or more",
        )
    # The value (c,) from which both are least far: x0 = x1 + V1 (V1 + V2)^-1 (x2 - x1)
    common = x1 + V1 @ np.linalg.lstsq(V1 + V2, x2 - x1, rcond=None)[0]
    rng = np.random.default_rng(seed)
    drawn = [_draw(common, V, e.dof, draws, rng) for V, e in zip((V1, V2), pair, strict=True)]
    one, two = (np.vstack([x, d]) for x, d in zip((x1, x2), drawn, strict=True))
    shape = (len(one), *V1.shape)
    found = statistics_between(
        (_matrices(one, k), _matrices(two, k)),
        two - one,
        (np.broadcast_to(V1, shape), np.broadcast_to(V2, shape)),
        (first.dof, second.dof),
    )
    return tuple(
        MatrixTest(
            matrix=name,
            distance=float(found.distance[0, i]) if i < 3 else float("nan"),
            p_distance=exceedance(found.ratio[:, i]),
            t2=float(found.t2[0, i]),
            p_t2=float(found.chance[0, i]),
        )
        for i, name in enumerate(MATRIX_NAMES)
    )


def _draw(
    centre: FloatArray, covariance: FloatArray, dof: float, draws: int, rng: np.random.Generator
) -> FloatArray:
    """Multivariate t about a centre (c,), (draws, c)."""
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0))
    normal = rng.standard_normal((draws, len(centre))) @ root.T
    wide = np.sqrt(rng.chisquare(dof, draws) / dof) if np.isfinite(dof) else np.ones(draws)
    return centre + normal / wide[:, None]


def _matrices(elements: FloatArray, k: int) -> FloatArray:
    """Symmetric matrices (R, 3, k, k) of their elements i <= j (R, 3 c)."""
    rows, columns = np.triu_indices(k)
    parts = elements.reshape(len(elements), 3, len(rows))
    result = np.empty((len(elements), 3, k, k))
    result[..., rows, columns] = parts
    result[..., columns, rows] = parts
    return result
