"""Single trials that are not like the others: the hand goes away, or moves for far longer."""

from __future__ import annotations

import numpy as np

from armimpedance.arrays import BoolArray, FloatArray, IntArray, lengths

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
    usual = float(np.quantile(known, 0.9, method="lower"))
    return np.asarray(values > TIMES * usual)


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
    moved = lengths(cut - cut[:, onset : onset + 1])
    peak = moved.max(axis=1)
    left = moved[np.arange(len(cut)), np.clip(end, 0, cut.shape[1] - 1)]
    away = (left > AWAY * peak) & beyond_the_others(left, peak[usable])
    return np.asarray(away & usable)
