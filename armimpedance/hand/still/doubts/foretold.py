"""Predicted width of the intervals of an estimate, before its trials are recorded.

The covariance of noise falls with the number of trials. The terms that `allowance` adds fall as the
trials exclude departures. The estimated sizes of the departures are random: they are drawn from
their joint distribution, and the median draw is the prediction.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray, frozen
from armimpedance.hand.still.doubts.knowledge import Knowledge
from armimpedance.hand.still.doubts.mixture import (
    expected_numbers,
    mean_square_of_gain,
    mean_squares,
)
from armimpedance.hand.still.doubts.model import ALL_COLUMNS
from armimpedance.hand.still.doubts.symmetry import (
    LARGEST_GAIN,
    gain_in,
    limit_of_gain,
    rows_of,
)
from armimpedance.numerics.regression import t_factor

#: Simulated sessions, with a fixed seed.
_DRAWS: Final = 200
#: Simulated sessions if many candidates are compared.
_FEW: Final = 48


def foretold_allowance(
    known: Sequence[Knowledge], parameters: Sequence[FloatArray]
) -> list[FloatArray]:
    """Covariance (p, p) that `estimate` will add to that of noise, for each condition of a session.

    Parameters
    ----------
    known : sequence of Knowledge
        Information of the trials of each condition, recorded and planned ones together.
    parameters : sequence of (p,)
        Expected M (with the handle), B and K of each condition, row by row.

    Returns
    -------
    list of (p, p) arrays
        To be added to the covariance of noise: the median by K of the first condition.
    """
    weight = np.stack([knowledge.expected**-2 for knowledge in known])
    expected = weight.sum(axis=0) ** -0.5
    dof = sum(knowledge.trials for knowledge in known) - len(known)
    z = _normal(len(ALL_COLUMNS)) @ _root_of_correlation(known).T
    k = expected * z
    squares = mean_squares(k, expected * t_factor(max(dof, 1.0)) / t_factor(np.inf))
    gain = _gains(known, parameters)
    # by how much K's diagonal grows in each draw
    first, d = known[0], round((known[0].parameters / 3) ** 0.5)
    diagonal = 2 * d * d + (d + 1) * np.arange(d)
    of_axes = (parameters[0].reshape(3, d, d)[2].diagonal()) ** 2
    grows = (squares @ first.shifts[:, diagonal] ** 2 + gain[:, None] * of_axes / d) / np.diag(
        first.covariance
    )[diagonal]
    middle = int(np.argsort(grows.max(axis=1))[_DRAWS // 2])
    return [
        (knowledge.shifts.T * squares[middle]) @ knowledge.shifts
        + gain[middle] * _of_gains(theta, d)
        for knowledge, theta in zip(known, parameters, strict=True)
    ]


def _root_of_correlation(conditions: Sequence[Knowledge]) -> FloatArray:
    """Root (c, c) of the correlation of the sizes of the departures, mean over conditions."""
    total = np.mean(
        [
            knowledge.own * np.outer(knowledge.expected, knowledge.expected)
            for knowledge in conditions
        ],
        axis=0,
    )
    values, vectors = np.linalg.eigh(total)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


@lru_cache(maxsize=2)
def _normal(count: int) -> FloatArray:
    return frozen(np.random.default_rng(43).standard_normal((_DRAWS, count)))


def _gains(conditions: Sequence[Knowledge], parameters: Sequence[FloatArray]) -> FloatArray:
    """Mean square of one axis' gain in each draw; 0 if the gain is hardly detectable."""
    d = round((conditions[0].parameters / 3) ** 0.5)
    if d == 1:
        return np.zeros(_DRAWS)
    gains_and_errors = [
        gain_in(theta, one.covariance, 0) for one, theta in zip(conditions, parameters, strict=True)
    ]
    error = float(sum(one[1] ** -2 for one in gains_and_errors) ** -0.5)
    if limit_of_gain(error, min(one.trials for one in conditions) - 1) > LARGEST_GAIN:
        return np.zeros(_DRAWS)
    return mean_square_of_gain(error * _normal(len(ALL_COLUMNS) + 1)[:, -1], error)


def _of_gains(theta: FloatArray, d: int) -> FloatArray:
    """Mean outer product (p, p) of the errors by a unit gain of an unknown axis."""
    rows = [rows_of(theta, axis) for axis in range(d)]
    return np.asarray(np.mean([np.outer(row, row) for row in rows], axis=0))


def expected_mean_squares(
    own: Sequence[FloatArray], dof: float, seen: tuple[FloatArray, FloatArray] | None = None
) -> FloatArray:
    """Expected mean square (..., c) of the size of each departure in the mixture.

    Parameters
    ----------
    own : sequence of (..., c, c)
        Information of each condition about the sizes of the departures, with M, B and K unknown.
    dof : float
        Degrees of freedom of the session.
    seen : ((c,), (c,)), optional
        Sizes of the departures estimated so far, and their standard errors: more trials are
        expected to confirm a likely departure. Default: none.

    Returns
    -------
    (..., c) array
        The mean over sessions in which the sizes differ by chance.
    """
    total = np.sum([np.diagonal(information, axis1=-2, axis2=-1) for information in own], axis=0)
    expected = np.maximum(total, 1e-300) ** -0.5
    few = _normal(total.shape[-1])[:_FEW]
    error = expected * t_factor(max(dof, 1.0)) / t_factor(np.inf)
    k = few * expected[..., None, :] + (0.0 if seen is None else expected_numbers(*seen))
    return np.asarray(mean_squares(k, error[..., None, :]).mean(axis=-2))
