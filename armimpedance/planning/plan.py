"""The plan: which disturbances meet a wish, with how many trials, and if none does, why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.errors import ArmImpedanceError, InputError
from armimpedance.planning.design import Goal, Limits, check_limits, design
from armimpedance.planning.motion import PlannedMotion
from armimpedance.planning.pilot import Pilot
from armimpedance.planning.precision import Precision, precision, reflex_bias
from armimpedance.planning.setting import Setting
from armimpedance.planning.shapes import SHAPES, Profile, Shape, shape_named

#: Durations (s) that are compared where none is asked for.
DURATIONS_S: Final = (0.15, 0.2, 0.3)
#: And these shapes; a half-sine no robot makes.
COMPARED: Final = tuple(name for name in SHAPES if name != "half_sine")
#: How well a reflex's delay is known beforehand (s).
_DELAY_RANGE_S: Final = 0.005
#: A hand that reaches less of the commanded peak than this is worth a word.
_FOLLOWED: Final = 0.9


@dataclass(frozen=True)
class Wish:
    """What an experiment shall tell; None: no wish.

    Attributes
    ----------
    k_part : float
        The 95 % interval of each diagonal element of K is to be at most +- this part of it.
    orientation_rad : float
        Half the 95 % interval of the stiffness ellipse's orientation is to be at most this.
    most_trials : int
        A plan that needs more is not met.
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
            if value is not None and not (np.isfinite(value) and value > 0):
                raise InputError(f"{name} within {factor * value:g} {unit}", expected="more than 0")
        if self.most_trials < 8:
            raise InputError(f"{self.most_trials} trials", expected="8 or more: one set")

    @property
    def text(self) -> str:
        """In words."""
        parts = []
        if self.k_part is not None:
            parts.append(f"K within {100 * self.k_part:g} %")
        if self.orientation_rad is not None:
            degrees = np.rad2deg(self.orientation_rad)
            parts.append(f"K's orientation within {degrees:.3g} degrees")
        return " and ".join(parts) or "one set"

    def trials(self, found: Precision) -> int | None:
        """Trials, in whole sets of eight, that fulfil it; None: millions."""
        needed = [8]
        if self.k_part is not None:
            needed.append(found.trials_for_k(self.k_part) or 0)
        if self.orientation_rad is not None:
            needed.append(found.trials_for_orientation(self.orientation_rad) or 0)
        return None if 0 in needed else max(needed)


@dataclass(frozen=True)
class Candidate:
    """One disturbance and what it needs.

    Attributes
    ----------
    name : str
    profile : Profile or None
        None: a pilot's own, as recorded.
    found : Precision or None
        None where `problem` stands in the way.
    trials : int or None
        For the wish, in whole sets.
    bias : (low, high)
        How much too large K comes out with a reflex of 25 % of K that is ignored, as a part of it:
        over delays from 5 ms before to 5 ms after the one asked about.
    apart : Precision or None
        Of K together with the reflex, its delay known.
    problem : str
    notes : tuple of str
    duration_s, amplitude_m : float
        Of the profile, or as a pilot recorded them.
    """

    name: str
    profile: Profile | None
    found: Precision | None = None
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
        return self.found is not None and not cautious


@dataclass(frozen=True)
class Plan:
    """All candidates under one wish.

    Attributes
    ----------
    setting, wish, limits, delay_s
    candidates : tuple of Candidate
    obstacle : str
        Why the wish cannot be met; empty: it can.
    """

    setting: Setting
    wish: Wish
    limits: Limits
    delay_s: float
    candidates: tuple[Candidate, ...]
    obstacle: str = ""

    @property
    def best(self) -> Candidate | None:
        """The recommendable candidate with the fewest trials, then the smallest interval of K."""
        usable = [c for c in self.candidates if c.recommendable and c.trials is not None]
        return min(usable, key=_cost, default=None)


def make_plan(
    setting: Setting,
    profiles: Sequence[Profile],
    wish: Wish,
    limits: Limits,
    *,
    delay_s: float = 0.055,
    measured: Sequence[Candidate] = (),
) -> Plan:
    """Judge profiles, and a pilot's own where there is one.

    Parameters
    ----------
    setting : Setting
    profiles : sequence of Profile
    wish : Wish
    limits : Limits
        Profiles are within them already (`within`).
    delay_s : float
        Of the reflex that is asked about.
    measured : sequence of Candidate
        Put first, as they are.
    """
    if not 0.01 <= delay_s <= 0.2:
        raise InputError(f"a reflex {1e3 * delay_s:g} ms late", expected="10 to 200 ms")
    judged = [_judge(setting, profile, wish, delay_s) for profile in profiles]
    plan = Plan(setting, wish, limits, delay_s, (*measured, *judged))
    return replace(plan, obstacle=_obstacle(plan))


def within(shape: Shape, limits: Limits, *, reduce: bool) -> Profile:
    """A shape at the limits' amplitude and duration.

    Parameters
    ----------
    reduce : bool
        Where the acceleration would be too large, take a smaller amplitude instead of refusing.

    Raises
    ------
    InputError
        Names the binding limit and what would do.
    """
    profile = Profile(shape, limits.amplitude_m, limits.duration_s)
    if profile.peak_acceleration <= limits.acceleration * (1 + 1e-9):
        return profile
    amplitude = limits.amplitude_m * limits.acceleration / profile.peak_acceleration
    if reduce:
        return replace(profile, amplitude_m=amplitude)
    root = np.sqrt(profile.peak_acceleration / limits.acceleration)
    raise InputError(
        f"{shape.name} of {1e3 * limits.amplitude_m:g} mm in {limits.duration_s:g} s reaches "
        f"{profile.peak_acceleration:.3g} m/s^2",
        expected=f"at most {limits.acceleration:g}: {limits.duration_s * root:.3f} s or longer, "
        f"or {1e3 * amplitude:.2f} mm or less",
    )


def candidates_of(
    names: Sequence[str], durations: Sequence[float], limits: Limits
) -> list[Profile]:
    """Named shapes at each duration, with smaller amplitudes where the acceleration asks for it."""
    return [
        within(shape_named(name), replace(limits, duration_s=duration), reduce=True)
        for name in names
        for duration in durations
    ]


def judge_pilot(pilot: Pilot, wish: Wish) -> Candidate:
    """A pilot's own disturbance, as it was recorded."""
    return Candidate(
        "pilot's own",
        None,
        pilot.found,
        wish.trials(pilot.found),
        duration_s=pilot.duration_s,
        amplitude_m=pilot.amplitude_m,
    )


def _judge(setting: Setting, profile: Profile, wish: Wish, delay_s: float) -> Candidate:
    made = Candidate(
        profile.shape.name,
        profile,
        duration_s=profile.duration_s,
        amplitude_m=profile.amplitude_m,
    )
    motion = PlannedMotion(setting, profile)
    try:
        found = precision(motion)
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
        found=found,
        trials=wish.trials(found),
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


def _cost(candidate: Candidate) -> tuple[int, float]:
    half = np.inf if candidate.found is None else candidate.found.k_part(40)
    return candidate.trials or 0, half


def _obstacle(plan: Plan) -> str:
    """Why no candidate meets the wish, and the limit that costs most."""
    best, wish = plan.best, plan.wish
    if best is not None and best.trials is not None and best.trials <= wish.most_trials:
        return ""
    problems = [c.problem for c in plan.candidates if c.problem]
    cautions = [note for c in plan.candidates if not c.recommendable for note in c.notes]
    if best is None and (problems or cautions):
        return (problems or cautions)[0]
    shown = "millions of" if best is None else f"{best.trials:,}"
    return (
        f"{wish.text} needs {shown} trials, more than {wish.most_trials:,}; {_binding_limit(plan)}"
    )


def _binding_limit(plan: Plan) -> str:
    """The limit whose loosening saves most trials, tried on disturbances designed for each."""
    limits, wish = plan.limits, plan.wish
    try:
        check_limits(limits)
    except InputError as error:
        return str(error)
    looser = {
        f"{1.5e3 * limits.amplitude_m:g} mm instead of {1e3 * limits.amplitude_m:g}": replace(
            limits, amplitude_m=1.5 * limits.amplitude_m
        ),
        f"{1.5 * limits.duration_s:g} s instead of {limits.duration_s:g}": replace(
            limits, duration_s=1.5 * limits.duration_s
        ),
        "the same limits": limits,
    }
    if np.isfinite(limits.acceleration):
        looser[f"{1.5 * limits.acceleration:g} m/s^2 instead of {limits.acceleration:g}"] = replace(
            limits, acceleration=1.5 * limits.acceleration
        )
    needed: dict[str, int] = {}
    for name, changed in looser.items():
        try:
            made = design(plan.setting, changed, Goal(), starts=4)
            trials = wish.trials(precision(PlannedMotion(plan.setting, made.profile)))
        except ArmImpedanceError:
            continue
        if trials is not None:
            needed[name] = trials
    if not needed:
        return "no change of amplitude, duration or acceleration helps: the noise is too large"
    name = min(needed, key=lambda key: needed[key])
    return f"what binds most: {name} and a disturbance designed for it would need {needed[name]:,}"
