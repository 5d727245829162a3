"""Estimation of inertia, viscosity and stiffness of a moving hand, by phase or over the reach."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.conventions import Level
from armimpedance.core.errors import EstimationError, InputError
from armimpedance.core.estimates import ImpedanceEstimate
from armimpedance.core.findings import warnings_of
from armimpedance.core.progress import Progress
from armimpedance.core.records import Recording
from armimpedance.hand.reaching.course import Courses, channel
from armimpedance.hand.reaching.equation import REPORTED, ReachEquations, equations_of
from armimpedance.hand.reaching.fitted import (
    INSTANT,
    DoubtedPhase,
    HandPlace,
    PhaseFit,
    ReachMethod,
    at_level,
    doubts_of,
    estimate_at,
    notes_of,
    to_estimate,
)
from armimpedance.hand.reaching.methods import METHODS
from armimpedance.hand.reaching.methods.latent import explained_by
from armimpedance.hand.reaching.one_limb import check_one_limb
from armimpedance.hand.reaching.over_reach import course_over
from armimpedance.hand.reaching.session import Session, session_of
from armimpedance.hand.reaching.solve import InertiaPrior, PhaseEvidence, evidence_of, solve
from armimpedance.hand.reaching.windows import PhaseWindows
from armimpedance.numerics.criticism import refuse_size


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
    """Estimate M, B and K of a reaching hand at every phase of every condition.

    Parameters
    ----------
    recording : Recording
        Reaches in a plane; the columns ``phase``, ``push_deg`` and ``push_onset_s`` of the trial
        table describe the pushes.
    method : str, optional
        A name of `METHODS`; default: ``latent``.
    level : {"hand", "joint"}
    inertia : sequence of ImpedanceEstimate, optional
        The hand's M of the same person in postures; default: inertia is fitted with the rest.
    phases : sequence of str, optional
        Only these phases.
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
        M comes out negative, or of a size that no person's is.
    """
    chosen = METHODS.named(method)
    _check_level(method or METHODS.default, chosen, level)
    session = session_of(recording, inertia, phases)
    _check_throughout(method or METHODS.default, chosen, session)
    estimates, cut = [], []
    for phase in session.phases(window_s, progress):
        for name, windows in phase.windows:
            cut.append(windows)
            fit = chosen.fit(windows, level, session.prior)
            check_inertia(fit, phase.name)
            keys = {"condition": phase.condition, "phase": name}
            estimates.append(to_estimate(fit, windows, method or METHODS.default, keys))
    for estimate in estimates:
        refuse_size(estimate, recording.subject.mass_kg)
    warnings = warnings_of(check_one_limb(cut))
    return [estimate.with_warning(*warnings) for estimate in estimates]


def _check_level(name: str, method: ReachMethod, level: Level) -> None:
    if level not in method.levels:
        raise InputError(
            f"method {name} at level {level!r}", expected=f"level {' or '.join(method.levels)}"
        )


def _check_throughout(name: str, method: ReachMethod, session: Session) -> None:
    if method.throughout:
        return
    for _, _, phase in session.groups:
        if session.pushes.throughout(phase):
            raise InputError(
                f"method {name}: the pushes of phase {phase} go on throughout",
                expected=f"method {METHODS.default}",
            )


def check_inertia(fit: PhaseFit, phase: str) -> None:
    """Refuse an inertia that is clearly negative.

    Raises EstimationError: its diagonal lies below zero by more than chance.
    """
    diagonal = [0, 3]
    if (fit.values[diagonal] < -4 * np.sqrt(np.diag(fit.covariance)[diagonal])).any():
        raise EstimationError(
            f"phase {phase}: the inertia comes out negative; is the force that of the limb on the "
            "device (force_by), and has it not been freed of the handle twice?"
        )


# Inertia, viscosity and stiffness over the whole reach, from the pushes of all phases together.

#: Spacing of the course (s).
EVERY_S: Final = 0.02
#: Number of groups of trials that are left out in turn.
GROUPS: Final = 8


@dataclass(frozen=True)
class _Phase:
    """Solution of one phase of a condition."""

    windows: PhaseWindows
    equations: ReachEquations
    doubted: DoubtedPhase


def identify_course(
    recording: Recording,
    *,
    level: Level = "hand",
    inertia: Sequence[ImpedanceEstimate] | None = None,
    phases: Sequence[str] | None = None,
    window_s: float | None = None,
    progress: Progress | None = None,
) -> list[ImpedanceEstimate]:
    """Estimate M, B and K of a reaching hand every 20 ms from the first phase to the last.

    Parameters
    ----------
    recording, level, inertia, phases, window_s, progress
        As `identify_movement`; two phases or more.

    Returns
    -------
    list of ImpedanceEstimate
        With keys ``condition`` and ``phase``: the time after the first phase's onset, "0.120 s".

    Raises
    ------
    InputError
        As `identify_movement`, or there is one phase only.
    NotIdentifiableError
        The pushes of a phase do not tell M, B and K apart.
    EstimationError
        M comes out negative, or of a size that no person's is.
    """
    session = session_of(recording, inertia, phases)
    solved: dict[str, list[_Phase]] = {}
    for phase in session.phases(window_s, progress):
        parts = solved.setdefault(phase.condition, [])
        for _, windows in phase.windows:
            equations = equations_of(windows)
            doubted = doubts_of(equations, solve(equations, session.prior), session.prior)
            parts.append(_Phase(windows, equations, doubted))
    estimates: list[ImpedanceEstimate] = []
    for condition, parts in solved.items():
        estimates += _course(session.courses, condition, parts, level, session.prior)
    for estimate in estimates:
        refuse_size(estimate, recording.subject.mass_kg)
    warnings = warnings_of(check_one_limb([p.windows for parts in solved.values() for p in parts]))
    return [estimate.with_warning(*warnings) for estimate in estimates]


def _middles(parts: list[_Phase], rate_hz: float) -> tuple[IntArray, FloatArray]:
    """Samples (n, P) of every reach at the phases' middles, and their mean times (P,), s."""
    first = parts[0].windows
    samples = _samples(parts, rate_hz)
    at_s = (samples - samples[:, :1]).mean(axis=0) / rate_hz
    return samples, at_s + first.after_s + first.lag_s[first.middle]


def _course(
    courses: Courses, condition: str, parts: list[_Phase], level: Level, prior: InertiaPrior | None
) -> list[ImpedanceEstimate]:
    if len(parts) < 2:
        raise InputError(
            f"condition {condition}: pushes at one phase only", expected="two phases or more"
        )
    first = parts[0].windows
    samples, at_s = _middles(parts, courses.sample_rate_hz)
    grid = np.append(np.arange(at_s[0], at_s[-1] - EVERY_S / 2, EVERY_S), at_s[-1])
    # an inertia that contradicts the pushes of one phase is used at none
    warnings = tuple(dict.fromkeys(w for part in parts for w in part.doubted.warnings))
    denied = any(warning.startswith("the inertia that was told") for warning in warnings)
    moving = max(part.equations.moving for part in parts)
    solutions = [part.doubted.solution for part in parts]
    prior_used = None if denied else prior
    without = [[_without(part, group, prior_used) for part in parts] for group in range(GROUPS)]
    over = course_over(solutions, without, at_s, moving, grid, prior_used)
    pushed = [int(p.windows.pushed.sum()) for p in parts]
    rows = [n * 2 * len(p.windows.lag_s) for n, p in zip(pushed, parts, strict=True)]
    counts = (sum(pushed), sum(rows))
    fit_of = partial(
        PhaseFit,
        level=level,
        dof=over.dof,
        condition=max(solution.condition for solution in solutions),
        rank=REPORTED.stop,
        explained=min(explained_by(p.equations, p.doubted.solution) for p in parts),
        warnings=warnings,
        provenance=(f"course over {len(parts)} phases", *notes_of(first)),
    )
    estimates = []
    for g, time in enumerate(grid):
        where = _where(courses, samples, at_s, float(time))
        values, covariance = at_level(
            level, first.arm, where, over.theta[g], over.covariance[g][REPORTED, REPORTED]
        )
        fit = fit_of(values=values, covariance=covariance)
        check_inertia(fit, f"{time:.3f} s")
        keys = {"condition": condition, "phase": f"{time:.3f} s"}
        estimates.append(estimate_at(fit, where.mean, first.shoulder_m, counts, "latent", keys))
    return estimates


def _without(part: _Phase, group: int, prior: InertiaPrior | None) -> PhaseEvidence:
    """Evidence of a phase without every eighth trial, in the order of the pushes' directions."""
    w = part.windows
    angle = np.round(np.arctan2(w.direction[:, 1], w.direction[:, 0]), 6)
    place = np.empty(len(angle), dtype=np.int64)
    place[np.lexsort((w.trial, angle, ~w.pushed))] = np.arange(len(angle))
    return evidence_of(equations_of(w.of_trials(place % GROUPS != group)), prior)


def _samples(parts: list[_Phase], rate: float) -> IntArray:
    """Samples (n, P) at the middles of the phases' windows, for free reaches that are in all."""
    tables: list[dict[int, int]] = []
    for part in parts:
        w, free = part.windows, ~part.windows.pushed
        middle = w.onset[free] + round(float(w.lag_s[w.middle]) * rate)
        tables.append(dict(zip(w.trial[free].tolist(), middle.tolist(), strict=True)))
    common = sorted(set(tables[0]).intersection(*tables[1:]))
    if len(common) < 3:
        raise InputError(f"{len(common)} free reaches go through all phases", expected="10 or more")
    return np.array([[table[trial] for table in tables] for trial in common])


def _where(courses: Courses, samples: IntArray, at_s: FloatArray, time_s: float) -> HandPlace:
    """All free reaches at a time of the mean reach, interpolated between phases for each reach."""
    at = np.array([np.interp(time_s, at_s, row) for row in samples.astype(float)])
    rows = np.rint(at).astype(np.int64)
    return HandPlace(tuple(courses.channels[rows][:, channel(name)] for name in INSTANT))
