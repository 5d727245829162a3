"""What a gain that may have changed in a session makes wrong in its estimates.

`courses` has the equations, `allowance` the mixture that intervals are.
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

#: Probability beforehand that a gain of the force changes in a session, and its usual part.
BEFOREHAND: Final = 0.05
USUAL_CHANGE: Final = 0.1
#: Changes less likely than this are left out.
_UNLIKELY: Final = 1e-4


@dataclass(frozen=True, eq=False)
class PossibleGain:
    """A gain that may have changed, with its probability and its mean square.

    `pattern` (3 d, 1): the rows of M, B and K that it scales.
    """

    weight: FloatArray
    pattern: FloatArray
    probability: float
    square: float


def possible_gains(
    recording: Recording, models: Sequence[tuple[IntArray, Model]]
) -> list[PossibleGain]:
    """The changes of a gain that the session does not exclude, by what its inertia says."""
    parts = [Part.of(model, rows) for rows, model in models]
    tried = tried_courses(recording, parts) if parts else []
    if not tried:
        return []
    told = []
    for one in tried:
        error2 = float(one.fit.covariance[one.number, one.number])
        told.append(odds_of(float(one.fit.sizes[one.number]), error2, USUAL_CHANGE**2))
    odds = np.array([float(each) for each, _ in told]) + np.log(
        BEFOREHAND / len(tried) / (1 - BEFOREHAND)
    )
    top = max(0.0, float(odds.max()))
    weight = np.exp(odds - top)
    likely = weight / (weight.sum() + np.exp(-top))
    wider, d = float(tails(likely.sum())), models[0][1].equation.axes
    return [
        PossibleGain(one.course.weight, rows_of_gain(d, one.axis), float(p) * wider, float(square))
        for one, p, (_, square) in zip(tried, likely, told, strict=True)
        if p > _UNLIKELY
    ]


def wrong_by_gains(gains: Sequence[PossibleGain], rows: IntArray, model: Model) -> FloatArray:
    """What they make wrong in one group, (2 gains, 3 d^2), in roots of mean squares.

    Nobody knows which gain was right, that before the change or that from it on: half each.
    """
    part = Part.of(model, rows)
    errors = []
    for gain in gains:
        D = part.scaled @ gain.pattern
        # theta = theta_before + (sum A)^-1 sum w A D g = theta_after - D g + the same
        before = part.inverse @ np.tensordot(gain.weight[rows], part.A, axes=1) @ D
        root = np.sqrt(gain.probability * gain.square / 2)
        errors += [root * before[:, 0], root * (before - D)[:, 0]]
    return np.array(errors).reshape(-1, len(part.theta))
