"""Single trials that are not like the others: the hand goes away, or moves for far longer."""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, IntArray

#: With fewer trials nobody can say which one is unlike the others.
FEWEST: int = 5
#: A trial is unlike the others beyond this many times what nine in ten of them reach.
TIMES: float = 2.0
#: A hand that is still this part of its way off at the end has not returned.
AWAY: float = 0.5


def beyond_the_others(values: FloatArray, reference: FloatArray | None = None) -> BoolArray:
    """Values beyond twice what nine in ten of the reference reach.

    Parameters
    ----------
    values : (T,)
    reference : (n,), optional
        Default: the values themselves.

    Returns
    -------
    (T,) array of bool
        All False where the reference has fewer than five values.
    """
    known = values if reference is None else reference
    if len(known) < FEWEST:
        return np.zeros(len(values), dtype=bool)
    return np.asarray(values > TIMES * lower_quantile(known, 0.9))


def lower_quantile(values: FloatArray | IntArray, part: float) -> float:
    """The value that this part of the values lies at or below, always one of them; NaN beside NaN.

    `numpy.quantile` with the method "lower", which takes longer for its many other ones.

    Parameters
    ----------
    values : (n,)
    part : float
        From 0 to 1.

    Returns
    -------
    float
    """
    ordered = np.sort(values)
    # NaN is sorted behind all numbers
    return float(ordered[-1 if np.isnan(ordered[-1]) else int((len(ordered) - 1) * part)])


def gone_astray(cut: FloatArray, onset: int, end: IntArray, usable: BoolArray) -> BoolArray:
    """Trials (T,) in which the hand goes further than in the others and does not come back.

    Parameters
    ----------
    cut : (T, S, d)
        Positions around the onset.
    onset : int
        Sample of the onset.
    end : (T,) int
        Sample at which each disturbance is over.
    usable : (T,) bool
        Trials that are judged.
    """
    far = np.zeros(cut.shape[:2])
    for axis in range(cut.shape[2]):
        far += np.square(cut[:, :, axis] - cut[:, onset, axis, None])
    peak = np.sqrt(far.max(axis=1))
    left = np.sqrt(far[np.arange(len(cut)), np.clip(end, 0, cut.shape[1] - 1)])
    away = (left > AWAY * peak) & beyond_the_others(left, peak[usable])
    return np.asarray(away & usable)
