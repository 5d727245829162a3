"""Method `impulse_response`: the hand's own oscillation once a short push is over.

D. Piovesan, A. Pierobon, P. DiZio and J. R. Lackner, Measuring multi-joint stiffness during single
movements: numerical validation of a novel time-frequency approach, PLoS ONE 7 (2012) e33086. After
the push hand and robot swing together and the force is that of the robot's own mass, so that B and
K can only be determined with a known inertia. The source reads frequency and damping of each trial
from a reassigned spectrogram; here the same samples are fitted in time, all trials of a phase
together.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from armimpedance.core.conventions import Level
from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.hand.reaching.deviations import against_prediction, regress
from armimpedance.hand.reaching.fitted import PhaseFit, ReachMethod, instant_of, to_hand
from armimpedance.hand.reaching.solve import InertiaPrior
from armimpedance.hand.reaching.windows import AFTER_S, PhaseWindows


def fit(windows: PhaseWindows, level: Level, prior: InertiaPrior | None) -> PhaseFit:
    """Fit one phase.

    Raises
    ------
    InputError
        The inertia is not known.
    NotIdentifiableError
        The window ends with the push.
    """
    del level
    if prior is None:
        raise InputError(
            "method impulse_response needs the inertia", expected="that of a posture experiment"
        )
    after = windows.lag_s >= windows.lag_s[-1] - AFTER_S
    if after.sum() < 3 or np.all(after):
        raise NotIdentifiableError(
            "method impulse_response: no samples after the push; --window-s can be longer"
        )
    weights = to_hand(windows.arm, instant_of(windows))[0][:4, :3]
    M = weights @ prior.inertial
    swing = against_prediction(windows).rows(after)
    # F + M a = -(B v + K x), with M fixed
    freed = replace(swing, force=swing.force + swing.acceleration @ M.reshape(2, 2).T)
    fitted = regress(
        freed, without_inertia=True, provenance=("against the predicted path, after the push",)
    )
    values, covariance = fitted.values.copy(), fitted.covariance.copy()
    values[:4], covariance[:4, :4] = M, weights @ prior.covariance @ weights.T
    return replace(fitted, values=values, covariance=covariance)


METHOD = ReachMethod(
    assumes="the path after the push is the mean one from the trial's own place and speed; the "
    "inertia is known; the hand swings freely",
    reference="Piovesan and colleagues (2012)",
    fit=fit,
)
