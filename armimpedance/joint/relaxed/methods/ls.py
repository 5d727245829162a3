"""The source's estimator: smoothed motion, sign of its velocity, ordinary least squares.

The sign is not filtered as the torque is, and the ends of the trials count: h and f come out
biased.
"""

from __future__ import annotations

from armimpedance.joint.relaxed.equations import plain_equations
from armimpedance.joint.relaxed.linear import solver
from armimpedance.joint.relaxed.methods import PassiveMethod

METHOD = PassiveMethod(
    "the smoothed motion is exact, its ends and its reversals included",
    "Venture elbow, eqs. (8)-(11)",
    plain_equations,
    solver(plain_equations),
)
