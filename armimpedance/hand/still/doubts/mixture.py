"""Probability of each departure, given its size and its standard error.

The limb has one of the departures or none; see `odds` for the equations.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.hand.still.doubts.model import ALL_COLUMNS, family, kind_of
from armimpedance.hand.still.doubts.odds import odds_of, tails

#: Prior probability of each departure, and its usual size (in the unit of its column).
BEFOREHAND: Final = {
    "delay": (0.1, 1e-3),
    "reflex": (0.3, 0.3),
    "reflex to the velocity": (0.05, 0.3),
    "amplitude": (0.1, 0.3),
    "friction": (0.05, 0.1),
    "voluntary": (0.1, 0.3),
}
#: The same for a gain of one axis of the force relative to the others.
GAIN_BEFOREHAND: Final = 0.05
USUAL_GAIN: Final = 0.1
#: Departures with a positive sign only: a negative one is another departure.
POSITIVE: Final = ("reflex", "friction")
#: Departures less likely than this are left out.
UNLIKELY: Final = 1e-4

#: The departure of each column, and its name among the priors.
_FAMILIES: Final = tuple(family(column) for column in ALL_COLUMNS)
_NAMES: Final = tuple(kind_of(column) for column in ALL_COLUMNS)
_PRIOR: Final = np.array([BEFOREHAND[name][0] / _NAMES.count(name) for name in _NAMES])
_USUAL: Final = np.array([BEFOREHAND[name][1] for name in _NAMES])
_NONE: Final = 1 - sum(prior for prior, _ in BEFOREHAND.values())
_POSITIVE: Final = np.array([name in POSITIVE for name in _FAMILIES])
#: 1 where two columns are of one departure.
_ALIKE: Final = np.array([[float(a == b) for b in _FAMILIES] for a in _FAMILIES])


def _probabilities(k: FloatArray, error: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Probability (..., c) of each departure, and the mean square of its size if it exists."""
    factor, square = odds_of(k, error**2, _USUAL**2)
    odds = factor + np.log(_PRIOR / _NONE)
    top = np.maximum(odds.max(axis=-1, keepdims=True), 0.0)
    weight = np.exp(odds - top)
    return weight / (np.exp(-top) + weight.sum(axis=-1, keepdims=True)), square


def mean_squares(k: FloatArray, error: FloatArray) -> FloatArray:
    """Mean square (..., c) of the size of each departure in the mixture, scaled for its tails.

    `k`, `error` (..., c): sizes and standard errors, in the order of `ALL_COLUMNS`.
    """
    p, square = _probabilities(np.where(_POSITIVE, np.maximum(k, 0.0), k), error)
    return np.asarray(np.where(p > UNLIKELY, p * tails(p @ _ALIKE) * square, 0.0))


def expected_numbers(k: FloatArray, error: FloatArray) -> FloatArray:
    """Sizes of departures that more trials are expected to show: 0 for an unlikely one.

    A mean over having the departure and not having it would fit neither case: more trials would
    make it significant.

    Parameters
    ----------
    k, error : (..., c) arrays
        Sizes and standard errors, in the order of `ALL_COLUMNS`.

    Returns
    -------
    (..., c) array
    """
    number = np.where(_POSITIVE, np.maximum(k, 0.0), k)
    p, _ = _probabilities(number, error)
    return np.asarray(np.where(p > 0.5, number * _USUAL**2 / (_USUAL**2 + error**2), 0.0))


def mean_square_of_gain(k: FloatArray, error: float) -> FloatArray:
    """Mean square, in the mixture, of the gain of one axis relative to the others, less 1."""
    factor, square = odds_of(k, error**2, USUAL_GAIN**2)
    odds = np.exp(np.minimum(factor, 50.0)) * GAIN_BEFOREHAND / (1 - GAIN_BEFOREHAND)
    p = odds / (1 + odds)
    return np.asarray(p * tails(p) * square)
