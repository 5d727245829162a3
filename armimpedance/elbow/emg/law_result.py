"""K, B or torque as a linear law of EMG amplitudes: coefficients, what it predicts, how sure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.arrays import BoolArray, FloatArray, frozen_array
from armimpedance.errors import InputError
from armimpedance.regression import NamedParameter, t_interval

#: Units of what a law gives.
LAW_UNITS: Final = {"K": "Nm/rad", "B": "Nm s/rad", "torque": "Nm"}
#: Beyond the measured amplitudes by more than this part of their range is extrapolation.
_BEYOND: Final = 0.05


@dataclass(frozen=True)
class LawPrediction:
    """What a law says at P amplitudes.

    Attributes
    ----------
    value, sd : (P,)
        Of the law itself; single points scatter about it by `LinearLaw.scatter` more.
    dof : float
    outside : (P,) bool
        Beyond the amplitudes that the law was fitted to.
    """

    value: FloatArray
    sd: FloatArray
    dof: float
    outside: BoolArray

    def interval(self, level: float = 0.95) -> FloatArray:
        """Confidence limits, (P, 2)."""
        return t_interval(self.value, self.sd, self.dof, level)


@dataclass(frozen=True)
class LinearLaw:
    """``y = c_0 + sum_i c_i s_i`` over m amplitudes, fitted to L points.

    Attributes
    ----------
    symbol : str
        "K", "B" or "torque".
    muscles : tuple of m str
    coefficients, naive : (m + 1,)
        With errors of the amplitudes accounted for, and plain (weighted) least squares.
    covariance, naive_covariance : (m + 1, m + 1)
    dof : float
    scatter : float
        Standard deviation of points about the law beyond their stated errors.
    r2 : float
        Of the points, weighted.
    cond_raw, cond_scaled : float
        Of the columns [1, s], and of the same with unit lengths, about their means.
    reliability : float
        Part of the least certain combination of amplitudes that errors do not explain.
    lowest, highest : (m,)
        Amplitudes that were measured.
    n : int
        Points L.
    warnings : tuple of str
    """

    symbol: str
    muscles: tuple[str, ...]
    coefficients: FloatArray
    naive: FloatArray
    covariance: FloatArray
    naive_covariance: FloatArray
    dof: float
    scatter: float
    r2: float
    cond_raw: float
    cond_scaled: float
    reliability: float
    lowest: FloatArray
    highest: FloatArray
    n: int
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        put, m = object.__setattr__, len(self.muscles)
        for name in ("coefficients", "naive"):
            put(self, name, frozen_array(getattr(self, name), name, (m + 1,)))
        for name in ("covariance", "naive_covariance"):
            put(self, name, frozen_array(getattr(self, name), name, (m + 1, m + 1)))
        for name in ("lowest", "highest"):
            put(self, name, frozen_array(getattr(self, name), name, (m,)))

    @property
    def unit(self) -> str:
        """Of all coefficients: amplitudes are parts of the maximum contraction."""
        return LAW_UNITS[self.symbol]

    @property
    def names(self) -> tuple[str, ...]:
        """``k0, k_<muscle>, ...``: the symbol in lower case (torque: a)."""
        letter = "a" if self.symbol == "torque" else self.symbol.lower()
        return (f"{letter}0", *(f"{letter}_{muscle}" for muscle in self.muscles))

    @property
    def sd(self) -> FloatArray:
        """Standard errors of `coefficients`, (m + 1,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def attenuation(self) -> FloatArray:
        """``naive / corrected``, (m + 1,): what errors of the amplitudes made of each."""
        known = self.coefficients != 0
        return np.divide(self.naive, self.coefficients, out=np.ones_like(self.naive), where=known)

    def interval(self, level: float = 0.95) -> FloatArray:
        """Confidence limits of `coefficients`, (m + 1, 2)."""
        return t_interval(self.coefficients, self.sd, self.dof, level)

    @property
    def parameters(self) -> tuple[NamedParameter, ...]:
        """For FIT.json: `sd` is the naive fit's, `sd_robust` the one to trust."""
        plain = np.sqrt(np.diag(self.naive_covariance))
        columns = zip(self.names, self.coefficients, plain, self.sd, strict=True)
        return tuple(
            NamedParameter(name, float(c), float(s), float(r), self.unit, self.dof)
            for name, c, s, r in columns
        )

    def predict(self, amplitude: ArrayLike, amplitude_sd: ArrayLike = 0.0) -> LawPrediction:
        """The law at amplitudes (P, m), with standard errors of them (broadcast) if known.

        Raises
        ------
        InputError
            Not one amplitude per muscle.
        """
        s = np.atleast_2d(np.asarray(amplitude, dtype=np.float64))
        m = len(self.muscles)
        if s.ndim != 2 or s.shape[1] != m:
            raise InputError(f"amplitudes of shape {s.shape}", expected=f"(points, {m})")
        errors = np.broadcast_to(np.asarray(amplitude_sd, dtype=np.float64), s.shape)
        W = constant_and(s)
        variance = np.einsum("pi,ij,pj->p", W, self.covariance, W)
        variance += ((errors * self.coefficients[1:]) ** 2).sum(axis=1)
        slack = _BEYOND * (self.highest - self.lowest)
        beyond = (s < self.lowest - slack) | (s > self.highest + slack)
        outside = np.asarray(beyond.any(axis=1))
        return LawPrediction(W @ self.coefficients, np.sqrt(variance), self.dof, outside)


@dataclass(frozen=True)
class EmgLaw:
    """The laws of K and, where it was given, of B."""

    stiffness: LinearLaw
    viscosity: LinearLaw | None = None

    @property
    def warnings(self) -> tuple[str, ...]:
        """Of both laws."""
        laws = (self.stiffness, self.viscosity)
        return tuple(dict.fromkeys(w for law in laws if law for w in law.warnings))


def constant_and(amplitude: FloatArray) -> FloatArray:
    """W (L, m + 1): a constant and the amplitudes (L, m)."""
    return np.column_stack([np.ones(len(amplitude)), amplitude])
