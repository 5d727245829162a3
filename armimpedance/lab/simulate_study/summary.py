"""Bias, error, coverage and efficiency of many sessions, added up block by block."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Final, Self

import numpy as np
from scipy.special import ndtri, stdtrit

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.hand.ellipses import half_turn
from armimpedance.lab.simulate_study.rig import (
    BOUND,
    DOF,
    ESTIMATE,
    HIGH,
    LOW,
    SD,
    TRUTH,
    StudyQuantity,
)

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


def sums_of(values: FloatArray, quantities: tuple[StudyQuantity, ...]) -> Sums:
    """Sums over sessions.

    `values` (n, Q, 7).
    """
    finite = np.isfinite(values[..., ESTIMATE])
    truth = values[..., TRUTH]
    error, covered = errors_of(values, quantities)
    squared = np.where(finite, error**2, 0)
    bound = values[..., BOUND]
    bounded = finite & np.isfinite(bound)
    return Sums(
        n=finite.sum(axis=0).astype(float),
        failed=(~finite).sum(axis=0).astype(float),
        truth=np.where(finite, truth, 0).sum(axis=0),
        error=np.where(finite, error, 0).sum(axis=0),
        squared=squared.sum(axis=0),
        fourth=(squared**2).sum(axis=0),
        sd=np.where(finite, values[..., SD], 0).sum(axis=0),
        held=(covered & finite).sum(axis=0).astype(float),
        bounded=bounded.sum(axis=0).astype(float),
        bound=np.where(bounded, bound**2, 0).sum(axis=0),
        bounded_squared=np.where(bounded, squared, 0).sum(axis=0),
    )


def errors_of(
    values: FloatArray, quantities: tuple[StudyQuantity, ...]
) -> tuple[FloatArray, BoolArray]:
    """Error (n, Q) of every estimate, and whether its interval holds the truth."""
    truth, low, high = values[..., TRUTH], values[..., LOW], values[..., HIGH]
    error = values[..., ESTIMATE] - truth
    covered = (low <= truth) & (truth <= high)
    for q, quantity in enumerate(quantities):
        if quantity.kind == "axis":
            error[:, q] = half_turn(error[:, q])
            for turn in (-np.pi, np.pi):
                turned = truth[:, q] + turn
                covered[:, q] |= (low[:, q] <= turned) & (turned <= high[:, q])
    return error, covered


def wilson(covered: FloatArray, n: FloatArray) -> tuple[FloatArray, FloatArray]:
    """95 % limits of a share after Wilson.

    `held`, `n` (Q,): how many of how many.
    Returns: `low`, `high` (Q,).
    """
    share = covered / n
    middle = (share + Z**2 / (2 * n)) / (1 + Z**2 / n)
    reach = Z / (1 + Z**2 / n) * np.sqrt(share * (1 - share) / n + Z**2 / (4 * n**2))
    # rounding must not leave the share itself outside
    return np.clip(middle - reach, 0, share), np.clip(middle + reach, share, 1)


# Changes from one condition to another, and how often they are found.


@dataclass(frozen=True)
class ChangeSums:
    """Sums over sessions, each (Q,); logarithms where the change is a ratio."""

    n: FloatArray
    failed: FloatArray
    truth: FloatArray
    change: FloatArray
    found: FloatArray
    held: FloatArray

    def __add__(self, other: Self) -> ChangeSums:
        both = ((getattr(self, f.name), getattr(other, f.name)) for f in fields(self))
        return ChangeSums(*(one + two for one, two in both))

    @property
    def power(self) -> FloatArray:
        """Share of the 95 % intervals of the change that do not hold zero."""
        return self.found / self.n

    @property
    def coverage(self) -> FloatArray:
        """Share of them that hold the true change."""
        return self.held / self.n


def change_sums(
    first: FloatArray, second: FloatArray, quantities: tuple[StudyQuantity, ...]
) -> ChangeSums:
    """Sums over sessions.

    `first`, `second` (n, Q, 7).
    """
    # what has no ellipse is nan all through, and a shape next to nothing has no logarithm
    with np.errstate(all="ignore"):
        change, low, high, truth = changes(first, second, quantities)
    finite = np.isfinite(change)
    detected, covered = (low > 0) | (high < 0), (low <= truth) & (truth <= high)
    for q, quantity in enumerate(quantities):
        if quantity.kind == "axis":
            for turn in (-np.pi, np.pi):
                detected[:, q] &= (low[:, q] > turn) | (high[:, q] < turn)
                covered[:, q] |= (low[:, q] <= truth[:, q] + turn) & (
                    truth[:, q] + turn <= high[:, q]
                )
    return ChangeSums(
        finite.sum(axis=0).astype(float),
        (~finite).sum(axis=0).astype(float),
        np.where(finite, truth, 0).sum(axis=0),
        np.where(finite, change, 0).sum(axis=0),
        (detected & finite).sum(axis=0).astype(float),
        (covered & finite).sum(axis=0).astype(float),
    )


def changes(
    first: FloatArray, second: FloatArray, quantities: tuple[StudyQuantity, ...]
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """The change, its 95 % limits and the true one, each (n, Q), as `hand.comparison.changes` has
    them.

    Ratios as logarithms. Sizes and elements: variances add, degrees of freedom after Welch and
    Satterthwaite. Shapes and axes have limits of their own, which are combined after Zou and
    Donner (2008).
    """
    kinds = np.array([quantity.kind for quantity in quantities])
    logs, axes = np.isin(kinds, ("ratio", "share")), kinds == "axis"
    one, two = _on_scale(first, logs), _on_scale(second, logs)
    change, truth = (two[..., at] - one[..., at] for at in (ESTIMATE, TRUTH))
    change[:, axes], truth[:, axes] = half_turn(change[:, axes]), half_turn(truth[:, axes])
    variances = one[..., SD] ** 2, two[..., SD] ** 2
    total = variances[0] + variances[1]
    dof = total**2 / (variances[0] ** 2 / one[..., DOF] + variances[1] ** 2 / two[..., DOF])
    reach = _t(dof) * np.sqrt(total)
    low, high = change - reach, change + reach
    own = axes | (kinds == "share")
    down = np.hypot((two[..., ESTIMATE] - two[..., LOW]), (one[..., HIGH] - one[..., ESTIMATE]))
    up = np.hypot((two[..., HIGH] - two[..., ESTIMATE]), (one[..., ESTIMATE] - one[..., LOW]))
    low[:, own], high[:, own] = (change - down)[:, own], (change + up)[:, own]
    for q in np.flatnonzero(axes):
        anything = high[:, q] - low[:, q] >= np.pi
        for side in (one, two):
            anything |= side[:, q, HIGH] - side[:, q, LOW] >= np.pi - 1e-12
        low[anything, q], high[anything, q] = -np.pi / 2, np.pi / 2
    return change, low, high, truth


def _on_scale(values: FloatArray, logs: BoolArray) -> FloatArray:
    """Logarithms of what is compared by a ratio, its standard error too."""
    scaled = values.copy(order="K")
    scaled[:, logs, SD] = values[:, logs, SD] / values[:, logs, ESTIMATE]
    for at in (ESTIMATE, LOW, HIGH, TRUTH):
        scaled[:, logs, at] = np.log(values[:, logs, at])
    return scaled


def _t(dof: FloatArray) -> FloatArray:
    """The t distribution's .975 quantile; between the nodes of a table where there are many."""
    if dof.size < 20_000:
        return np.asarray(stdtrit(dof, 0.975))
    nodes = np.linspace(0, 1, 4001)[1:]
    quantiles = stdtrit(1 / nodes, 0.975)
    # In 1/dof the quantile is all but straight; below one degree of freedom there is no table.
    inverse = np.concatenate([[0.0], nodes])
    normal = float(stdtrit(1e12, 0.975))
    value = np.interp(1 / dof, inverse, np.concatenate([[normal], quantiles]))
    return np.asarray(np.where(np.isfinite(dof), value, np.where(np.isnan(dof), np.nan, normal)))
