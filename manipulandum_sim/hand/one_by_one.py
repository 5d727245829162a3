"""Pushes one after another, as somebody asks for them: the manipulandum in a closed loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

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
    """What is asked for: a condition's name, a unit vector, and the course along it."""

    condition: str
    direction: tuple[float, float]
    disturbance: str
    amplitude_m: float
    duration_s: float


@dataclass(frozen=True)
class RecordedPush:
    """What one push gave: position (m), force by the limb (N), joint angles (rad), (S, 2) each.

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
        """What is known of it before the first push."""
        return self._truth(Arm.of(self.subject))

    def _truth(self, arm: Arm) -> Truth:
        reflex = (self.rig.reflex.gain, self.rig.reflex.delay_s) if self.rig.reflex else (0.0, 0.0)
        return find_truth(
            arm, self.conditions, handle_mass_kg=self.rig.handle_mass_kg, reflex=reflex
        )

    def push(self, asked: AskedPush, number: int) -> RecordedPush:
        """The push with this number of the session; the same number draws the same noise.

        Raises
        ------
        InputError
            The condition or the course is unknown, or out of range.
        """
        names = [condition.name for condition in self.conditions]
        if asked.condition not in names:
            raise InputError(f"no condition {asked.condition!r}", expected=f"such as {names[0]}")
        rig = replace(
            self.rig,
            disturbance=asked.disturbance,
            amplitude_m=asked.amplitude_m,
            duration_s=asked.duration_s,
            emg=False,
        )
        strength = self.subject.strength * (1 + self.drift * number / 100)
        arm = Arm.of(replace(self.subject, strength=strength))
        schedule = _one(asked, names.index(asked.condition), number, self.seed)
        batch = Batch(arm, rig, self._truth(arm), schedule, np.array([0]))
        sensed = run_batch(batch, self.seed)
        onset = int(schedule.onset[0])
        length = onset + round((asked.duration_s + AFTER_S) * RATE_HZ) + 1
        return RecordedPush(
            sensed.position[0, :length],
            sensed.force[0, :length],
            sensed.joint_angles[0, :length],
            onset / RATE_HZ,
            onset / RATE_HZ + asked.duration_s,
        )


def _one(asked: AskedPush, condition: int, number: int, seed: int) -> Schedule:
    """The schedule of one push."""
    key = (ASKED_KEY, condition)
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(*key, 0, number)))
    first, last = (round(s * RATE_HZ) for s in ONSET_S)
    return Schedule(
        labels=(asked.condition,),
        keys=((*key, 1, number),),
        condition=np.array([condition]),
        set_number=np.array([1]),
        direction=np.array([0]),
        onset=rng.integers(first, last, 1, endpoint=True),
        directions=np.array([asked.direction], dtype=float),
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
