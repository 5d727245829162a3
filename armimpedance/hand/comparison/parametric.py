"""Tests from estimates and their covariances alone, without trials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Self

import numpy as np
from scipy.special import ndtr

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.comparison.matrix_test import (
    MATRIX_NAMES,
    MatrixTest,
    Statistics,
    distance_ratios,
    exceedance,
    is_positive_definite,
    metric_at,
    statistics_between,
    upper_elements,
)
from armimpedance.hand.comparison.permutation import planar_statistics


def parametric_test(
    first: ImpedanceEstimate,
    second: ImpedanceEstimate,
    *,
    draws: int = 1999,
    seed: int | np.random.SeedSequence = 0,
) -> tuple[MatrixTest, ...]:
    """Test the hypothesis that two independent estimates have the same matrices.

    T2 is compared with its F distribution (`hotelling`); the distance with pairs drawn from the two
    covariances about one common value (t distributed), as under the null hypothesis.

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
    # the common value (c,) nearest to both: x0 = x1 + V1 (V1 + V2)^-1 (x2 - x1)
    common = x1 + V1 @ np.linalg.lstsq(V1 + V2, x2 - x1, rcond=None)[0]
    statistics = statistics_between(
        (matrices_of(x1[None], k), matrices_of(x2[None], k)),
        (x2 - x1)[None],
        (V1[None], V2[None]),
        (first.dof, second.dof),
    )
    rng = np.random.default_rng(seed)
    drawn = [_draw(common, V, e.dof, draws, rng) for V, e in zip((V1, V2), pair, strict=True)]
    ratio = np.vstack([statistics.ratio, _ratios(drawn[0], drawn[1], V1 + V2, k)])
    return tuple(
        MatrixTest(
            matrix=name,
            distance=float(statistics.distance[0, i]) if i < 3 else float("nan"),
            p_distance=exceedance(ratio[:, i]),
            t2=float(statistics.t2[0, i]),
            p_t2=float(statistics.chance[0, i]),
        )
        for i, name in enumerate(MATRIX_NAMES)
    )


def symmetric_elements(estimate: ImpedanceEstimate) -> tuple[FloatArray, FloatArray]:
    """Symmetric elements of M, B, K of an estimate, (3 c,), and their covariance, (3 c, 3 c)."""
    C = np.kron(np.eye(3), upper_elements(estimate.k))
    return C @ estimate.parameters, C @ estimate.covariance @ C.T


def check_errors(total: FloatArray) -> None:
    """Refuse differences (..., 3 c, 3 c) if one element has no error."""
    if not (np.diagonal(total, axis1=-2, axis2=-1) > 0).all():
        raise InputError(
            "an estimate without an error: its covariance is zero",
            expected="results of `armimpedance estimate` on two trials or more",
        )


def _ratios(first: FloatArray, second: FloatArray, total: FloatArray, k: int) -> FloatArray:
    """`Statistics.ratio` of drawn pairs: elements (R, 3 c) of both, and their covariance."""
    if k != 2:
        stack = np.broadcast_to(total, (len(first), *total.shape))
        return distance_ratios((matrices_of(first, k), matrices_of(second, k)), stack)[0]
    return planar_statistics(first.reshape(-1, 3, 3), second.reshape(-1, 3, 3), total)


def _draw(
    centre: FloatArray, covariance: FloatArray, dof: float, draws: int, rng: np.random.Generator
) -> FloatArray:
    """Draw from a multivariate t distribution about a centre (c,), (draws, c)."""
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0))
    normal = rng.standard_normal((draws, len(centre))) @ root.T
    wide = np.sqrt(rng.chisquare(dof, draws) / dof) if np.isfinite(dof) else np.ones(draws)
    return centre + normal / wide[:, None]


def matrices_of(elements: FloatArray, k: int) -> FloatArray:
    """Symmetric matrices (R, 3, k, k) from their elements i <= j (R, 3 c)."""
    rows, columns = np.triu_indices(k)
    parts = elements.reshape(len(elements), 3, len(rows))
    result = np.empty((len(elements), 3, k, k))
    result[..., rows, columns] = parts
    result[..., columns, rows] = parts
    return result


# Tail of a sum of weighted chi-squares over one more chi-square, by a saddlepoint, without draws.
#
# ``P(sum_j w_j X_j > q Y/nu)``, X_j of one degree of freedom, Y of nu, all independent: the tail of
# the quadratic form of a difference that is t distributed. It is that of ``S = sum_j w_j X_j -
# (q/nu) Y`` beyond zero, whose cumulant generating function is known (R. Lugannani and S. Rice
# 1980, Saddle point approximation for the distribution of the sum of independent random variables,
# Adv Appl Probab 12:475-490, in the form of O. E. Barndorff-Nielsen; D. Kuonen 1999, Saddlepoint
# approximations for distributions of quadratic forms in normal variables, Biometrika 86:929-935).
# Its relative error is a few per cent, however small the tail.

#: Bisections of the bracket of the saddlepoint, then Newton steps.
_HALVINGS: Final = 40
_NEWTON: Final = 4
#: Degrees of freedom that are used for a known covariance.
_KNOWN_DOF: Final = 1e7
#: Nearer to the mean than this many standard deviations the formula is 0/0 and its limit is used.
_NEAR_MEAN: Final = 1e-3


def mixture_tail(weights: FloatArray, dof: FloatArray, statistic: FloatArray) -> FloatArray:
    """``P(sum_j w_j X_j > q Y/nu)``.

    `weights` (R, J): at least 0, and not all of them 0.
    `dof` (R,): nu; inf for Y/nu = 1.
    `statistic` (R,): q, at least 0.
    Returns: (R,): nan if an argument is nan.
    """
    weights = np.maximum(weights, 1e-12 * weights.max(axis=1, keepdims=True))
    nu, scale = np.minimum(dof, _KNOWN_DOF), weights.sum(axis=1)
    # a statistic of zero is always exceeded; a slightly larger one avoids a division by zero
    against = np.maximum(statistic, 1e-9 * scale) / nu
    rates = np.concatenate([weights, -against[:, None]], axis=1)
    counts = np.ones_like(rates)
    counts[:, -1] = nu
    with np.errstate(all="ignore"):
        return _tail(rates, counts, _saddlepoint(rates, counts))


def _saddlepoint(rates: FloatArray, counts: FloatArray) -> FloatArray:
    """The root t (R,) of ``K'(t) = sum_j n_j r_j/(1 - 2 t r_j)``, which rises from -inf to inf."""
    low, high = 0.5 / rates.min(axis=1), 0.5 / rates.max(axis=1)
    for _ in range(_HALVINGS):
        t = (low + high) / 2
        above = (counts * rates / (1 - 2 * t[:, None] * rates)).sum(axis=1) > 0
        low, high = np.where(above, low, t), np.where(above, t, high)
    t = (low + high) / 2
    for _ in range(_NEWTON):
        shares = rates / (1 - 2 * t[:, None] * rates)
        slope = (counts * shares).sum(axis=1)
        low, high = np.where(slope > 0, low, t), np.where(slope > 0, t, high)
        step = t - slope / (2 * (counts * shares**2).sum(axis=1))
        # a step that leaves the bracket is replaced by a bisection
        t = np.where((step > low) & (step < high), step, (low + high) / 2)
    return np.asarray(t)


def _tail(rates: FloatArray, counts: FloatArray, t: FloatArray) -> FloatArray:
    """P(S > 0) from the saddlepoint t of S."""
    moved = 1 - 2 * t[:, None] * rates
    K = -0.5 * (counts * np.log1p(-2 * t[:, None] * rates)).sum(axis=1)
    K2 = 2 * (counts * (rates / moved) ** 2).sum(axis=1)
    K3 = 8 * (counts * (rates / moved) ** 3).sum(axis=1)
    w, v = np.sign(t) * np.sqrt(np.maximum(-2 * K, 0)), t * np.sqrt(K2)
    far = ndtr(-(w + np.log(v / w) / w))
    near = 0.5 - K3 / (6 * np.sqrt(2 * np.pi) * K2**1.5)
    return np.asarray(np.where(np.abs(v) > _NEAR_MEAN, far, near))


# Tests of many pairs from the estimates' covariances alone, without draws, in blocks.
# T2 is compared with its F distribution (`hotelling`), without draws. The squared distance of two
# matrices ``X -+ D/2`` is the sum over the eigenvalues e of ``X^-1 D`` of ``(2 artanh(e/2))^2``:
# near X the quadratic form ``tr(X^-1 D X^-1 D)``. The common value X0 nearest to both estimates has
# no information about D, so that X is fixed at X0. Then the form is a weighted sum of chi-squares
# over one more (`mixture`), with the degrees of freedom of Welch and Satterthwaite.
# The squared distance exceeds the form, also in the tail: a distance d requires a form of at least
# ``(2 tanh(d/2))^2``, which is used in its place and is conservative. See docs/evidence/compare.md
# for the measured levels.

#: Numbers in one block of pairs: some 20 MB with intermediate results.
_BLOCK_NUMBERS: Final = 40_000


@dataclass(frozen=True, eq=False)
class Elements:
    """Symmetric elements of M, B, K of G estimates of k axes, their covariances and dof.

    `values` (G, m), `covariances` (G, m, m), `dof` (G,).
    """

    values: FloatArray
    covariances: FloatArray
    dof: FloatArray
    k: int

    @classmethod
    def of(cls, estimates: Sequence[ImpedanceEstimate]) -> Self:
        """Collect the elements of estimates with the same number of axes."""
        values, covariances = zip(*map(symmetric_elements, estimates), strict=True)
        dof = np.array([estimate.dof for estimate in estimates])
        return cls(np.array(values), np.array(covariances), dof, estimates[0].k)

    @property
    def block(self) -> int:
        """Number of pairs in a block."""
        return int(max(_BLOCK_NUMBERS // self.values.shape[1] ** 2, 1))


def first_order_tests(of: Elements, first: IntArray, second: IntArray) -> FloatArray:
    """Test R pairs, (R, 4, 4).

    `first`, `second` (R,): indices of the estimates of each pair.
    Returns: (R, 4, 4): of inertia, viscosity, stiffness and all: distance, its p, T2, its p, as in
    `MatrixTest`.
    Raises InputError: a pair without an error.
    """
    x1, x2, V1, V2 = (part[of_] for part in (of.values, of.covariances) for of_ in (first, second))
    check_errors(V1 + V2)
    statistics = statistics_between(
        (matrices_of(x1, of.k), matrices_of(x2, of.k)),
        x2 - x1,
        (V1, V2),
        (of.dof[first], of.dof[second]),
    )
    common = x1 + (V1 @ np.linalg.solve(V1 + V2, (x2 - x1)[..., None]))[..., 0]
    chance = _distance_chance(statistics, matrices_of(common, of.k), (V1, V2), of, (first, second))
    distance = np.column_stack([statistics.distance, np.full(len(first), np.nan)])
    return np.stack([distance, chance, statistics.t2, statistics.chance], axis=2)


def _distance_chance(
    statistics: Statistics,
    common: FloatArray,
    covariances: tuple[FloatArray, FloatArray],
    of: Elements,
    pair: tuple[IntArray, IntArray],
) -> FloatArray:
    """p values of the distances, (R, 4); nan if a distance does not exist."""
    V1, V2 = covariances
    total, c = V1 + V2, V1.shape[-1] // 3
    metric, share = np.zeros_like(total), np.zeros((len(total), 4))
    definite = is_positive_definite(common)
    for i in range(3):
        part = slice(c * i, c * i + c)
        safe = np.where(definite[:, i, None, None], common[:, i], np.eye(of.k))
        g = metric_at(safe)
        # scale the form to a mean of 1, like the statistic
        size = np.einsum("ref,rfe->r", g, total[:, part, part])
        metric[:, part, part] = g / size[:, None, None]
        share[:, i] = np.einsum("ref,rfe->r", g, V1[:, part, part]) / size
    share[:, 3] = share[:, :3].mean(axis=1)
    dof = 1 / (share**2 / of.dof[pair[0], None] + (1 - share) ** 2 / of.dof[pair[1], None])
    form = _form_of(statistics)
    parts = [slice(c * i, c * i + c) for i in range(3)] + [slice(0, 3 * c)]
    p = [
        mixture_tail(_weights(metric[:, s, s], total[:, s, s]), dof[:, i], form[:, i])
        for i, s in enumerate(parts)
    ]
    # an implausible common value is no evidence against chance
    valid = np.column_stack([definite, definite.all(axis=1)])
    return np.where(np.isnan(statistics.ratio), np.nan, np.where(valid, np.column_stack(p), 1.0))


def _form_of(statistics: Statistics) -> FloatArray:
    """Smallest quadratic form (R, 4) that is compatible with the distances."""
    d = statistics.distance
    with np.errstate(divide="ignore", invalid="ignore"):
        # at distance zero the ratio is 1
        shrunk = np.where(d > 0, (2 * np.tanh(d / 2) / d) ** 2, 1.0)
    forms = statistics.ratio[:, :3] * shrunk
    return np.column_stack([forms, forms.sum(axis=1)])


def _weights(metric: FloatArray, covariance: FloatArray) -> FloatArray:
    """Eigenvalues (R, c) of metric times covariance: the weights of the chi-squares."""
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0))[:, None, :]
    return np.asarray(np.linalg.eigvalsh(root.swapaxes(-1, -2) @ metric @ root))
