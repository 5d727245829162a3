"""A person in the therapy robot: recording and truth (M. Guidali et al. 2013).

Two movements in four conditions, in closed loop: the position controller moves a passive or a
resisting arm, an able-bodied person who is active moves freely with nothing but the robot's own
needs compensated, everybody else is helped from behind the reference.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from manipulandum_sim.therapy.control import identified
from manipulandum_sim.therapy.device import TherapyDevice, therapy_device
from manipulandum_sim.therapy.plan import (
    CONDITIONS,
    OF_SESSION,
    Noise,
    Streams,
    TherapyOptions,
    TherapyTrial,
    trials_of,
)
from manipulandum_sim.therapy.plant import Progress
from manipulandum_sim.therapy.record import TherapyRun
from manipulandum_sim.therapy.reference import SPEED_deg_s
from manipulandum_sim.therapy.subject import THERAPY_SUBJECTS, TherapySubject, find_therapy_subject
from manipulandum_sim.therapy.truth import TherapyTruth

#: Trials that go through the plant together, at most: bounds the memory.
BATCH: Final = 210
#: Steps that the progress of a batch is told in.
PARTS: Final = 1000


def simulate_therapy(
    *,
    subject: str | TherapySubject = "S1",
    seed: int = 0,
    noise: Noise = "nominal",
    conditions: Sequence[str] = CONDITIONS,
    movements: Sequence[str] = ("elevation", "horizontal"),
    lowering: bool = False,
    repetitions: int = 3,
    speed_deg_s: float = SPEED_deg_s,
    share: float = 0.5,
    share_sd: float = 0.0,
    mass_sd: float = 0.03,
    rest_at_middle: bool = False,
    inertia_compensation: float = 0.0,
    device: TherapyDevice | None = None,
    exact: bool = True,
    progress: Progress | None = None,
) -> tuple[Recording, TherapyTruth]:
    """One person's session, and its truth.

    Parameters
    ----------
    subject : str or TherapySubject
        "S1" to "S12", able-bodied; "P1" to "P7", patients, who have no half active condition.
    seed : int
        A trial's noise depends on seed, subject and the trial alone.
    noise : {"nominal", "none"}
        ``none``: exact sensors, steady people, all repetitions alike (a moving trunk still moves).
    conditions, movements : sequences of str
        ``passive``, ``active``, ``half_active``, ``resistive``; ``elevation``, ``horizontal``,
        ``lowering``.
    lowering : bool
        Adds the movement of that name, 110 to 45 degrees.
    repetitions : int
    speed_deg_s : float
        Mean speed of a movement.
    share, share_sd : float
        Of what the passive arm needs, carried when half active.
    mass_sd : float
        Sd of the factor between the arm's true masses and those after the stated body mass.
    rest_at_middle : bool
        Horizontal rest angle at 45 degrees, where (4) has no denominator.
    inertia_compensation : float
        Share of the robot's own inertia that the controller takes from a person who moves freely;
        the source's takes none.
    device : TherapyDevice, optional
    exact : bool
        Whether the truth keeps the exact course of every sample.
    progress : function, optional
        Called with how many steps are done, of how many.

    Returns
    -------
    (Recording, TherapyTruth)
        `onset_s` and `end_s` are the reference's; of a person who moves freely, the first and last
        instant about the true speed's peak at which it is at least 5 % of that.

    Raises
    ------
    InputError
        An argument that makes no recording.
    """
    options = TherapyOptions(
        conditions=_names(conditions),
        movements=_with_lowering(movements, lowering),
        repetitions=repetitions,
        speed_deg_s=speed_deg_s,
        share=share,
        share_sd=share_sd,
        mass_sd=mass_sd,
        rest_at_middle=rest_at_middle,
        inertia_compensation=inertia_compensation,
        noise=noise,
    )
    return simulate_therapy_many(
        [subject], seed, options=options, device=device, exact=exact, progress=progress
    )[0]


def _with_lowering(movements: Sequence[str], lowering: bool) -> tuple[str, ...]:
    named = _names(movements)
    return (*named, "lowering") if lowering and "lowering" not in named else named


def _names(given: Sequence[str]) -> tuple[str, ...]:
    return (given,) if isinstance(given, str) else tuple(given)


def simulate_therapy_many(
    subjects: Sequence[str | TherapySubject] = tuple(THERAPY_SUBJECTS),
    seed: int = 0,
    *,
    options: TherapyOptions | None = None,
    device: TherapyDevice | None = None,
    exact: bool = True,
    progress: Progress | None = None,
) -> list[tuple[Recording, TherapyTruth]]:
    """Sessions of several persons, side by side; the same numbers as one by one.

    Parameters
    ----------
    options : TherapyOptions, optional
        See `simulate_therapy`.
    subjects, seed, device, exact, progress
        As there.

    Raises
    ------
    InputError
        An argument that makes no recording.
    """
    options, own = options or TherapyOptions(), device or therapy_device()
    people = [find_therapy_subject(subject) for subject in subjects]
    if len({person.id for person in people}) < len(people):
        raise InputError("a subject stands twice in a list", expected="each once")
    model = identified(own, Streams(seed, "").of(OF_SESSION))
    plans = [trials_of(person, options, seed, own.torque_limit_Nm) for person in people]
    if not all(plans):
        raise InputError("nothing to do for a patient", expected="conditions beside half_active")
    batches = _batches(plans)
    total, sessions = len(batches), []
    for i, batch in enumerate(batches):
        told = None if progress is None else _Part(progress, i, total)
        trials = [trial for plan in batch for trial in plan]
        session = TherapyRun.of(trials, options, own, model, told)
        first = 0
        for plan in batch:
            rows = slice(first, first + len(plan))
            sessions.append(session.of_person(rows, seed, exact))
            first += len(plan)
    return sessions


def _batches(plans: list[list[TherapyTrial]]) -> list[list[list[TherapyTrial]]]:
    batches: list[list[list[TherapyTrial]]] = []
    for plan in plans:
        if batches and sum(map(len, batches[-1])) + len(plan) <= BATCH:
            batches[-1].append(plan)
        else:
            batches.append([plan])
    return batches


@dataclass(frozen=True)
class _Part:
    """Progress of one batch of several, which may differ in their steps."""

    progress: Progress
    number: int
    of: int

    def __call__(self, done: int, steps: int) -> None:
        part = round(PARTS * done / steps)
        self.progress(self.number * PARTS + part, self.of * PARTS)
