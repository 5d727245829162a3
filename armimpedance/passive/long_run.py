"""Robust covariance of a fit to few seconds of a swing: residuals that remember.

Equal-weighted cosines (E. Lazarus, D. J. Lewis, J. H. Stock, M. W. Watson, J. Bus. Econ. Stat. 36
(2018) 541-559; U. K. Mueller, J. Econometrics 141 (2007) 1331-1352): the long-run variance of the
scores is the mean of squares of their B slowest cosine sums, and t has B degrees of freedom. Noise
of an acceleration is strong just below the filter's cut-off and nearly absent where the joint
swings; the Bartlett weights of the regression's Newey-West estimator smear the one over the other
and make the interval of k twice too wide, cosines do not.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from scipy.linalg import solve_triangular

from armimpedance.arrays import FloatArray
from armimpedance.regression import Fit, with_covariance

#: The band about the swing's own frequencies whose noise counts, Hz.
BAND_HZ: Final = 0.25

#: Fewest and most cosines: fewer say little, more would pool the noise of other frequencies.
_FEWEST: Final = 6
_MOST: Final = 40


def with_long_run(
    fit: Fit, W: Sequence[FloatArray], E: Sequence[FloatArray], sample_rate_hz: float
) -> Fit:
    """The same fit with the covariance of autocorrelated residuals.

    Parameters
    ----------
    fit : Fit
        Of one output.
    W : sequence of (S_t, p)
    E : sequence of (S_t, 1)
        Residuals, trials one after another in time.
    sample_rate_hz : float
    """
    rows, residual = np.concatenate(W), np.concatenate(E)
    n = len(rows)
    count = number_of_cosines(n, sample_rate_hz)
    scale = np.linalg.norm(fit.triangle, axis=0)
    # scores u (n, p) in the orthonormal basis: W = Z R, u_i = z_i e_i
    scores = solve_triangular(fit.triangle / scale, (rows / scale).T, trans="T").T * residual
    phase = np.pi * (np.arange(n) + 0.5) / n
    cosines = np.cos(np.arange(1, count + 1)[:, None] * phase)
    # meat (p, p) = (2 / B) sum_j L_j L_j^T, L (B, p) the cosine sums
    sums = cosines @ scores
    meat = 2 / count * sums.T @ sums
    inverse = solve_triangular(fit.triangle / scale, np.eye(len(scale))) / scale[:, None]
    covariance = inverse @ meat @ inverse.T
    return with_covariance(fit, covariance, f"long-run, {count} cosines", float(count))


def number_of_cosines(rows: int, sample_rate_hz: float) -> int:
    """B: cosine j has ``j / (2 T)`` Hz, T the seconds of all rows; at most a quarter of them."""
    seconds = rows / sample_rate_hz
    within = round(2 * seconds * BAND_HZ)
    return int(np.clip(np.clip(within, _FEWEST, _MOST), 1, max(rows // 4, 1)))
