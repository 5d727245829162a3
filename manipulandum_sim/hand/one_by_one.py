"""Pushes one after another, as somebody asks for them: the manipulandum in a closed loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from manipulandum_sim.hand.arm_plant import Arm
from manipulandum_sim.hand.experiments import Condition
from manipulandum_sim.hand.rig import AFTER_S, ONSET_S, RATE_HZ, Rig
from manipulandum_sim.hand.schedule import Schedule
from manipulandum_sim.hand.subjects import SimulatedSubject
from manipulandum_sim.hand.trials import Batch, run_batch
from manipulandum_sim.hand.truth import Truth, find_truth

#: First number of the random keys of pushes that are asked for one by one.
ASKED_KEY = 200


@dataclass(frozen=True)
class AskedPush:
    """A requested push: a condition's name, a unit vector, and the course along it."""

    condition: str
    direction: tuple[float, float]
    disturbance: str
    amplitude_m: float
    duration_s: float

    @property
    def course(self) -> tuple[str, float, float]:
        """Shape, amplitude (m) and duration (s)."""
        return self.disturbance, self.amplitude_m, self.duration_s


@dataclass(frozen=True)
class RecordedPush:
    """Record of one push: position (m), force by the limb (N), joint angles (rad), (S, 2) each.

    `onset_s`, `end_s`: of the disturbance.
    """

    position: FloatArray
    force: FloatArray
    joint_angles: FloatArray
    onset_s: float
    end_s: float


@dataclass(frozen=True)
class AskedArm:
    """A subject at the manipulandum, ready to be pushed.

    Attributes
    ----------
    subject : SimulatedSubject
    conditions : tuple of Condition
    rig : Rig
        Servo, noise and reflex; the course is each push's own.
    seed : int
    drift : float
        By this part muscles become stronger (or weaker) over a hundred pushes.
    """

    subject: SimulatedSubject
    conditions: tuple[Condition, ...]
    rig: Rig
    seed: int
    drift: float = 0.0

    @property
    def truth(self) -> Truth:
        """Truth of the arm before the first push."""
        return self._truth(Arm.of(self.subject))

    def _truth(self, arm: Arm) -> Truth:
        rig = self.rig
        return find_truth(
            arm, self.conditions, handle_mass_kg=rig.handle_mass_kg, reflex=rig.reflex_numbers
        )

    def push(self, asked: Sequence[AskedPush], first: int) -> list[RecordedPush]:
        """Pushes that are known by now, the first with this number of the session.

        The same number draws the same noise. Muscles change from group to group.

        Raises
        ------
        InputError
            A condition or a course is unknown, or out of range.
        """
        made: list[RecordedPush] = []
        arm = Arm.of(
            replace(self.subject, strength=self.subject.strength * (1 + self.drift * first / 100))
        )
        truth = self._truth(arm)
        for course, group in groupby(asked, key=lambda one: one.course):
            made += self._of_one_course(arm, truth, course, list(group), first + len(made))
        return made

    def _of_one_course(
        self,
        arm: Arm,
        truth: Truth,
        course: tuple[str, float, float],
        asked: Sequence[AskedPush],
        first: int,
    ) -> list[RecordedPush]:
        disturbance, amplitude_m, duration_s = course
        rig = replace(
            self.rig,
            disturbance=disturbance,
            amplitude_m=amplitude_m,
            duration_s=duration_s,
            emg=False,
        )
        schedule = self._schedule(asked, first)
        sensed = run_batch(Batch(arm, rig, truth, schedule, np.arange(len(asked))), self.seed)
        made = []
        for row, onset in enumerate(schedule.onset):
            length = int(onset) + round((duration_s + AFTER_S) * RATE_HZ) + 1
            made.append(
                RecordedPush(
                    sensed.position[row, :length],
                    sensed.force[row, :length],
                    sensed.joint_angles[row, :length],
                    onset / RATE_HZ,
                    onset / RATE_HZ + duration_s,
                )
            )
        return made

    def _schedule(self, asked: Sequence[AskedPush], first: int) -> Schedule:
        names = [condition.name for condition in self.conditions]
        for one in asked:
            if one.condition not in names:
                raise InputError(f"no condition {one.condition!r}", expected=f"such as {names[0]}")
        earliest, latest = (round(s * RATE_HZ) for s in ONSET_S)
        onsets = [
            np.random.default_rng(
                np.random.SeedSequence(self.seed, spawn_key=(ASKED_KEY, 0, number))
            ).integers(earliest, latest, endpoint=True)
            for number in range(first, first + len(asked))
        ]
        return Schedule(
            labels=tuple(one.condition for one in asked),
            keys=tuple((ASKED_KEY, 1, first + n) for n in range(len(asked))),
            condition=np.array([names.index(one.condition) for one in asked]),
            set_number=np.ones(len(asked), dtype=int),
            direction=np.arange(len(asked)),
            onset=np.array(onsets),
            directions=np.array([one.direction for one in asked], dtype=float),
        )


def conditions_named(names: Sequence[str], known: Sequence[Condition]) -> tuple[Condition, ...]:
    """Conditions of an experiment by their names.

    Raises
    ------
    InputError
        If there is no such condition.
    """
    found = {condition.name: condition for condition in known}
    for name in names:
        if name not in found:
            raise InputError(f"no condition {name!r}", expected=f"such as {known[0].name}")
    return tuple(found[name] for name in names)
