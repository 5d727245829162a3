"""Least squares with every column, the sign included, through the filter that Y went through."""

from __future__ import annotations

from armimpedance.passive.equations import Equations, parallel_equations
from armimpedance.passive.linear import TwoFits, solve_linear
from armimpedance.passive.samples import PassiveSamples
from armimpedance.passive.terms import Terms


def equations(samples: PassiveSamples, terms: Terms) -> Equations:
    """Rows away from the trials' ends."""
    return parallel_equations(samples, terms)


def solve(samples: PassiveSamples, terms: Terms) -> TwoFits:
    """Least squares.

    Raises
    ------
    NotIdentifiableError
        W loses rank; names the parameters.
    """
    return solve_linear(equations(samples, terms), samples.sample_rate_hz)
