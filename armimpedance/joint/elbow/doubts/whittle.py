"""Models of one record that compete: linear least squares, each with its own residual spectrum.

The residual's spectrum absorbs what a model misses: judged by the spectrum of another one, a
misfit looks larger or smaller than it is. Each model's deviance is therefore minimised over its
parameters and its spectrum in turn: ``sum nu (ln g + r / g)``, P. Whittle, Ark. Mat. 2, 1953; the
logarithm of g is linear between knots (see `stationary.weights`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.elbow.stationary.weights import hats, knots_of

_ROUNDS: Final = 3
_STEPS: Final = 5
_LONGEST: Final = 1.0


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Hats over the lines, and how many squares each line holds.

    Attributes
    ----------
    hats : (n, k)
    squares : (n,)
    """

    hats: FloatArray
    squares: FloatArray

    @classmethod
    def over(cls, frequency_hz: FloatArray, squares: FloatArray) -> Spectrum:
        """Knots as the weights have them, over lines of all trials (n,)."""
        return cls(hats(np.log(frequency_hz), np.log(knots_of(frequency_hz))), squares)

    def logarithms(self, power: FloatArray) -> FloatArray:
        """``ln g`` (m, n) of each of m residuals with powers (m, n), by Fisher's scoring."""
        weight = self.hats * self.squares[:, None]
        tiny = np.finfo(float).tiny
        logs = np.log(power @ weight / np.maximum(weight.sum(axis=0), tiny) + tiny)
        # (H^T nu H)^-1 (k, k) H^T nu (k, n)
        gain = np.linalg.solve(weight.T @ self.hats, weight.T)
        for _ in range(_STEPS):
            eta = logs @ self.hats.T
            logs = logs + np.clip((power * np.exp(-eta) - 1) @ gain.T, -_LONGEST, _LONGEST)
        return np.asarray(logs @ self.hats.T)


@dataclass(frozen=True, eq=False)
class Fitted:
    """m models of p parameters, each with its own spectrum.

    Attributes
    ----------
    values : (m, p)
    information : (m, p, p)
        X^T W X with the model's own weights; its inverse is the covariance.
    deviance : (m,)
        Minus twice the logarithm of the likelihood, up to a constant that all share.
    eta : (m, n)
        Logarithm of the model's noise power over the reference.
    """

    values: FloatArray
    information: FloatArray
    deviance: FloatArray
    eta: FloatArray

    def one(self, row: int) -> Fitted:
        """Model `row` alone."""
        part = slice(row, row + 1)
        return Fitted(
            self.values[part], self.information[part], self.deviance[part], self.eta[part]
        )


def fit_models(X: FloatArray, y: FloatArray, spectrum: Spectrum, prior: FloatArray) -> Fitted:
    """Fit m models ``y = X p + e`` to the same rows.

    Parameters
    ----------
    X : (m, n, 2, p)
        Real and imaginary part of each line's columns, weighed by the reference.
    y : (n, 2)
    spectrum : Spectrum
    prior : (p,)
        One over the variance of each parameter before the record, about zero; 0 = free.
    """
    m, n, _, p = X.shape
    eta = np.zeros((m, n))
    rows = X.reshape(m, 2 * n, p)
    scale = np.sqrt((rows**2).sum(axis=1)) + np.finfo(float).tiny
    rows = rows / scale[:, None, :]
    ridge = np.einsum("mp,pq->mpq", prior / scale**2, np.eye(p))
    target = y.reshape(2 * n)
    for turn in range(_ROUNDS):
        weight = np.repeat(np.exp(-eta), 2, axis=1)
        weighed = rows * weight[:, :, None]
        # N (m, p, p) = X^T W X + prior, N p (m, p) = X^T W y
        N = np.swapaxes(weighed, 1, 2) @ rows + ridge
        values = np.linalg.solve(N, (np.swapaxes(weighed, 1, 2) @ target)[..., None])[..., 0]
        e = target - (rows @ values[..., None])[..., 0]
        power = (e.reshape(m, n, 2) ** 2).sum(axis=2) / np.maximum(spectrum.squares, 1e-300)
        if turn < _ROUNDS - 1:
            eta = spectrum.logarithms(power)
    last = spectrum.logarithms(power)
    deviance = (spectrum.squares * (last + power * np.exp(-last))).sum(axis=1)
    deviance = deviance + ((values / scale) ** 2 * prior).sum(axis=1)
    return Fitted(values / scale, N * scale[:, :, None] * scale[:, None, :], deviance, eta)
