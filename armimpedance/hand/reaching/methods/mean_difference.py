"""Method `mean_difference`: each pushed reach minus the mean of the free ones.

H. Gomi and M. Kawato, Equilibrium-point control hypothesis examined by measured arm stiffness
during multijoint movement, Science 272 (1996) 117-120. The undisturbed course of a trial differs
from that mean by about as much as a push moves the hand. So the method needs many trials.
"""

from __future__ import annotations

from armimpedance.core.conventions import Level
from armimpedance.hand.reaching.deviations import against_mean, regress
from armimpedance.hand.reaching.fitted import PhaseFit, ReachMethod
from armimpedance.hand.reaching.solve import InertiaPrior
from armimpedance.hand.reaching.windows import PhaseWindows


def fit(windows: PhaseWindows, level: Level, prior: InertiaPrior | None) -> PhaseFit:
    """Fit one phase; the inertia is fitted even if a prior is stated."""
    del level, prior
    return regress(against_mean(windows), provenance=("against the mean of free reaches",))


METHOD = ReachMethod(
    assumes="every reach would have been the mean one; the hand's M, B and K stay as they are",
    reference="Gomi and Kawato (1996)",
    fit=fit,
)
