"""Least squares for regressors with errors of known size, by corrected moments.

The model is ``y = X beta + e``, but ``W = X + U`` is observed, with errors U that are independent
of X and of e and have a known covariance. Then ``E[W^T W] = X^T X + S``, ``S = E[U^T U]``, while
``E[W^T y] = X^T X beta``: least squares is biased towards zero (attenuated) by
``(W^T W)^-1 (W^T W - S)``, and ``(W^T W - S) beta = W^T y`` is not (W. A. Fuller, Measurement Error
Models, 1987, chapters 2 and 3).

Every cluster of rows (a point of a curve, a section of a record) has its own three moments, so that
the covariance is computed as elsewhere, by leaving out one cluster at a time.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np
from scipy.linalg import eigh
from scipy.special import chdtri

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.numerics.regression.equations import TrialEquations, solve_equations

#: Reliability (the share of a direction's squared length that errors do not explain) below which a
#: direction is refused, however many points there are, and below which there is a warning.
REFUSED, DOUBTFUL = 0.2, 0.8
#: A direction is refused too if errors alone reach its length with this probability.
BY_CHANCE: Final = 0.05
#: A regressor belongs to a direction above this share of the largest weight.
_TAKES_PART: Final = 0.3


@dataclass(frozen=True, eq=False)
class ErrorMoments(FrozenRecord):
    """Moments of C clusters of rows and p regressors.

    Attributes
    ----------
    gram : (C, p, p)
        ``W_c^T W_c``.
    cross : (C, p)
        ``W_c^T y_c``.
    error : (C, p, p)
        ``E[U_c^T U_c]``: the contribution of the regressors' errors to `gram`.
    names, units : tuples of str
        Names and units of the p coefficients.
    """

    gram: Annotated[FloatArray, "c p p"]
    cross: Annotated[FloatArray, "c p"]
    error: Annotated[FloatArray, "c p p"]
    names: Annotated[tuple[str, ...], "p"]
    units: Annotated[tuple[str, ...], "p"]

    @property
    def corrected(self) -> TrialEquations:
        """The corrected equations, ``sum_c (W_c^T y_c - (W_c^T W_c - S_c) beta) = 0``."""
        return TrialEquations(self.gram - self.error, self.cross, self.names, self.units)

    @property
    def naive(self) -> TrialEquations:
        """The equations of least squares, which ignore errors of the regressors."""
        return TrialEquations(self.gram, self.cross, self.names, self.units)


@dataclass(frozen=True)
class Corrected:
    """Coefficients with the regressors' errors accounted for, and the naive ones.

    Attributes
    ----------
    coefficients, naive : (p,)
    covariance, naive_covariance : (p, p)
    dof : float
        Degrees of freedom of the t distribution.
    reliability : float
        Share of the squared length of the least certain combination of regressors that errors do
        not explain, 0..1.
    least_certain : tuple of str
        The regressors in that combination.
    """

    coefficients: FloatArray
    naive: FloatArray
    covariance: FloatArray
    naive_covariance: FloatArray
    dof: float
    reliability: float
    least_certain: tuple[str, ...]

    @property
    def doubtful(self) -> bool:
        """True if errors explain so much of some combination that the correction is rough."""
        return self.reliability < DOUBTFUL


def solve_corrected(moments: ErrorMoments, small_sample: FloatArray | None = None) -> Corrected:
    """Coefficients from moments, and their covariance by leaving out one cluster at a time.

    Parameters
    ----------
    moments : ErrorMoments
    small_sample : (p, p), optional
        Removes the bias of second order: `small_sample_term`.

    Returns
    -------
    Corrected
        Coefficients with and without the correction, their covariances, and the reliability.

    Raises
    ------
    NotIdentifiableError
        Errors explain most of some combination of regressors, or the regressors lose rank.
    InputError
        As many clusters as coefficients, or fewer.
    """
    C, p = moments.cross.shape
    if p >= C:
        raise InputError(f"{C} points for {p} coefficients", expected=f"{p + 1} or more")
    reliability, names = refuse_unreliable(moments)
    equations = moments.corrected
    if small_sample is not None:
        # divided among the clusters, so that leaving one out removes its share
        A = equations.A + small_sample / C
        equations = TrialEquations(A, equations.b, moments.names, moments.units)
    solution = solve_equations(equations, covariance="cr3")
    naive = solve_equations(moments.naive, covariance="cr3")
    return Corrected(
        coefficients=solution.parameters,
        naive=naive.parameters,
        covariance=solution.covariance,
        naive_covariance=naive.covariance,
        dof=float(C - p),
        reliability=reliability,
        least_certain=names,
    )


def small_sample_term(moments: ErrorMoments) -> FloatArray:
    """Term (p, p) to add to ``M = W^T W - S`` so that the solution is unbiased to second order.

    For points with one row ``w_c = x_c + u_c`` and normal errors, expanding ``M^-1 W^T y`` in u
    gives the bias ``M^-1 T beta`` with

        T = sum_c x_c x_c^T M^-1 S_c + (x_c^T M^-1 x_c) S_c + S_c M^-1 S_c + tr(M^-1 S_c) S_c

    (for p regressors with equal errors: about ``(p + 1) S / C``). Its purpose is that of Fuller's
    modified estimators: without it the denominator may come near zero.

    Parameters
    ----------
    moments : ErrorMoments
        Moments of points with one row each.

    Returns
    -------
    (p, p) array
        The term to add to the corrected moments ``W^T W - S``.
    """
    S = moments.error

    def term(inverse: FloatArray) -> FloatArray:
        # x x^T is estimated by w w^T - S, so that the four terms become two:
        # T (p, p) = sum_c w w^T M^-1 S_c + tr(M^-1 w w^T) S_c
        traces = np.einsum("ij,cji->c", inverse, moments.gram)
        first = moments.gram @ inverse @ S
        return np.asarray(first.sum(axis=0) + np.einsum("c,cij->ij", traces, S))

    # at (M + T)^-1: the inverse of a sample's M is itself too large on average
    M = (moments.gram - S).sum(axis=0)
    return term(np.linalg.inv(M + term(np.linalg.inv(M))))


def refuse_unreliable(
    moments: ErrorMoments, points: int | None = None
) -> tuple[float, tuple[str, ...]]:
    """Reliability of the least certain combination of regressors, and its regressors.

    Parameters
    ----------
    moments : ErrorMoments
    points : int, optional
        Number of rows with independent errors, if known: with few, errors alone can look like a
        signal by chance.

    Returns
    -------
    reliability : float
        Share of the combination's squared length that errors do not explain, 0 to 1.
    names : tuple of str
        Regressors that make up the combination.

    Raises
    ------
    NotIdentifiableError
        Errors explain most of it, or errors alone could reach as much by chance (chi squared with
        one degree of freedom less than points); or a regressor is zero throughout.
    """
    reliability, names = _least_reliable(moments)
    least = REFUSED
    if points is not None:
        # errors alone: length^2 / expected ~ chi^2 / free, reliability = 1 - expected / length^2
        free = max(points - 1, 1)
        least = max(least, 1 - free / float(chdtri(free, BY_CHANCE)))
    if reliability < least:
        raise NotIdentifiableError(
            f"errors explain {100 - 100 * reliability:.0f} % of what is seen of a combination of "
            f"{' and '.join(names)}: it determines nothing; let them vary more, one without "
            "the other, or average longer",
            names,
        )
    return reliability, names


def _least_reliable(moments: ErrorMoments) -> tuple[float, tuple[str, ...]]:
    gram, error = moments.gram.sum(axis=0), moments.error.sum(axis=0)
    length = np.sqrt(np.diag(gram))
    if not (length > 0).all():
        zero = tuple(n for n, size in zip(moments.names, length, strict=True) if not size > 0)
        raise NotIdentifiableError(f"{', '.join(zero)}: nothing but zeros", zero)
    unit = np.outer(length, length)
    scaled = gram / unit
    if np.linalg.eigvalsh(scaled)[0] < 1e-12:
        return 0.0, moments.names
    # S v = (1 - reliability) W^T W v
    explained, v = eigh(error / unit, scaled)
    # a regressor without errors is never the cause
    weight = np.abs(v[:, -1]) * (np.diag(error) > 0)
    weight = weight if weight.any() else np.ones(len(weight))
    names = tuple(np.array(moments.names)[weight > _TAKES_PART * weight.max()].tolist())
    return float(np.clip(1 - explained[-1], 0.0, 1.0)), names
