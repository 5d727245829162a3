"""Bias, error, coverage and efficiency of many sessions, added up block by block."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Final, Self

import numpy as np
from scipy.special import ndtri

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.lab.simulate_study.rig import BOUND, ESTIMATE, HIGH, LOW, SD, TRUTH, Quantity

Z: Final = float(ndtri(0.975))


@dataclass(frozen=True)
class Sums:
    """Sums over sessions, each (Q,); a sum of two is that of both their sessions."""

    n: FloatArray
    failed: FloatArray
    truth: FloatArray
    error: FloatArray
    squared: FloatArray
    fourth: FloatArray
    sd: FloatArray
    held: FloatArray
    bounded: FloatArray
    bound: FloatArray
    bounded_squared: FloatArray

    def __add__(self, other: Self) -> Sums:
        both = ((getattr(self, f.name), getattr(other, f.name)) for f in fields(self))
        return Sums(*(one + two for one, two in both))

    @property
    def bias(self) -> FloatArray:
        """Mean error."""
        return self.error / self.n

    @property
    def bias_se(self) -> FloatArray:
        """Its standard error."""
        return np.sqrt(np.maximum(self.squared / self.n - self.bias**2, 0) / (self.n - 1))

    @property
    def rmse(self) -> FloatArray:
        """Root of the mean squared error."""
        return np.sqrt(self.squared / self.n)

    @property
    def rmse_se(self) -> FloatArray:
        """Its standard error, to first order."""
        mean = self.squared / self.n
        spread = np.sqrt(np.maximum(self.fourth / self.n - mean**2, 0) / (self.n - 1))
        return spread / (2 * self.rmse)

    @property
    def coverage(self) -> FloatArray:
        """Share of the 95 % intervals that hold the truth."""
        return self.held / self.n

    @property
    def efficiency(self) -> FloatArray:
        """Mean variance of the Cramer-Rao bound over the mean squared error."""
        return self.bound / self.bounded_squared


def sums_of(values: FloatArray, quantities: tuple[Quantity, ...]) -> Sums:
    """Sums over sessions.

    Parameters
    ----------
    values : (n, Q, 7)
    quantities : tuple of Q Quantity

    Returns
    -------
    Sums
    """
    there = np.isfinite(values[..., ESTIMATE])
    truth = values[..., TRUTH]
    error, held = errors_of(values, quantities)
    squared = np.where(there, error**2, 0)
    bound = values[..., BOUND]
    bounded = there & np.isfinite(bound)
    return Sums(
        n=there.sum(axis=0).astype(float),
        failed=(~there).sum(axis=0).astype(float),
        truth=np.where(there, truth, 0).sum(axis=0),
        error=np.where(there, error, 0).sum(axis=0),
        squared=squared.sum(axis=0),
        fourth=(squared**2).sum(axis=0),
        sd=np.where(there, values[..., SD], 0).sum(axis=0),
        held=(held & there).sum(axis=0).astype(float),
        bounded=bounded.sum(axis=0).astype(float),
        bound=np.where(bounded, bound**2, 0).sum(axis=0),
        bounded_squared=np.where(bounded, squared, 0).sum(axis=0),
    )


def errors_of(values: FloatArray, quantities: tuple[Quantity, ...]) -> tuple[FloatArray, BoolArray]:
    """Error (n, Q) of every estimate, and whether its interval holds the truth."""
    truth, low, high = values[..., TRUTH], values[..., LOW], values[..., HIGH]
    error = values[..., ESTIMATE] - truth
    held = (low <= truth) & (truth <= high)
    for q, quantity in enumerate(quantities):
        if quantity.kind == "axis":
            error[:, q] = half_turn(error[:, q])
            for turn in (-np.pi, np.pi):
                turned = truth[:, q] + turn
                held[:, q] |= (low[:, q] <= turned) & (turned <= high[:, q])
    return error, held


def half_turn(angle: FloatArray) -> FloatArray:
    """The same axis in (-pi/2, pi/2]."""
    return np.asarray(np.pi / 2 - np.mod(np.pi / 2 - angle, np.pi))


def wilson(held: FloatArray, n: FloatArray) -> tuple[FloatArray, FloatArray]:
    """95 % limits of a share after Wilson.

    Parameters
    ----------
    held, n : (Q,)
        How many of how many.

    Returns
    -------
    low, high : (Q,)
    """
    share = held / n
    middle = (share + Z**2 / (2 * n)) / (1 + Z**2 / n)
    reach = Z / (1 + Z**2 / n) * np.sqrt(share * (1 - share) / n + Z**2 / (4 * n**2))
    # rounding must not leave the share itself outside
    return np.clip(middle - reach, 0, share), np.clip(middle + reach, share, 1)
