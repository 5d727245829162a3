"""Table of the methods for base parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

from armimpedance.core.method_table import RecordTable

if TYPE_CHECKING:
    from armimpedance.joint.body.estimate import BodySolution, WeightedSolution


@dataclass(frozen=True)
class BodyMethod:
    """A method for base parameters.

    `label`: its name in FIT.json, after ``body_``.
    `assumes`: assumption of the estimate, in one sentence.
    `weighting`: weights of the rows in least squares. With weights, the bias from noise of the
    angles is removed too.
    `improve`: improves the least-squares solution; None: it is the result.
    """

    label: str
    assumes: str
    weighting: Literal["none", "levels"]
    improve: Callable[[WeightedSolution], BodySolution] | None = None


def _consistent(start: WeightedSolution) -> BodySolution:
    """Physically consistent parameters; the prior only determines what the motion cannot show."""
    from armimpedance.joint.body.estimate import consistent_solution

    return consistent_solution(start)


def _prior(start: WeightedSolution) -> BodySolution:
    """Physically consistent parameters near the expected masses and inertias."""
    from armimpedance.joint.body.estimate import prior_solution

    return prior_solution(start)


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
