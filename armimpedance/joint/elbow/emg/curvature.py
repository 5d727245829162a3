"""Test if a law is straight: squares of the amplitudes, an F test, and the effect of a bend.

    y = c_0 + sum_i c_i s_i + sum_i q_i s_i^2 + e

The F test uses the points' scatter about the bent law, so that errors of the points that were
stated too small, or not at all, are not mistaken for a bend.

A bend may exist even if it is not significant. The prior gives even odds to a straight law and to a
bend by which all muscles' slopes fall, from silence to the largest amplitude, by the same share of
the straight law's slopes; this share is N(0, `PRIOR_SD`^2). The intervals cover the posterior.
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

#: A bend is reported if its p value is below this.
UNLIKELY: Final = 0.003
#: With fewer points than this, one common bend is tested instead of one for each muscle.
FOR_EACH: Final = 14
#: "cannot tell" if an undetected bend could move slopes by more than `MATTERS`, as a share; a bend
#: that moves them by less than `LEAST` does not count as one.
MATTERS: Final = 0.6
LEAST: Final = 0.02
#: Prior sd of the fall of the slopes. ``s / (1 + 3.3 s)``, which is half at 30 % of the maximum,
#: falls by one of its chord's slopes over levels up to .17.
PRIOR_SD: Final = 1.0


@dataclass(frozen=True, eq=False)
class Bend:
    """Finding on the straightness of a law, and the effect of a bend on the straight law.

    The bent law is ``W c + z (sum_i c_i s_i^2 - W moved)``: the straight law, and the part of its
    muscles' squares that no straight law can describe.

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
        """Covariance (m + 1, m + 1) that a bend adds to the coefficients, read as those near
        silence.
        """
        return self.variance * np.outer(self.moved, self.moved)

    def of_prediction(self, amplitude: FloatArray) -> FloatArray:
        """Variance (P,) that a bend adds to the law's prediction at amplitudes (P, m)."""
        W = np.column_stack([np.ones(len(amplitude)), amplitude])
        return np.asarray(self.variance * (amplitude**2 @ self.slopes - W @ self.moved) ** 2)


def bend_of(
    symbol: str, W: FloatArray, y: FloatArray, variance: FloatArray, slopes: FloatArray
) -> Bend:
    """Test a law against one with a bend.

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
        text = f"{symbol}: {L} points are too few to show a bend; intervals allow for one"
        return shared.bend(Finding("curvature", "cannot tell", text), shared.unseen(1.0))
    X, z = np.column_stack([W, further]) * root[:, None], y * root
    # X (L, p + q) [c, q] = z (L,), and the straight law W c = z
    bent, straight = (np.asarray(np.linalg.lstsq(X[:, :k], z)[0], dtype=float) for k in (p + q, p))
    scatter = float(((z - X @ bent) ** 2).sum()) / (L - p - q)
    gained = float(((z - X[:, :p] @ straight) ** 2).sum()) - scatter * (L - p - q)
    chance = float(fdtrc(q, L - p - q, max(gained, 0.0) / q / max(scatter, 1e-300)))
    shift = bent[:p] - straight
    # a bend that is detected in half of the cases gains so much
    hidden = shared.hidden(scatter * q * float(fdtri(q, L - p - q, 1 - UNLIKELY)))
    smallest = f"slopes {100 * hidden:.0f} % off"
    if chance < UNLIKELY and np.abs(shift[1:]).max() > LEAST * np.abs(slopes).max():
        finding = _bent(symbol, chance, bent[:p], straight, smallest)
        return Bend(finding, bent[p:] if q > 1 else bent[p] * slopes, -shift, 1.0)
    unseen = shared.unseen(max(scatter, 1.0))
    if hidden > MATTERS:
        text = (
            f"{symbol}: too few or too scattered points to show one (p = {chance:.2g}); intervals "
            "allow for one"
        )
        return shared.bend(Finding("curvature", "cannot tell", text, smallest), unseen)
    text = f"{symbol}: no bend is seen (p = {chance:.2g})"
    return shared.bend(Finding("curvature", "ok", text, smallest), unseen)


@dataclass(frozen=True, eq=False)
class _Shared:
    """A bend by which all muscles' slopes fall alike.

    `moved` (p,): its effect on the straight law. `own`: length of its weighted part that no
    straight law can describe. `reach`: largest amplitude. `size`: least-squares estimate of it.
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
        """Share of a slope that a bend can change while it gains less than `needed` squares."""
        moved = np.sqrt(needed) / self.own * np.abs(self.moved[1:]).max()
        return float(moved / max(np.abs(self.slopes).max(), 1e-300))

    def unseen(self, scatter: float) -> float:
        """Posterior mean square of the bend; `scatter`: variance of the points' weighted errors."""
        # sum_i c_i (s_i + z s_i^2): slopes fall by 2 z s from 0 to s
        prior = (PRIOR_SD / (2 * max(self.reach, 1e-300))) ** 2
        error = scatter / self.own**2
        ratio = prior / (prior + error)
        # odds of a bend of that prior over none
        gain = min(0.5 * self.size**2 / error * ratio, 500.0)
        odds = float(np.sqrt(1 - ratio) * np.exp(gain))
        return odds / (1 + odds) * ((self.size * ratio) ** 2 + error * ratio)


def _bent(
    symbol: str, chance: float, bent: FloatArray, straight: FloatArray, smallest: str
) -> Finding:
    """Finding on a law that is not straight."""
    at_rest, chord = (", ".join(f"{value:.3g}" for value in c) for c in (bent, straight))
    return Finding(
        "curvature",
        "warning",
        f"{symbol} is no straight line over the amplitudes (p = {chance:.1g}): near silence its "
        f"constant and slopes are {at_rest}, over the whole range {chord}; intervals hold both; "
        "use levels closer together, or a law for each range",
        smallest,
    )


# Scatter of points about a law beyond their stated errors: weights and slopes in turn.

#: Largest number of rounds for weights and slopes, and the relative change that ends them.
_ROUNDS, _SETTLED = 200, 1e-9
#: Variance of points without any error, as a share of the variance of the values.
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
    """Weighted moments for the regression, with one cluster per point."""
    w = 1 / variance
    gram = np.einsum("l,li,lj->lij", w, W, W)
    units = ("",) * len(names)
    return ErrorMoments(gram, W * (w * y)[:, None], S * w[:, None, None], names, units)


def settled_variance(
    W: FloatArray, y: FloatArray, sd: FloatArray, S: FloatArray, names: tuple[str, ...]
) -> tuple[FloatArray, float]:
    """Variance (L,) of each point about the law, and the sd of its unexplained part.

    Weights depend on the slopes, and slopes on the weights: both in turn until they converge.
    """
    base = np.full(len(y), float(y.var() + (sd**2).mean()) or 1.0)
    refuse_unreliable(error_moments(W, y, S, base, names), points=len(y))
    variance, scatter = base, 0.0
    for _ in range(_ROUNDS):
        before = variance
        beta = solve_total(error_moments(W, y, S, variance, names).corrected)
        # stated (L,) = sd^2 + beta^T S_l beta
        stated = sd**2 + np.einsum("i,lij,j->l", beta, S, beta)
        scatter = _unexplained(y - W @ beta, stated, len(y) - len(beta))
        variance = np.maximum(stated + scatter, _EXACT * base)
        if np.abs(variance - before).max() <= _SETTLED * variance.max():
            return variance, float(np.sqrt(scatter))
    raise EstimationError(
        f"weights and slopes of {', '.join(names[1:])} do not settle in {_ROUNDS} rounds: "
        "errors of the amplitudes are too large for these points"
    )


def _unexplained(residual: FloatArray, stated: FloatArray, dof: int) -> float:
    """Solve ``sum residual^2 / (stated + t) = dof`` for t >= 0 (R. C. Paule, J. Mandel, 1982)."""
    from scipy.optimize import brentq

    squares = residual**2
    most = float(squares.sum()) / dof

    def excess(t: float) -> float:
        total = np.maximum(stated + t, np.finfo(float).tiny)
        return float((squares / total).sum()) - dof

    if most == 0 or excess(0.0) <= 0:
        return 0.0
    if excess(most) >= 0:  # the points have no stated errors
        return most
    return float(brentq(excess, 0.0, most, xtol=1e-14 * most, rtol=1e-13))
