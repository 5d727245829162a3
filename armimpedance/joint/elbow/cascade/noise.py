"""The torque's noise as an autoregression, and rows from which it is taken."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray

#: Highest order of the autoregression.
ORDER: Final = 16


def autoregression(residual: FloatArray) -> FloatArray:
    """Coefficients ``1, a_1, ...`` (p + 1,) of what is left of the torque, after Burg (1968).

    Parameters
    ----------
    residual : (N,)
        NaN where there is none.
    """
    known = np.where(np.isfinite(residual), residual, 0.0)
    forward, backward = known[1:].copy(), known[:-1].copy()
    # no product goes over the gap between two trials
    gap = ~(np.isfinite(residual[1:]) & np.isfinite(residual[:-1]))
    a = best = np.ones(1)
    count = max(int((~gap).sum()), 2)
    least = score = np.log(max((known**2).sum(), 1e-300))
    for order in range(1, ORDER + 1):
        forward[gap], backward[gap] = 0.0, 0.0
        power = (forward**2).sum() + (backward**2).sum()
        k = -2 * (forward @ backward) / power if power else 0.0
        longer = np.append(a, 0.0)
        a = longer + k * longer[::-1]
        forward, backward = (forward + k * backward)[1:], (backward + k * forward)[:-1]
        gap = gap[1:] | gap[:-1]
        score += np.log(1 - k**2)
        # Schwarz's criterion
        if score + order * np.log(count) / count < least:
            least, best = score + order * np.log(count) / count, a
    return best


def whitened(values: FloatArray, a: FloatArray) -> FloatArray:
    """``sum_k a_k values[t - k]`` along the first axis; the first p rows lack their past."""
    out = np.array(values)
    for k in range(1, len(a)):
        out[k:] += a[k] * values[:-k]
    return out
