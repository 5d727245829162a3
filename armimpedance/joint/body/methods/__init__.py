"""What a way to base parameters is, and the table of those that there are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

from armimpedance.core.method_table import MethodTable

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


METHODS: Final = MethodTable[BodyMethod](
    "armimpedance.joint.body.methods", "METHOD", "method", default="weighted"
)
