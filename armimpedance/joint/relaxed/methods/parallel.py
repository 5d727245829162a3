"""Least squares with every column, the sign included, through the filter of the torque."""

from __future__ import annotations

from armimpedance.joint.relaxed.equations import parallel_equations
from armimpedance.joint.relaxed.linear import solver
from armimpedance.joint.relaxed.methods import PassiveMethod

METHOD = PassiveMethod(
    "noise of the smoothed velocity is small against the swing",
    "every column through the filter of Y, as in M. Gautier, ICRA 1997, pp. 2203-2208",
    parallel_equations,
    solver(parallel_equations, filtered=True),
)
