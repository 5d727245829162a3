"""The weighted fit among the parameters that some distribution of mass could have."""

from __future__ import annotations

from armimpedance.body.method import Method
from armimpedance.body.solution import Solution, WeightedSolution, consistent_solution


def improve(given: WeightedSolution) -> Solution:
    """The nearest possible parameters; the prior only chooses among what the motion cannot show.

    Raises
    ------
    InputError
        No prior mass of a segment.
    EstimationError
        The iteration does not settle.
    """
    return consistent_solution(given, None)


METHOD = Method("consistent", "every segment is a body with mass", "levels", improve)
