"""A person in the therapy robot: recording and truth (M. Guidali et al. 2013).

Two movements in four conditions, in closed loop: the position controller moves a passive or a
resisting arm, an able-bodied person who is active moves freely with nothing but the robot's own
needs compensated, everybody else is helped from behind the reference.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, Final

import numpy as np
import pandas as pd

from armimpedance.errors import InputError
from armimpedance.records import FloatArray, IntArray, Recording

from .therapy_calibration import Seeds, therapy_recording
from .therapy_control import TherapyController, identified
from .therapy_device import RATE_HZ, TherapyDevice, therapy_device
from .therapy_plan import (
    CONDITIONS,
    OF_SESSION,
    Noise,
    PassiveLimbs,
    Streams,
    TherapyOptions,
    TherapyTrial,
    effort_of,
    payload_of,
    reference_of,
    samples_of,
    trials_of,
)
from .therapy_plant import Motion, Progress, run
from .therapy_reference import REST_S, SPEED_deg_s
from .therapy_subject import THERAPY_SUBJECTS, TherapySubject, find_therapy_subject
from .therapy_truth import TherapyMotion, TherapyTruth

#: Seconds before the record in which everything settles.
RUN_IN_S: Final = 1.0
#: A person who moves freely moves while faster than this share of the own peak speed.
SPEED_SHARE: Final = 0.05
#: Steps that the progress of a batch is told in.
PARTS: Final = 1000
#: What is true of each trial; see `TherapyTruth`.
_MEASURES: Final = ("contribution", "contribution_elastic", "projection", "cancellation")
#: Trials that go through the plant together, at most: bounds the memory.
BATCH: Final = 210


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
        instant about the true speed's peak at which it is at least `SPEED_SHARE` of that.

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
        session = _Session.run(trials, options, own, model, told)
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


@dataclass(frozen=True)
class _Session:
    """Trials that went through the plant together, and what came of them.

    Attributes
    ----------
    trials : list of T TherapyTrial
    motion : Motion
    reference : (S, T, 5)
        rad.
    onset_s, end_s : (T,)
    lengths : (T,)
        Samples that are kept.
    """

    trials: list[TherapyTrial]
    options: TherapyOptions
    device: TherapyDevice
    limbs: PassiveLimbs
    motion: Motion
    reference: FloatArray
    onset_s: FloatArray
    end_s: FloatArray
    lengths: IntArray

    @classmethod
    def run(
        cls,
        trials: list[TherapyTrial],
        options: TherapyOptions,
        device: TherapyDevice,
        model: TherapyDevice,
        progress: Progress | None,
    ) -> _Session:
        asked, limbs = reference_of(trials, options.speed_deg_s), PassiveLimbs.of(trials)
        needed, run_in = samples_of(trials, asked), round(RUN_IN_S * RATE_HZ)
        samples = int(needed.max())
        effort = effort_of(trials, asked, device, run_in + samples, options)
        payload = payload_of(trials, device)
        modes = np.array([trial.mode for trial in trials])

        def user(time_s: float, q: FloatArray, qd: FloatArray) -> FloatArray:
            return effort.torque(round(time_s * RATE_HZ) + run_in, time_s, q, qd)

        motion = run(
            device,
            payload,
            asked.start,
            TherapyController.of(
                model, payload.upper_arm_m, asked, modes, options.inertia_compensation
            ),
            samples,
            user=user,
            passive=limbs,
            run_in=run_in,
            measured=options.noisy,
            progress=progress,
        )
        told = np.stack([asked.at(k / RATE_HZ)[0] for k in range(samples)])
        leads = np.array([trial.leads for trial in trials])
        first, last = _moving(motion.qd, asked.axis, needed)
        onset = np.where(leads, first / RATE_HZ, asked.begin_s)
        end = np.where(leads, last / RATE_HZ, asked.end_s)
        rest = round(REST_S * RATE_HZ)
        lengths = np.minimum(np.round(end * RATE_HZ).astype(np.int64) + rest + 1, needed)
        return cls(trials, options, device, limbs, motion, told, onset, end, lengths)

    def of_person(self, rows: slice, seed: int, exact: bool) -> tuple[Recording, TherapyTruth]:
        """What one person's trials (rows from, to) recorded, and what is true of them."""
        trials, lengths = self.trials[rows], self.lengths[rows]
        subject = trials[0].subject
        motion = _columns(self.motion, rows)
        said = (
            f"Simulated: subject {subject.id} in the therapy robot {self.device.name}, "
            f"seed {seed}, noise {self.options.noise}."
        )
        recording = therapy_recording(
            self.device,
            motion,
            self.reference[:, rows],
            self._table(rows),
            lengths,
            Seeds(seed, f"therapy {subject.id}"),
            self.options.noise,
            subject.record,
            said,
        )
        truth = TherapyTruth.of(
            "therapy",
            subject.id,
            self.device.adjusted_to(trials[0].arm.upper_arm_m),
            recording.offsets,
            TherapyMotion.of(motion, lengths) if exact else None,
            **self._contributions(rows),
            stiffness=self.limbs.k[rows],
            rest_rad=self.limbs.rest_rad[rows],
            damping=self.limbs.damping[rows],
            tone_Nm=self.limbs.tone_Nm[rows],
        )
        return recording, truth

    def _table(self, rows: slice) -> pd.DataFrame:
        trials = self.trials[rows]
        return pd.DataFrame(
            {
                "trial": np.arange(len(trials)) + 1,
                "condition": [trial.condition for trial in trials],
                "movement": [trial.movement.name for trial in trials],
                "axis": [trial.movement.axis + 1 for trial in trials],
                "onset_s": np.round(self.onset_s[rows], 6),
                "end_s": np.round(self.end_s[rows], 6),
                "repetition": [trial.repetition for trial in trials],
            }
        )

    def _contributions(self, rows: slice) -> dict[str, FloatArray]:
        """Per trial, of the moving axis from onset to end, percent; cancellation a fraction."""
        found: dict[str, list[float]] = {
            name: []
            for name in ("contribution", "contribution_elastic", "projection", "cancellation")
        }
        for t in range(rows.start, rows.stop):
            first, last = (round(s[t] * RATE_HZ) for s in (self.onset_s, self.end_s))
            part = (slice(first, last + 1), t, self.trials[t].movement.axis)
            user, need = self.motion.user[part], (self.motion.arm + self.motion.passive)[part]
            beside = self.limbs.beside(self.motion.qd[part[0]])[:, t, part[2]]
            found["contribution"].append(_percent(float(user.sum()), float(need.sum())))
            found["contribution_elastic"].append(
                _percent(float((user - beside).sum()), float((need - beside).sum()))
            )
            found["projection"].append(_percent(float(user @ need), float(need @ need)))
            found["cancellation"].append(float(abs(need.sum()) / np.abs(need).sum()))
        return {name: np.array(values) for name, values in found.items()}


def _percent(part: float, whole: float) -> float:
    """Never infinite: a denominator of exactly zero is no number that a truth can hold."""
    return float(100 * part / (whole if whole else np.finfo(float).tiny ** 0.5))


def _columns(motion: Motion, rows: slice) -> Motion:
    return Motion(**{f.name: getattr(motion, f.name)[:, rows] for f in fields(Motion)})


def _moving(qd: FloatArray, axis: Any, needed: Any) -> tuple[IntArray, IntArray]:
    """First and last sample (T,) about the peak at which an axis is faster than a share of it."""
    samples, trials = qd.shape[:2]
    speed = np.abs(qd[:, np.arange(trials), axis])
    speed[np.arange(samples)[:, None] >= needed] = 0.0
    peak = speed.argmax(axis=0)
    slow = speed < SPEED_SHARE * speed.max(axis=0)
    index = np.arange(samples)[:, None]
    first = np.where(slow & (index < peak), index, -1).max(axis=0) + 1
    last = np.where(slow & (index > peak), index, samples).min(axis=0) - 1
    return first, last
