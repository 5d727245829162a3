"""Twice the log-likelihood of white rows, by columns and by the noise that made them white."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from armimpedance.core.arrays import FloatArray


@dataclass(frozen=True)
class Noise:
    """A model of the noise, and the rows that it makes white.

    Attributes
    ----------
    triangle : (r, m + 1)
        Holds the same products as all white rows, what is to be explained in the last column.
    lost : float
        Logarithm of the determinant that the rows lost when they were made white.
    slow : float
        Size of the slow torque that is part of it, over the noise of a sample; 0: none.
    bump_sd : float
        Standard error of a slow torque of half a second, likewise.
    """

    triangle: FloatArray
    lost: float
    slow: float
    bump_sd: float


@dataclass(frozen=True)
class Fitted:
    """The fit of some columns with the likeliest noise.

    Attributes
    ----------
    deviance : float
        Minus twice the log-likelihood, up to a constant.
    values : (c,)
    covariance : (c, c)
    slow_Nm, bump_sd_Nm : float
        As in `Noise`.
    """

    deviance: float
    values: FloatArray
    covariance: FloatArray
    slow_Nm: float
    bump_sd_Nm: float


@dataclass(frozen=True)
class Evidence:
    """Rows that any choice of columns can be fitted to.

    Attributes
    ----------
    names : tuple of m str
        Of the columns.
    noises : tuple of Noise
    count : int
        Of samples.
    """

    names: tuple[str, ...]
    noises: tuple[Noise, ...]
    count: int

    def fit(self, columns: Sequence[str], *, slow: bool = True) -> Fitted:
        """Fit these columns by the likeliest noise, with or without slow torque.

        Parameters
        ----------
        columns : sequence of c str
        slow : bool
        """
        chosen = [self.names.index(name) for name in columns]
        tried = [noise for noise in self.noises if slow or noise.slow == 0]
        return min((self._fit(chosen, noise) for noise in tried), key=lambda fit: fit.deviance)

    def _fit(self, chosen: list[int], noise: Noise) -> Fitted:
        rows, c = noise.triangle, len(chosen)
        scale = np.linalg.norm(rows[:, chosen], axis=0)
        scale = np.where(scale > 0, scale, 1.0)
        # y (r,) = X (r, c) theta by X = Q R, with columns of length one
        stacked = np.column_stack([rows[:, chosen] / scale, rows[:, -1]])
        R: FloatArray = np.asarray(np.linalg.qr(stacked, mode="r"))
        left = float((R[c:, c] ** 2).sum()) + float(np.finfo(np.float64).tiny)
        inverse = np.linalg.pinv(R[:c, :c], rcond=1e-10) / scale[:, None]
        variance = left / (self.count - c)
        sigma = float(np.sqrt(variance))
        return Fitted(
            self.count * np.log(left) + noise.lost,
            inverse @ R[:c, c],
            variance * inverse @ inverse.T,
            sigma * noise.slow,
            sigma * noise.bump_sd,
        )
