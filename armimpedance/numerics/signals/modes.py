"""Smooth test functions over a window: a few dozen numbers per trial hold all that a fit can use.

B-splines of degree 5 with uniform knots, each inside the window, so that they and their first four
derivatives vanish at its ends. Sums of a signal against them need no derivative of the signal:
``sum phi x'' = sum phi'' x`` and ``sum phi x' = -sum phi' x``, whatever the signal does at the
window's ends. What passes is below about one over twice the spacing of the knots (25 Hz at 20 ms);
the arm's inertia, encoder noise and force noise leave nothing to gain above.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Annotated

import numpy as np
from scipy.linalg import solve_triangular

from armimpedance.core.arrays import FloatArray, FrozenRecord, frozen
from armimpedance.core.errors import InputError
from armimpedance.numerics.signals.cardinal import cardinal_spline
from armimpedance.numerics.signals.differentiate import SPLINE_DEGREE

#: Distance of the knots (s); docs/estimate/methods.md says how it was chosen.
SPACING_S = 0.020
#: A window is covered by at least this many test functions, with narrower spacing if need be.
FEWEST = 10


@dataclass(frozen=True, eq=False)
class Modes(FrozenRecord):
    """Orthonormal combinations of test functions and what replaces derivatives of the signal.

    Attributes
    ----------
    smooth : (n, S)
        ``smooth @ smooth.T = I``: white noise of the samples stays white.
    first, second : (n, S)
        ``first @ x`` is what `smooth` makes of x', ``second @ x`` of x''.
    """

    smooth: Annotated[FloatArray, "n s"]
    first: Annotated[FloatArray, "n s"]
    second: Annotated[FloatArray, "n s"]

    @property
    def count(self) -> int:
        """Number of modes n."""
        return len(self.smooth)

    @cached_property
    def stacked(self) -> FloatArray:
        """Operators for x'', x', x on top of each other, (3 n, S)."""
        return frozen(np.concatenate([self.second, self.first, self.smooth]))

    @property
    def gaps(self) -> FloatArray:
        """What `smooth` makes of a constant of one, (n,)."""
        return np.asarray(self.smooth.sum(axis=1))


def delayed(signal: FloatArray, samples: float) -> FloatArray:
    """The signal (..., S) as it was `samples` earlier, linear between samples; at rest before.

    Parameters
    ----------
    signal : (..., S)
    samples : float
        Delay in samples, not necessarily whole.

    Returns
    -------
    array of the same shape
        The delayed signal, in the signal's unit.
    """
    whole = int(np.floor(samples))
    part = samples - whole
    rest = np.repeat(signal[..., :1], whole + 1, axis=-1)
    padded, count = np.concatenate([rest, signal], axis=-1), signal.shape[-1]
    return np.asarray((1 - part) * padded[..., 1 : count + 1] + part * padded[..., :count])


@lru_cache(maxsize=64)
def spline_modes(samples: int, sample_rate_hz: float, spacing_s: float = SPACING_S) -> Modes:
    """Modes of a window of that many samples.

    Parameters
    ----------
    samples : int
    sample_rate_hz : float
    spacing_s : float
        Distance of the knots; narrowed where the window holds fewer than ten splines.

    Raises
    ------
    InputError
        If the window has too few samples for ten splines with knots two samples apart.
    """
    widest = (samples - 1) // (FEWEST + SPLINE_DEGREE)
    if widest < 2:
        raise InputError(
            f"a window of {samples} samples at {sample_rate_hz:g} Hz",
            expected=f"at least {2 * (FEWEST + SPLINE_DEGREE) + 1} samples",
        )
    spacing = min(max(2, round(spacing_s * sample_rate_hz)), widest)
    count = (samples - 1) // spacing - SPLINE_DEGREE
    first_knot = ((samples - 1) - (count + SPLINE_DEGREE) * spacing) // 2
    at = np.arange(samples)
    places = (at - first_knot) / spacing - np.arange(count)[:, None]
    # integration by parts: (-1)^order
    per = -sample_rate_hz / spacing
    rows = [per**order * cardinal_spline(places, SPLINE_DEGREE, order) for order in range(3)]
    # P (n, S) = L Q: L^-1 P has orthonormal rows
    L = np.linalg.cholesky(rows[0] @ rows[0].T)
    smooth, first, second = (solve_triangular(L, each, lower=True) for each in rows)
    return Modes(smooth, first, second)
