"""Is there a reflex at all? Evidence over delays, and how often chance gives as much.

At one delay, scores g and information I weigh a reflex R against none by the likelihood ratio
``exp(R^T g - R^T I R / 2)``. Averaged over delays and over the reflexes that one may expect it is
the most powerful statistic on average (D. W. K. Andrews and W. Ploberger, Econometrica 62, 1994,
1383-1414). Its distribution without a reflex comes from the trials themselves: their scores with
signs flipped at random. What one expects decides the power only, never the rate of false alarms.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.hand.still.reflex.scan import DelayScan

#: Expected reflex: this part of K, give or take the same (a stretch reflex stiffens),
EXPECTED_SHARE = 0.15
#: and this part of K in any other direction of matrices.
OTHER_SHARE = 0.05
#: Random flips; with few trials all flips are tried.
FLIPS = 1999
#: A reflex "would have been seen" if the test finds it this often.
POWER = 0.95
#: Flips that stand for chance where power is asked for.
_POWER_FLIPS = 250
#: A reflex of more than this part of K is not looked for.
_LARGEST_SHARE = 4.0


@dataclass(frozen=True, eq=False)
class Evidence:
    """Evidence for a reflex at D delays.

    Attributes
    ----------
    log_ratio : (D,)
        Log of the likelihood of the best reflex at each delay, penalised by what is expected,
        over that of none.
    p_value : float
        How often flipped trials give as much evidence over all delays.
    """

    log_ratio: FloatArray
    p_value: float

    @property
    def weight(self) -> FloatArray:
        """Weights of all delays, which sum to one; before the measurement all are equal."""
        raised = np.exp(self.log_ratio - self.log_ratio.max())
        return np.asarray(raised / raised.sum())


@dataclass(frozen=True, eq=False)
class _Expected:
    """Normal distribution of the reflexes R (q,) that one may expect, and the information."""

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
        """What averaging over R takes off the logarithm at each delay, (D,)."""
        spread = np.linalg.inv(self.precision) @ self.information
        return np.asarray(-0.5 * np.linalg.slogdet(np.eye(len(self.mean)) + spread)[1])

    def statistic(self, score: FloatArray) -> FloatArray:
        """Log of the likelihood ratio averaged over reflexes and delays, (...,)."""
        each = self.ratios(score) + self.volumes()
        return np.asarray(np.logaddexp.reduce(each, axis=-1) - np.log(each.shape[-1]))


def weigh(scan: DelayScan, seed: int = 0) -> Evidence:
    """Evidence for a reflex at the scan's delays."""
    expected, total = _expected(scan), scan.score.sum(axis=0)
    signs = _signs(len(scan.score), FLIPS, seed)
    observed = float(expected.statistic(total))
    flipped = expected.statistic(_flipped(scan, signs))
    beaten = int((flipped >= observed - 1e-9 * abs(observed)).sum())
    return Evidence(expected.ratios(total), (1 + beaten) / (1 + len(signs)))


def visible_share(scan: DelayScan, delay_s: float, level: float, seed: int = 0) -> float:
    """Smallest reflex, as part of K, that the test finds in 95 % of such experiments; inf if none.

    It is computed for trials without a reflex, whose flipped scores stand for chance.
    """
    expected, stiffness = _expected(scan), _stiffness(scan)
    number = int(np.argmin(np.abs(scan.delay_s - delay_s)))
    shift = scan.information[:, :, number, :] @ stiffness
    critical = np.quantile(
        expected.statistic(_flipped(scan, _signs(len(scan.score), FLIPS, seed))), 1 - level
    )
    chance = _flipped(scan, _signs(len(scan.score), _POWER_FLIPS, seed + 1))

    def found(share: float) -> bool:
        return bool((expected.statistic(chance + share * shift) > critical).mean() >= POWER)

    low, high = 0.0, _LARGEST_SHARE
    if not found(high):
        return float("inf")
    while high - low > 0.005:
        middle = (low + high) / 2
        low, high = (low, middle) if found(middle) else (middle, high)
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
    """Signs (F, T): all there are, the observed ones left out, if they are no more than wanted."""
    if 2**trials - 1 <= wanted:
        numbers = np.arange(1, 2**trials)
        return np.asarray(1.0 - 2.0 * (numbers[:, None] >> np.arange(trials) & 1))
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(trials,)))
    return np.asarray(rng.choice([-1.0, 1.0], (wanted, trials)))
