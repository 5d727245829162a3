"""The trials of a therapy session: who does which movement in which way.

Random numbers of a trial depend on the seed, the person, the movement, the condition and the
repetition alone: what else is simulated does not change them.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass, replace
from typing import Final, Literal, get_args

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.skeleton import GRAVITY_M_S2
from manipulandum_sim.therapy.arm import TherapyArm
from manipulandum_sim.therapy.control import ASSIST, FREE, POSITION
from manipulandum_sim.therapy.reference import MOVEMENTS, Movement, find_movement
from manipulandum_sim.therapy.subject import TherapySubject, passive_of_repetition

Noise = Literal["nominal", "none"]
CONDITIONS: Final = ("passive", "active", "half_active", "resistive")
_PURPOSES: Final = ("passive", "effort", "unsteady", "sensors")
#: Person and session, not one trial.
_OF_PERSON: Final = 1_000_003
OF_SESSION: Final = 1_000_004

#: Own timing of a person who leads: delay s (least, most), sd of the logarithm of the duration's
#: factor, sd of the error of the target, rad.
DELAY_S: Final = (0.1, 0.4)
PACE_SD: Final = 0.06
TARGET_SD_rad: Final = float(np.deg2rad(0.7))
#: Resistance: elevation as a share of what the passive arm needs in the middle of the movement,
#: horizontal in N m (far more than the arm needs, as in the source); least, most.
RESISTED_SHARE: Final = (0.6, 2.2)
RESISTED_Nm: Final = (3.0, 18.0)
#: What motors can give a movement that is resisted, of their limit; friction takes its part.
USABLE: Final = 0.7


@dataclass(frozen=True)
class TherapyOptions:
    """Options of a session; see `therapy_session.simulate_therapy`."""

    conditions: tuple[str, ...] = CONDITIONS
    movements: tuple[str, ...] = ("elevation", "horizontal")
    repetitions: int = 3
    speed_deg_s: float = 20.0
    share: float = 0.5
    share_sd: float = 0.0
    mass_sd: float = 0.03
    rest_at_middle: bool = False
    inertia_compensation: float = 0.0
    noise: Noise = "nominal"

    def __post_init__(self) -> None:
        for name in ("conditions", "movements"):
            value = getattr(self, name)
            if isinstance(value, str) or not value:
                raise InputError(f"{name} {value!r}", expected="a list of names")
            object.__setattr__(self, name, tuple(value))
        for condition in self.conditions:
            if condition not in CONDITIONS:
                raise InputError(f"no condition {condition!r}", expected=" or ".join(CONDITIONS))
        for movement in self.movements:
            find_movement(movement)
        if not (isinstance(self.repetitions, int) and 1 <= self.repetitions <= 100):
            raise InputError(f"{self.repetitions} repetitions", expected="1 to 100")
        if not (0 <= self.share <= 1.5 and 0 <= self.share_sd <= 0.5):
            raise InputError(f"a share of {self.share}", expected="0 to 1.5, its sd 0 to 0.5")
        if not 0 <= self.mass_sd <= 0.2:
            raise InputError(f"mass_sd {self.mass_sd}", expected="0 to 0.2, a fraction")
        if not 0 <= self.inertia_compensation <= 0.9:
            raise InputError(
                f"inertia_compensation {self.inertia_compensation}", expected="0 to 0.9"
            )
        if self.noise not in get_args(Noise):
            known = " or ".join(get_args(Noise))
            raise InputError(f"no noise level {self.noise!r}", expected=known)

    @property
    def noisy(self) -> bool:
        """True if people and sensors are unsteady."""
        return self.noise != "none"


@dataclass(frozen=True)
class Streams:
    """Random numbers of one person's session."""

    seed: int
    person: str

    def __post_init__(self) -> None:
        if not (isinstance(self.seed, int) and self.seed >= 0):
            raise InputError(f"seed {self.seed}", expected="a whole number, 0 or more")

    def of(self, *key: int) -> np.random.Generator:
        """A generator of its own for each key."""
        whole = (zlib.crc32(self.person.encode()), *key)
        return np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=whole))

    def of_trial(
        self, movement: str, condition: str, repetition: int, purpose: str
    ) -> np.random.Generator:
        """For one purpose of one trial."""
        places = (list(MOVEMENTS).index(movement), CONDITIONS.index(condition), repetition)
        return self.of(*places, _PURPOSES.index(purpose))

    def of_person(self) -> np.random.Generator:
        """For what is the same in all trials of a person."""
        return self.of(_OF_PERSON)


@dataclass(frozen=True)
class TherapyTrial:
    """One person, one movement.

    Attributes
    ----------
    streams : Streams
    subject : TherapySubject
    movement : Movement
    condition : str
    repetition : int
        From 1.
    arm : TherapyArm
        As it truly is.
    k, rest_rad : (2,)
        Of this repetition; elevation, horizontal.
    share, resistance_Nm : float
    leads : bool
    mode : int
        Of the controller.
    delay_s, pace, miss_rad : float
        Own timing: when it starts, by which factor it takes longer, by how much it misses.
    """

    streams: Streams
    subject: TherapySubject
    movement: Movement
    condition: str
    repetition: int
    arm: TherapyArm
    k: FloatArray
    rest_rad: FloatArray
    share: float
    resistance_Nm: float
    leads: bool
    mode: int
    delay_s: float = 0.0
    pace: float = 1.0
    miss_rad: float = 0.0

    def stream(self, purpose: str) -> np.random.Generator:
        """Random numbers for one purpose."""
        return self.streams.of_trial(self.movement.name, self.condition, self.repetition, purpose)


def trials_of(
    subject: TherapySubject, options: TherapyOptions, seed: int, torque_limit: FloatArray
) -> list[TherapyTrial]:
    """A person's session: movement by movement, condition by condition, repetitions in a row."""
    streams = Streams(seed, subject.id)
    # one draw each for mass and the two resistances, whatever of them is used
    person = streams.of_person()
    factor = 1 + options.mass_sd * person.standard_normal()
    resists = person.random(2)
    if options.rest_at_middle:
        subject = _resting_at_middle(subject)
    arm = subject.stated_arm.heavier(float(factor))
    done = [c for c in options.conditions if not (subject.patient and c == "half_active")]
    trials = []
    for movement in (find_movement(name) for name in options.movements):
        resisted = _resistance(subject, arm, movement, resists, torque_limit)
        for condition in done:
            for repetition in range(1, options.repetitions + 1):
                plain = TherapyTrial(
                    streams, subject, movement, condition, repetition, arm,
                    subject.stiffness, subject.rest_rad,
                    share=0.0, resistance_Nm=0.0, leads=False, mode=POSITION,
                )  # fmt: skip
                trials.append(_in_condition(plain, options, resisted))
    return trials


def _resting_at_middle(subject: TherapySubject) -> TherapySubject:
    """With the horizontal rest angle in the middle of the movement: sum tau_h is about zero."""
    movement = MOVEMENTS["horizontal"]
    middle = np.deg2rad((movement.start_deg[movement.axis] + movement.to_deg) / 2)
    return replace(subject, rest_rad=np.array([subject.rest_rad[0], middle]), trunk_moves=False)


def _in_condition(trial: TherapyTrial, options: TherapyOptions, resisted: float) -> TherapyTrial:
    subject, noisy = trial.subject, options.noisy
    k, rest = passive_of_repetition(
        subject, trial.repetition, trial.stream("passive") if noisy else None
    )
    trial = replace(trial, k=k, rest_rad=rest)
    if trial.condition == "resistive":
        return replace(trial, resistance_Nm=resisted)
    draws = trial.stream("effort").standard_normal(4)
    if trial.condition == "half_active":
        share = options.share + options.share_sd * float(draws[3])
        return replace(trial, share=share, mode=ASSIST)
    if trial.condition == "active" and subject.patient:
        return replace(trial, share=subject.active_share, mode=ASSIST)
    if trial.condition == "active":
        late, pace, miss = (draws[:3] if noisy else np.zeros(3)).tolist()
        middle, half = sum(DELAY_S) / 2, (DELAY_S[1] - DELAY_S[0]) / 2
        return replace(
            trial,
            share=subject.active_share,
            leads=True,
            mode=FREE,
            delay_s=middle + half * float(np.tanh(late)),
            pace=float(np.exp(PACE_SD * pace)),
            miss_rad=TARGET_SD_rad * miss,
        )
    return trial


def _resistance(
    subject: TherapySubject,
    arm: TherapyArm,
    movement: Movement,
    draws: FloatArray,
    torque_limit: FloatArray,
) -> float:
    """N m; as much as the motor can overcome beside friction and arm."""
    axis, ends = (
        movement.axis,
        movement.start_deg[movement.axis]
        + np.array([0.0, 0.5, 1.0]) * (movement.to_deg - movement.start_deg[movement.axis]),
    )
    q = np.deg2rad(ends)
    weight = GRAVITY_M_S2 * arm.level_kgm * np.sin(q) if axis == 0 else np.zeros(3)
    passive = weight + subject.stiffness[axis] * (q - subject.rest_rad[axis])
    low, high = RESISTED_Nm
    wanted = low + (high - low) * draws[1]
    if axis == 0:
        low, high = RESISTED_SHARE
        wanted = (low + (high - low) * draws[0]) * abs(passive[1])
    # friction of axis 1 takes about a fifth of its motor's torque
    room = USABLE * torque_limit[axis] - np.abs(passive).max()
    return float(np.clip(wanted, 1.0, max(room, 1.0)))
