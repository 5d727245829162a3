"""Rows with errors that all conditions share, and errors that each condition draws anew.

    y_p = X_p theta + Z_p u + e_p,   u ~ N(0, 1),   e_p ~ N(0, V_p),   V_p = phi^2 + s^2 D_p D_p^T

of P conditions, r rows each. Restricted likelihood and solution need no matrix larger than the
number of columns: C. R. Henderson's equations (Biometrics 31 (1975) 423-447).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armimpedance.arrays import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class MixedRows:
    """P conditions of r whitened rows, p columns, m muscles.

    A point x (5,) holds logarithms: factors of the pure errors of two groups, sizes of the moment
    arms' errors, of the exponents', and of the moment arms' in single conditions; (2,): factors.

    Attributes
    ----------
    design, target : (P, r, p), (P, r)
    prior : (., p)
        Further rows, fitted to zero with unit variance.
    group : (r,)
    arms, law : (P, r, 2 m), (P, r, m)
        What unit errors do.
    """

    design: FloatArray
    target: FloatArray
    prior: FloatArray
    group: IntArray
    arms: FloatArray
    law: FloatArray

    def negative_log(self, x: FloatArray) -> float:
        """Minus the restricted log likelihood, but for a constant."""
        gram, log_own = self._gram(x)
        try:
            # A (p + c, p + c) [theta, u] = b, the normal equations of all columns
            lower = np.linalg.cholesky(gram[:-1, :-1])
        except np.linalg.LinAlgError:
            return 1e30
        left = gram[-1, -1] - float((np.linalg.solve(lower, gram[:-1, -1]) ** 2).sum())
        return float(log_own / 2 + np.log(np.diag(lower)).sum() + left / 2)

    def likeliest(
        self, first: FloatArray, limits: list[tuple[float, float]]
    ) -> tuple[float, FloatArray]:
        """Least `negative_log` between limits, and where."""
        from scipy.optimize import minimize

        start = np.asarray(np.clip(first, *np.array(limits).T))
        made = minimize(self.negative_log, start, method="L-BFGS-B", bounds=limits, tol=1e-6)
        return float(made.fun), np.asarray(made.x)

    def solution(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Theta (p,) and its covariance (p, p) without shared errors; what those do, (p, c)."""
        gram, _ = self._gram(x)
        p = self.design.shape[-1]
        # C (p, p) = (X^T V^-1 X)^-1, theta = C X^T V^-1 y, moved (p, c) = C X^T V^-1 Z
        C = np.asarray(np.linalg.inv(gram[:p, :p]), dtype=np.float64)
        return C @ gram[:p, -1], C, C @ gram[:p, p:-1]

    def missed(self, x: FloatArray, C: FloatArray, moved: FloatArray) -> FloatArray:
        """What shared errors do to a condition that was not measured, (P, r, c)."""
        lower = self._own(x)
        left = self._shared(x) - self.design @ moved
        # (1 - H_p)^-1 left_p, H_p (r, r) = X_p C X_p^T V_p^-1
        V = lower @ lower.transpose(0, 2, 1)
        H = self.design @ C @ self.design.transpose(0, 2, 1) @ np.linalg.inv(V)
        return np.asarray(np.linalg.pinv(np.eye(len(self.group)) - H) @ left)

    def _own(self, x: FloatArray) -> FloatArray:
        """Cholesky factors of V_p, (P, r, r)."""
        V = np.exp(2 * x[:2])[self.group] * np.eye(len(self.group))
        if len(x) > 2:
            V = V + np.exp(2 * x[4]) * (self.arms @ self.arms.transpose(0, 2, 1))
        return np.asarray(np.linalg.cholesky(np.broadcast_to(V, (len(self.arms), *V.shape[-2:]))))

    def _shared(self, x: FloatArray) -> FloatArray:
        """Z (P, r, c)."""
        if len(x) == 2:
            return self.arms[..., :0]
        return np.concatenate([np.exp(x[2]) * self.arms, np.exp(x[3]) * self.law], axis=-1)

    def _gram(self, x: FloatArray) -> tuple[FloatArray, float]:
        """Gram of [X, Z, y] with errors made white, u's own information in it, and log det V."""
        lower, Z = self._own(x), self._shared(x)
        p, c = self.design.shape[-1], Z.shape[-1]
        columns = np.concatenate([self.design, Z, self.target[..., None]], axis=-1)
        white = np.linalg.solve(lower, columns).reshape(-1, columns.shape[-1])
        gram = white.T @ white
        gram[:p, :p] += self.prior.T @ self.prior
        gram[np.arange(p, p + c), np.arange(p, p + c)] += 1.0
        return gram, 2 * float(np.log(np.diagonal(lower, axis1=1, axis2=2)).sum())
