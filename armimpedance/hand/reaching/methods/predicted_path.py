"""Method `predicted_path`: K while a servo holds the hand at a distance from its predicted path.

E. Burdet, R. Osu, D. W. Franklin, T. Yoshioka, T. E. Milner and M. Kawato, A method for measuring
endpoint stiffness during multi-joint arm movements, J Biomech 33 (2000) 1705-1709. K is the slope
of force over displacement while the displacement is held. The remaining motion of the hand is
corrected with M and B from all samples. The source estimates K only, with displacements that are
held longer.
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
from armimpedance.hand.reaching.solve import InertiaPrior
from armimpedance.hand.reaching.windows import PhaseWindows

#: A displacement is held while it exceeds this share of its largest value, and its speed is below
#: this share.
HELD: Final = 0.9
SLOW: Final = 0.1
LEAST_S: Final = 0.02
#: If held displacements differ by more than this between trials, the servo yields.
SOFT: Final = 0.25


def fit(windows: PhaseWindows, level: Level, prior: InertiaPrior | None) -> PhaseFit:
    """Fit one phase.

    Raises
    ------
    NotIdentifiableError
        No displacement is held.
    """
    del level, prior
    deviations = centred(against_prediction(windows))
    plateau_samples = _held(deviations)
    if plateau_samples.sum() < LEAST_S / (windows.lag_s[1] - windows.lag_s[0]):
        raise NotIdentifiableError(
            "method predicted_path: no displacement is held; it needs a servo that displaces the "
            "hand and holds it there"
        )
    notes = ("against the predicted path, K while it is held",)
    whole = regress(deviations, along_push(deviations), provenance=notes)
    M, B = whole.values[:4].reshape(2, 2), whole.values[4:8].reshape(2, 2)
    still = deviations.rows(plateau_samples)
    moving = still.acceleration @ M.T + still.velocity @ B.T
    plateau = _slope(replace(still, force=still.force + moving))
    values, covariance = whole.values.copy(), whole.covariance.copy()
    values[8:], covariance[8:, :8], covariance[:8, 8:] = plateau[0], 0.0, 0.0
    covariance[8:, 8:] = plateau[1]
    warnings = whole.warnings
    if _spread(deviations.rows(plateau_samples)) > SOFT:
        warnings = (*warnings, "the servo gives way: what it holds differs between trials")
    return replace(whole, values=values, covariance=covariance, warnings=warnings)


def _held(deviations: Deviations) -> BoolArray:
    """True for samples (S,) at which the mean displacement along the push is held."""
    along = np.einsum("nsi,ni->s", deviations.displacement, deviations.direction)
    speed = np.abs(np.einsum("nsi,ni->s", deviations.velocity, deviations.direction))
    return (along > HELD * along.max()) & (speed < SLOW * speed.max())


def _slope(held: Deviations) -> tuple[np.ndarray, np.ndarray]:
    """K row by row (4,) from the trials' means, and its covariance.

    The displacement that the servo adds to the predicted path is the same in all trials of a
    direction, which is the instrument: force and displacement share the error of the prediction.
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
    """Relative standard deviation between trials of the held displacement along the push."""
    along = np.einsum("nsi,ni->ns", held.displacement, held.direction).mean(axis=1)
    return float(along.std() / along.mean())


METHOD = ReachMethod(
    assumes="the path after the push is the mean one from the trial's own place and speed; a stiff "
    "servo holds the hand off it",
    reference="Burdet and colleagues (2000)",
    fit=fit,
)
