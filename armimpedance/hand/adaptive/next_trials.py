"""The next pushes, the number that remains, and whether the requirements are met."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from html import escape
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import ArmImpedanceError, InputError
from armimpedance.core.records import ImpedanceEstimate, Recording
from armimpedance.hand.adaptive.choice import ExperimentSoFar, Need, needed, scaled_to
from armimpedance.hand.adaptive.menu import Menu, lines_of, menu_of
from armimpedance.hand.adaptive.order import (
    Comfort,
    Push,
    in_random_order,
    pauses,
    shared_out,
    ways,
)
from armimpedance.hand.adaptive.so_far import FIRST_TRIALS, SoFar, conditions_of, so_far
from armimpedance.hand.adaptive.target import Aim, Target, log_size, targets_of
from armimpedance.hand.planning import (
    COMPARED,
    DURATIONS_S,
    Limits,
    Profile,
    Servo,
    candidates_of,
)
from armimpedance.hand.still import allowing, estimate

if TYPE_CHECKING:
    import pandas as pd


#: The first shape: the one that needs fewest trials with a relaxed arm (docs/evidence/
#: reflex_and_plan.md), so that the course hardly ever has to change during a session.
FIRST_SHAPE: Final = "reflex_separating"


@dataclass(frozen=True)
class PushingRobot:
    """Abilities of the robot.

    Attributes
    ----------
    limits : Limits
        Limits of a push; its duration is the longest one.
    servo : Servo
    shapes : tuple of str
        Names of the available shapes.
    course : Profile or None
        The only course; None to choose one within shapes and limits.
    """

    limits: Limits = field(default_factory=Limits)
    servo: Servo = field(default_factory=Servo)
    shapes: tuple[str, ...] = COMPARED
    course: Profile | None = None

    @property
    def profiles(self) -> list[Profile]:
        """The courses to choose from: each shape at each duration up to the longest."""
        if self.course is not None:
            return [self.course]
        longest = self.limits.duration_s
        durations = [duration for duration in DURATIONS_S if duration < longest - 1e-9]
        profiles = candidates_of(self.shapes, [*durations, longest], self.limits)
        return [profile for profile in profiles if not profile.shape.caution]

    @property
    def first(self) -> Profile:
        """The course to begin with: the designed shape if available, at the longest duration."""
        longest = max((profile.duration_s for profile in self.profiles), default=0.0)
        longest_profiles = [profile for profile in self.profiles if profile.duration_s == longest]
        if not longest_profiles:
            raise InputError(f"shapes {', '.join(self.shapes)}", expected="one without a caution")
        return next(
            (profile for profile in longest_profiles if profile.shape.name == FIRST_SHAPE),
            longest_profiles[0],
        )


@dataclass(frozen=True, repr=False)
class NextTrials(FrozenRecord):
    """The next pushes, and the state of the requirements.

    Attributes
    ----------
    pushes : tuple of Push
        In the order in which they are to be done; empty if the requirements are met.
    remaining : mapping from a condition to an int
        Pushes that are still needed, including the next ones; for a condition with too few trials,
        its first set.
    targets : tuple of Target
    now, then : (targets,) arrays
        Half-width of each interval relative to the allowed one: now, as `estimate` prints it, and
        after the remaining pushes.
    met : bool
        True if all intervals are as narrow as required, a difference being detected or excluded.
    detected : bool
        True if a difference between two conditions was requested and is significant at the level of
        5 %, however often it was tested.
    enough : bool
        True if they will be met with the allowed number of trials.
    warnings : tuple of str
        Warnings of the recording's checks.

    Examples
    --------
    >>> import armimpedance as ai
    >>> first = ai.next_trials(None, conditions="relaxed")
    >>> first
    8 pushes next; remaining relaxed: 8
    >>> first.to_frame().shape
    (8, 7)
    """

    pushes: tuple[Push, ...]
    remaining: Mapping[str, int]
    targets: tuple[Target, ...]
    now: FloatArray
    then: FloatArray
    met: bool
    enough: bool = True
    detected: bool = False
    warnings: tuple[str, ...] = ()

    def to_frame(self) -> pd.DataFrame:
        """One row per push: condition, direction, course, pause."""
        import pandas as pd

        return pd.DataFrame([_row(number, push) for number, push in enumerate(self.pushes, 1)])

    def to_dict(self) -> dict[str, Any]:
        """The pushes, the remaining numbers, and each target's present and required half-width."""
        shown = [
            {
                "name": target.name,
                "now": float(target.allowed / target.scale * now),
                "wished": float(target.allowed / target.scale),
                "unit": target.unit,
            }
            for target, now in zip(self.targets, self.now, strict=True)
        ]
        return {
            "met": self.met,
            "enough": self.enough,
            "detected": self.detected,
            "warnings": list(self.warnings),
            "remaining": dict(self.remaining),
            "targets": shown,
            "pushes": [_row(number, push) for number, push in enumerate(self.pushes, 1)],
        }

    def _lines(self) -> list[str]:
        if self.met:
            return ["the wish is met"]
        left = ", ".join(f"{name}: {count}" for name, count in self.remaining.items())
        return [f"{len(self.pushes)} pushes next; remaining {left}"]

    def __repr__(self) -> str:
        return "\n".join(self._lines())

    def _repr_html_(self) -> str:
        table = self.to_frame().to_html(index=False) if self.pushes else ""
        return f"<p>{escape(self._lines()[0])}</p>{table}"


def _row(number: int, push: Push) -> dict[str, Any]:
    planar = len(push.direction) == 2
    way = {"direction_deg": push.direction_deg} if planar else {}
    if not planar:
        way = {f"direction_{axis}": u for axis, u in zip("xyz", push.direction, strict=True)}
    return {
        "push": number,
        "condition": push.condition,
        **way,
        "shape": push.profile.shape.name,
        "duration_s": push.profile.duration_s,
        "amplitude_m": push.profile.amplitude_m,
        "pause_s": push.pause_s,
    }


def next_trials(
    recording: Recording | None,
    aim: Aim,
    robot: PushingRobot,
    comfort: Comfort,
    *,
    conditions: Sequence[str] | None = None,
    count: int = 8,
    most_trials: int = 1000,
    axes: int = 2,
    seed: int = 0,
    found: Sequence[ImpedanceEstimate] | None = None,
) -> NextTrials:
    """Choose the next pushes.

    Parameters
    ----------
    recording : Recording or None
        The trials so far; None if there are none.
    aim : Aim
    robot : PushingRobot
    comfort : Comfort
    conditions : sequence of str, optional
        Requested conditions; default: the recording's.
    count : int
        Pushes to choose now.
    most_trials : int
        Limit of the number of pushes that are counted.
    axes : int
        Number of axes if nothing was measured yet.
    seed : int
        Seed of the order, which also depends on the number of trials.
    found : sequence of ImpedanceEstimate, optional
        Estimates of the recording, if the caller has them.

    Returns
    -------
    NextTrials
        The pushes, and the state of the requirements.

    Raises
    ------
    InputError
        The recording is not of returning disturbances of the hand, or a requirement has no meaning
        for it.
    """
    names = _named(recording, conditions)
    done = 0 if recording is None else recording.n_trials
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(done,)))
    if recording is None:
        return _first_set(None, names, robot, comfort, axes, done, rng)
    states = _known(recording, names)
    short = [name for name in names if name not in states]
    if short:
        return _first_set(recording, short, robot, comfort, recording.axes, done, rng)
    requested_states = tuple(states[name] for name in names)
    targets = tuple(targets_of(aim, requested_states))
    estimates = allowing(estimate(recording), recording, ("condition",)) if found is None else found
    session = ExperimentSoFar(requested_states, (), targets)
    parts = measured_parts(session, estimates)
    now = np.array([parts.get(target.name, np.nan) for target in targets])
    session, need = best_session(session, robot, most_trials, parts)
    now = np.where(np.isnan(now), _by_forecast(session), now)
    seen = np.array([_detected(target, estimates) for target in targets])
    met = bool(((now <= 1) | seen).all())
    counts = (
        [np.zeros_like(group_counts) for group_counts in need.counts] if met else list(need.counts)
    )
    pushes = _pushes(session, shared_out(counts, count), comfort, done, rng)
    remaining = {
        group_counts.name: int(c.sum())
        for group_counts, c in zip(requested_states, counts, strict=True)
    }
    enough, detected = met or need.enough, bool(seen.any())
    return NextTrials(pushes, remaining, targets, now, need.parts, met, enough, detected)


def _named(recording: Recording | None, conditions: Sequence[str] | None) -> tuple[str, ...]:
    if recording is not None:
        return conditions_of(recording, conditions)
    if not conditions:
        raise InputError("neither a recording nor conditions", expected="one of them")
    return tuple(dict.fromkeys(conditions))


def _known(recording: Recording, names: Sequence[str]) -> dict[str, SoFar]:
    states = {name: so_far(recording, name) for name in names}
    return {name: state for name, state in states.items() if state is not None}


def _first_set(
    recording: Recording | None,
    short: Sequence[str],
    robot: PushingRobot,
    comfort: Comfort,
    axes: int,
    done: int,
    rng: np.random.Generator,
) -> NextTrials:
    """A set of pushes along all lines, for conditions with too few trials."""
    profile = robot.first
    lines = lines_of(axes)
    pushes: list[Push] = []
    remaining: dict[str, int] = {}
    for name in short:
        have = 0
        if recording is not None:
            have = int((recording.trials["condition"].astype(str) == name).sum())
        sets = max(FIRST_TRIALS - have, 1) if have < FIRST_TRIALS else FIRST_TRIALS
        chosen = np.resize(rng.permutation(len(lines)), sets)
        signs = np.where(np.arange(sets) % 2, -1.0, 1.0)
        units = in_random_order(signs[:, None] * lines[chosen], comfort.most_alike, rng)
        pause_list = pauses(sets, done + len(pushes), comfort, rng)
        pushes += [
            Push(name, tuple(map(float, unit)), profile, float(pause))
            for unit, pause in zip(units, pause_list, strict=True)
        ]
        remaining[name] = sets
    none = np.zeros(0)
    return NextTrials(tuple(pushes), remaining, (), none, none, met=False)


def best_session(
    session: ExperimentSoFar, robot: PushingRobot, most_trials: int, parts: Mapping[str, float]
) -> tuple[ExperimentSoFar, Need]:
    """The course that needs fewest pushes, with their information."""
    best: tuple[ExperimentSoFar, Need] | None = None
    most = most_trials
    problem: ArmImpedanceError | None = None
    for profile in robot.profiles:
        try:
            menus: tuple[Menu, ...] = tuple(
                menu_of(state, profile, robot.servo) for state in session.known
            )
        except ArmImpedanceError as error:
            problem = error
            continue
        tried = replace(session, menus=menus)
        need = needed(tried, most, scaled_to(tried, parts))
        if best is None or _rank(need) < _rank(best[1]):
            best = tried, need
            most = max(1, min(most, need.trials)) if need.enough else most
    if best is None:
        raise problem or InputError("no course", expected="one within the robot's limits")
    return best


def _rank(need: Need) -> tuple[bool, int, float]:
    return not need.enough, need.trials, float(need.parts.max())


def measured_parts(
    session: ExperimentSoFar, estimates: Sequence[ImpedanceEstimate]
) -> dict[str, float]:
    """Half-width of each target's interval by `estimate`, relative to the allowed one."""
    named = {str(estimate.keys.get("condition")): estimate for estimate in estimates}
    parts = {}
    for target in session.targets:
        if target.column is not None:
            continue
        estimates_of_target = [named[name] for name in target.gradients]
        variance = sum(
            float(slope @ estimate.covariance @ slope)
            for slope, estimate in zip(target.gradients.values(), estimates_of_target, strict=True)
        )
        factor = target.factor(min(estimate.dof for estimate in estimates_of_target))
        parts[target.name] = factor * float(np.sqrt(variance)) / target.allowed
    return parts


def _detected(target: Target, estimates: Sequence[ImpedanceEstimate]) -> bool:
    """True if the two conditions of a difference differ significantly so far."""
    if target.power is None:
        return False
    named = {str(estimate.keys.get("condition")): estimate for estimate in estimates}
    first, second = (named[name] for name in target.gradients)
    variance = sum(
        float(slope @ named[name].covariance @ slope) for name, slope in target.gradients.items()
    )
    difference = log_size(first.stiffness) - log_size(second.stiffness)
    return target.is_detected(difference, float(np.sqrt(variance)), min(first.dof, second.dof))


def _by_forecast(session: ExperimentSoFar) -> FloatArray:
    """Predicted relative half-widths, for targets that `estimate` does not print."""
    return needed(session, 0).parts


def _pushes(
    session: ExperimentSoFar,
    counts: Sequence[Any],
    comfort: Comfort,
    done: int,
    rng: np.random.Generator,
) -> tuple[Push, ...]:
    pushes: list[Push] = []
    for state, menu, count in zip(session.known, session.menus, counts, strict=True):
        if not count.sum():
            continue
        units = in_random_order(ways(menu.lines, count, rng), comfort.most_alike, rng)
        pause_list = pauses(len(units), done + len(pushes), comfort, rng)
        pushes += [
            Push(state.name, tuple(map(float, unit)), menu.profile, float(pause))
            for unit, pause in zip(units, pause_list, strict=True)
        ]
    return tuple(pushes)
