"""Equation of motion of a condition with one channel filtered, and its residual after M, B and K.

The search for a filter evaluates this hundreds of times. So only the signals of the filtered
channel are computed again, and trials are summed before anything is solved.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import Kind
from armimpedance.core.records import Window
from armimpedance.hand.still.doubts.passed import Passed
from armimpedance.hand.still.modal import (
    ModalEquation,
    about_rest,
    expected_motion,
    modal_equation,
    names_and_units,
)
from armimpedance.hand.still.weighing import weighted_fit
from armimpedance.numerics.regression import TrialEquations, solve_total


@dataclass(frozen=True, eq=False)
class FilteredRows:
    """Window of a condition, its rows as measured, and their weight.

    `root` (d n, d n): R of the weight ``V = R R^T``.
    `moved`, `pushed` (d T, S): displacement, and force less its rest, of the usable trials.
    """

    window: Window
    kind: Kind
    root: FloatArray
    equation: ModalEquation
    moved: FloatArray
    pushed: FloatArray

    @classmethod
    def of(cls, window: Window, kind: Kind, passed: Passed | None) -> FilteredRows:
        """Build the rows, weighted by the noise that remains with a filter (None: without one)."""
        fit = weighted_fit(window if passed is None else passed.through(window), kind)
        # V = C^-1 with C = G G^T, so that R = G^-T
        R = np.linalg.inv(np.linalg.cholesky(fit.noise.covariance(fit.parameters))).T
        if passed is not None and passed.other == "force":
            # V of L y is L^-T V L^-1
            R = _of_modes(fit.equation, passed, window.sample_rate_hz).T @ R
        return cls(window, kind, R, modal_equation(window), *about_rest(window))

    @property
    def weight(self) -> FloatArray:
        """V (d n, d n)."""
        return np.asarray(self.root @ self.root.T)

    def left(self, passed: Passed | None) -> tuple[float, FloatArray, int]:
        """Weighted sum of squared residuals with a filter, M, B and K, and the number of rows."""
        equation, R = self._through(passed)
        Z = expected_motion(equation)
        X = self._weighed(equation.regressors, R)
        y = equation.force.reshape(equation.trials, -1) @ R
        # the filter must not be credited with the noise of the motion that it removes
        free = X if Z is None else self._weighed(Z, R)
        # (sum_t Z_t^T V W_t) (3 d^2, 3 d^2) theta = sum_t Z_t^T V y_t
        A = np.tensordot(free, X, axes=((0, 2), (0, 2)))
        b = np.tensordot(free, y, axes=((0, 2), (0, 1)))
        theta = solve_total(
            TrialEquations(A[None], b[None], *names_and_units(self.kind, equation.axes))
        )
        r = y - np.tensordot(theta, free, axes=(0, 1))
        return float((r * r).sum()), theta, r.size

    def _through(self, passed: Passed | None) -> tuple[ModalEquation, FloatArray]:
        """The equation with the other channel filtered, and R of its rows."""
        if passed is None:
            return self.equation, self.root
        rate, equation = self.window.sample_rate_hz, self.equation
        d, n = equation.axes, equation.modes.count
        if passed.other == "position":
            motion = passed.of_rows(self.moved, rate) @ equation.modes.stacked.T
            motion = motion.reshape(d, -1, equation.matrices, n).transpose(1, 2, 0, 3)
            return replace(equation, motion=np.ascontiguousarray(motion)), self.root
        force = -passed.of_rows(self.pushed, rate) @ equation.modes.smooth.T
        force = np.ascontiguousarray(force.reshape(d, -1, n).transpose(1, 0, 2))
        # a force that is filtered here has filtered noise: R of L y is L^-T R
        R = np.linalg.solve(_of_modes(equation, passed, rate).T, self.root)
        return replace(equation, force=force), np.asarray(R)

    def _weighed(self, regressors: FloatArray, R: FloatArray) -> FloatArray:
        """``W_t^T R`` (T, 3 d^2, d n) of regressors (T, 3 d, n): row (m, i, k) is x_k^(m) R_i."""
        T, rows, n = regressors.shape
        d = len(R) // n
        # (T 3 d, n) times every axis's rows of R, (d, n, d n)
        weighed = regressors.reshape(T * rows, n) @ R.reshape(d, n, d * n)
        weighed = weighed.reshape(d, T, rows // d, d, d * n).transpose(1, 2, 0, 3, 4)
        return weighed.reshape(T, rows * d, d * n)


def _of_modes(equation: ModalEquation, passed: Passed, rate_hz: float) -> FloatArray:
    """Matrix L (d n, d n) of a filter on the rows of the force."""
    smooth = equation.modes.smooth
    # (n, S) times the filtered modes (S, n), for each axis
    return np.asarray(np.kron(np.eye(equation.axes), smooth @ passed.of_rows(smooth, rate_hz).T))
