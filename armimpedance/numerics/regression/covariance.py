"""Covariance of the parameters: classical, clustered, long-run, and by leaving trials out.

All are in the order of `Fit.parameters` (every regressor of output 1, then of output 2, ...), with
the blocks between outputs. Residuals at 1 kHz are autocorrelated. The classical covariance assumes
them to be independent and is far too small; it is for comparison with the sources only.
"""

from __future__ import annotations

from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_triangular

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.errors import EstimationError, InputError, check_number
from armimpedance.numerics.regression.diagnose import (
    LEAST_INFORMATION,
    Pooled,
    leave_out_scores,
    pool,
    solve_positive,
)
from armimpedance.numerics.regression.factors import TrialFactors

#: Least share of a slow sum that the fit leaves; limits the correction of its mean.
_LEAST_LEFT: Final = 0.1

CovarianceKind = Literal["cr1", "cr3", "replicates", "classical"]


def parameter_covariance(
    factors: TrialFactors,
    pooled: Pooled,
    kind: CovarianceKind,
    strata: ArrayLike | None = None,
) -> FloatArray:
    """Covariance (p q, p q) of the requested kind.

    Raises InputError: unknown kind, a single cluster for a clustered one, no more rows than
    parameters, or replicates without strata of two clusters or more.
    Raises NotIdentifiableError: for CR3, if only one cluster informs a parameter.
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
    """Degrees of freedom of a clustered covariance: clusters less means subtracted from them."""
    means = len(np.unique(np.asarray(strata))) if kind == "replicates" else 1
    return factors.n_clusters - means


def check_strata(n_clusters: int, strata: ArrayLike | None) -> IntArray:
    """Number of the stratum of each cluster, (T,).

    Raises InputError: there is not one label per cluster, or a stratum has a single cluster.
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
    """Rows less regressors less nuisance parameters projected out before."""
    return factors.effective_rows - factors.n_regressors


def residual_covariance(factors: TrialFactors, pooled: Pooled) -> FloatArray:
    """Covariance of the residuals, ``E^T E / dof`` (q, q)."""
    R_E = pooled.residual_triangle
    return np.asarray(R_E.T @ R_E / max(residual_dof(factors), 1))


def classical_covariance(factors: TrialFactors, pooled: Pooled) -> FloatArray:
    """Covariance for independent residuals: ``Sigma (x) (W^T W)^-1``.

    Sigma (q, q) is the residuals' covariance.
    """
    inverse = pooled.to_si(np.eye(factors.n_regressors))
    # C (q p, q p) = Sigma (q, q) (x) R^-1 R^-T (p, p)
    return np.asarray(np.kron(residual_covariance(factors, pooled), inverse @ inverse.T))


def cr1_covariance(factors: TrialFactors, pooled: Pooled) -> FloatArray:
    """Clustered covariance CR1: outer products of the clusters' scores.

    Times ``G/(G-1) (N-1)/(N-p)``, N the rows less the nuisance parameters, G the clusters.
    """
    N, G = factors.effective_rows, factors.n_clusters
    small_sample = G / (G - 1) * (N - 1) / (N - factors.n_regressors)
    return small_sample * _outer(_influence(pooled, pooled.score))


def cr3_covariance(pooled: Pooled) -> FloatArray:
    """Clustered covariance CR3, by jackknife.

    ``(G-1)/G sum_t (Theta_(t) - Theta)(Theta_(t) - Theta)^T``, Theta_(t) the fit without cluster t.
    """
    G = len(pooled.gram)
    return (G - 1) / G * _outer(_influence(pooled, leave_out_scores(pooled)))


def replicate_covariance(pooled: Pooled, strata: IntArray) -> FloatArray:
    """Clustered covariance from replicates: scores about the mean of their stratum.

    ``C = sum_s n_s/(n_s - 1) sum_(t in s) (d_t - mean_s d)(d_t - mean_s d)^T``, d_t the change of
    the solution by cluster t. A deviation that is the same in every replicate of a stratum, such as
    a limb's non-linearity along one direction, repeats in every experiment: it is not random and
    adds nothing here, while CR1 and CR3 include it. Replicates share their regressors, so that the
    fit shrinks the residuals of a stratum alike and no correction is needed.
    """
    return replicate_sum(_influence(pooled, pooled.score), strata)


def replicate_sum(changes: FloatArray, strata: IntArray) -> FloatArray:
    """Compute ``sum_s n_s/(n_s - 1) sum_(t in s) (d_t - mean_s d)(d_t - mean_s d)^T``, d (T, n)."""
    counts = np.bincount(strata)
    means = (
        np.stack([np.bincount(strata, column) for column in changes.T], axis=1) / counts[:, None]
    )
    weight = np.sqrt(counts / (counts - 1))[strata]
    return _outer(weight[:, None] * (changes - means[strata]))


def long_run_covariance(
    triangle: FloatArray, W: FloatArray, E: FloatArray, cosines: int
) -> FloatArray:
    """Covariance (p, p) of one output's parameters for autocorrelated residuals.

    The long-run variance of the scores is the mean of squares of their slowest cosine sums (U. K.
    Mueller, J. Econometrics 141 (2007) 1331-1352). The fit removes from the residuals their share
    along the regressors, which for a slow regressor reduces mostly the slow sums. The sums are
    rescaled so that their mean for independent residuals is right, as HC2 does for single rows.

    Parameters
    ----------
    triangle : (p, p)
        `Fit.triangle`.
    W : (N, p)
        Regressors, samples one after another in time.
    E : (N, 1)
        Residuals.
    cosines : int
        Number of sums, which is the degrees of freedom of the t distribution.

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
    overlaps = [Z.T @ (wave[:, None] * Z) for wave in waves]
    power = (waves**2).sum(axis=0)
    mean = (
        2 / cosines * (Z.T @ (power[:, None] * Z) - sum(overlap @ overlap for overlap in overlaps))
    )
    value, axes = np.linalg.eigh(mean)
    root = axes / np.sqrt(np.maximum(value, _LEAST_LEFT)) @ axes.T
    inverse = solve_triangular(triangle / scale, np.eye(len(scale))) / scale[:, None]
    return np.asarray(inverse @ root @ meat @ root @ inverse.T)


def _influence(pooled: Pooled, scores: FloatArray) -> FloatArray:
    """Change of the parameters (T, q p) by scores (T, p, q)."""
    T, p, q = scores.shape
    side_by_side = scores.transpose(1, 0, 2).reshape(p, T * q)
    changes = pooled.to_si(side_by_side).reshape(p, T, q)
    return changes.transpose(1, 2, 0).reshape(T, q * p)


def _outer(influence: FloatArray) -> FloatArray:
    return np.asarray(influence.T @ influence)


# Leave-one-out and bootstrap over clusters, from the factors only.

#: Largest share of resamples that may lose rank; with more, the rest do not represent the data.
_MOST_LOST = 0.1

#: Numbers in one batch of resamples: small enough for a processor's cache.
_BATCH_NUMBERS = 60_000


def leave_one_out(factors: TrialFactors) -> FloatArray:
    """Coefficients (T, p, q) of the fits that leave out one cluster each.

    Parameters
    ----------
    factors : TrialFactors
        T clusters, p regressors, q outputs.

    Returns
    -------
    (T, p, q) array
        Coefficients without cluster t, one matrix per cluster.

    Raises
    ------
    NotIdentifiableError
        W loses rank, with all clusters or without one of them.
    """
    pooled = pool(factors)
    # Theta_(t) = Theta - R^-1 (I - G_t)^-1 s_t
    return np.asarray(pooled.coefficients - _back(pooled, leave_out_scores(pooled)))


def bootstrap(
    factors: TrialFactors,
    repeats: int,
    seed: int | np.random.SeedSequence,
    strata: ArrayLike | None = None,
) -> FloatArray:
    """Coefficients (repeats, p, q) of fits to clusters drawn with replacement.

    A resample that loses rank is replaced from a separate random stream. The first n of N repeats
    do not depend on N (up to rounding), and the same call gives the same bits.

    Parameters
    ----------
    factors : TrialFactors
    repeats : int
    seed : int or SeedSequence
        A SeedSequence is not changed by the call.
    strata : (T,), optional
        Labels; clusters are drawn within each label. Intervals from few clusters per label are
        too short.

    Returns
    -------
    (repeats, p, q) array
        Coefficients of each resample. A resample that still loses rank after twenty draws is
        left out.

    Raises
    ------
    NotIdentifiableError
        W loses rank with all clusters.
    EstimationError
        More than a tenth of the resamples lose rank.
    InputError
        No repeats, or not one label per cluster.
    """
    check_number(repeats, f"{repeats} bootstrap repeats", low=1)
    pooled = pool(factors)
    lost, draws = np.ones(repeats, np.bool_), np.empty((repeats, *pooled.coefficients.shape))
    for attempt in range(20):
        counts = draw_counts(factors.n_clusters, repeats, seed, strata, attempt)[lost]
        draws[lost], still_lost = _weighted_fits(pooled, counts)
        lost[lost] = still_lost
        if lost.mean() > _MOST_LOST:
            raise EstimationError(
                f"{lost.sum()} of {repeats} resamples of {factors.n_clusters} clusters lose rank: "
                "too few clusters for a bootstrap"
            )
        if not lost.any():
            break
    return draws[~lost]


def draw_counts(
    n_clusters: int,
    repeats: int,
    seed: int | np.random.SeedSequence,
    strata: ArrayLike | None = None,
    attempt: int = 0,
) -> FloatArray:
    """Number of times that `bootstrap` draws each cluster, (repeats, T); each row sums to T.

    `attempt`: 0 the first time; resamples that lose rank are replaced from attempts 1, 2, ...
    Raises InputError: not one label per cluster.
    """
    groups = _groups(n_clusters, strata)
    counts = np.zeros((repeats, n_clusters))
    for members, stream in zip(groups, _stream(seed, attempt).spawn(len(groups)), strict=True):
        n = len(members)
        drawn = stream.integers(n, size=(repeats, n)) + n * np.arange(repeats)[:, None]
        counts[:, members] = np.bincount(drawn.ravel(), minlength=n * repeats).reshape(-1, n)
    return counts


def _weighted_fits(pooled: Pooled, counts: FloatArray) -> tuple[FloatArray, np.ndarray]:
    """Coefficients (n, p, q) with clusters weighted by counts (n, T), and lost fits (n,)."""
    T, p, q = pooled.score.shape
    grams, scores = pooled.gram.reshape(T, p * p).T, pooled.score.reshape(T, p * q).T
    change, pivots = [], []
    size = max(_BATCH_NUMBERS // (p * (p + q)), 1)
    for start in range(0, len(counts), size):
        c = counts[start : start + size].T
        # (sum_t c_t G_t) (p, p) d (p, q) = sum_t c_t s_t (p, q), for all resamples
        d, pivot = solve_positive((grams @ c).reshape(p, p, -1), (scores @ c).reshape(p, q, -1))
        change.append(d)
        pivots.append(pivot)
    changes = np.moveaxis(np.concatenate(change, axis=2), -1, 0)
    lost = np.concatenate(pivots) < LEAST_INFORMATION
    return pooled.coefficients + _back(pooled, changes), lost


def _back(pooled: Pooled, changes: FloatArray) -> FloatArray:
    """Transform changes (n, p, q) from the orthonormal basis to SI."""
    n, p, q = changes.shape
    in_si = pooled.to_si(changes.transpose(1, 0, 2).reshape(p, n * q))
    return in_si.reshape(p, n, q).transpose(1, 0, 2)


def _groups(n_clusters: int, strata: ArrayLike | None) -> list[IntArray]:
    if strata is None:
        return [np.arange(n_clusters)]
    labels = np.asarray(strata)
    if labels.shape != (n_clusters,):
        raise InputError(f"strata of shape {labels.shape}", expected=f"({n_clusters},)")
    return [np.flatnonzero(labels == label) for label in np.unique(labels)]


def _stream(seed: int | np.random.SeedSequence, attempt: int) -> np.random.Generator:
    root = seed if isinstance(seed, np.random.SeedSequence) else np.random.SeedSequence(seed)
    # not root.spawn, which would change the caller's sequence and so the next result
    child = np.random.SeedSequence(root.entropy, spawn_key=(*root.spawn_key, attempt))
    return np.random.default_rng(child)
