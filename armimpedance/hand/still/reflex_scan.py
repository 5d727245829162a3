"""A delayed position term, at every delay at once: scores, information, fits.

    M x'' + B x' + K x + R x(t - delay) = -f

The information of a trial about R, with M, B and K fitted without R, is its efficient score: the
score of R minus the part that M, B and K explain. Sums of scores and the information are small, so
that a test may try many delays, and flip the signs of trials, without another fit (C. R. Rao, 1948:
the score test).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import Kind
from armimpedance.core.records import Window
from armimpedance.hand.still.modal import (
    ModalEquation,
    expected_motion,
    modal_equation,
    weighted_equations,
)
from armimpedance.hand.still.weighing import regressor_excess, weighted_fit
from armimpedance.numerics.regression import TrialEquations, leave_one_out_shift, solve_total

#: Noise is estimated from the residuals of a fit with a reflex this late (s), if no delay is
#: stated. It is near enough to other delays to remove a reflex from the residuals.
REFERENCE_S = 0.060


@dataclass(frozen=True, eq=False)
class DelayScan:
    """Scores and information of T trials about R (q = d^2 elements) at D delays.

    `delay_s` (D,), `weight` (d n, d n).
    `without` (3 q,): M, B, K of the model without R, row by row.
    `score` (T, D, q): efficient scores of R at R = 0.
    `information` (D, q, D, q): ``information[i, :, j, :] @ r`` is the contribution of a reflex r of
    delay j to the sum of the scores at i.
    `equation`: equation with a regressor for each delay.
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
        """K without R, K and R at every delay, with the influence of each trial on them."""
        d, T = self.equation.axes, self.equation.trials
        q = d * d
        equations_without = self._equations(())
        stiffnesses = np.empty((len(self.delay_s), 3 * q))
        moved = np.empty((len(self.delay_s), T, 3 * q))
        stiffnesses[:, :q] = self.without[2 * q :]
        moved[:, :, :q] = leave_one_out_shift(equations_without, self.without)[:, 2 * q :]
        for number in range(len(self.delay_s)):
            equations = self._equations((number,))
            theta = solve_total(equations)
            stiffnesses[number, q:] = theta[2 * q :]
            moved[number, :, q:] = leave_one_out_shift(equations, theta)[:, 2 * q :]
        return DelayFits(self.delay_s, stiffnesses, moved)

    def keep(self, chosen: np.ndarray) -> DelayScan:
        """Restrict the scan to these delays (mask)."""
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
        """Equations of M, B, K and, with one delay, also R."""
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

    `delay_s` (D,).
    `found` (D, 3 q): K of the model without R, then K and R of the model with it, row by row.
    `moved` (D, T, 3 q): influence of each trial on them (jackknife).
    """

    delay_s: FloatArray
    found: FloatArray
    moved: FloatArray

    def covariance(self) -> FloatArray:
        """Covariance at each delay, clustered by trial (CR3), (D, 3 q, 3 q)."""
        T = self.moved.shape[1]
        return np.asarray((T - 1) / T * self.moved.transpose(0, 2, 1) @ self.moved)


def scan_delays(window: Window, kind: Kind, delay_s: FloatArray) -> DelayScan:
    """Compute scores and information at these delays.

    Raises NotIdentifiableError: if the motion does not determine M, B and K.
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


# Test for a reflex: evidence over all delays, and how often chance gives as much.
# At one delay, scores g and information I give the likelihood ratio ``exp(R^T g - R^T I R / 2)`` of
# a reflex R against none. Its average over delays and over the expected reflexes is the most
# powerful statistic on average (D. W. K. Andrews and W. Ploberger, Econometrica 62, 1994,
# 1383-1414). Its distribution without a reflex comes from the trials themselves: their scores with
# signs flipped at random. The expectation affects the power only, never the rate of false alarms.

#: Expected reflex: this share of K, with the same standard deviation (a stretch reflex stiffens),
EXPECTED_SHARE = 0.15
#: and this share of K in any other direction of matrices.
OTHER_SHARE = 0.05
#: Random flips; with few trials all flips are tried.
FLIPS = 1999
#: A reflex "would have been seen" if the test detects it with this probability.
POWER = 0.95
#: Number of flips for the simulation of the power.
_POWER_FLIPS = 250
#: Largest reflex that is considered, as a share of K.
_LARGEST_SHARE = 4.0


@dataclass(frozen=True, eq=False)
class Evidence:
    """Evidence for a reflex at D delays.

    `log_ratio` (D,): log likelihood ratio of the best reflex at each delay, penalised by its prior
    distribution, against none.
    `p_value`: share of flipped trials that give as much evidence over all delays.
    """

    log_ratio: FloatArray
    p_value: float

    @property
    def weight(self) -> FloatArray:
        """Weights of all delays, which sum to one; their prior weights are equal."""
        raised = np.exp(self.log_ratio - self.log_ratio.max())
        return np.asarray(raised / raised.sum())


@dataclass(frozen=True, eq=False)
class _Expected:
    """Prior normal distribution of the reflexes R (q,), and the information."""

    mean: FloatArray
    precision: FloatArray
    information: FloatArray

    def ratios(self, score: FloatArray) -> FloatArray:
        """Log of the penalised likelihood ratio for sums of scores (..., D, q), (..., D)."""
        shifted = score + self.precision @ self.mean
        inverse = np.linalg.inv(self.information + self.precision)
        gain = np.einsum("...da,dab,...db->...d", shifted, inverse, shifted, optimize=True)
        return np.asarray(0.5 * (gain - self.mean @ self.precision @ self.mean))

    def volumes(self) -> FloatArray:
        """Change of the logarithm at each delay by averaging over R, (D,)."""
        spread = np.linalg.inv(self.precision) @ self.information
        return np.asarray(-0.5 * np.linalg.slogdet(np.eye(len(self.mean)) + spread)[1])

    def statistic(self, score: FloatArray) -> FloatArray:
        """Log of the likelihood ratio averaged over reflexes and delays, (...,)."""
        log_ratios = self.ratios(score) + self.volumes()
        return np.asarray(np.logaddexp.reduce(log_ratios, axis=-1) - np.log(log_ratios.shape[-1]))


def weigh(scan: DelayScan, seed: int = 0) -> Evidence:
    """Compute the evidence for a reflex at the scan's delays."""
    expected, total = _expected(scan), scan.score.sum(axis=0)
    signs = _signs(len(scan.score), FLIPS, seed)
    observed = float(expected.statistic(total))
    flipped = expected.statistic(_flipped(scan, signs))
    as_extreme = int((flipped >= observed - 1e-9 * abs(observed)).sum())
    return Evidence(expected.ratios(total), (1 + as_extreme) / (1 + len(signs)))


def visible_share(scan: DelayScan, delay_s: float, level: float, seed: int = 0) -> float:
    """Smallest reflex, as a share of K, detected in 95 % of such experiments; inf if there is none.

    It is computed for trials without a reflex, simulated by flipped scores.
    """
    expected, stiffness = _expected(scan), _stiffness(scan)
    number = int(np.argmin(np.abs(scan.delay_s - delay_s)))
    shift = scan.information[:, :, number, :] @ stiffness
    critical = np.quantile(
        expected.statistic(_flipped(scan, _signs(len(scan.score), FLIPS, seed))), 1 - level
    )
    chance = _flipped(scan, _signs(len(scan.score), _POWER_FLIPS, seed + 1))

    def detected(share: float) -> bool:
        return bool((expected.statistic(chance + share * shift) > critical).mean() >= POWER)

    low, high = 0.0, _LARGEST_SHARE
    if not detected(high):
        return float("inf")
    while high - low > 0.005:
        middle = (low + high) / 2
        low, high = (low, middle) if detected(middle) else (middle, high)
    return high


def _stiffness(scan: DelayScan) -> FloatArray:
    """Symmetric part of K (q,) of the model without reflex."""
    d = scan.equation.axes
    K = scan.without[2 * d * d :].reshape(d, d)
    return np.asarray((K + K.T).ravel() / 2)


def _expected(scan: DelayScan) -> _Expected:
    k = _stiffness(scan)
    mean = EXPECTED_SHARE * k
    other = OTHER_SHARE**2 * (k @ k) / len(k)
    return _Expected(
        mean,
        np.asarray(np.linalg.inv(np.outer(mean, mean) + other * np.eye(len(k))), dtype=np.float64),
        scan.own_information,
    )


def _flipped(scan: DelayScan, signs: FloatArray) -> FloatArray:
    """Sums of scores with the signs (F, T) of trials, (F, D, q)."""
    T, D, q = scan.score.shape
    return np.asarray((signs @ scan.score.reshape(T, -1)).reshape(-1, D, q))


def _signs(trials: int, wanted: int, seed: int) -> FloatArray:
    """Signs (F, T): all combinations but the observed one, or `wanted` random ones."""
    if 2**trials - 1 <= wanted:
        numbers = np.arange(1, 2**trials)
        return np.asarray(1.0 - 2.0 * (numbers[:, None] >> np.arange(trials) & 1))
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(trials,)))
    return np.asarray(rng.choice([-1.0, 1.0], (wanted, trials)))
