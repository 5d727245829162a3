"""Methods for two pathways: I, B, K and the reflex's gain, given the pathway."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from armimpedance.core.method_table import RecordTable

if TYPE_CHECKING:
    from armimpedance.joint.elbow.cascade.fit import Prior
    from armimpedance.joint.elbow.cascade.task import CascadeCourses, CascadeTask

_KEARNEY: Final = "R. E. Kearney, R. B. Stein, L. Parameswaran, IEEE TBME 44 (1997) 493-504"
_MACNEIL: Final = "MacNeil, Kearney, Hunter, IEEE TBME 39 (1992) 697-704"
_LUDVIG: Final = "D. Ludvig, E. J. Perreault, IEEE TBME 59 (2012) 3541-3549"


@dataclass(frozen=True)
class CascadeMethod:
    """A method for I, B, K and the reflex's gain, given the pathway.

    `realizations`: number of trials of the same course that it needs.
    """

    name: str
    description: str
    reference: str
    realizations: int
    estimate: Callable[[CascadeTask], CascadeCourses]


def _under(prior: Prior | None) -> Callable[[CascadeTask], CascadeCourses]:
    """Fit courses under a prior; None: the one of greater likelihood."""

    def estimate(task: CascadeTask) -> CascadeCourses:
        from armimpedance.joint.elbow.cascade.fit import in_rounds

        return in_rounds(task, prior)

    return estimate


def _over_trials(segment_s: float) -> Callable[[CascadeTask], CascadeCourses]:
    """Fit by least squares over realizations of one course, in segments of this length."""

    def estimate(task: CascadeTask) -> CascadeCourses:
        from armimpedance.joint.elbow.cascade.fit import over_realizations

        return over_realizations(task, segment_s)

    return estimate


_METHODS: Final = (
    CascadeMethod(
        "cascade",
        "smooth courses or courses that jump, as the record asks",
        _KEARNEY,
        1,
        _under(None),
    ),
    CascadeMethod("cascade-jumps", "constant between jumps", _KEARNEY, 1, _under("jumps")),
    CascadeMethod("cascade-smooth", "integrated random walks", _KEARNEY, 1, _under("smooth")),
    CascadeMethod(
        "ensemble", "every instant by itself, over realizations", _MACNEIL, 10, _over_trials(0.0)
    ),
    CascadeMethod(
        "short-segments", "segments of 0.1 s, over realizations", _LUDVIG, 10, _over_trials(0.1)
    ),
)

#: The methods by their names.
CASCADE_METHODS: Final = RecordTable(
    {method.name: method for method in _METHODS}, "method", default="cascade"
)
