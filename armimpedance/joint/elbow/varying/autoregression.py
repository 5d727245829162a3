"""An autoregressive torque, and the operator that makes it white: what a subject adds unasked.

    v_t = a_1 v_(t-1) + ... + a_p v_(t-p) + w_t,      w ~ sd^2

One pole near 1 is an Ornstein-Uhlenbeck process (slow voluntary torque); a pair of poles near the
unit circle is a tremor. The operator A with ``A Cov(v) A^T = sd^2 1`` is banded: row t is
``(1, -a_1, ..., -a_p)``, and the first p rows of a trial take what came before from the stationary
covariance.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import toeplitz

from armimpedance.core.arrays import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Autoregression:
    """A stationary process of order p; order 0 with `sd` 0 is no torque at all.

    Attributes
    ----------
    coefficients : (p,)
    sd : float
        Standard deviation of the innovation, N m.
    """

    coefficients: FloatArray = field(default_factory=lambda: np.zeros(0))
    sd: float = 0.0

    @property
    def order(self) -> int:
        """Number p of coefficients."""
        return len(self.coefficients)

    @cached_property
    def covariance(self) -> FloatArray:
        """Autocovariance at lags 0 to p, (p + 1,), N m^2: the equations of Yule and Walker."""
        p = self.order
        # M (p + 1, p + 1) r = (sd^2, 0, ...)
        M = np.zeros((p + 1, p + 1))
        row = np.concatenate([[1.0], -self.coefficients])
        for i in range(p + 1):
            for j in range(p + 1):
                M[i, abs(i - j)] += row[j]
        right = np.zeros(p + 1)
        right[0] = self.sd**2
        return np.asarray(np.linalg.solve(M, right))

    @property
    def rms(self) -> float:
        """Root mean square of the torque, N m."""
        return float(np.sqrt(self.covariance[0]))

    def slower(self, factor: float) -> Autoregression:
        """The same innovation, the longest time constant of a real pole so many times as long."""
        # poles z (p,) of z^p = a_1 z^(p - 1) + ... + a_p
        poles = np.roots(np.append(1.0, -self.coefficients)).astype(complex)
        real = np.flatnonzero((np.abs(poles.imag) < 1e-9) & (poles.real > 0))
        if not len(real):
            return self
        slowest = real[poles[real].real.argmax()]
        poles[slowest] = poles[slowest].real ** (1 / factor)
        return Autoregression(np.asarray(-np.poly(poles).real[1:], dtype=np.float64), self.sd)

    def spectrum(self, frequency: FloatArray) -> FloatArray:
        """Power per sample at frequencies (f,) in cycles per sample; its mean is the variance."""
        return self.spectrum_at(phases(frequency, self.order))

    def spectrum_at(self, phase: NDArray[np.complex128]) -> FloatArray:
        """The same at `phases` (f, p)."""
        return np.asarray(self.sd**2 / np.abs(1 - phase @ self.coefficients) ** 2)

    def slope_at(self, phase: NDArray[np.complex128]) -> FloatArray:
        """Derivative of the power at `phases` (f, p) by the coefficients, (f, p)."""
        error = 1 - phase @ self.coefficients
        square = np.abs(error) ** 2
        # S = sd^2 / |e|^2 with e = 1 - phase a (f,):  dS/da_k = 2 S Re(e* phase_k) / |e|^2
        turned = (error.conj()[:, None] * phase).real
        return np.asarray(2 * (self.sd**2 / square**2)[:, None] * turned)

    def operator(self, lengths: IntArray) -> FloatArray:
        """A of trials of so many rows, lower banded: ``A[i, i - k]`` at [k, i], (p + 1, R)."""
        p, R = self.order, int(np.sum(lengths))
        A = np.zeros((p + 1, R))
        A[0], A[1:] = 1.0, -self.coefficients[:, None]
        first = self._first
        start = 0
        for length in lengths:
            for i in range(min(p, int(length))):
                A[:, start + i] = 0.0
                A[: i + 1, start + i] = first[i, i::-1]
            start += int(length)
        return A

    @cached_property
    def _first(self) -> FloatArray:
        """The first p rows of A, (p, p): sd times the inverse Cholesky factor of Cov(v)."""
        if not self.order:
            return np.zeros((0, 0))
        lower = np.linalg.cholesky(toeplitz(self.covariance[:-1]))
        return np.asarray(self.sd * np.linalg.inv(lower))


def phases(frequency: FloatArray, order: int) -> NDArray[np.complex128]:
    """``exp(-2 pi i f k)`` of lags k = 1 to p, (f, p)."""
    return np.asarray(np.exp(-2j * np.pi * frequency[:, None] * np.arange(1, order + 1)))


def applied(operator: FloatArray, columns: FloatArray) -> FloatArray:
    """``A columns`` for A of `Autoregression.operator` and columns (R, q)."""
    out = operator[0][:, None] * columns
    for k in range(1, len(operator)):
        out[k:] += operator[k, k:, None] * columns[: len(columns) - k]
    return np.asarray(out)


def transposed(operator: FloatArray, columns: FloatArray) -> FloatArray:
    """``A^T columns`` for A of `Autoregression.operator` and columns (R, q)."""
    out = operator[0][:, None] * columns
    for k in range(1, len(operator)):
        out[: len(columns) - k] += operator[k, k:, None] * columns[k:]
    return np.asarray(out)


def from_reflections(reflections: FloatArray, sd: float) -> Autoregression:
    """The stable process of reflection coefficients (p,) within -1..1 (Levinson's recursion)."""
    a = np.zeros(0)
    for r in reflections:
        a = np.append(a - r * a[::-1], r)
    return Autoregression(a, sd)


def by_reflection(reflections: FloatArray) -> FloatArray:
    """Derivative (p, p) of the coefficients of `from_reflections` by what they come from."""
    a, slope = np.zeros(0), np.zeros((0, len(reflections)))
    for k, r in enumerate(reflections):
        own = np.eye(1, len(reflections), k)
        slope = np.vstack([slope - r * slope[::-1] - a[::-1, None] * own, own])
        a = np.append(a - r * a[::-1], r)
    return slope


def reflections_of(covariance: FloatArray) -> tuple[FloatArray, float]:
    """Reflection coefficients (p,) and the innovation's variance of autocovariances (p + 1,)."""
    a, variance = np.zeros(0), float(covariance[0])
    out = []
    for k in range(1, len(covariance)):
        r = (covariance[k] - a @ covariance[k - 1 : 0 : -1]) / variance
        r = float(np.clip(r, -0.999, 0.999))
        out.append(r)
        a = np.append(a - r * a[::-1], r)
        variance *= 1 - r**2
    return np.array(out), variance
