"""Rows with errors that all conditions share, and errors that each condition draws anew.

    y_p = X_p theta + Z_p u + e_p,   u ~ N(0, 1),   e_p ~ N(0, V_p),   V_p = phi^2 + s^2 D_p D_p^T

of P conditions, r rows each. Restricted likelihood and solution need no matrix larger than the
number of columns: C. R. Henderson's equations (Biometrics 31 (1975) 423-447).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray


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
        try:
            return _value(*self._factors(x))
        except np.linalg.LinAlgError:
            return 1e30

    def likelihood(self, x: FloatArray) -> tuple[float, FloatArray]:
        """`negative_log` and its slope by x."""
        try:
            factors = self._factors(x)
        except np.linalg.LinAlgError:
            return 1e30, np.zeros(len(x))
        return _value(*factors), self._slope(x, *factors)

    def _factors(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Factors of V_p, columns made white, inverse of A's factor (n, n), that times b (n,)."""
        lower = self._own(x)
        white, gram = self._white(x, lower)
        # A (p + c, p + c) [theta, u] = b, the normal equations of all columns; A^-1 = root^T root
        root = np.linalg.inv(np.linalg.cholesky(gram[:-1, :-1]))
        return lower, white, np.asarray(root, dtype=np.float64), np.asarray(root @ gram[:-1, -1])

    def _slope(
        self,
        x: FloatArray,
        lower: FloatArray,
        white: FloatArray,
        root: FloatArray,
        half: FloatArray,
    ) -> FloatArray:
        # solution (n,), errors made white (P, r), H (P, r, n) = [X, Z] root^T made white
        solution = root.T @ half
        error = white[..., -1] - white[..., :-1] @ solution
        H = white[..., :-1] @ root.T
        # d l = <1 - H H^T - e e^T, L^-1 dV L^-T> / 2
        inner = np.eye(error.shape[1]) - H @ H.transpose(0, 2, 1)
        inverse = np.linalg.inv(lower)
        by_own = inverse.transpose(0, 2, 1) @ (inner - error[:, :, None] * error[:, None]) @ inverse
        each = np.einsum("pii->i", by_own) * np.exp(2 * x[:2])[self.group]
        groups = np.bincount(self.group, each, 2).astype(np.float64)
        if len(x) == 2:
            return groups
        single = np.exp(2 * x[4]) * np.einsum("pij,pik,pjk->", by_own, self.arms, self.arms)
        # d l = <H root - e u^T, L^-1 dZ>, each column of Z in proportion to its size
        p, m = self.design.shape[-1], self.arms.shape[-1]
        by_shared = (H @ root)[..., p:] - error[..., None] * solution[p:]
        sizes = np.einsum("pij,pij->j", by_shared, white[..., p:-1])
        return np.concatenate([groups, [sizes[:m].sum(), sizes[m:].sum(), single]])

    def likeliest(
        self, first: FloatArray, limits: list[tuple[float, float]]
    ) -> tuple[float, FloatArray]:
        """Least `negative_log` between limits, and where."""
        from scipy.optimize import minimize

        start = np.asarray(np.clip(first, *np.array(limits).T))
        made = minimize(
            self.likelihood, start, jac=True, method="L-BFGS-B", bounds=limits, tol=1e-6
        )
        return float(made.fun), np.asarray(made.x)

    def solution(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Theta (p,) and its covariance (p, p) without shared errors; what those do, (p, c)."""
        _, gram = self._white(x, self._own(x))
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

    def _white(self, x: FloatArray, lower: FloatArray) -> tuple[FloatArray, FloatArray]:
        """[X, Z, y] with errors made white (P, r, n + 1), and its gram with u's information."""
        Z = self._shared(x)
        p, c = self.design.shape[-1], Z.shape[-1]
        columns = np.concatenate([self.design, Z, self.target[..., None]], axis=-1)
        white = np.linalg.solve(lower, columns)
        flat = white.reshape(-1, columns.shape[-1])
        gram = flat.T @ flat
        gram[:p, :p] += self.prior.T @ self.prior
        gram[np.arange(p, p + c), np.arange(p, p + c)] += 1.0
        return white, gram


def _value(lower: FloatArray, white: FloatArray, root: FloatArray, half: FloatArray) -> float:
    left = (white[..., -1] ** 2).sum() - half @ half
    log_own = np.log(np.diagonal(lower, axis1=1, axis2=2)).sum()
    return float(log_own - np.log(np.diag(root)).sum() + left / 2)
