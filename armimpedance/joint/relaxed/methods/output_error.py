"""Output error: the measured motion itself is fitted, and no noisy derivative enters.

A hinge whose inertia is known is simulated forward (`swing_fit`). Where only angle and torque were
measured, a spline of the motion and the torque are fitted together (`joint_spline`).
"""

from __future__ import annotations

from armimpedance.joint.relaxed.equations import Terms, parallel_equations
from armimpedance.joint.relaxed.joint_spline import solve_joint_spline
from armimpedance.joint.relaxed.linear import TwoFits
from armimpedance.joint.relaxed.methods import PassiveMethod
from armimpedance.joint.relaxed.samples import PassiveSamples
from armimpedance.joint.relaxed.swing import solve_swing


def solve(samples: PassiveSamples, terms: Terms) -> TwoFits:
    """The fit that the samples allow.

    Raises EstimationError: the search does not settle.
    Raises InputError: there is neither a skeleton nor a measured torque.
    """
    chosen = solve_joint_spline if samples.hinges is None else solve_swing
    return chosen(samples, terms)


METHOD = PassiveMethod(
    "the skeleton's inertia and the other coordinates' motion are right; of a joint "
    "recording: noise of angle and torque is white",
    "L. Ljung, System Identification: Theory for the User (1999), chapters 4 and 7",
    parallel_equations,
    solve,
)
