"""Leaving trials out and drawing them again, on the factors alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.errors import EstimationError, InputError
from armimpedance.numerics.regression.factors import TrialFactors
from armimpedance.numerics.regression.pooled import (
    LEAST_INFORMATION,
    Pooled,
    leave_out_scores,
    pool,
    solve_positive,
)

#: More resamples than this part lost: what is left no longer stands for the data.
_MOST_LOST = 0.1

#: Numbers in the work space of one batch of resamples: small enough for a processor's cache.
_BATCH_NUMBERS = 60_000


def leave_one_out(factors: TrialFactors) -> FloatArray:
    """Coefficients (T, p, q) of the fits without one cluster each.

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

    A resample that loses rank is drawn again from a stream of its own; the first n of N repeats
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
    if repeats < 1:
        raise InputError(f"{repeats} bootstrap repeats", expected="one or more")
    pooled = pool(factors)
    lost, draws = np.ones(repeats, np.bool_), np.empty((repeats, *pooled.coefficients.shape))
    for attempt in range(20):
        counts = draw_counts(factors.n_clusters, repeats, seed, strata, attempt)[lost]
        draws[lost], again = _weighted_fits(pooled, counts)
        lost[lost] = again
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
    """How often `bootstrap` draws each cluster, (repeats, T), each row summing to T.

    Parameters
    ----------
    attempt : int
        0 the first time; resamples that lose rank are replaced from attempts 1, 2, ...

    Raises
    ------
    InputError
        Not one label per cluster.
    """
    groups = _groups(n_clusters, strata)
    counts = np.zeros((repeats, n_clusters))
    for members, stream in zip(groups, _stream(seed, attempt).spawn(len(groups)), strict=True):
        n = len(members)
        drawn = stream.integers(n, size=(repeats, n)) + n * np.arange(repeats)[:, None]
        counts[:, members] = np.bincount(drawn.ravel(), minlength=n * repeats).reshape(-1, n)
    return counts


def bootstrap_covariance(draws: FloatArray) -> FloatArray:
    """Covariance (p q, p q) of draws (repeats, p, q), in the order of `Fit.parameters`."""
    return np.atleast_2d(np.cov(draws.transpose(0, 2, 1).reshape(len(draws), -1), rowvar=False))


def _weighted_fits(pooled: Pooled, counts: FloatArray) -> tuple[FloatArray, np.ndarray]:
    """Coefficients (n, p, q) with clusters weighted by counts (n, T), and which lost rank."""
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
    moved = np.moveaxis(np.concatenate(change, axis=2), -1, 0)
    lost = np.concatenate(pivots) < LEAST_INFORMATION
    return pooled.coefficients + _back(pooled, moved), lost


def _back(pooled: Pooled, moved: FloatArray) -> FloatArray:
    """Bring changes (n, p, q) from the orthonormal basis to SI."""
    n, p, q = moved.shape
    in_si = pooled.to_si(moved.transpose(1, 0, 2).reshape(p, n * q))
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
    # Not root.spawn: that would change the caller's sequence, and with it the next result.
    child = np.random.SeedSequence(root.entropy, spawn_key=(*root.spawn_key, attempt))
    return np.random.default_rng(child)
