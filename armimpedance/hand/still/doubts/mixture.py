"""How probable each departure is, given its number and its standard error.

The limb has none of the departures or one; see `odds` for the equations.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.hand.still.doubts.model import ALL_COLUMNS, COLUMNS, family
from armimpedance.hand.still.doubts.odds import odds_of, tails

#: Probability of each departure beforehand, and the size that it usually has (its column's unit).
BEFOREHAND: Final = {
    "delay": (0.1, 1e-3),
    "reflex": (0.3, 0.3),
    "amplitude": (0.1, 0.3),
    "friction": (0.05, 0.1),
    "voluntary": (0.1, 0.3),
}
#: The same of a gain of one axis of the force beside the others.
GAIN_BEFOREHAND: Final = 0.05
USUAL_GAIN: Final = 0.1
#: Departures that have one sign only: a negative one is another departure.
POSITIVE: Final = ("reflex", "friction")
#: Departures less likely than this are left out.
UNLIKELY: Final = 1e-4

#: The departure of each column.
_FAMILIES: Final = tuple(family(column) for column in ALL_COLUMNS)
_PRIOR: Final = np.array([BEFOREHAND[name][0] / len(COLUMNS[name]) for name in _FAMILIES])
_USUAL: Final = np.array([BEFOREHAND[name][1] for name in _FAMILIES])
_NONE: Final = 1 - sum(prior for prior, _ in BEFOREHAND.values())
_POSITIVE: Final = np.array([name in POSITIVE for name in _FAMILIES])
#: 1 where two columns are of one departure.
_ALIKE: Final = np.array([[float(a == b) for b in _FAMILIES] for a in _FAMILIES])


def _probabilities(k: FloatArray, error: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Probability (..., c) of each departure, and its number's mean square if it is there."""
    factor, square = odds_of(k, error**2, _USUAL**2)
    odds = factor + np.log(_PRIOR / _NONE)
    top = np.maximum(odds.max(axis=-1, keepdims=True), 0.0)
    weight = np.exp(odds - top)
    return weight / (np.exp(-top) + weight.sum(axis=-1, keepdims=True)), square


def mean_squares(k: FloatArray, error: FloatArray) -> FloatArray:
    """Mean square (..., c) of each departure's number in the mixture, for the tails of it.

    `k`, `error` (..., c): numbers and standard errors, in the order of `ALL_COLUMNS`.
    """
    p, square = _probabilities(np.where(_POSITIVE, np.maximum(k, 0.0), k), error)
    return np.asarray(np.where(p > UNLIKELY, p * tails(p @ _ALIKE) * square, 0.0))


def expected_numbers(k: FloatArray, error: FloatArray) -> FloatArray:
    """Numbers of departures that more trials are to show: those of a likely one, else 0.

    A mean over having and not having it would be neither: more trials would make it significant.

    Parameters
    ----------
    k, error : (..., c) arrays
        Numbers and standard errors, in the order of `ALL_COLUMNS`.

    Returns
    -------
    (..., c) array
    """
    number = np.where(_POSITIVE, np.maximum(k, 0.0), k)
    p, _ = _probabilities(number, error)
    return np.asarray(np.where(p > 0.5, number * _USUAL**2 / (_USUAL**2 + error**2), 0.0))


def mean_square_of_gain(k: FloatArray, error: float) -> FloatArray:
    """The same of one axis' gain beside the others less 1."""
    factor, square = odds_of(k, error**2, USUAL_GAIN**2)
    odds = np.exp(np.minimum(factor, 50.0)) * GAIN_BEFOREHAND / (1 - GAIN_BEFOREHAND)
    p = odds / (1 + odds)
    return np.asarray(p * tails(p) * square)
