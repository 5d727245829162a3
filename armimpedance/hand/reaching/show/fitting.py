"""The work of `movement`: check and fit pushed reaches of any recording."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from functools import partial
from typing import Any, Final

from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate, Recording
from armimpedance.hand.reaching.identify import identify_course, identify_movement
from armimpedance.hand.reaching.methods import METHODS
from armimpedance.hand.reaching.windows import check_pushes
from armimpedance.hand.show.estimates import Estimates, ForceBy, estimates_of
from armimpedance.show.verbs.checks import TopicChecks, checked
from armimpedance.show.verbs.results import PathLike, naming, read_recording

#: Checks of this topic only.
CHECKS: Final = TopicChecks(pushes=check_pushes)


def fit_movement(
    recording: Recording | PathLike,
    inertia: Sequence[ImpedanceEstimate] | PathLike | None,
    *,
    course: bool,
    method: str | None,
    force_by: ForceBy | None,
    despite: str | Collection[str],
    **options: Any,
) -> Estimates:
    """Read, check and fit; `options`: keywords of `identify_movement` and `identify_course`."""
    prior = None if inertia is None else estimates_of(inertia)
    if course and method not in (None, METHODS.default):
        raise InputError(f"a course by method {method}", expected=f"method {METHODS.default}")
    identify = identify_course if course else partial(identify_movement, method=method)
    with naming(recording):
        read = read_recording(recording, force_by=force_by)
        marks = checked(read, despite, CHECKS)
        estimates = identify(read, inertia=prior, **options)
        marked = tuple(estimate.marked(marks) for estimate in estimates)
        return Estimates(marked, read.subject, read.gravity_m_s2)
