"""Method `ensemble`: instruments from the common response of trials along the push, unweighted.

The idea of ensemble methods for time-varying joints (D. Ludvig and E. J. Perreault, System
identification of physiological systems using short data segments, IEEE Trans Biomed Eng 59 (2012)
3541-3549), on pushes of the hand: the response that is linear in the push's direction is the
instrument, so that differences between trials cause no bias.
"""

from __future__ import annotations

from armimpedance.core.conventions import Level
from armimpedance.hand.reaching.deviations import against_mean, along_push, centred, regress
from armimpedance.hand.reaching.fitted import PhaseFit, ReachMethod
from armimpedance.hand.reaching.solve import InertiaPrior
from armimpedance.hand.reaching.windows import PhaseWindows


def fit(windows: PhaseWindows, level: Level, prior: InertiaPrior | None) -> PhaseFit:
    """Fit one phase; the inertia is fitted even if a prior is stated."""
    del level, prior
    deviations = centred(against_mean(windows))
    notes = ("instruments: the ensemble's response",)
    return regress(deviations, along_push(deviations), provenance=notes)


METHOD = ReachMethod(
    assumes="the hand's M, B and K stay as they are over the window; pushes all around",
    reference="after Ludvig and Perreault (2012)",
    fit=fit,
)
