"""What a user's script looks like to a type checker: every public verb, from outside."""

from __future__ import annotations

import numpy as np

import armimpedance as ai
from armimpedance import Estimates, Recording
from manipulandum_sim.hand import simulate


def stiffest(recording: Recording) -> float:
    """The largest stiffness of the first condition, N/m."""
    found: Estimates = ai.estimate(recording)
    values = np.linalg.eigvalsh(found[0].stiffness)
    return float(values[-1])


recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
largest: float = stiffest(recording)
joint: Estimates = ai.to_joint(ai.estimate(recording), recording=recording)
print(f"{largest:.0f} N/m; {len(joint)} conditions at the joints")
