"""Least squares on a joint's equations, with the source's covariance and a robust one.

Robust covariance of a fit to few seconds of a swing, whose residuals remember: equal-weighted
cosines (E. Lazarus, D. J. Lewis, J. H. Stock, M. W. Watson, J. Bus. Econ. Stat. 36 (2018) 541-559;
U. K. Mueller, J. Econometrics 141 (2007) 1331-1352). The long-run variance of the scores is the
mean of squares of their B slowest cosine sums, and t has B degrees of freedom. Noise of an
acceleration is strong just below the filter's cut-off and nearly absent where the joint swings. The
Bartlett weights of a Newey-West estimator smear the one over the other and make the interval of k
twice too wide; cosines do not.

They take the noise to be as large everywhere as it is on average. After a release all of the swing
is in its first seconds, noise of the posture counts by the cosine of the swinging angle, and the
fit takes off residuals where few rows decide: k was covered in 86 %. Where every column went
through one filter, residuals forget within few of its periods, and leaving out piece by piece
counts all three.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import NotIdentifiableError
from armimpedance.joint.relaxed.equations import Equations
from armimpedance.joint.relaxed.samples import PassiveSamples
from armimpedance.joint.relaxed.terms import Terms
from armimpedance.numerics.regression import Fit, long_run_covariance

#: The band about the swing's own frequencies whose noise counts, Hz.
BAND_HZ: Final = 0.25

#: A piece, in periods of the cut-off: residuals behind the filter remember two or three.
_PIECE_PERIODS: Final = 12.0
_FEWEST_PIECES: Final = 8

#: Fewest and most cosines: fewer say little, more would pool the noise of other frequencies.
_FEWEST: Final = 6
_MOST: Final = 40


@dataclass(frozen=True)
class TwoFits:
    """One estimate with two covariances.

    Attributes
    ----------
    classical : Fit
        Fit with the source's covariance (10), for independent residuals.
    robust : Fit
        Fit with a covariance for autocorrelated residuals; intervals are made of it.
    """

    classical: Fit
    robust: Fit


def solver(
    equations: Callable[[PassiveSamples, Terms], Equations], *, filtered: bool = False
) -> Callable[[PassiveSamples, Terms], TwoFits]:
    """The estimator that solves these equations of a single joint by least squares.

    `filtered`: every column went through the filter of Y.
    """

    def solve(samples: PassiveSamples, terms: Terms) -> TwoFits:
        cutoff = samples.cutoff_hz if filtered else None
        return solve_linear(equations(samples, terms), samples.sample_rate_hz, cutoff)

    return solve


def solve_linear(
    equations: Equations, sample_rate_hz: float, cutoff_hz: float | None = None
) -> TwoFits:
    """Least squares with both covariances.

    Parameters
    ----------
    equations : Equations
    sample_rate_hz : float
    cutoff_hz : float, optional
        Of the low-pass that every column and Y went through; residuals then forget within pieces
        of some periods.

    Raises
    ------
    NotIdentifiableError
        W loses rank; names the parameters.
    InputError
        No more rows than parameters.
    """
    classical = equations.fit()
    E = [y - classical.predict(w) for w, y in zip(equations.W, equations.Y, strict=True)]
    if cutoff_hz is not None:
        try:
            rows = _PIECE_PERIODS * sample_rate_hz / cutoff_hz
            return TwoFits(classical, with_pieces(classical, equations, rows))
        except NotIdentifiableError:
            pass  # a motion so short that one piece holds all of it: the cosines say what they can
    return TwoFits(classical, with_long_run(classical, equations.W, E, sample_rate_hz))


def with_pieces(fit: Fit, equations: Equations, piece_rows: float) -> Fit:
    """The same fit with the jackknife's covariance (CR3) of pieces of its trials.

    Parameters
    ----------
    fit : Fit
        The fit of `equations`.
    equations : Equations
    piece_rows : float
        Longest piece; shorter where that makes fewer than `_FEWEST_PIECES`.

    Returns
    -------
    Fit

    Raises
    ------
    NotIdentifiableError
        One piece alone informs a parameter.
    """
    longest = min(piece_rows, equations.n_rows / _FEWEST_PIECES)
    pieces = [max(int(np.ceil(len(w) / longest)), 1) for w in equations.W]
    cut = replace(
        equations,
        W=tuple(p for w, n in zip(equations.W, pieces, strict=True) for p in np.array_split(w, n)),
        Y=tuple(p for y, n in zip(equations.Y, pieces, strict=True) for p in np.array_split(y, n)),
    ).fit("cr3")
    return fit.with_covariance(cut.covariance, f"cr3 of {sum(pieces)} pieces", cut.dof)


def with_long_run(
    fit: Fit, W: Sequence[FloatArray], E: Sequence[FloatArray], sample_rate_hz: float
) -> Fit:
    """The same fit with the covariance of autocorrelated residuals.

    Parameters
    ----------
    fit : Fit
        A fit of one output.
    W : sequence of (S_t, p)
    E : sequence of (S_t, 1)
        Residuals, trials one after another in time.
    sample_rate_hz : float
    """
    rows, residual = np.concatenate(W), np.concatenate(E)
    count = number_of_cosines(len(rows), sample_rate_hz)
    covariance = long_run_covariance(fit.triangle, rows, residual, count)
    return fit.with_covariance(covariance, f"long-run, {count} cosines", float(count))


def number_of_cosines(rows: int, sample_rate_hz: float) -> int:
    """B: cosine j has ``j / (2 T)`` Hz, T the seconds of all rows; at most a quarter of them."""
    seconds = rows / sample_rate_hz
    within = round(2 * seconds * BAND_HZ)
    return int(np.clip(np.clip(within, _FEWEST, _MOST), 1, max(rows // 4, 1)))
