"""Inertia, viscosity and stiffness of a moving hand, phase by phase."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from armimpedance.arrays import IntArray
from armimpedance.conventions import Level
from armimpedance.errors import EstimationError, InputError
from armimpedance.estimates import ImpedanceEstimate
from armimpedance.movement.arm import geometry_of
from armimpedance.movement.course import courses_of
from armimpedance.movement.fitted import Method, PhaseFit, to_estimate
from armimpedance.movement.known import known_inertia
from armimpedance.movement.labels import check_labels
from armimpedance.movement.pushes import Pushes, pushes_of
from armimpedance.movement.table import METHODS
from armimpedance.movement.windows import windows_of
from armimpedance.records import Recording

Progress = Callable[[int, int], None]


def identify_movement(
    recording: Recording,
    *,
    method: str | None = None,
    level: Level = "hand",
    inertia: Sequence[ImpedanceEstimate] | None = None,
    phases: Sequence[str] | None = None,
    window_s: float | None = None,
    progress: Progress | None = None,
) -> list[ImpedanceEstimate]:
    """M, B and K of a reaching hand at every phase of every condition.

    Parameters
    ----------
    recording : Recording
        Reaches in a plane; the trial table says in ``phase``, ``push_deg`` and ``push_onset_s``
        which ones were pushed.
    method : str, optional
        A name of `METHODS`; default: ``latent``.
    level : {"hand", "joint"}
    inertia : sequence of ImpedanceEstimate, optional
        The hand's M of the same person in postures; default: inertia is fitted with the rest.
    phases : sequence of str, optional
        Only these.
    window_s : float, optional
        Length of the fitted window after a push's onset.
    progress : function (done, all), optional

    Returns
    -------
    list of ImpedanceEstimate
        With keys ``condition`` and ``phase``; phases in the order of their onset.

    Raises
    ------
    InputError
        The recording lacks something (see `course`, `pushes`, `windows`), or a name is unknown.
    NotIdentifiableError
        The pushes of a phase do not tell M, B and K apart.
    EstimationError
        M comes out negative.
    """
    chosen = METHODS.named(method)
    _check_level(method or METHODS.default, chosen, level)
    pushes = pushes_of(recording)
    wanted = phases_of(pushes, phases)
    known = None if inertia is None else known_inertia(inertia, geometry_of(recording).arm)
    courses = courses_of(recording)
    made = []
    every = list(groups_of(recording, pushes, wanted))
    for done, (condition, rows, phase) in enumerate(every, 1):
        if pushes.throughout(phase) and not chosen.throughout:
            raise InputError(
                f"method {method}: the pushes of phase {phase} go on throughout",
                expected=f"method {METHODS.default}",
            )
        for name, windows in windows_of(courses, pushes, rows, phase, window_s):
            check_labels(windows, phase)
            fit = chosen.fit(windows, level, known)
            _check_inertia(fit, phase)
            keys = {"condition": condition, "phase": name}
            made.append(to_estimate(fit, windows, method or METHODS.default, keys))
        if progress is not None:
            progress(done, len(every))
    return made


def _check_level(name: str, method: Method, level: Level) -> None:
    if level not in method.levels:
        raise InputError(
            f"method {name} at level {level!r}", expected=f"level {' or '.join(method.levels)}"
        )


def _check_inertia(fit: PhaseFit, phase: str) -> None:
    """Refuse an inertia that is clearly negative.

    Raises
    ------
    EstimationError
        Its diagonal lies below zero by more than chance.
    """
    diagonal = [0, 3]
    if (fit.values[diagonal] < -4 * np.sqrt(np.diag(fit.covariance)[diagonal])).any():
        raise EstimationError(
            f"phase {phase}: the inertia comes out negative; is the force that of the limb on the "
            "device (force_by), and has it not been freed of the handle twice?"
        )


def phases_of(pushes: Pushes, asked: Sequence[str] | None) -> tuple[str, ...]:
    if asked is None:
        return pushes.phases
    unknown = [name for name in asked if name not in pushes.phases]
    if unknown:
        there = ", ".join(pushes.phases)
        raise InputError(f"no phase {unknown[0]!r}", column="phase", expected=f"one of {there}")
    return tuple(name for name in pushes.phases if name in asked)


def groups_of(
    recording: Recording, pushes: Pushes, phases: Sequence[str]
) -> Iterator[tuple[str, IntArray, str]]:
    """Condition, its trials, and each phase at which some of them were pushed."""
    condition = recording.trials["condition"].astype(str).to_numpy()
    for name in dict.fromkeys(condition):
        rows = np.flatnonzero(condition == name)
        for phase in phases:
            if pushes.rows(phase)[rows].any():
                yield str(name), rows, phase
