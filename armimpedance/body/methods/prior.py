"""The weighted fit among possible parameters, near the masses and inertias that are expected."""

from __future__ import annotations

from armimpedance.body.method import Method
from armimpedance.body.solution import Solution, WeightedSolution, consistent_solution


def improve(given: WeightedSolution) -> Solution:
    """What data and prior say together.

    Raises
    ------
    InputError
        No prior mass of a segment.
    EstimationError
        The iteration does not settle.
    """
    return consistent_solution(given, given.prior_sd)


METHOD = Method("prior", "the segments' masses are known to some per cent", "levels", improve)
