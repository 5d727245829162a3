"""Size of every inner mode along every direction, estimated together with M, B and K.

The column of a mode is bilinear in its direction n, so that nine sums for each mode are enough for
all directions. The columns use the motion expected from the other trials: with its own noise in the
column, the noise of M x'' would be taken for a mode.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.records import Window
from armimpedance.hand.still.doubts.inner_modes import (
    INNER_DIRECTIONS,
    InnerMode,
    half_sphere,
    modes_of,
)
from armimpedance.hand.still.modal import ModalEquation, SharedCourse
from armimpedance.numerics.regression import TrialEquations


@dataclass(frozen=True, eq=False)
class InnerFits:
    """Sizes S of g modes along c directions, as shares of K's (or M's) mean diagonal.

    `size`, `error` (g, c): the error is that of the noise's covariance.
    `shift` (g, c, 3 d^2): error of M, B and K for one unit of S.
    """

    modes: tuple[InnerMode, ...]
    size: FloatArray
    error: FloatArray
    shift: FloatArray

    @cached_property
    def best(self) -> tuple[int, int]:
        """Mode and direction with the largest ratio of size to standard error."""
        at = np.unravel_index(int(np.argmax(self.size / self.error)), self.size.shape)
        return int(at[0]), int(at[1])

    def wider(self, factor: float) -> InnerFits:
        """Copy with errors multiplied by a factor."""
        return InnerFits(self.modes, self.size, factor * self.error, self.shift)


def together(fits: Sequence[InnerFits]) -> InnerFits:
    """Mean over conditions, weighted by the precision of the sizes in each."""
    weight = np.array([fit.error**-2.0 for fit in fits])
    total = weight.sum(axis=0)
    size = (weight * [fit.size for fit in fits]).sum(axis=0) / total
    shift = np.mean([fit.shift for fit in fits], axis=0)
    return InnerFits(fits[0].modes, size, total**-0.5, shift)


@dataclass(frozen=True, eq=False)
class InnerSetting:
    """A weighted fit to which inner modes are added.

    `weight` (d n, d n): V. `instruments` (T, 3 d, n) or None: Z, None where it is W itself.
    `plain`: sums of ``Z^T V W`` and ``Z^T V y``. `theta` (3 d^2,): M, B, K.
    """

    window: Window
    equation: ModalEquation
    weight: FloatArray
    instruments: FloatArray | None
    plain: TrialEquations
    theta: FloatArray

    @cached_property
    def _blocks(self) -> FloatArray:
        """V as (d, n, d, n)."""
        d, n = self.equation.axes, self.equation.modes.count
        return self.weight.reshape(d, n, d, n)

    @cached_property
    def _inverse(self) -> FloatArray:
        return np.asarray(np.linalg.inv(self.plain.A.sum(axis=0)))

    @cached_property
    def _force(self) -> FloatArray:
        """V y, (T, d, n)."""
        return np.asarray(
            np.einsum("anck,tck->tan", self._blocks, self.equation.force, optimize=True)
        )

    @cached_property
    def _displacement(self) -> FloatArray:
        used = self.window.usable
        return self.window.position[used] - self.window.position_at_onset[used][:, None]

    def column(self, mode: InnerMode) -> FloatArray:
        """g x (T, d, n) of a mode, in the unit of S."""
        smooth, rate = self.equation.modes.smooth, self.window.sample_rate_hz
        return self._unit(mode) * mode.columns(self._displacement, smooth, rate)

    def _unit(self, mode: InnerMode) -> float:
        """Value of a size of one: the mean of M's or K's diagonal."""
        d = self.equation.axes
        mass, _, stiffness = (float(np.trace(part)) / d for part in self.theta.reshape(3, d, d))
        return mass if mode.carried else stiffness

    def fits(self, free_wrist: bool) -> InnerFits:
        """Sizes of all modes along all directions.

        M and B are those of a sudden motion; with a free wrist, which always gives way, those of a
        slow one.
        """
        n = half_sphere(INNER_DIRECTIONS)
        pairs = (n[:, :, None] * n[:, None]).reshape(len(n), -1)
        modes = modes_of(free_wrist)
        shared = None if self.instruments is None else SharedCourse.of(self.equation)
        sized = [self._sized(self.column(mode), shared, pairs) for mode in modes]
        size, error, shift = (np.array(part) for part in zip(*sized, strict=True))
        if free_wrist:
            slow = np.array([[curve, slope, 0.0] for slope, curve in (m.slow for m in modes)])
            unit = np.array([self._unit(mode) for mode in modes])
            more = np.einsum("g,gm,cp->gcmp", unit, slow, pairs)
            shift = shift - more.reshape(shift.shape)
        return InnerFits(modes, size, error, shift)

    def _sized(
        self, z: FloatArray, shared: SharedCourse | None, pairs: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """S (c,) of one mode along ``n n^T`` (c, d^2), its error, and shifts (c, 3 d^2)."""
        expected = z if shared is None else shared.expected(z[:, None])[:, 0]
        W = self.equation.regressors
        Z = W if self.instruments is None else self.instruments
        V, inverse, b = self._blocks, self._inverse, self.plain.b.sum(axis=0)
        d = self.equation.axes
        # e_a z_b^T are columns (a, b): C^T V C (d^2, d^2), C^T V W and (Z^T V C)^T (d^2, 3 d^2)
        own = np.einsum("anck,bnek->abce", V, _summed(expected, z), optimize=True)
        own = own.reshape(d * d, -1)
        left, right = (_against(V, _summed(*two), d) for two in ((expected, W), (z, Z)))
        target = np.einsum("tbn,tan->ab", expected, self._force).ravel()
        # (C^T V C - C^T V W P^-1 Z^T V C) along n n^T
        solved = inverse @ right.T
        precision = np.einsum("ci,ij,cj->c", pairs, own - left @ solved, pairs)
        precision = np.maximum(precision, 1e-300)
        size = pairs @ (target - left @ inverse @ b) / precision
        return size, precision**-0.5, pairs @ solved.T


def _summed(first: FloatArray, second: FloatArray) -> FloatArray:
    """``sum_t first_t (b, n) second_t (r, k)``, (b, n, r, k)."""
    T = len(first)
    flat = first.reshape(T, -1).T @ second.reshape(T, -1)
    return flat.reshape(*first.shape[1:], *second.shape[1:])


def _against(V: FloatArray, sums: FloatArray, d: int) -> FloatArray:
    """C^T V W (d^2, 3 d^2): columns e_a z_b^T against those of M, B, K, row by row."""
    products = np.einsum("anik,bnrk->abri", V, sums, optimize=True)
    return products.reshape(d, d, -1, d, d).transpose(0, 1, 2, 4, 3).reshape(d * d, -1)
