"""Method `ensemble`: what the trials have in common along the push, as instrument, unweighted.

The idea of ensemble methods for time-varying joints (D. Ludvig and E. J. Perreault, System
identification of physiological systems using short data segments, IEEE Trans Biomed Eng 59 (2012)
3541-3549), on pushes of the hand: the response that is linear in the push's direction stands for
the regressors, so that what differs between trials does not bias.
"""

from __future__ import annotations

from armimpedance.core.conventions import Level
from armimpedance.hand.reaching.deviations import against_mean, along_push, centred, regress
from armimpedance.hand.reaching.fitted import PhaseFit, ReachMethod
from armimpedance.hand.reaching.solve import Known
from armimpedance.hand.reaching.windows import PhaseWindows


def fit(windows: PhaseWindows, level: Level, known: Known | None) -> PhaseFit:
    """Fit one phase; the inertia is fitted whatever is known of it."""
    del level, known
    deviations = centred(against_mean(windows))
    said = ("instruments: the ensemble's response",)
    return regress(deviations, along_push(deviations), provenance=said)


METHOD = ReachMethod(
    assumes="the hand's M, B and K stay as they are over the window; pushes all around",
    reference="after Ludvig and Perreault (2012)",
    fit=fit,
)
