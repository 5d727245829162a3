"""A candidate disturbance, and the trials that it needs for a required precision."""

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

# Requirements for an experiment.


@dataclass(frozen=True)
class Wish:
    """Requirements for an experiment; None for no requirement.

    `k_part`: largest half-width of the 95 % interval of each diagonal element of K, relative to it.
    `orientation_rad`: largest half-width of the 95 % interval of the stiffness ellipse's
    orientation.
    `most_trials`: a plan that needs more does not meet the requirements.
    """

    k_part: float | None = None
    orientation_rad: float | None = None
    most_trials: int = 1000

    def __post_init__(self) -> None:
        requirements = (
            ("K", self.k_part, 100.0, "%"),
            ("the orientation", self.orientation_rad, 180 / np.pi, "degrees"),
        )
        for name, value, factor, unit in requirements:
            if value is not None:
                check_number(value, f"{name} within {factor * value:g} {unit}", above=0)
        if self.most_trials < 8:
            raise InputError(f"{self.most_trials} trials", expected="8 or more: one set")

    @property
    def text(self) -> str:
        """The requirements in words."""
        parts = []
        if self.k_part is not None:
            parts.append(f"K within {100 * self.k_part:g} %")
        if self.orientation_rad is not None:
            degrees = np.rad2deg(self.orientation_rad)
            parts.append(f"K's orientation within {degrees:.3g} degrees")
        return " and ".join(parts) or "one set"

    def trials(self, precision: Precision) -> int | None:
        """Number of trials, in whole sets, that meets them; None: millions."""
        needed = [precision.directions]
        if self.k_part is not None:
            needed.append(precision.trials_for_k(self.k_part) or 0)
        if self.orientation_rad is not None:
            needed.append(precision.trials_for_orientation(self.orientation_rad) or 0)
        return None if 0 in needed else max(needed)


#: Number of trials for the comparison of candidates' intervals.
_COMPARED_TRIALS: Final = 40
#: A note is added if departures widen K's interval by more than this factor.
_WIDER: Final = 1.15
#: Half-width of the range of a reflex's delay (s).
_DELAY_RANGE_S: Final = 0.005
#: A note is added if the hand reaches less than this share of the commanded peak.
_FOLLOWED: Final = 0.9


@dataclass(frozen=True)
class Candidate(FrozenRecord):
    """One disturbance and the trials that it needs.

    `profile`: None for a pilot's own disturbance, as recorded.
    `precision`: None if there is a `problem`.
    `trials`: number of trials for the requirements, in whole sets.
    `bias` (low, high): relative overstatement of K by an ignored reflex of 25 % of K, over delays
    from 5 ms below to 5 ms above the requested one.
    `apart`: the precision of K and of the reflex estimated together, with known delay.
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
        """True if it can be recommended."""
        cautious = self.profile is not None and self.profile.shape.caution
        return self.precision is not None and not cautious

    @property
    def doubt(self) -> str:
        """Sentence on the allowance for departures in K's interval, if it is large; else empty.

        A disturbance that cannot separate a reflex from stiffness has it in the interval.
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
        """Sort key of candidates: trials needed, then K's interval."""
        half = np.inf if self.precision is None else self.precision.k_part(_COMPARED_TRIALS)
        return self.trials or 0, half


def judge_pilot(pilot: Pilot, wish: Wish, conditions: int = 1) -> Candidate:
    """Judge a pilot's own disturbance, as recorded, in a session of so many conditions."""
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
    """Judge a disturbance by its predicted precision in a session of so many conditions."""
    candidate = Candidate(
        profile.shape.name,
        profile,
        duration_s=profile.duration_s,
        amplitude_m=profile.amplitude_m,
    )
    motion = PlannedMotion(setting, profile)
    try:
        expected = precision(motion, conditions=conditions)
    except ArmImpedanceError as error:
        return replace(candidate, problem=str(error))
    try:
        apart = precision(motion, delay_s=delay_s)
    except ArmImpedanceError:
        apart = None
    around = (delay_s - _DELAY_RANGE_S, delay_s, delay_s + _DELAY_RANGE_S)
    biases = [float(reflex_bias(motion, delay)[2]) for delay in around]
    return replace(
        candidate,
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
