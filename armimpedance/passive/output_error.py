"""Output error: the measured motion itself is fitted, and no noisy derivative enters.

A hinge whose inertia is known is simulated forward (`swing_fit`); where only angle and torque
were measured, a spline of the motion and the torque are fitted together (`joint_spline`).
"""

from __future__ import annotations

from armimpedance.passive.joint_spline import solve_joint_spline
from armimpedance.passive.linear import TwoFits
from armimpedance.passive.samples import PassiveSamples
from armimpedance.passive.swing_fit import solve_swing
from armimpedance.passive.terms import Terms


def solve(samples: PassiveSamples, terms: Terms) -> TwoFits:
    """The fit that the samples allow.

    Raises
    ------
    EstimationError
        The search does not settle.
    InputError
        Neither a skeleton nor a measured torque.
    """
    if samples.hinges is not None:
        return solve_swing(samples, terms)
    return solve_joint_spline(samples, terms)
