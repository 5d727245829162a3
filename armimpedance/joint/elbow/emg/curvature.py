"""Is the law straight? Squares of the amplitudes beside it, an F test, and what a bend does to it.

    y = c_0 + sum_i c_i s_i + sum_i q_i s_i^2 + e

The points' scatter about the bent law is its own measure, so that errors of the points that were
stated too small, or not at all, do not pass for a bend.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import fdtrc, fdtri

from armimpedance.core.arrays import FloatArray
from armimpedance.core.findings import Finding

#: A bend that chance makes less often than this is told.
UNLIKELY: Final = 0.003
#: Fewer points than this are asked for one bend of both muscles, not for one of each.
FOR_EACH: Final = 14
#: A bend that could move slopes by more than this part, unseen, is said to be untold; one that
#: moves them by less than that part is none.
MATTERS: Final = 0.6
LEAST: Final = 0.02


@dataclass(frozen=True, eq=False)
class Bend:
    """What was found, and by how much a bend moves the coefficients of the straight law.

    Attributes
    ----------
    finding : Finding
    shift : (m + 1,)
        Coefficients of the bent law at silent muscles less those of the straight one; 0 where no
        bend was found.
    """

    finding: Finding
    shift: FloatArray


def bend_of(
    symbol: str, W: FloatArray, y: FloatArray, variance: FloatArray, slopes: FloatArray
) -> Bend:
    """Hold a law against one that is bent.

    Parameters
    ----------
    symbol : str
    W : (L, m + 1)
        A constant and the amplitudes.
    y, variance : (L,)
        Values, and their variances about the law.
    slopes : (m,)
        Of the straight law.
    """
    L, p = W.shape
    root = 1 / np.sqrt(variance)
    squares = W[:, 1:] ** 2
    alike = squares @ slopes
    further = squares if L >= FOR_EACH else alike[:, None]
    q = further.shape[1]
    if L - p - q < 1:
        said = f"{symbol}: {L} points are too few to show a bend"
        return Bend(Finding("curvature", "cannot tell", said), np.zeros(p))
    X, z = np.column_stack([W, further]) * root[:, None], y * root
    # X (L, p + q) [c, q] = z (L,), and the straight law W c = z
    bent, straight = (np.asarray(np.linalg.lstsq(X[:, :k], z)[0], dtype=float) for k in (p + q, p))
    left = float(((z - X @ bent) ** 2).sum()) / (L - p - q)
    gained = float(((z - X[:, :p] @ straight) ** 2).sum()) - left * (L - p - q)
    chance = float(fdtrc(q, L - p - q, max(gained, 0.0) / q / max(left, 1e-300)))
    shift = bent[:p] - straight
    # a bend that is told half of the times gains so much
    needed = left * q * float(fdtri(q, L - p - q, 1 - UNLIKELY))
    hidden = _hidden(X[:, :p], alike * root, needed, slopes)
    smallest = f"slopes {100 * hidden:.0f} % off"
    if chance < UNLIKELY and np.abs(shift[1:]).max() > LEAST * np.abs(slopes).max():
        return Bend(_bent(symbol, chance, bent[:p], straight, smallest), shift)
    if hidden > MATTERS:
        said = f"{symbol}: too few or too scattered points to show one (p = {chance:.2g})"
        return Bend(Finding("curvature", "cannot tell", said, smallest), np.zeros(p))
    said = f"{symbol}: no bend is seen (p = {chance:.2g})"
    return Bend(Finding("curvature", "ok", said, smallest), np.zeros(p))


def _hidden(W: FloatArray, alike: FloatArray, needed: float, slopes: FloatArray) -> float:
    """Part of a slope by which a bend that all muscles share may move it without being told."""
    moved, *_ = np.linalg.lstsq(W, alike, rcond=None)
    own = float(np.linalg.norm(alike - W @ moved))
    size = np.sqrt(needed) / max(own, 1e-300)
    return float(np.abs(size * moved[1:]).max() / max(np.abs(slopes).max(), 1e-300))


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
