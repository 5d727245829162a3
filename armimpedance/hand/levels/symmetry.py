"""The symmetric and the antisymmetric part of an impedance, with their covariance.

The symmetric part is used for eigenvectors, ellipses and mappings; the antisymmetric part (a
rotational force field, which no passive spring can produce) is reported with its standard error.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import Annotated

import numpy as np
from scipy.special import stdtr

from armimpedance.core.arrays import FloatArray, FrozenRecord, frozen
from armimpedance.core.conventions import MATRICES
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.numerics.regression import t_interval


def transposition(k: int) -> FloatArray:
    """The (k^2, k^2) permutation that takes a matrix, row by row, to its transpose."""
    return np.eye(k * k)[np.arange(k * k).reshape(k, k).T.ravel()]


def symmetric_part(estimate: ImpedanceEstimate) -> ImpedanceEstimate:
    """``(A + A^T)/2`` of M, B and K, with the covariance of that linear map.

    The covariance becomes singular: the two off-diagonal elements are one number.

    Parameters
    ----------
    estimate : ImpedanceEstimate

    Returns
    -------
    ImpedanceEstimate
    """
    k = estimate.k
    # vec(A_s) (k^2,) = (I + P)/2 (k^2, k^2) vec(A) (k^2,)
    average = np.kron(np.eye(3), (np.eye(k * k) + transposition(k)) / 2).astype(float)

    def part(matrix: FloatArray | None) -> FloatArray:
        matrix = np.asarray(matrix)
        return (matrix + matrix.T) / 2

    return replace(
        estimate,
        inertia=part(estimate.inertia),
        inertia_with_handle=part(estimate.inertia_with_handle),
        viscosity=part(estimate.viscosity),
        stiffness=part(estimate.stiffness),
        covariance=average @ estimate.covariance @ average.T,
        bound=None if estimate.bound is None else average @ estimate.bound @ average.T,
        shared_errors=estimate.shared_through(average),
        provenance=(*estimate.provenance, "symmetric part taken"),
    )


@dataclass(frozen=True)
class AntisymmetricPart(FrozenRecord):
    """``(A_ij - A_ji)/2`` for i < j, of M, B and K (rows), in the units of the estimate.

    `value`, `sd` (3, c).
    `names` (3, c) tuple of tuples of str: ``M_12`` is the name of ``(M_12 - M_21)/2``.
    """

    names: tuple[tuple[str, ...], ...]
    value: Annotated[FloatArray, "3 c"]
    sd: Annotated[FloatArray, "3 c"]
    dof: float

    @property
    def t(self) -> FloatArray:
        """Value over standard error, (3, c); nan where the standard error is zero."""
        undefined = np.full_like(self.value, np.nan)
        return np.divide(self.value, self.sd, out=undefined, where=self.sd > 0)

    @property
    def p(self) -> FloatArray:
        """Two-sided probability that |t| of a symmetric arm exceeds this value, (3, c)."""
        return np.asarray(2 * stdtr(self.dof, -np.abs(self.t)))

    def interval(self, level: float = 0.95) -> FloatArray:
        """Confidence limits, (3, c, 2)."""
        return t_interval(self.value, self.sd, self.dof, level)


def antisymmetric_part(estimate: ImpedanceEstimate) -> AntisymmetricPart:
    """The antisymmetric coefficients of M, B and K: one each for two axes, three for three.

    Parameters
    ----------
    estimate : ImpedanceEstimate

    Returns
    -------
    AntisymmetricPart
    """
    pairs, differences = _differences(estimate.k)
    variance = np.diag(differences @ estimate.covariance @ differences.T)
    symbols = [symbol for symbol, _ in MATRICES.values()]
    return AntisymmetricPart(
        names=tuple(tuple(f"{symbol}_{i}{j}" for i, j in pairs) for symbol in symbols),
        value=(differences @ estimate.parameters).reshape(3, -1),
        sd=np.sqrt(np.maximum(variance, 0)).reshape(3, -1),
        dof=estimate.dof,
    )


@cache
def _differences(k: int) -> tuple[tuple[tuple[int, int], ...], FloatArray]:
    """Index pairs above the diagonal, from 1, and the map of M, B, K to ``(A_ij - A_ji)/2``."""
    rows, columns = np.triu_indices(k, 1)
    # coefficients (c,) = (A_ij - A_ji)/2 = D (c, k^2) vec(A) (k^2,)
    difference = (np.eye(k * k) - transposition(k))[rows * k + columns] / 2
    pairs = tuple((int(i) + 1, int(j) + 1) for i, j in zip(rows, columns, strict=True))
    return pairs, frozen(np.kron(np.eye(3), difference))
