"""The source's estimator: smoothed motion, sign of its velocity, ordinary least squares.

The sign is not filtered as Y is, and the trials' ends count: h and f come out biased.
"""

from __future__ import annotations

from armimpedance.passive.equations import Equations, plain_equations
from armimpedance.passive.linear import TwoFits, solve_linear
from armimpedance.passive.samples import PassiveSamples
from armimpedance.passive.terms import Terms


def equations(samples: PassiveSamples, terms: Terms) -> Equations:
    """All rows, the sign unfiltered."""
    return plain_equations(samples, terms)


def solve(samples: PassiveSamples, terms: Terms) -> TwoFits:
    """Venture elbow, eqs. (8)-(10).

    Raises
    ------
    NotIdentifiableError
        W loses rank; names the parameters.
    """
    return solve_linear(equations(samples, terms), samples.sample_rate_hz)
