"""Is the law straight? Squares of the amplitudes beside it, an F test, and what a bend does to it.

    y = c_0 + sum_i c_i s_i + sum_i q_i s_i^2 + e

The points' scatter about the bent law is its own measure, so that errors of the points that were
stated too small, or not at all, do not pass for a bend.

A bend that is not seen may be there all the same. All muscles' slopes fall by the same part from
silence to the largest amplitude, a part of the straight law's that is N(0, `PRIOR_SD`^2), or the
law is straight, with even odds; the intervals hold what the points leave of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import fdtrc, fdtri

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError
from armimpedance.core.findings import Finding
from armimpedance.numerics.regression import ErrorMoments, refuse_unreliable, solve_total

#: A bend that chance makes less often than this is told.
UNLIKELY: Final = 0.003
#: Fewer points than this are asked for one bend of both muscles, not for one of each.
FOR_EACH: Final = 14
#: A bend that could move slopes by more than this part, unseen, is said to be untold; one that
#: moves them by less than that part is none.
MATTERS: Final = 0.6
LEAST: Final = 0.02
#: Sd of that part. ``s / (1 + 3.3 s)``, half at 30 % of the maximum, falls by one of its chord's
#: slope over levels up to .17.
PRIOR_SD: Final = 1.0


@dataclass(frozen=True, eq=False)
class Bend:
    """What was found, and what a bend does to the straight law.

    The bent law is ``W c + z (sum_i c_i s_i^2 - W moved)``: the straight one, and the part of its
    muscles' squares that no straight law follows.

    `slopes` (m,): c_i of the straight law.
    `moved` (m + 1,): coefficients of the straight law through the muscles' squares.
    `variance`: mean square of z.
    """

    finding: Finding
    slopes: FloatArray
    moved: FloatArray
    variance: float

    @property
    def covariance(self) -> FloatArray:
        """What it adds to that of the coefficients as those of silent muscles, (m + 1, m + 1)."""
        return self.variance * np.outer(self.moved, self.moved)

    def of_prediction(self, amplitude: FloatArray) -> FloatArray:
        """What it adds to the variance (P,) of what the law says at amplitudes (P, m)."""
        W = np.column_stack([np.ones(len(amplitude)), amplitude])
        return np.asarray(self.variance * (amplitude**2 @ self.slopes - W @ self.moved) ** 2)


def bend_of(
    symbol: str, W: FloatArray, y: FloatArray, variance: FloatArray, slopes: FloatArray
) -> Bend:
    """Hold a law against one that is bent.

    `W` (L, m + 1): a constant and the amplitudes.
    `y`, `variance` (L,): values, and their variances about the law.
    `slopes` (m,): of the straight law.
    """
    L, p = W.shape
    root = 1 / np.sqrt(variance)
    squares = W[:, 1:] ** 2
    shared = _Shared.of(W, y, root, slopes)
    further = squares if L >= FOR_EACH else (squares @ slopes)[:, None]
    q = further.shape[1]
    if L - p - q < 1:
        said = f"{symbol}: {L} points are too few to show a bend; intervals allow for one"
        return shared.bend(Finding("curvature", "cannot tell", said), shared.unseen(1.0))
    X, z = np.column_stack([W, further]) * root[:, None], y * root
    # X (L, p + q) [c, q] = z (L,), and the straight law W c = z
    bent, straight = (np.asarray(np.linalg.lstsq(X[:, :k], z)[0], dtype=float) for k in (p + q, p))
    left = float(((z - X @ bent) ** 2).sum()) / (L - p - q)
    gained = float(((z - X[:, :p] @ straight) ** 2).sum()) - left * (L - p - q)
    chance = float(fdtrc(q, L - p - q, max(gained, 0.0) / q / max(left, 1e-300)))
    shift = bent[:p] - straight
    # a bend that is told half of the times gains so much
    hidden = shared.hidden(left * q * float(fdtri(q, L - p - q, 1 - UNLIKELY)))
    smallest = f"slopes {100 * hidden:.0f} % off"
    if chance < UNLIKELY and np.abs(shift[1:]).max() > LEAST * np.abs(slopes).max():
        finding = _bent(symbol, chance, bent[:p], straight, smallest)
        return Bend(finding, bent[p:] if q > 1 else bent[p] * slopes, -shift, 1.0)
    unseen = shared.unseen(max(left, 1.0))
    if hidden > MATTERS:
        said = (
            f"{symbol}: too few or too scattered points to show one (p = {chance:.2g}); intervals "
            "allow for one"
        )
        return shared.bend(Finding("curvature", "cannot tell", said, smallest), unseen)
    said = f"{symbol}: no bend is seen (p = {chance:.2g})"
    return shared.bend(Finding("curvature", "ok", said, smallest), unseen)


@dataclass(frozen=True, eq=False)
class _Shared:
    """A bend by which all muscles' slopes fall alike.

    `moved` (p,): what it does to the straight law. `own` (L,): its weighted part that no straight
    law follows. `reach`: the largest amplitude. `size`: of it, as the points have it.
    """

    slopes: FloatArray
    moved: FloatArray
    own: float
    reach: float
    size: float

    @classmethod
    def of(cls, W: FloatArray, y: FloatArray, root: FloatArray, slopes: FloatArray) -> _Shared:
        X, alike = W * root[:, None], (W[:, 1:] ** 2 @ slopes) * root
        # alike (L,) = X (L, p) moved + own
        moved = np.asarray(np.linalg.lstsq(X, alike)[0], dtype=float)
        own = alike - X @ moved
        square = max(float(own @ own), 1e-300)
        size = float(own @ (y * root)) / square
        return cls(slopes, moved, np.sqrt(square), float(W[:, 1:].max()), size)

    def bend(self, finding: Finding, variance: float) -> Bend:
        return Bend(finding, self.slopes, self.moved, variance)

    def hidden(self, needed: float) -> float:
        """Part of a slope that a bend may move by without gaining what is needed to tell it."""
        moved = np.sqrt(needed) / self.own * np.abs(self.moved[1:]).max()
        return float(moved / max(np.abs(self.slopes).max(), 1e-300))

    def unseen(self, left: float) -> float:
        """Mean square of it given the points, whose errors have the variance `left`."""
        # sum_i c_i (s_i + z s_i^2): slopes fall by 2 z s from 0 to s
        prior = (PRIOR_SD / (2 * max(self.reach, 1e-300))) ** 2
        error = left / self.own**2
        ratio = prior / (prior + error)
        # odds of a bend of that prior over none
        gain = min(0.5 * self.size**2 / error * ratio, 500.0)
        odds = float(np.sqrt(1 - ratio) * np.exp(gain))
        return odds / (1 + odds) * ((self.size * ratio) ** 2 + error * ratio)


def _bent(
    symbol: str, chance: float, bent: FloatArray, straight: FloatArray, smallest: str
) -> Finding:
    """What to say of a law that is not straight."""
    at_rest, chord = (", ".join(f"{value:.3g}" for value in c) for c in (bent, straight))
    return Finding(
        "curvature",
        "warning",
        f"{symbol} is no straight line over the amplitudes (p = {chance:.1g}): near silence its "
        f"constant and slopes are {at_rest}, over the whole range {chord}; intervals hold both; "
        "use levels closer together, or a law for each range",
        smallest,
    )


# How points scatter about a law beyond their stated errors: weights and slopes, in turns.

#: Rounds of, and a relative change that ends, the search for weights and slopes.
_ROUNDS, _SETTLED = 200, 1e-9
#: Points without any error weigh as if they had this part of the variance of the values.
_EXACT: Final = 1e-20


def error_covariance(amplitude_sd: FloatArray) -> FloatArray:
    """Covariance (L, m + 1, m + 1) of the errors of each row of W; the constant has none."""
    L, m = amplitude_sd.shape
    S = np.zeros((L, m + 1, m + 1))
    S[:, np.arange(1, m + 1), np.arange(1, m + 1)] = amplitude_sd**2
    return S


def error_moments(
    W: FloatArray, y: FloatArray, S: FloatArray, variance: FloatArray, names: tuple[str, ...]
) -> ErrorMoments:
    """One cluster per point, weighted."""
    w = 1 / variance
    gram = np.einsum("l,li,lj->lij", w, W, W)
    units = ("",) * len(names)
    return ErrorMoments(gram, W * (w * y)[:, None], S * w[:, None, None], names, units)


def settled_variance(
    W: FloatArray, y: FloatArray, sd: FloatArray, S: FloatArray, names: tuple[str, ...]
) -> tuple[FloatArray, float]:
    """Variance (L,) of each point about the law, and its unexplained part as a deviation.

    Weights need the slopes and slopes the weights: in turns until both stay.
    """
    base = np.full(len(y), float(y.var() + (sd**2).mean()) or 1.0)
    refuse_unreliable(error_moments(W, y, S, base, names), points=len(y))
    variance, scatter = base, 0.0
    for _ in range(_ROUNDS):
        before = variance
        beta = solve_total(error_moments(W, y, S, variance, names).corrected)
        # known (L,) = sd^2 + beta^T S_l beta
        known = sd**2 + np.einsum("i,lij,j->l", beta, S, beta)
        scatter = _unexplained(y - W @ beta, known, len(y) - len(beta))
        variance = np.maximum(known + scatter, _EXACT * base)
        if np.abs(variance - before).max() <= _SETTLED * variance.max():
            return variance, float(np.sqrt(scatter))
    raise EstimationError(
        f"weights and slopes of {', '.join(names[1:])} do not settle in {_ROUNDS} rounds: "
        "errors of the amplitudes are too large for these points"
    )


def _unexplained(residual: FloatArray, known: FloatArray, dof: int) -> float:
    """t >= 0 with ``sum residual^2 / (known + t) = dof`` (R. C. Paule, J. Mandel, 1982)."""
    from scipy.optimize import brentq

    squares = residual**2
    most = float(squares.sum()) / dof

    def excess(t: float) -> float:
        total = np.maximum(known + t, np.finfo(float).tiny)
        return float((squares / total).sum()) - dof

    if most == 0 or excess(0.0) <= 0:
        return 0.0
    if excess(most) >= 0:  # nothing else is known of the points' errors
        return most
    return float(brentq(excess, 0.0, most, xtol=1e-14 * most, rtol=1e-13))
