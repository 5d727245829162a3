"""One disturbance and what it needs to fulfil a wish."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FrozenRecord
from armimpedance.core.errors import ArmImpedanceError, InputError, check_number
from armimpedance.hand.planning.pilot import Pilot
from armimpedance.hand.planning.precision import PlannedMotion, Precision, precision, reflex_bias
from armimpedance.hand.planning.profile import Profile
from armimpedance.hand.planning.setting import Setting

# What an experiment shall tell.


@dataclass(frozen=True)
class Wish:
    """What an experiment shall tell; None: no wish.

    `k_part`: the 95 % interval of each diagonal element of K is to be at most +- this part of it.
    `orientation_rad`: half the 95 % interval of the stiffness ellipse's orientation is to be at
    most this.
    `most_trials`: a plan that needs more is not met.
    """

    k_part: float | None = None
    orientation_rad: float | None = None
    most_trials: int = 1000

    def __post_init__(self) -> None:
        asked = (
            ("K", self.k_part, 100.0, "%"),
            ("the orientation", self.orientation_rad, 180 / np.pi, "degrees"),
        )
        for name, value, factor, unit in asked:
            if value is not None:
                check_number(value, f"{name} within {factor * value:g} {unit}", above=0)
        if self.most_trials < 8:
            raise InputError(f"{self.most_trials} trials", expected="8 or more: one set")

    @property
    def text(self) -> str:
        """The wish in words."""
        parts = []
        if self.k_part is not None:
            parts.append(f"K within {100 * self.k_part:g} %")
        if self.orientation_rad is not None:
            degrees = np.rad2deg(self.orientation_rad)
            parts.append(f"K's orientation within {degrees:.3g} degrees")
        return " and ".join(parts) or "one set"

    def trials(self, precision: Precision) -> int | None:
        """Trials, in whole sets, that fulfil it; None: millions."""
        needed = [precision.directions]
        if self.k_part is not None:
            needed.append(precision.trials_for_k(self.k_part) or 0)
        if self.orientation_rad is not None:
            needed.append(precision.trials_for_orientation(self.orientation_rad) or 0)
        return None if 0 in needed else max(needed)


#: Trials at which intervals of candidates are compared.
_COMPARED_TRIALS: Final = 40
#: Departures that make K's interval so many times as wide as noise are worth a word.
_WIDER: Final = 1.15
#: How well a reflex's delay is known beforehand (s).
_DELAY_RANGE_S: Final = 0.005
#: A hand that reaches less of the commanded peak than this is worth a word.
_FOLLOWED: Final = 0.9


@dataclass(frozen=True)
class Candidate(FrozenRecord):
    """One disturbance and what it needs.

    `profile`: None: a pilot's own, as recorded.
    `precision`: None where `problem` stands in the way.
    `trials`: trials that the wish needs, in whole sets.
    `bias` (low, high): how much too large K comes out with a reflex of 25 % of K that is ignored,
    as a part of it: over delays from 5 ms before to 5 ms after the one asked about.
    `apart`: the precision of K together with the reflex, its delay known.
    `duration_s`, `amplitude_m`: duration and amplitude of the profile, or as a pilot recorded them.
    """

    name: str
    profile: Profile | None
    precision: Precision | None = None
    trials: int | None = None
    bias: tuple[float, float] = (np.nan, np.nan)
    apart: Precision | None = None
    problem: str = ""
    notes: tuple[str, ...] = ()
    duration_s: float = np.nan
    amplitude_m: float = np.nan

    @property
    def recommendable(self) -> bool:
        """Whether it can be chosen."""
        cautious = self.profile is not None and self.profile.shape.caution
        return self.precision is not None and not cautious

    @property
    def doubt(self) -> str:
        """How much of K's interval is allowed for departures, where that is much; else empty.

        A disturbance that cannot tell a reflex from stiffness leaves it in the interval.
        """
        if self.precision is None:
            return ""
        noise = replace(self.precision, knowledge=None)
        ratio = self.precision.k_part(_COMPARED_TRIALS) / noise.k_part(_COMPARED_TRIALS)
        if ratio < _WIDER:
            return ""
        return (
            f"{self.name} of {self.duration_s:.3g} s cannot tell a reflex from stiffness: with "
            f"{_COMPARED_TRIALS} trials the interval of K is {ratio:.1f} times as wide as noise "
            "alone makes it, which `estimate` allows for and this plan counts"
        )

    @property
    def cost(self) -> tuple[int, float]:
        """Trials needed, then K's interval: candidates are compared by these."""
        half = np.inf if self.precision is None else self.precision.k_part(_COMPARED_TRIALS)
        return self.trials or 0, half


def judge_pilot(pilot: Pilot, wish: Wish, conditions: int = 1) -> Candidate:
    """A pilot's own disturbance, as it was recorded, in a session of so many conditions."""
    expected = replace(pilot.precision, conditions=conditions)
    return Candidate(
        "pilot's own",
        None,
        expected,
        wish.trials(expected),
        duration_s=pilot.duration_s,
        amplitude_m=pilot.amplitude_m,
    )


def judge(
    setting: Setting, profile: Profile, wish: Wish, delay_s: float, conditions: int = 1
) -> Candidate:
    """A disturbance judged by what it will tell in a session of so many conditions."""
    made = Candidate(
        profile.shape.name,
        profile,
        duration_s=profile.duration_s,
        amplitude_m=profile.amplitude_m,
    )
    motion = PlannedMotion(setting, profile)
    try:
        expected = precision(motion, conditions=conditions)
    except ArmImpedanceError as error:
        return replace(made, problem=str(error))
    try:
        apart = precision(motion, delay_s=delay_s)
    except ArmImpedanceError:
        apart = None
    around = (delay_s - _DELAY_RANGE_S, delay_s, delay_s + _DELAY_RANGE_S)
    biases = [float(reflex_bias(motion, delay)[2]) for delay in around]
    return replace(
        made,
        precision=expected,
        trials=wish.trials(expected),
        bias=(min(biases), max(biases)),
        apart=apart,
        notes=_notes(motion),
    )


def _notes(motion: PlannedMotion) -> tuple[str, ...]:
    setting, profile, moved = motion.setting, motion.profile, motion.displacement
    notes = [f"{profile.shape.name}: {profile.shape.caution}"] if profile.shape.caution else []
    reached = min(np.abs(moved[a, a]).max() for a in range(len(moved))) / profile.amplitude_m
    if reached < _FOLLOWED:
        notes.append(
            f"{profile.shape.name} in {profile.duration_s:g} s: the servo "
            f"({setting.servo.natural_hz:.3g} Hz) lets the hand reach {100 * reached:.0f} % of the "
            "commanded peak"
        )
    return tuple(notes)
