"""Whiten and smooth a linear state with a random push, measured with noise; many at once.

``d_(i+1) = Phi_i d_i + u_i + b_i w_i`` with w white of variance ``ratio``, and ``y_i = d_i[0] +
n_i`` with n white of variance one; d_0 is given. The Kalman filter turns any sequence of
measurements and inputs into rows that are as white as n (J. Durbin, S. J. Koopman, Time Series
Analysis by State Space Methods, 2nd ed. 2012, chapter 4).

Sizes: S samples, T trials, m columns, V variants of the ratio.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray


@dataclass(frozen=True)
class StateSteps:
    """Steps from one sample to the next, and the measured samples.

    `transition` (S - 1, T, 2, 2). `seen` (S, T) bool: True if measured.
    `push` (S - 1, T, 2): effect of a unit of w in a step.
    """

    transition: FloatArray
    push: FloatArray
    seen: BoolArray

    def spread(self, ratios: FloatArray) -> FloatArray:
        """Covariances P (S, V, T, 2, 2) of the states, given all earlier measurements."""
        S, T = self.seen.shape
        P = np.zeros((S, len(ratios), T, 2, 2))
        b = self.push[:, None, :, :, None]
        Q = ratios[:, None, None, None] * (b * b.swapaxes(-1, -2))
        for i in range(S - 1):
            # P (2, 2) = Phi (P - P H^T F^-1 H P) Phi^T + ratio b b^T, F = H P H^T + 1
            first = P[i, ..., 0]
            share = (self.seen[i] / (first[..., 0] + 1))[..., None, None]
            updated = P[i] - share * first[..., :, None] * first[..., None, :]
            P[i + 1] = self.transition[i] @ updated @ self.transition[i].swapaxes(-1, -2) + Q[i]
        return P

    def whiten(
        self, measured: FloatArray, inputs: FloatArray, start: FloatArray, ratios: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """White rows (V, T, S, m) and the log determinants (V,) of the whitening.

        `measured` (S, T, m), `inputs` (S - 1, T, 2, m).
        `start` (T, 2, m): the first states.
        `ratios` (V,): variances of w over that of n.
        Returns: (rows, logarithms); rows of samples that were not measured are zero.
        """
        S, T, m = measured.shape
        first = self.spread(ratios)[..., 0]
        variance = first[..., 0] + 1
        gain = first / variance[..., None] * self.seen[:, None, :, None]
        rows = np.empty((S, len(ratios), T, m))
        state = np.repeat(start[None], len(ratios), axis=0)
        for i in range(S):
            rows[i] = measured[i] - state[:, :, 0]
            if i < S - 1:
                state = state + gain[i][..., None] * rows[i][:, :, None]
                state = self.transition[i] @ state + inputs[i]
        rows *= (self.seen[:, None] / np.sqrt(variance))[..., None]
        lost = (np.log(variance) * self.seen[:, None]).sum(axis=(0, 2))
        return rows.transpose(1, 2, 0, 3), lost

    def smooth(
        self, measured: FloatArray, inputs: FloatArray, start: FloatArray, ratio: float
    ) -> FloatArray:
        """Likeliest states (S, T, 2) given all measurements.

        `measured` (S, T), `inputs` (S - 1, T, 2).
        `start` (T, 2): the first state.
        """
        S, T = measured.shape
        P = self.spread(np.array([ratio]))[:, 0]
        gain = P[..., 0] / (P[..., 0, 0] + 1)[..., None] * self.seen[..., None]
        ahead, innovation = np.empty((S, T, 2)), np.empty((S, T))
        state = start
        for i in range(S):
            ahead[i], innovation[i] = state, measured[i] - state[:, 0]
            if i < S - 1:
                state = state + gain[i] * innovation[i][:, None]
                state = (self.transition[i] @ state[..., None])[..., 0] + inputs[i]
        innovation *= self.seen / (P[..., 0, 0] + 1)
        later = np.zeros((T, 2))
        for i in range(S - 1, -1, -1):
            # r_(i-1) (2,) = H^T (F^-1 v - K^T Phi^T r_i) + Phi^T r_i
            if i < S - 1:
                later = (self.transition[i].swapaxes(-1, -2) @ later[..., None])[..., 0]
            later[:, 0] += innovation[i] - (gain[i] * later).sum(axis=-1)
            ahead[i] += (P[i] @ later[..., None])[..., 0]
        return ahead
