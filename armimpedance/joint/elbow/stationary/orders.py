"""Does a joint of second order hold it? Transfer functions of other orders, by AIC and BIC.

``A(s) Theta = B(s) exp(-s nk / rate) Tau`` with na the degree of A, nb the coefficients of B, on
the band's Fourier coefficients: noise of the channels is weighed there and does not ask for higher
orders, as it does in one-step predictions of filtered samples. I, B, K are ``na = 2, nb = 1,
nk = 0``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.findings import Finding
from armimpedance.joint.elbow.stationary.band import Band, Bins, Complex
from armimpedance.joint.elbow.stationary.least_squares import least_squares

JOINT: Final = (2, 1, 0)
GRID: Final = tuple(
    (na, nb, nk) for na in (1, 2, 3, 4) for nb in (1, 2) for nk in (0, 1, 2) if nb <= na
)
_ROUNDS: Final = 6
#: What "clearly better" is: of BIC, and of the squares left.
BIC_GAIN: Final = 10.0
SQUARES_GAIN: Final = 0.1
#: A joint that explains all but this part of the angle holds, whatever remains.
ENOUGH: Final = 1e-3


@dataclass(frozen=True)
class OrderScore:
    """One set of orders: weighted squares left, AIC and BIC."""

    na: int
    nb: int
    nk: int
    squares: float
    aic: float
    bic: float

    @property
    def orders(self) -> tuple[int, int, int]:
        """na, nb, nk."""
        return self.na, self.nb, self.nk


def compare_orders(
    band: Band, rate_hz: float, unexplained: float
) -> tuple[tuple[OrderScore, ...], Finding]:
    """Scores of `GRID`, the best BIC first, and whether the joint is clearly worse.

    Parameters
    ----------
    band : Band
    rate_hz : float
        Rate in whose samples nk counts.
    unexplained : float
        Part of the angle's power that I, B and K do not explain.
    """
    rows, scores = band.rows, []
    for na, nb, nk in GRID:
        squares = _squares(band, na, nb, nk / rate_hz)
        per_row = max(squares / rows, np.finfo(float).tiny)
        fit, p = rows * float(np.log(per_row)), na + nb + (nk > 0)
        scores.append(OrderScore(na, nb, nk, squares, fit + 2 * p, fit + float(np.log(rows)) * p))
    ranked = tuple(sorted(scores, key=lambda s: s.bic))
    return ranked, _judged(ranked, unexplained)


def _judged(scores: tuple[OrderScore, ...], unexplained: float) -> Finding:
    joint = next(s for s in scores if s.orders == JOINT)
    best = scores[0]
    gain = 1 - best.squares / joint.squares if joint.squares else 0.0
    smallest = f"{100 * SQUARES_GAIN:g} % of what is left, {100 * ENOUGH:g} % of the motion"
    if unexplained < ENOUGH or joint.bic - best.bic < BIC_GAIN or gain < SQUARES_GAIN:
        return Finding("order", "ok", "no transfer function of low order does better", smallest)
    said = (
        f"a joint of second order does not hold the record: na = {best.na}, nb = {best.nb}, "
        f"nk = {best.nk} leaves {100 * gain:.0f} % less (BIC {joint.bic - best.bic:.0f} lower): "
        "a reflex, soft tissue or the device's own dynamics; look at the frequency response, "
        "measure the torque nearer to the limb"
    )
    return Finding("order", "warning", said, smallest)


def _squares(band: Band, na: int, nb: int, delay_s: float) -> float:
    """Weighted squares left, by linear least squares with the weights of the fit before."""
    top = float(np.abs(band.trials[0].s[-1]))
    columns = [_columns(bins, na, nb, delay_s, top) for bins in band.trials]
    weights = [np.ones(len(b.s)) / np.maximum(np.abs(b.torque).mean(), 1e-300) for b in band.trials]
    squares = np.inf
    for _ in range(_ROUNDS):
        fit = least_squares(band, columns, weights)
        weights = [np.sqrt(2 / _power(b, fit.parameters, na, nb, top)) for b in band.trials]
        squares = fit.squares
    return squares


def _columns(bins: Bins, na: int, nb: int, delay_s: float, top: float) -> Complex:
    """Theta s^0 ... s^na, -Tau s^1 ... s^(nb-1); last the torque, whose coefficient is one."""
    x = bins.s / top
    torque = bins.torque * np.exp(-bins.s * delay_s)
    left = bins.angle[:, None] * x[:, None] ** np.arange(na + 1)
    right = -torque[:, None] * x[:, None] ** np.arange(1, nb)
    return np.concatenate([left, right, torque[:, None]], axis=1)


def _power(bins: Bins, parameters: FloatArray, na: int, nb: int, top: float) -> FloatArray:
    """Power of the noise of ``A Theta - B Tau`` (n,)."""
    x = bins.s / top
    A = (x[:, None] ** np.arange(na + 1)) @ parameters[: na + 1]
    B = 1 + (x[:, None] ** np.arange(1, nb)) @ parameters[na + 1 :]
    return np.asarray(bins.angle_noise * np.abs(A) ** 2 + bins.torque_noise * np.abs(B) ** 2)
