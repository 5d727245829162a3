"""Lack of fit beside pure error: moment arms and laws that are wrong, and what they do.

The estimates' own covariances tell the pure error. What the model cannot follow beyond it is laid
to three causes, to first order about the fit, each of one unknown size:

    y = X theta + D_g g + D_l l + (D_g h)_p + phi e

g (2 m), relative errors of the moment arms, the same in all conditions; l (m), errors of the
exponent of each muscle's ``f_i ~ alpha^(1 + l)``; h_p, relative errors of moment arms drawn anew in
every condition; phi, the pure error over the stated one where that is not known. Sizes are those of
largest restricted likelihood (H. D. Patterson, R. Thompson, Biometrika 58 (1971) 545-554).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.special import expit

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.findings import Finding
from armimpedance.muscles.models.activation.equations import (
    ActivationEquations,
    SolvedEquations,
    powers,
)

# Rows with errors that all conditions share, and errors that each condition draws anew.
#
#     y_p = X_p theta + Z_p u + e_p,   u ~ N(0, 1),   e_p ~ N(0, V_p),   V_p = phi^2 + s^2 D_p D_p^T
#
# of P conditions, r rows each. Restricted likelihood and solution need no matrix larger than the
# number of columns: C. R. Henderson's equations (Biometrics 31 (1975) 423-447).


@dataclass(frozen=True, eq=False)
class MixedRows:
    """P conditions of r whitened rows, p columns, m muscles.

    A point x (5,) holds logarithms: factors of the pure errors of two groups, sizes of the moment
    arms' errors, of the exponents', and of the moment arms' in single conditions; (2,): factors.

    `design`, `target` (P, r, p), (P, r), `group` (r,).
    `prior` (., p): further rows, fitted to zero with unit variance.
    `arms`, `law` (P, r, 2 m), (P, r, m): what unit errors do.
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
        optimum = minimize(
            self.likelihood, start, jac=True, method="L-BFGS-B", bounds=limits, tol=1e-6
        )
        return float(optimum.fun), np.asarray(optimum.x)

    def solution(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Theta (p,) and its covariance (p, p) without shared errors; what those do, (p, c)."""
        _, gram = self._white(x, self._own(x))
        p = self.design.shape[-1]
        # C (p, p) = (X^T V^-1 X)^-1, theta = C X^T V^-1 y, moved (p, c) = C X^T V^-1 Z
        C = np.asarray(np.linalg.inv(gram[:p, :p]), dtype=np.float64)
        return C @ gram[:p, -1], C, C @ gram[:p, p:-1]

    def missed(self, x: FloatArray, C: FloatArray, moved: FloatArray) -> FloatArray:
        """Effect of shared errors on the prediction of a condition left out, (P, r, c)."""
        lower = self._own(x)
        residual = self._shared(x) - self.design @ moved
        # (1 - H_p)^-1 left_p, H_p (r, r) = X_p C X_p^T V_p^-1
        V = lower @ lower.transpose(0, 2, 1)
        H = self.design @ C @ self.design.transpose(0, 2, 1) @ np.linalg.inv(V)
        return np.asarray(np.linalg.pinv(np.eye(len(self.group)) - H) @ residual)

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
    residual = (white[..., -1] ** 2).sum() - half @ half
    log_own = np.log(np.diagonal(lower, axis1=1, axis2=2)).sum()
    return float(log_own - np.log(np.diag(root)).sum() + residual / 2)


#: Twice the gain of restricted log likelihood above which a lack of fit is told.
SEEN: Final = 10.0
#: Sizes that are looked for: relative errors of moment arms, of an exponent, single ones.
SIZES: Final = np.array([0.05, 0.1, 0.05])
LEAST: Final = 1e-4
MOST: Final = 1.0
#: Fall of the log likelihood within which a size is likely, and the halvings that look for it.
HARDLY: Final = 1.0
HALVINGS: Final = 8


@dataclass(frozen=True, eq=False)
class ActivationMisfit:
    """Lack of fit: distance of the model from its rows beyond their errors.

    `sizes` (3,): relative errors of moment arms, of exponents, of the moment arms of single
    conditions (sd).
    `likely`, `smallest` (2,): sizes of the first two up to which the likelihood hardly falls, and
    that would be seen.
    `gain`: twice the gain of restricted log likelihood by them.
    `theta`, `covariance` (p,), (p, p): the solution with weights that allow for the errors of
    single conditions.
    `of_muscles` (p, p): covariance of theta with what the other errors add: a moment arm that is
    wrong by a part makes its muscle's stiffness wrong by twice that, hardly with a trace in the
    matrix.
    `missed` (3, 3): covariance of what the other errors make of a matrix that no theta follows,
    mean over the conditions.
    """

    sizes: FloatArray
    likely: FloatArray
    smallest: FloatArray
    gain: float
    theta: FloatArray
    covariance: FloatArray
    of_muscles: FloatArray
    missed: FloatArray

    @property
    def seen(self) -> bool:
        """True if it is reported, and the intervals allow for it."""
        return self.gain > SEEN

    def allowed_for(self, solved: SolvedEquations, *, moved: bool) -> SolvedEquations:
        """The solution of these weights where a lack of fit was seen; else as it was."""
        if not self.seen:
            return solved
        theta = self.theta if moved else solved.theta
        return replace(solved, theta=theta, covariance=self.covariance)

    def widened(self, more: FloatArray) -> ActivationMisfit:
        """The same with so much more (p, p) in the covariance of single muscles."""
        return replace(self, of_muscles=self.of_muscles + more)

    @property
    def chance(self) -> float:
        """Probability of a lack of fit: 1 where it is detected, 1/2 just below the threshold."""
        return 1.0 if self.seen else float(expit((self.gain - SEEN) / 2))

    def matrix_covariance(self, covariance: FloatArray) -> FloatArray:
        """Covariance of theta, the constant matrix taking what no theta follows."""
        out = np.array(covariance)
        out[:3, :3] += self.chance * self.missed
        return out

    def muscle_covariance(self) -> FloatArray:
        """Covariance of theta for single muscles, with moment arms as far off as is likely.

        It is so whether a lack of fit was seen or not: what leaves no trace in the matrix moves
        single muscles all the same, and crosstalk between electrodes does what moment arms do.
        """
        return self.of_muscles

    def finding(self, symbol: str, doubt: float) -> Finding:
        """The finding on K or B.

        `doubt`: relative standard error of a single muscle's coefficient (median).
        """
        arms, exponent = self.smallest
        smallest = f"moment arms {100 * arms:.1f} % off, exponents {exponent:.2g} off"
        if self.seen:
            arms, exponent, single = self.sizes
            sentence = (
                f"rows of {symbol} differ from the model beyond their errors, as moment arms that "
                f"are {100 * arms:.0f} % off, exponents of the law that are {exponent:.2f} off and "
                f"moment arms that change by {100 * single:.0f} % between conditions would make "
                "them: intervals allow for it; check the arm, the law's order and the activations"
            )
            return Finding("lack of fit", "warning", sentence, smallest)
        hidden = self.likely[0]
        if 2 * hidden > 2 * doubt:
            sentence = (
                f"none is seen in {symbol}; but moment arms up to {100 * hidden:.0f} % off would "
                "leave no trace, and single muscles would be off by twice that, which their "
                "intervals allow for"
            )
            return Finding("lack of fit", "cannot tell", sentence, smallest)
        return Finding("lack of fit", "ok", f"rows of {symbol} differ by their errors", smallest)


def misfit_of(
    equations: ActivationEquations, solved: SolvedEquations, G: FloatArray
) -> ActivationMisfit:
    """Sizes of the causes, and the solution that allows for them.

    `G` (m, 2): moment arms at the posture, m.
    """
    arms, law = (np.asarray(solved.weight @ d) for d in _causes(equations, solved, G))
    mixed = MixedRows(
        design=solved.weight @ solved.design,
        target=np.einsum("pij,pj->pi", solved.weight, solved.target),
        prior=solved.prior,
        group=equations.group,
        arms=arms,
        law=law,
    )
    # factors of the pure errors of elements and torque: what the fit found, or less
    low = np.where(equations.known, 1 / solved.group_sd, LEAST)
    limits = [(float(np.log(np.clip(one, LEAST, 1.0))), 0.0) for one in low]
    limits += [(float(np.log(LEAST)), float(np.log(MOST)))] * len(SIZES)
    without, factors = mixed.likeliest(np.zeros(2), limits[:2])
    starts = (np.append(factors, np.log(sizes)) for sizes in (SIZES, SIZES / 20))
    least, x = min((mixed.likeliest(start, limits) for start in starts), key=lambda made: made[0])
    likely, smallest = (_fallen(mixed, x, least + by) for by in (HARDLY, SEEN / 2))
    at = np.concatenate([x[:2], np.log(likely), x[4:]])
    theta, C, moved = mixed.solution(at)
    plain = (np.linalg.inv(solved.weight) @ mixed.missed(at, C, moved))[:, :3]
    missed = np.einsum("pic,pjc->ij", plain, plain) / len(plain)
    gain, of_muscles = 2 * (without - least), C + moved @ moved.T
    return ActivationMisfit(np.exp(x[2:]), likely, smallest, gain, theta, C, of_muscles, missed)


def _fallen(mixed: MixedRows, x: FloatArray, allowed: float) -> FloatArray:
    """Sizes (2,) of the shared causes, one at a time, up to which -log likelihood is allowed."""
    out = np.zeros(2)
    for k in (2, 3):
        at, low, high = np.array(x), float(x[k]), float(np.log(MOST))
        for _ in range(HALVINGS):
            at[k] = (low + high) / 2
            low, high = (at[k], high) if mixed.negative_log(at) < allowed else (low, at[k])
        out[k - 2] = np.exp(low)
    return out


def _causes(
    equations: ActivationEquations, solved: SolvedEquations, G: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Effects of unit errors of log moment arms (P, r, 2 m) and of exponents (P, r, m)."""
    m, N = len(G), equations.order
    alpha, theta = solved.activation, solved.theta
    f = (powers(alpha, N) * theta[3 : 3 + m * N].reshape(m, N)).sum(axis=-1)
    gs, ge = G.T
    zero = np.zeros(m)
    # derivatives of (g_s^2, g_s g_e, g_e^2) by log g_s and log g_e, (m, 3)
    by = (
        np.stack([2 * gs**2, gs * ge, zero], axis=1),
        np.stack([zero, gs * ge, 2 * ge**2], axis=1),
    )
    reach = [np.hstack([b, np.zeros((m, equations.outputs.shape[1] - 3))]) for b in by]
    if equations.moment_arms is not None:
        for j in (0, 1):
            reach[j][:, 3 + j] = -equations.moment_arms[:, j] / equations.stiffness_per_tension
    arms = np.concatenate([f[:, None, :] * one.T for one in reach], axis=-1)
    top = alpha.max(axis=0)
    bent = f * np.log(np.maximum(alpha / top, 1e-6))
    return arms, bent[:, None, :] * equations.reach.T
