"""A recording as both estimates take it: courses, pushes, what is known, and checked windows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from armimpedance.core.arrays import IntArray
from armimpedance.core.errors import InputError
from armimpedance.core.estimates import ImpedanceEstimate
from armimpedance.core.progress import Progress
from armimpedance.core.records import Recording
from armimpedance.hand.reaching.arm import geometry_of
from armimpedance.hand.reaching.course import Courses, courses_of
from armimpedance.hand.reaching.known import known_inertia
from armimpedance.hand.reaching.labels import check_labels
from armimpedance.hand.reaching.pushes import Pushes, pushes_of
from armimpedance.hand.reaching.solve import Known
from armimpedance.hand.reaching.windows import PhaseWindows, windows_of


class Phase(NamedTuple):
    """One phase of a condition, with its windows by name: one, or several of pushes throughout."""

    condition: str
    name: str
    windows: tuple[tuple[str, PhaseWindows], ...]


@dataclass(frozen=True)
class Session:
    """All that is asked of a recording.

    Attributes
    ----------
    courses : Courses
    pushes : Pushes
    known : Known or None
        The inertia as it was told.
    groups : tuple of (condition, its trials, phase)
    """

    courses: Courses
    pushes: Pushes
    known: Known | None
    groups: tuple[tuple[str, IntArray, str], ...]

    def phases(self, window_s: float | None, progress: Progress | None) -> Iterator[Phase]:
        """Cut and check one phase after another; `progress` is told when the next is asked for.

        Raises
        ------
        InputError
            A phase lacks trials, or its labels are not those of its pushes.
        """
        for done, (condition, rows, phase) in enumerate(self.groups, 1):
            cut = tuple(windows_of(self.courses, self.pushes, rows, phase, window_s))
            check_labels([windows for _, windows in cut], phase)
            yield Phase(condition, phase, cut)
            if progress is not None:
                progress(done, len(self.groups))


def session_of(
    recording: Recording,
    inertia: Sequence[ImpedanceEstimate] | None,
    phases: Sequence[str] | None,
) -> Session:
    """Read what is needed.

    Raises
    ------
    InputError
        The recording lacks something (see `course`, `pushes`), or a phase is not there.
    """
    pushes = pushes_of(recording)
    wanted = _phases(pushes, phases)
    known = None if inertia is None else known_inertia(inertia, geometry_of(recording).arm)
    return Session(courses_of(recording), pushes, known, tuple(_groups(recording, pushes, wanted)))


def _phases(pushes: Pushes, asked: Sequence[str] | None) -> tuple[str, ...]:
    if asked is None:
        return pushes.phases
    unknown = [name for name in asked if name not in pushes.phases]
    if unknown:
        there = ", ".join(pushes.phases)
        raise InputError(f"no phase {unknown[0]!r}", column="phase", expected=f"one of {there}")
    return tuple(name for name in pushes.phases if name in asked)


def _groups(
    recording: Recording, pushes: Pushes, phases: Sequence[str]
) -> Iterator[tuple[str, IntArray, str]]:
    """Condition, its trials, and each phase at which some of them were pushed."""
    condition = recording.trials["condition"].astype(str).to_numpy()
    for name in dict.fromkeys(condition):
        rows = np.flatnonzero(condition == name)
        for phase in phases:
            if pushes.rows(phase)[rows].any():
                yield str(name), rows, phase
