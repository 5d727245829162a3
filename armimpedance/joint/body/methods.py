"""What a way to base parameters is, and the table of those that there are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

from armimpedance.core.method_table import RecordTable

if TYPE_CHECKING:
    from armimpedance.joint.body.estimate import BodySolution, WeightedSolution


@dataclass(frozen=True)
class BodyMethod:
    """A way to base parameters.

    `label`: what FIT.json calls it, after ``body_``.
    `assumes`: what must hold for the estimate to be right, in one sentence.
    `weighting`: how the least squares weight the rows. Where rows are weighted, the bias from noise
    of the angles is taken off too.
    `improve`: what is made of the least-squares solution; None: it stands.
    """

    label: str
    assumes: str
    weighting: Literal["none", "levels"]
    improve: Callable[[WeightedSolution], BodySolution] | None = None


def _consistent(given: WeightedSolution) -> BodySolution:
    """Among the parameters that some distribution of mass could have.

    The prior only chooses among what the motion cannot show.
    """
    from armimpedance.joint.body.estimate import consistent_solution

    return consistent_solution(given)


def _prior(given: WeightedSolution) -> BodySolution:
    """Among possible parameters, near the masses and inertias that are expected."""
    from armimpedance.joint.body.estimate import prior_solution

    return prior_solution(given)


METHODS: Final = RecordTable(
    {
        "weighted": BodyMethod(
            "weighted", "each row of the wrench has a level of noise of its own", "levels"
        ),
        "consistent": BodyMethod(
            "consistent", "every segment is a body with mass", "levels", _consistent
        ),
        "prior": BodyMethod(
            "prior", "the segments' masses are known to some per cent", "levels", _prior
        ),
        "ls": BodyMethod(
            "least_squares", "all rows are equally noisy, and the motion is exact", "none"
        ),
    },
    "method",
    default="weighted",
)
