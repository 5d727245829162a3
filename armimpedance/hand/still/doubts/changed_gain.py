"""Errors of a session's estimates by a gain that may have changed during the session.

See `courses` for the equations, `allowance` for the mixture that the intervals come from.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.records import Recording
from armimpedance.hand.still.doubts.courses import Part, rows_of_gain, tried_courses
from armimpedance.hand.still.doubts.model import Model
from armimpedance.hand.still.doubts.odds import odds_of, tails

#: Prior probability that a gain of the force changes in a session, and its usual relative change.
BEFOREHAND: Final = 0.05
USUAL_CHANGE: Final = 0.1
#: Changes less likely than this are left out.
_UNLIKELY: Final = 1e-4


@dataclass(frozen=True, eq=False)
class PossibleGain:
    """A possible change of a gain, with its probability and its mean square.

    `pattern` (3 d, 1): the rows of M, B and K that it scales.
    """

    weight: FloatArray
    pattern: FloatArray
    probability: float
    square: float


def possible_gains(
    recording: Recording, models: Sequence[tuple[IntArray, Model]]
) -> list[PossibleGain]:
    """Changes of a gain that the inertia over the session does not exclude."""
    parts = [Part.of(model, rows) for rows, model in models]
    tried = tried_courses(recording, parts) if parts else []
    if not tried:
        return []
    factors = []
    for candidate in tried:
        error2 = float(candidate.fit.covariance[candidate.number, candidate.number])
        factors.append(
            odds_of(float(candidate.fit.sizes[candidate.number]), error2, USUAL_CHANGE**2)
        )
    odds = np.array([float(factor) for factor, _ in factors]) + np.log(
        BEFOREHAND / len(tried) / (1 - BEFOREHAND)
    )
    top = max(0.0, float(odds.max()))
    weight = np.exp(odds - top)
    likely = weight / (weight.sum() + np.exp(-top))
    wider, d = float(tails(likely.sum())), models[0][1].equation.axes
    return [
        PossibleGain(
            candidate.course.weight,
            rows_of_gain(d, candidate.axis),
            float(p) * wider,
            float(square),
        )
        for candidate, p, (_, square) in zip(tried, likely, factors, strict=True)
        if p > _UNLIKELY
    ]


def wrong_by_gains(gains: Sequence[PossibleGain], rows: IntArray, model: Model) -> FloatArray:
    """Errors of one group by these changes, (2 gains, 3 d^2), as roots of mean squares.

    The gain before the change or the gain after it may be the right one: each has half the
    probability.
    """
    part = Part.of(model, rows)
    errors = []
    for gain in gains:
        D = part.scaled @ gain.pattern
        # theta = theta_before + (sum A)^-1 sum w A D g = theta_after - D g + the same term
        before = part.inverse @ np.tensordot(gain.weight[rows], part.A, axes=1) @ D
        root = np.sqrt(gain.probability * gain.square / 2)
        errors += [root * before[:, 0], root * (before - D)[:, 0]]
    return np.array(errors).reshape(-1, len(part.theta))
