"""Are the residuals white? Judged where the signal is, not where a filter left its mark.

The residual of a filtered fit at the filtered samples' rate is coloured by the filter, whatever
the joint does. Tested is therefore the equation's residual as Fourier coefficients of the band, in
units of what the sensors' noise predicts, as a series at twice the band's upper edge: with white
sensors' noise and a true model it is white for every method alike. What is not is the subject's
own torque, a reflex, a joint that changed: the interval, made of blocks, allows for it, the values
may not.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.elbow.result import Whiteness
from armimpedance.joint.elbow.stationary.band import Band, in_time

MOST_LAGS: Final = 20
#: A correlation below this is of no consequence, however sure.
SMALL: Final = 0.15
UNLIKELY: Final = 1e-3
#: What is left when all but this part of the angle is explained is of no consequence either.
ENOUGH: Final = 1e-4


def residual_whiteness(
    floors: Band, values: FloatArray, unexplained: float, *, weighed: bool = False
) -> tuple[Whiteness, str | None]:
    """Ljung-Box test of the weighed residual at I, B, K (3,), and a warning where it is far off.

    Parameters
    ----------
    floors : Band
        Weighed by the sensors' noise alone.
    values : (3,)
    unexplained : float
        Part of the angle's power that I, B and K do not explain.
    weighed : bool
        The fit's weights follow the residual's spectrum: what is in it is allowed for already.
    """
    white = ljung_box([in_time(bins.residual(values)) for bins in floors.trials])
    return white, _warning(white, unexplained, weighed)


def ljung_box(series: list[FloatArray], lags: int | None = None) -> Whiteness:
    """``Q = N (N + 2) sum_k r_k^2 / (N - k)``, chi-squared with as many degrees as lags.

    Parameters
    ----------
    series : list of (S_t,)
        Never correlated across trials.
    lags : int, optional
        20, or a fifth of the shortest series.
    """
    from scipy.stats import chi2

    shortest = min(len(e) for e in series)
    count = lags or max(min(MOST_LAGS, shortest // 5), 1)
    centred = [e - e.mean() for e in series]
    power = sum(float(e @ e) for e in centred)
    if power == 0:
        return Whiteness(0.0, 1.0, count, 0.0)
    k = np.arange(1, count + 1)
    r = np.array([sum(float(e[:-j] @ e[j:]) for e in centred) for j in k]) / power
    N = sum(len(e) for e in series)
    statistic = float(N * (N + 2) * (r**2 / (N - k)).sum())
    return Whiteness(
        statistic, float(chi2.sf(statistic, count)), count, float(r[np.abs(r).argmax()])
    )


def _warning(white: Whiteness, unexplained: float, weighed: bool) -> str | None:
    """A sentence where the residuals are far from white, and more than rounding."""
    if (
        weighed
        or unexplained < ENOUGH
        or white.p > UNLIKELY
        or abs(white.largest_correlation) < SMALL
    ):
        return None
    return (
        f"the residuals are not white (Ljung-Box {white.probability}, correlation up to "
        f"{white.largest_correlation:.2f}): more than I, B, K and sensors' noise is in the "
        "torque (the subject's own, a joint that changed); the intervals allow for it, the values "
        "may not"
    )
