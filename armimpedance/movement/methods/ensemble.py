"""Method `ensemble`: what the trials have in common along the push, as instrument, unweighted.

The idea of ensemble methods for time-varying joints (D. Ludvig and E. J. Perreault, System
identification of physiological systems using short data segments, IEEE Trans Biomed Eng 59 (2012)
3541-3549), on pushes of the hand: the response that is linear in the push's direction stands for
the regressors, so that what differs between trials does not bias.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from armimpedance.arrays import FloatArray
from armimpedance.conventions import Level
from armimpedance.movement.deviations import Deviations, against_mean, regress
from armimpedance.movement.fitted import Method, PhaseFit
from armimpedance.movement.solve import Known
from armimpedance.movement.windows import PhaseWindows


def fit(windows: PhaseWindows, level: Level, known: Known | None) -> PhaseFit:
    """Fit one phase; the inertia is fitted whatever is known of it."""
    del level, known
    deviations = _centred(against_mean(windows))
    D = deviations.direction

    def common(part: FloatArray) -> FloatArray:
        # D (D^T D)^-1 D^T part, (n, S 2)
        fitted = D @ np.linalg.solve(D.T @ D, D.T @ part.reshape(len(part), -1))
        return np.asarray(fitted).reshape(part.shape)

    instruments = replace(
        deviations,
        displacement=common(deviations.displacement),
        velocity=common(deviations.velocity),
        acceleration=common(deviations.acceleration),
    )
    return regress(deviations, instruments, provenance=("instruments: the ensemble's response",))


def _centred(deviations: Deviations) -> Deviations:
    """Without what all pushed reaches have in common."""
    return Deviations(
        deviations.displacement - deviations.displacement.mean(axis=0),
        deviations.velocity - deviations.velocity.mean(axis=0),
        deviations.acceleration - deviations.acceleration.mean(axis=0),
        deviations.force - deviations.force.mean(axis=0),
        deviations.direction - deviations.direction.mean(axis=0),
    )


METHOD = Method(
    assumes="the hand's M, B and K stay as they are over the window; pushes all around",
    reference="after Ludvig and Perreault (2012)",
    fit=fit,
)
