"""Deviation of the hand from a reference course, and constant M, B, K fitted to it.

The common part of the methods from the literature: ``dF = -(M da + B dv + K dx)`` with constant
matrices of the hand.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, FrozenRecord
from armimpedance.core.errors import NotIdentifiableError
from armimpedance.hand.reaching.fitted import PhaseFit
from armimpedance.hand.reaching.windows import PhaseWindows

#: Largest condition of the scaled normal equations that counts as identifiable.
SINGULAR = 1e8


@dataclass(frozen=True)
class Deviations(FrozenRecord):
    """Deviations of pushed trials from their estimated undisturbed course, (n, S, 2) each."""

    displacement: Annotated[FloatArray, "n S 2"]
    velocity: Annotated[FloatArray, "n S 2"]
    acceleration: Annotated[FloatArray, "n S 2"]
    force: Annotated[FloatArray, "n S 2"]
    direction: Annotated[FloatArray, "n 2"]

    def rows(self, keep: BoolArray) -> Deviations:
        """Select samples by a mask (S,)."""
        return Deviations(
            self.displacement[:, keep],
            self.velocity[:, keep],
            self.acceleration[:, keep],
            self.force[:, keep],
            self.direction,
        )


def against_mean(windows: PhaseWindows) -> Deviations:
    """Deviation from the mean of the free reaches, aligned where they have travelled as far."""
    hit = windows.pushed
    names = ("hand", "velocity", "acceleration", "force")
    parts = [windows.part(name) for name in names]
    x, v, a, F = (p[hit] - p[~hit].mean(axis=0) for p in parts)
    return Deviations(x, v, a, F, windows.direction[hit])


def against_prediction(windows: PhaseWindows) -> Deviations:
    """Deviation from the course predicted from place and velocity just before the push.

    The prediction is a linear regression of the free reaches' course on both.
    """
    hit, state = windows.pushed, windows.state
    state = state - state[~hit].mean(axis=0)

    def beyond(name: str) -> FloatArray:
        part = windows.part(name)
        part = (part - part[~hit].mean(axis=0)).reshape(len(part), -1)
        # part (n, S d) = state (n, 4) slope (4, S d)
        slope = np.linalg.lstsq(state[~hit], part[~hit], rcond=None)[0]
        return np.asarray((part - state @ slope)[hit]).reshape(-1, len(windows.lag_s), 2)

    return Deviations(
        beyond("hand"),
        beyond("velocity"),
        beyond("acceleration"),
        beyond("force"),
        windows.direction[hit],
    )


def centred(deviations: Deviations) -> Deviations:
    """Subtract the mean over all pushed reaches."""
    return Deviations(
        deviations.displacement - deviations.displacement.mean(axis=0),
        deviations.velocity - deviations.velocity.mean(axis=0),
        deviations.acceleration - deviations.acceleration.mean(axis=0),
        deviations.force - deviations.force.mean(axis=0),
        deviations.direction - deviations.direction.mean(axis=0),
    )


def along_push(deviations: Deviations) -> Deviations:
    """Part that is linear in the push's direction: without the differences between trials."""
    D = deviations.direction

    def common(part: FloatArray) -> FloatArray:
        # D (D^T D)^-1 D^T part, (n, S 2)
        fitted = D @ np.linalg.solve(D.T @ D, D.T @ part.reshape(len(part), -1))
        return np.asarray(fitted).reshape(part.shape)

    return Deviations(
        common(deviations.displacement),
        common(deviations.velocity),
        common(deviations.acceleration),
        common(deviations.force),
        D,
    )


def regress(
    deviations: Deviations,
    instruments: Deviations | None = None,
    *,
    without_inertia: bool = False,
    provenance: tuple[str, ...] = (),
) -> PhaseFit:
    """Fit M, B and K by least squares, or with instruments; standard errors by trial.

    `instruments`: used in place of the regressors.
    `without_inertia`: M is 0; the force contains no inertial part.
    Raises NotIdentifiableError: the motion does not determine M, B and K.
    """
    first = 4 if without_inertia else 0
    X = _regressors(deviations)[..., first:]
    Z = X if instruments is None else _regressors(instruments)[..., first:]
    n = len(X)
    force = deviations.force.reshape(n, -1)
    # theta (12,) = -(sum_n Z_n^T X_n)^-1 sum_n Z_n^T F_n
    by_trial = np.einsum("nrp,nrq->npq", Z, X)
    A = by_trial.sum(axis=0)
    size = np.sqrt(np.abs(np.diag(A)))
    condition = np.linalg.cond(A / np.outer(size, size)) if (size > 0).all() else np.inf
    if condition > SINGULAR:
        raise NotIdentifiableError(
            "the pushes do not tell inertia, viscosity and stiffness apart: push the hand to all "
            "sides, and farther"
        )
    theta = -np.linalg.solve(A, np.einsum("nrp,nr->p", Z, force))
    residual = force + np.einsum("nrp,p->nr", X, theta)
    scores = np.einsum("nrp,nr->np", Z, residual)
    shifts = np.linalg.solve(A - by_trial, scores[..., None])[..., 0]
    values, covariance = np.zeros(12), np.zeros((12, 12))
    values[first:], covariance[first:, first:] = theta, shifts.T @ shifts
    return PhaseFit(
        level="hand",
        values=values,
        covariance=covariance,
        dof=max(n - len(theta) / 2, 2.0),
        condition=float(condition),
        rank=len(theta),
        explained=float(1 - (residual**2).sum() / (force**2).sum()),
        provenance=provenance,
    )


def _regressors(deviations: Deviations) -> FloatArray:
    """Regressors (n, 2 S, 12): columns of M, B, K row by row."""
    columns = []
    for part in (deviations.acceleration, deviations.velocity, deviations.displacement):
        block = np.zeros((*part.shape, 4))
        block[..., 0, :2] = block[..., 1, 2:] = part
        columns.append(block)
    X = np.concatenate(columns, axis=-1)
    return X.reshape(len(X), -1, 12)
