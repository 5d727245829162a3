"""Check of labels: do the trials of a set belong to the conditions that their labels name?

A set is compared with the others. With theta_a and theta_b, M, B and K of two conditions from the
trials of all other sets, its trials labelled a have ``theta_a + g (theta_b - theta_a)``, and those
labelled b the same with a and b exchanged. g is 0 if the labels are right and 1 if they are
exchanged.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, IntArray
from armimpedance.core.findings import Finding
from armimpedance.core.records import Recording
from armimpedance.hand.still.doubts.courses import ORDER
from armimpedance.hand.still.doubts.model import Model

#: Labels are exchanged if g is nearer to 1 than to 0 and this many standard errors from 0.
SIGNIFICANT: Final = 4.0
HALF: Final = 0.5
#: A pair of conditions is not judged if the standard error of g is larger.
LEAST_KNOWN: Final = 0.2
#: Of more conditions only the first are compared with each other.
MOST_CONDITIONS: Final = 8


@dataclass(frozen=True)
class Exchanged:
    """g of two conditions in one set, its standard error, and the set."""

    size: float
    error: float
    column: str
    label: Any
    conditions: tuple[str, str]

    @property
    def seen(self) -> bool:
        """True if the labels are exchanged."""
        return self.size > HALF and self.size > SIGNIFICANT * self.error


def check_labels(
    recording: Recording, models: Sequence[tuple[IntArray, Model]]
) -> tuple[Finding, ...]:
    """The finding "labels"; empty without two conditions in three sets.

    `models`: each condition's trials, as rows of the recording, and its fit.
    """
    determined = [pair for pair in exchanges(recording, models) if pair.error < LEAST_KNOWN]
    if not determined:
        return ()
    worst = max(determined, key=lambda pair: pair.size)
    if not worst.seen:
        text = "each set's trials are like those of their conditions in the other sets"
        return (Finding("labels", "ok", text),)
    first, second = worst.conditions
    text = (
        f"in {worst.column} {worst.label} trials labelled {first} are like those labelled "
        f"{second} elsewhere, and the other way round: are the labels exchanged there?"
    )
    return (Finding("labels", "warning", text),)


def exchanges(
    recording: Recording, models: Sequence[tuple[IntArray, Model]]
) -> Iterator[Exchanged]:
    """Yield every pair of conditions in every set that has both; other sets must have both, too."""
    named = [
        (str(recording.trials["condition"].iloc[rows[0]]), rows, model)
        for rows, model in models[:MOST_CONDITIONS]
    ]
    for column in ORDER:
        if column not in recording.trials or recording.trials[column].nunique() < 3:
            continue
        labels = recording.trials[column].to_numpy()
        for label in recording.trials[column].dropna().unique():
            apart = {name: _Apart.of(m, labels[rows] == label) for name, rows, m in named}
            for pair in combinations(apart, 2):
                first, second = (apart[name] for name in pair)
                if first is not None and second is not None:
                    size, error = _exchange(first, second)
                    yield Exchanged(size, error, column, label, pair)


@dataclass(frozen=True, eq=False)
class _Apart:
    """Trials of one condition in the set, A (p, p) and b (p,) summed, and theta of the others.

    `covariance` (p, p): of theta. `scale`: ratio of the scatter of trials to their noise.
    """

    A: FloatArray
    b: FloatArray
    theta: FloatArray
    covariance: FloatArray
    scale: float

    @classmethod
    def of(cls, model: Model, inside: BoolArray) -> _Apart | None:
        """Split a model's trials; None if the set has none of them, or too many."""
        A, b = model.equations.A, model.equations.b
        if not inside.any() or inside.mean() > HALF:
            return None
        try:
            inverse = np.linalg.inv(A[~inside].sum(axis=0))
        except np.linalg.LinAlgError:
            return None
        # sum_others A_t (p, p) theta (p,) = sum_others b_t
        theta = inverse @ b[~inside].sum(axis=0)
        residual = b[~inside] - A[~inside] @ theta
        # scores (T, p) have the covariance scale^2 A_t
        spread = np.einsum("tp,pq,tq->", residual, inverse, residual) / len(theta)
        scale = float(np.sqrt(max(spread, 1e-300)))
        return cls(A[inside].sum(axis=0), b[inside].sum(axis=0), theta, inverse * scale**2, scale)


def _exchange(first: _Apart, second: _Apart) -> tuple[float, float]:
    """g and its standard error."""
    step = second.theta - first.theta
    precision = float(step @ (first.A + second.A) @ step)
    score = float(
        step @ (first.b - first.A @ first.theta) - step @ (second.b - second.A @ second.theta)
    )
    variance = sum(
        condition.scale**2 * float(step @ condition.A @ step)
        + float(step @ condition.A @ condition.covariance @ condition.A.T @ step)
        for condition in (first, second)
    )
    if precision <= 0 or variance <= 0:
        return 0.0, np.inf
    return score / precision, float(np.sqrt(variance)) / precision
