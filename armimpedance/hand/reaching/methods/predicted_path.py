"""Method `predicted_path`: a servo holds the hand off its predicted path, K from what is held.

E. Burdet, R. Osu, D. W. Franklin, T. Yoshioka, T. E. Milner and M. Kawato, A method for measuring
endpoint stiffness during multi-joint arm movements, J Biomech 33 (2000) 1705-1709. K is the slope
of force over displacement while the displacement is held; what the hand still moves there is taken
off with M and B of all samples. The source gives K alone, of displacements that are held longer.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import BoolArray
from armimpedance.core.conventions import Level
from armimpedance.core.errors import NotIdentifiableError
from armimpedance.hand.reaching.deviations import (
    Deviations,
    against_prediction,
    along_push,
    centred,
    regress,
)
from armimpedance.hand.reaching.fitted import PhaseFit, ReachMethod
from armimpedance.hand.reaching.solve import Known
from armimpedance.hand.reaching.windows import PhaseWindows

#: A displacement is held where it is more than this of its largest, and its speed less than this.
HELD: Final = 0.9
SLOW: Final = 0.1
LEAST_S: Final = 0.02
#: Held displacements that differ by more than this between trials come from a servo that gives way.
SOFT: Final = 0.25


def fit(windows: PhaseWindows, level: Level, known: Known | None) -> PhaseFit:
    """Fit one phase.

    Raises
    ------
    NotIdentifiableError
        No displacement is held.
    """
    del level, known
    deviations = centred(against_prediction(windows))
    held = _held(deviations)
    if held.sum() < LEAST_S / (windows.lag_s[1] - windows.lag_s[0]):
        raise NotIdentifiableError(
            "method predicted_path: no displacement is held; it needs a servo that displaces the "
            "hand and holds it there"
        )
    said = ("against the predicted path, K while it is held",)
    whole = regress(deviations, along_push(deviations), provenance=said)
    M, B = whole.values[:4].reshape(2, 2), whole.values[4:8].reshape(2, 2)
    still = deviations.rows(held)
    moving = still.acceleration @ M.T + still.velocity @ B.T
    plateau = _slope(replace(still, force=still.force + moving))
    values, covariance = whole.values.copy(), whole.covariance.copy()
    values[8:], covariance[8:, :8], covariance[:8, 8:] = plateau[0], 0.0, 0.0
    covariance[8:, 8:] = plateau[1]
    warnings = whole.warnings
    if _spread(deviations.rows(held)) > SOFT:
        warnings = (*warnings, "the servo gives way: what it holds differs between trials")
    return replace(whole, values=values, covariance=covariance, warnings=warnings)


def _held(deviations: Deviations) -> BoolArray:
    """Samples (S,) at which the mean displacement along the push is held."""
    along = np.einsum("nsi,ni->s", deviations.displacement, deviations.direction)
    speed = np.abs(np.einsum("nsi,ni->s", deviations.velocity, deviations.direction))
    return (along > HELD * along.max()) & (speed < SLOW * speed.max())


def _slope(held: Deviations) -> tuple[np.ndarray, np.ndarray]:
    """K row by row (4,) from the trials' means, and its covariance.

    What the servo adds to the predicted path is the same in all trials of a direction, which is the
    instrument: the prediction's own error stands in force and displacement alike.
    """
    x, F, D = held.displacement.mean(axis=1), held.force.mean(axis=1), held.direction
    # F (n, 2) = -x (n, 2) K^T (2, 2), seen along D (n, 2)
    inverse = np.linalg.inv(D.T @ x)
    K = -(inverse @ D.T @ F).T
    residual = F + x @ K.T
    leverage = 1 - np.einsum("ni,ij,nj->n", x, inverse, D)
    moved = np.einsum("na,nb->nab", residual / leverage[:, None], D @ inverse.T)
    return K.ravel(), moved.reshape(len(x), 4).T @ moved.reshape(len(x), 4)


def _spread(held: Deviations) -> float:
    """How much the held displacement along the push differs between trials, of its mean."""
    along = np.einsum("nsi,ni->ns", held.displacement, held.direction).mean(axis=1)
    return float(along.std() / along.mean())


METHOD = ReachMethod(
    assumes="the path after the push is the mean one from the trial's own place and speed; a stiff "
    "servo holds the hand off it",
    reference="Burdet and colleagues (2000)",
    fit=fit,
)
