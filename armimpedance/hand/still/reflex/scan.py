"""A delayed position term, at every delay at once: scores, information, fits.

    M x'' + B x' + K x + R x(t - delay) = -f

What a trial says about R where M, B and K are fitted without it is its efficient score: the score
of R less what M, B and K explain of it. Sums of scores and the information are small, so that a
test may try many delays, and flip the signs of trials, without another fit (C. R. Rao, 1948: the
score test).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import Kind
from armimpedance.core.records import Window
from armimpedance.hand.still.weighing.expected_motion import expected_motion
from armimpedance.hand.still.weighing.modal import ModalEquation, modal_equation, weighted_equations
from armimpedance.hand.still.weighing.noise import regressor_excess
from armimpedance.hand.still.weighing.weighted_fit import weighted_fit
from armimpedance.numerics.regression import TrialEquations, leave_one_out_shift, solve_total

#: Noise is judged from the residuals of a fit with a reflex this late (s), if none is given: near
#: enough to others to take a reflex out of them.
REFERENCE_S = 0.060


@dataclass(frozen=True, eq=False)
class DelayScan:
    """What T trials say about R (q = d^2 elements) at D delays.

    Attributes
    ----------
    delay_s : (D,)
    without : (3 q,)
        M, B, K of the model without R, row by row.
    score : (T, D, q)
        Efficient scores of R where R = 0.
    information : (D, q, D, q)
        ``information[i, :, j, :] @ r`` is what a reflex r of delay j adds to the scores' sum at i.
    equation : ModalEquation
        Equation with a regressor for each delay.
    weight : (d n, d n)
    kind : {"hand", "joint"}
    """

    delay_s: FloatArray
    without: FloatArray
    score: FloatArray
    information: FloatArray
    equation: ModalEquation
    weight: FloatArray
    instruments: FloatArray | None
    excess: FloatArray
    kind: Kind

    @property
    def own_information(self) -> FloatArray:
        """Information about R at each delay, (D, q, q), symmetric."""
        own = np.einsum("iaib->iab", self.information)
        return np.asarray((own + own.transpose(0, 2, 1)) / 2)

    def stiffness(self) -> DelayFits:
        """K without R, K and R at every delay, with what each trial moved them."""
        d, T = self.equation.axes, self.equation.trials
        q = d * d
        own = self._equations(())
        found = np.empty((len(self.delay_s), 3 * q))
        moved = np.empty((len(self.delay_s), T, 3 * q))
        found[:, :q] = self.without[2 * q :]
        moved[:, :, :q] = leave_one_out_shift(own, self.without)[:, 2 * q :]
        for number in range(len(self.delay_s)):
            equations = self._equations((number,))
            theta = solve_total(equations)
            found[number, q:] = theta[2 * q :]
            moved[number, :, q:] = leave_one_out_shift(equations, theta)[:, 2 * q :]
        return DelayFits(self.delay_s, found, moved)

    def keep(self, chosen: np.ndarray) -> DelayScan:
        """The scan at these delays only (mask)."""
        at = np.flatnonzero(chosen)
        matrices = np.concatenate([np.arange(3), 3 + at])
        rows = None if self.instruments is None else self._matrices(self.instruments, matrices)
        return replace(
            self,
            delay_s=self.delay_s[at],
            score=self.score[:, at],
            information=self.information[at][:, :, at],
            equation=replace(self.equation, motion=self.equation.motion[:, matrices]),
            instruments=rows,
        )

    def _matrices(self, rows: FloatArray, matrices: np.ndarray) -> FloatArray:
        T, d, n = self.equation.trials, self.equation.axes, self.equation.modes.count
        return np.asarray(rows.reshape(T, -1, d, n)[:, matrices].reshape(T, -1, n))

    def _equations(self, delays: tuple[int, ...]) -> TrialEquations:
        """Equations of M, B, K and, with one delay, R."""
        matrices = np.array([0, 1, 2, *(3 + number for number in delays)])
        equation = replace(self.equation, motion=self.equation.motion[:, matrices])
        if self.instruments is not None:
            rows = self._matrices(self.instruments, matrices)
            return weighted_equations(equation, self.weight, self.kind, instruments=rows)
        size = len(matrices) * equation.axes**2
        excess = np.zeros((size, size))
        excess[: len(self.excess), : len(self.excess)] = self.excess
        return weighted_equations(equation, self.weight, self.kind, excess=excess)


@dataclass(frozen=True, eq=False)
class DelayFits:
    """Stiffness at D delays.

    Attributes
    ----------
    delay_s : (D,)
    found : (D, 3 q)
        K of the model without R, then K and R of the model with it, row by row.
    moved : (D, T, 3 q)
        How far each trial moved them (jackknife).
    """

    delay_s: FloatArray
    found: FloatArray
    moved: FloatArray

    def covariance(self) -> FloatArray:
        """Covariance at each delay, clustered by trial (CR3), (D, 3 q, 3 q)."""
        T = self.moved.shape[1]
        return np.asarray((T - 1) / T * self.moved.transpose(0, 2, 1) @ self.moved)


def scan_delays(window: Window, kind: Kind, delay_s: FloatArray) -> DelayScan:
    """Scores and information at these delays.

    Raises
    ------
    NotIdentifiableError
        If the motion does not determine M, B and K.
    """
    reference = float(delay_s[np.argmin(np.abs(delay_s - REFERENCE_S))])
    fitted = weighted_fit(window, kind, delay_s=reference)
    V = np.linalg.inv(fitted.noise.covariance(fitted.parameters))
    V = (V + V.T) / 2
    equation = modal_equation(window, fitted.equation.modes, delay_s=delay_s.tolist())
    instruments = expected_motion(equation)
    d = equation.axes
    excess = np.zeros((3 * d * d, 3 * d * d))
    if instruments is None:
        excess = regressor_excess(V, fitted.noise.position)
    scan = DelayScan(
        delay_s=delay_s,
        without=np.zeros(3 * d * d),
        score=np.zeros((equation.trials, len(delay_s), d * d)),
        information=np.zeros((len(delay_s), d * d, len(delay_s), d * d)),
        equation=equation,
        weight=V,
        instruments=instruments,
        excess=excess,
        kind=kind,
    )
    return _with_scores(scan, solve_total(scan._equations(())))


def _with_scores(scan: DelayScan, without: FloatArray) -> DelayScan:
    """Project M, B and K out of the scores and the information of R."""
    equation, q = scan.equation, scan.equation.axes**2
    padded = np.concatenate([without, np.zeros(len(scan.delay_s) * q)])
    score = _scores(scan, equation.residual(padded))
    A = _total_information(scan)
    A[: 3 * q, : 3 * q] -= equation.trials * scan.excess
    score[:, : 3 * q] += scan.excess @ without
    # P (D q, 3 q) A_00 (3 q, 3 q) = A_R0 (D q, 3 q)
    P = np.linalg.solve(A[: 3 * q, : 3 * q].T, A[3 * q :, : 3 * q].T).T
    efficient = score[:, 3 * q :] - score[:, : 3 * q] @ P.T
    information = A[3 * q :, 3 * q :] - P @ A[: 3 * q, 3 * q :]
    D = len(scan.delay_s)
    return replace(
        scan,
        without=without,
        score=efficient.reshape(-1, D, q),
        information=information.reshape(D, q, D, q),
    )


def _rows(scan: DelayScan) -> FloatArray:
    return scan.equation.regressors if scan.instruments is None else scan.instruments


def _scores(scan: DelayScan, residual: FloatArray) -> FloatArray:
    """``Z_t^T V e_t`` of every trial, (T, r q)."""
    equation, d = scan.equation, scan.equation.axes
    T, n, r = equation.trials, equation.modes.count, equation.matrices
    weighted = (residual @ scan.weight).reshape(T, d, n)
    # [t, m k, i] = sum_n Z[t, m k, n] (V e)[t, i, n], then to (m, i, k)
    score = _rows(scan) @ weighted.transpose(0, 2, 1)
    return np.asarray(score.reshape(T, r, d, d).transpose(0, 1, 3, 2).reshape(T, -1))


def _total_information(scan: DelayScan) -> FloatArray:
    """``sum_t Z_t^T V W_t`` over all matrices and delays, (r q, r q)."""
    equation, d = scan.equation, scan.equation.axes
    n, r = equation.modes.count, equation.matrices
    Z, X = (
        rows.transpose(1, 0, 2).reshape(r * d, -1) for rows in (_rows(scan), equation.regressors)
    )
    V = scan.weight.reshape(d, n, d, n).transpose(0, 2, 1, 3)
    A = np.empty((r, d, d, r, d, d))
    for i in range(d):
        for j in range(d):
            left = (Z.reshape(-1, n) @ V[i, j]).reshape(r * d, -1)
            A[:, i, :, :, j, :] = (left @ X.T).reshape(r, d, r, d)
    return A.reshape(r * d * d, r * d * d)
