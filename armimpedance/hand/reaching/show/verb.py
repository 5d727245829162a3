"""The hand's impedance while it moves: the verb."""

from __future__ import annotations

import os
from collections.abc import Collection, Sequence
from functools import partial
from typing import Final

from armimpedance.core.conventions import Level
from armimpedance.core.errors import InputError
from armimpedance.core.progress import Progress
from armimpedance.core.records import ImpedanceEstimate, Recording
from armimpedance.hand.reaching.identify import identify_course, identify_movement
from armimpedance.hand.reaching.methods import METHODS
from armimpedance.hand.reaching.push_plan import MovementPlan, plan_movement as plan_pushes
from armimpedance.hand.reaching.windows import check_pushes
from armimpedance.hand.show.estimates import Estimates, ForceBy
from armimpedance.hand.show.results_csv import read_results
from armimpedance.show.verbs.checks import TopicChecks, checked
from armimpedance.show.verbs.results import PathLike, naming, read_recording

#: What only this topic can judge.
CHECKS: Final = TopicChecks(pushes=check_pushes)


def movement(
    recording: Recording | PathLike,
    *,
    method: str | None = None,
    level: Level = "hand",
    inertia: Sequence[ImpedanceEstimate] | PathLike | None = None,
    phases: Sequence[str] | None = None,
    window_s: float | None = None,
    course: bool = False,
    force_by: ForceBy | None = None,
    despite: str | Collection[str] = (),
    progress: Progress | None = None,
) -> Estimates:
    """Estimate inertia, viscosity and stiffness of a reaching hand, phase by phase.

    Parameters
    ----------
    recording : Recording or path
        Reaches in a plane, ``perturbation`` "moving": the trial table says in ``phase``,
        ``push_deg`` and ``push_onset_s`` which of them were pushed, empty where nobody pushed.
    method : str, optional
        "latent" (the default), or one of the sources': "mean_difference", "predicted_path",
        "impulse_response", "ensemble".
    level : {"hand", "joint"}
        At the joints K is that of muscles and joints, without the force term.
    inertia : sequence of ImpedanceEstimate or path, optional
        The hand's M of the same person in postures, or their RESULTS.csv; default: the inertia is
        fitted with the rest.
    phases : sequence of str, optional
        Only these.
    window_s : float, optional
        Length of the fitted window after a push's onset, s; default: until .1 s after the push, at
        most .3 s.
    course : bool
        Every 20 ms from the first phase to the last, from the pushes of all phases together, two
        phases or more (method "latent").
    force_by : {"limb", "device"}, optional
        Whose force on the other a Kinarm's sensor holds.
    despite : str or collection of str
        Names of checks of `inspect` whose STOP is overruled; every estimate says so.
    progress : function (done, all), optional
        Called after each phase.

    Returns
    -------
    Estimates
        One estimate per condition and phase, for the middle of the window; `position` is where
        undisturbed reaches are then.

    Raises
    ------
    InputError
        The recording cannot be read or lacks what is needed, a check of `inspect` says STOP, or a
        name is unknown.
    NotIdentifiableError
        The pushes of a phase do not tell M, B and K apart.
    EstimationError
        M comes out negative: the force's sign is not what the recording says.

    Examples
    --------
    >>> from armimpedance.hand.reaching.show import movement
    >>> from manipulandum_sim.movement import simulate_movement
    >>> recording, _ = simulate_movement(seed=1, repeats=2, unperturbed=15, phases=(0.5,))
    >>> moving = movement(recording)
    >>> moving.names
    ('condition free, phase 50%',)
    """
    known = read_results(inertia) if isinstance(inertia, str | os.PathLike) else inertia
    if course and method not in (None, METHODS.default):
        raise InputError(f"a course by method {method}", expected=f"method {METHODS.default}")
    find = identify_course if course else partial(identify_movement, method=method)
    with naming(recording):
        read = read_recording(recording, force_by=force_by)
        marks = checked(read, despite, CHECKS)
        made = find(
            read,
            level=level,
            inertia=known,
            phases=phases,
            window_s=window_s,
            progress=progress,
        )
        marked = tuple(one.marked(marks) for one in made)
        return Estimates(marked, read.subject, read.gravity_m_s2)


def plan_movement(
    pilot: Recording | PathLike,
    *,
    k_percent: float = 10.0,
    phase: str | None = None,
    robot_kg: float = 1.0,
    max_force_n: float = 10.0,
    max_displacement_m: float = 0.01,
    force_by: ForceBy | None = None,
    despite: str | Collection[str] = (),
) -> MovementPlan:
    """Compare pushes of a reaching hand by the trials that they need, from a small pilot.

    Parameters
    ----------
    pilot : Recording or path
        Ten free reaches and eight pushed ones of a phase are the least.
    k_percent : float
        Wanted error of K, which 95 of 100 experiments stay below.
    phase : str, optional
        Default: the pilot's first.
    robot_kg : float
        Mass of robot and handle that a pushed hand carries.
    max_force_n, max_displacement_m : float
        No push is larger.
    force_by : {"limb", "device"}, optional
    despite : str or collection of str
        Names of checks of `inspect` whose STOP is overruled.

    Returns
    -------
    MovementPlan
        Shapes of pushes, the best first.

    Raises
    ------
    InputError
        The pilot cannot be read or lacks something, or a number is not positive.
    NotIdentifiableError
        The pilot does not tell what the arm is.

    Examples
    --------
    >>> from armimpedance.hand.reaching.show import plan_movement
    >>> from manipulandum_sim.movement import simulate_movement
    >>> pilot, _ = simulate_movement(seed=1, repeats=2, unperturbed=15, phases=(0.5,))
    >>> plan_movement(pilot).pushes[0].shape.kind
    'displacement'
    """
    with naming(pilot):
        read = read_recording(pilot, force_by=force_by)
        checked(read, despite, CHECKS)
        return plan_pushes(
            read,
            k_percent=k_percent,
            phase=phase,
            robot_kg=robot_kg,
            max_force_n=max_force_n,
            max_displacement_m=max_displacement_m,
        )
