"""Covariance of the parameters: classical, clustered (CR1, CR3, replicates), and long-run.

All in the order of `Fit.parameters` (every regressor of output 1, then of output 2, ...), with
the blocks between outputs. Residuals at 1 kHz are autocorrelated; the classical covariance, which
takes them as independent, is far too small there and serves comparison with the sources only.
"""

from __future__ import annotations

from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_triangular

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.errors import InputError
from armimpedance.numerics.regression.factors import TrialFactors
from armimpedance.numerics.regression.pooled import Pooled, leave_out_scores

#: Part of a slow sum that the fit leaves at least, for its mean to be made up.
_LEAST_LEFT: Final = 0.1

CovarianceKind = Literal["cr1", "cr3", "replicates", "classical"]


def parameter_covariance(
    factors: TrialFactors,
    pooled: Pooled,
    kind: CovarianceKind,
    strata: ArrayLike | None = None,
) -> FloatArray:
    """Covariance (p q, p q) of one kind.

    Raises
    ------
    InputError
        Unknown kind, a single cluster for a clustered one, no more rows than parameters, or
        replicates without strata of two clusters or more.
    NotIdentifiableError
        CR3 where one cluster alone informs a parameter.
    """
    if kind not in get_args(CovarianceKind):
        raise InputError(
            f"no covariance {kind!r}",
            expected="cr1, cr3, replicates or classical",
        )
    if residual_dof(factors) <= 0:
        raise InputError(
            f"{factors.effective_rows} rows for {factors.n_regressors} parameters per output",
            expected="more rows than parameters",
        )
    if kind == "classical":
        return classical_covariance(factors, pooled)
    if factors.n_clusters < 2:
        raise InputError(
            "one cluster only: its spread cannot be seen",
            expected="two trials or more, or a long trial split into blocks (split_blocks)",
        )
    if kind == "replicates":
        return replicate_covariance(pooled, check_strata(factors.n_clusters, strata))
    return cr1_covariance(factors, pooled) if kind == "cr1" else cr3_covariance(pooled)


def clustered_dof(factors: TrialFactors, kind: CovarianceKind, strata: ArrayLike | None) -> int:
    """Degrees of freedom of a clustered covariance: clusters less means taken off them."""
    means = len(np.unique(np.asarray(strata))) if kind == "replicates" else 1
    return factors.n_clusters - means


def check_strata(n_clusters: int, strata: ArrayLike | None) -> IntArray:
    """Number of the stratum of each cluster, (T,).

    Raises
    ------
    InputError
        No labels, not one per cluster, or a stratum of a single cluster.
    """
    labels = np.asarray([] if strata is None else strata)
    if labels.shape != (n_clusters,):
        raise InputError(
            f"{labels.size} labels of strata", expected=f"one for each of {n_clusters} clusters"
        )
    _, numbers, counts = np.unique(labels, return_inverse=True, return_counts=True)
    if counts.min() < 2:
        raise InputError("a stratum of a single cluster", expected="two replicates or more of each")
    return np.asarray(numbers, dtype=np.int64)


def residual_dof(factors: TrialFactors) -> int:
    """Rows less regressors less nuisance parameters already projected out."""
    return factors.effective_rows - factors.n_regressors


def residual_covariance(factors: TrialFactors, pooled: Pooled) -> FloatArray:
    """``E^T E / dof`` (q, q)."""
    R_E = pooled.residual_triangle
    return np.asarray(R_E.T @ R_E / max(residual_dof(factors), 1))


def classical_covariance(factors: TrialFactors, pooled: Pooled) -> FloatArray:
    """Independent residuals: ``Sigma (x) (W^T W)^-1``, Sigma (q, q) the residuals' covariance."""
    inverse = pooled.to_si(np.eye(factors.n_regressors))
    # C (q p, q p) = Sigma (q, q) (x) R^-1 R^-T (p, p)
    return np.asarray(np.kron(residual_covariance(factors, pooled), inverse @ inverse.T))


def cr1_covariance(factors: TrialFactors, pooled: Pooled) -> FloatArray:
    """Clustered: outer products of the clusters' scores times ``G/(G-1) (N-1)/(N-p)``.

    N counts the rows less the nuisance parameters, G the clusters.
    """
    N, G = factors.effective_rows, factors.n_clusters
    small_sample = G / (G - 1) * (N - 1) / (N - factors.n_regressors)
    return small_sample * _outer(_influence(pooled, pooled.score))


def cr3_covariance(pooled: Pooled) -> FloatArray:
    """Clustered, jackknife: ``(G-1)/G sum_t (Theta_(t) - Theta)(Theta_(t) - Theta)^T``.

    Theta_(t) is the fit without cluster t.
    """
    G = len(pooled.gram)
    return (G - 1) / G * _outer(_influence(pooled, leave_out_scores(pooled)))


def replicate_covariance(pooled: Pooled, strata: IntArray) -> FloatArray:
    """Clustered, from replicates: scores about the mean of their stratum, ``n_s/(n_s - 1)`` each.

    ``C = sum_s n_s/(n_s - 1) sum_(t in s) (d_t - mean_s d)(d_t - mean_s d)^T``, d_t what cluster t
    moves the solution by. What is the same in every replicate of a stratum, such as a limb's
    non-linearity along one direction, repeats in every experiment: it is no chance and adds
    nothing, where CR1 and CR3 count it. Replicates share their regressors, so that the residuals'
    shrinkage by the fit is common to a stratum and needs no correction.
    """
    return replicate_sum(_influence(pooled, pooled.score), strata)


def replicate_sum(moved: FloatArray, strata: IntArray) -> FloatArray:
    """``sum_s n_s/(n_s - 1) sum_(t in s) (d_t - mean_s d)(d_t - mean_s d)^T`` of d (T, n)."""
    counts = np.bincount(strata)
    means = np.stack([np.bincount(strata, column) for column in moved.T], axis=1) / counts[:, None]
    weight = np.sqrt(counts / (counts - 1))[strata]
    return _outer(weight[:, None] * (moved - means[strata]))


def long_run_covariance(
    triangle: FloatArray, W: FloatArray, E: FloatArray, cosines: int
) -> FloatArray:
    """Covariance (p, p) of one output's parameters for autocorrelated residuals.

    The long-run variance of the scores is the mean of squares of their slowest cosine sums (U. K.
    Mueller, J. Econometrics 141 (2007) 1331-1352). The fit takes off residuals what they share
    with the regressors, of a slow regressor most in the slow sums; the mean is made that of
    independent residuals again, as HC2 does for single rows.

    Parameters
    ----------
    triangle : (p, p)
        `Fit.triangle`.
    W : (N, p)
        Regressors, samples one after another in time.
    E : (N, 1)
        Residuals.
    cosines : int
        How many sums are taken; the degrees of freedom of the t distribution.

    Returns
    -------
    (p, p) array
        Covariance of the parameters.
    """
    n, scale = len(W), np.linalg.norm(triangle, axis=0)
    # scores u (n, p) in the orthonormal basis: W = Z R, u_i = z_i e_i
    Z = solve_triangular(triangle / scale, (W / scale).T, trans="T").T
    phase = np.pi * (np.arange(n) + 0.5) / n
    waves = np.cos(np.arange(1, cosines + 1)[:, None] * phase)
    # meat (p, p) = (2 / B) sum_j L_j L_j^T, L (B, p) the cosine sums
    sums = waves @ (Z * E)
    meat = 2 / cosines * sums.T @ sums
    # its mean for independent residuals: (2 / B) sum_j Z^T C_j^2 Z - (Z^T C_j Z)^2, C_j = diag
    lost = [Z.T @ (wave[:, None] * Z) for wave in waves]
    power = (waves**2).sum(axis=0)
    mean = 2 / cosines * (Z.T @ (power[:, None] * Z) - sum(one @ one for one in lost))
    value, axes = np.linalg.eigh(mean)
    root = axes / np.sqrt(np.maximum(value, _LEAST_LEFT)) @ axes.T
    inverse = solve_triangular(triangle / scale, np.eye(len(scale))) / scale[:, None]
    return np.asarray(inverse @ root @ meat @ root @ inverse.T)


def _influence(pooled: Pooled, scores: FloatArray) -> FloatArray:
    """Change of the parameters (T, q p) that belongs to scores (T, p, q)."""
    T, p, q = scores.shape
    side_by_side = scores.transpose(1, 0, 2).reshape(p, T * q)
    moved = pooled.to_si(side_by_side).reshape(p, T, q)
    return moved.transpose(1, 2, 0).reshape(T, q * p)


def _outer(influence: FloatArray) -> FloatArray:
    return np.asarray(influence.T @ influence)
