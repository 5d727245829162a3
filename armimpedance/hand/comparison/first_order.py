"""Tests of many pairs from the estimates' covariances alone, without draws, in blocks.

T2 goes against its F distribution (`hotelling`), which needs no draws. The squared distance of two
matrices ``X -+ D/2`` is the sum over the eigenvalues e of ``X^-1 D`` of ``(2 artanh(e/2))^2``: near
X the quadratic form ``tr(X^-1 D X^-1 D)``. The value X0 from which both estimates are least far
tells nothing about D, so that X is held at X0; then the form is a weighted sum of chi-squares over
one more (`mixture`), with the degrees of freedom of Welch and Satterthwaite.

What the squared distance has beyond the form, it has in the tail too: a distance d is reached by no
form smaller than ``(2 tanh(d/2))^2``, which stands in its place and errs on the careful side.
docs/compare/tests.md has the measured levels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Self

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.comparison.distance import is_positive_definite, metric_at
from armimpedance.hand.comparison.matrix_test import Statistics, statistics_between
from armimpedance.hand.comparison.mixture import mixture_tail
from armimpedance.hand.comparison.parametric import check_errors, matrices_of, symmetric_elements

#: Numbers of one block of pairs: some 20 MB with what is computed on the way.
_BLOCK_NUMBERS: Final = 40_000


@dataclass(frozen=True, eq=False)
class Elements:
    """Symmetric elements of M, B, K of G estimates of k axes, their covariances and dof.

    Attributes
    ----------
    values : (G, m)
    covariances : (G, m, m)
    dof : (G,)
    k : int
    """

    values: FloatArray
    covariances: FloatArray
    dof: FloatArray
    k: int

    @classmethod
    def of(cls, estimates: Sequence[ImpedanceEstimate]) -> Self:
        """Those of estimates of one number of axes."""
        values, covariances = zip(*map(symmetric_elements, estimates), strict=True)
        dof = np.array([each.dof for each in estimates])
        return cls(np.array(values), np.array(covariances), dof, estimates[0].k)

    @property
    def block(self) -> int:
        """Pairs of a block."""
        return int(max(_BLOCK_NUMBERS // self.values.shape[1] ** 2, 1))


def first_order_tests(of: Elements, first: IntArray, second: IntArray) -> FloatArray:
    """Tests of R pairs, (R, 4, 4).

    Parameters
    ----------
    of : Elements
    first, second : (R,)
        Numbers of the estimates of each pair.

    Returns
    -------
    (R, 4, 4)
        Of inertia, viscosity, stiffness and all: distance, its p, T2, its p, as in `MatrixTest`.

    Raises
    ------
    InputError
        A pair without an error.
    """
    x1, x2, V1, V2 = (part[of_] for part in (of.values, of.covariances) for of_ in (first, second))
    check_errors(V1 + V2)
    found = statistics_between(
        (matrices_of(x1, of.k), matrices_of(x2, of.k)),
        x2 - x1,
        (V1, V2),
        (of.dof[first], of.dof[second]),
    )
    common = x1 + (V1 @ np.linalg.solve(V1 + V2, (x2 - x1)[..., None]))[..., 0]
    chance = _distance_chance(found, matrices_of(common, of.k), (V1, V2), of, (first, second))
    distance = np.column_stack([found.distance, np.full(len(first), np.nan)])
    return np.stack([distance, chance, found.t2, found.chance], axis=2)


def _distance_chance(
    found: Statistics,
    common: FloatArray,
    covariances: tuple[FloatArray, FloatArray],
    of: Elements,
    pair: tuple[IntArray, IntArray],
) -> FloatArray:
    """p of the distances, (R, 4); nan where one does not exist."""
    V1, V2 = covariances
    total, c = V1 + V2, V1.shape[-1] // 3
    metric, share = np.zeros_like(total), np.zeros((len(total), 4))
    definite = is_positive_definite(common)
    for i in range(3):
        part = slice(c * i, c * i + c)
        safe = np.where(definite[:, i, None, None], common[:, i], np.eye(of.k))
        g = metric_at(safe)
        # so that the form is one on average, as the statistic is
        size = np.einsum("ref,rfe->r", g, total[:, part, part])
        metric[:, part, part] = g / size[:, None, None]
        share[:, i] = np.einsum("ref,rfe->r", g, V1[:, part, part]) / size
    share[:, 3] = share[:, :3].mean(axis=1)
    dof = 1 / (share**2 / of.dof[pair[0], None] + (1 - share) ** 2 / of.dof[pair[1], None])
    form = _form_of(found)
    parts = [slice(c * i, c * i + c) for i in range(3)] + [slice(0, 3 * c)]
    p = [
        mixture_tail(_weights(metric[:, s, s], total[:, s, s]), dof[:, i], form[:, i])
        for i, s in enumerate(parts)
    ]
    # a common value that is no limb's says nothing against chance
    known = np.column_stack([definite, definite.all(axis=1)])
    return np.where(np.isnan(found.ratio), np.nan, np.where(known, np.column_stack(p), 1.0))


def _form_of(found: Statistics) -> FloatArray:
    """The least quadratic form (R, 4) that belongs to the distances found."""
    d = found.distance
    with np.errstate(divide="ignore", invalid="ignore"):
        # without any distance nothing is smaller
        shrunk = np.where(d > 0, (2 * np.tanh(d / 2) / d) ** 2, 1.0)
    own = found.ratio[:, :3] * shrunk
    return np.column_stack([own, own.sum(axis=1)])


def _weights(metric: FloatArray, covariance: FloatArray) -> FloatArray:
    """Eigenvalues (R, c) of metric times covariance: the weights of the chi-squares."""
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0))[:, None, :]
    return np.asarray(np.linalg.eigvalsh(root.swapaxes(-1, -2) @ metric @ root))
