"""The verb `next_trials`: the next pushes for a recording so far."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from math import radians

from armimpedance.core.records import Recording
from armimpedance.hand.adaptive.next_trials import (
    NextTrials,
    PushingRobot,
    next_trials as chosen_trials,
)
from armimpedance.hand.adaptive.order import Comfort
from armimpedance.hand.adaptive.show.options import NEXT
from armimpedance.hand.adaptive.target import POWER, Aim
from armimpedance.hand.planning import COMPARED, Limits, Profile, Servo
from armimpedance.hand.show.wish import DEFAULT_K_PERCENT
from armimpedance.hand.still import in_step
from armimpedance.hand.still.show import checked_response
from armimpedance.show.verbs.results import PathLike, naming, read_recording


@NEXT.function
def next_trials(
    recording: Recording | PathLike | None,
    *,
    k_percent: float | None = None,
    orientation_deg: float | None = None,
    joint_percent: float | None = None,
    reflex_percent: float | None = None,
    difference_percent: float | None = None,
    between: tuple[str, str] | None = None,
    power: float = POWER,
    conditions: str | Sequence[str] | None = None,
    count: int = 8,
    max_trials: int = 1000,
    shapes: Sequence[str] | None = None,
    amplitude_m: float = 0.005,
    max_duration_s: float = 0.3,
    max_acceleration: float = 5.3,
    most_alike: int = 2,
    rest_every: int = 40,
    despite: str | Collection[str] = (),
    seed: int = 0,
    course: Profile | None = None,
    servo: Servo | None = None,
    checks: bool = True,
) -> NextTrials:
    """Choose the next pushes of an experiment, and say how many it still needs.

    Condition, direction and course are chosen that narrow most the interval that is furthest from
    its requirement. Intervals are those that `estimate` prints, including its allowances: if a
    reflex that is not yet excluded widens K, the pushes that exclude it come next.

    Parameters
    ----------
    recording : Recording, path or None
        The trials so far; None for the first set.
    {options}
    course : Profile, optional
        The only course, such as that of the previous pushes: a session with one course is estimated
        best.
    servo : Servo, optional
        Default: the hand moves as commanded.
    checks : bool
        False leaves out the checks, which take seconds, for a robot that waits. `estimate` makes
        them at the end.

    Returns
    -------
    NextTrials
        The pushes in their order, the number that remains, and whether the requirements are met.

    Raises
    ------
    InputError
        The recording cannot be read, a check says STOP, it is not of returning disturbances of the
        hand, or a requirement has no meaning for it.

    Examples
    --------
    >>> from armimpedance.hand.adaptive.show import next_trials
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate(
    ...     "cocontraction", seed=1, conditions=["cocontraction_10"], disturbance="designed"
    ... )
    >>> next_trials(recording, k_percent=20).met
    True
    >>> next_trials(None, conditions="relaxed").remaining["relaxed"]
    8
    """
    aim = _aim(
        k_percent,
        orientation_deg,
        joint_percent,
        reflex_percent,
        difference_percent,
        between,
        power,
    )
    limits = Limits(amplitude_m, max_duration_s, max_acceleration)
    shape_names = COMPARED if shapes is None else tuple(shapes)
    with naming(recording):
        read = None if recording is None else read_recording(recording)
        marks: tuple[str, ...] = ()
        if checks and read is not None and read.perturbation == "returning":
            marks = checked_response(read, despite)
            read, _ = in_step(read)
        chosen = chosen_trials(
            read,
            aim,
            PushingRobot(limits, servo or Servo(), shape_names, course),
            Comfort(most_alike, rest_every=rest_every),
            conditions=[conditions] if isinstance(conditions, str) else conditions,
            count=count,
            most_trials=max_trials,
            seed=seed,
        )
        return replace(chosen, warnings=marks)


def _aim(
    k_percent: float | None,
    orientation_deg: float | None,
    joint_percent: float | None,
    reflex_percent: float | None,
    difference_percent: float | None,
    between: tuple[str, str] | None,
    power: float,
) -> Aim:
    requirements = (k_percent, orientation_deg, joint_percent, reflex_percent, difference_percent)
    if all(requirement is None for requirement in requirements):
        k_percent = DEFAULT_K_PERCENT
    return Aim(
        k_part=_part(k_percent),
        orientation_rad=None if orientation_deg is None else radians(orientation_deg),
        joint_part=_part(joint_percent),
        reflex_part=_part(reflex_percent),
        difference_part=_part(difference_percent),
        between=between,
        power=power,
    )


def _part(percent: float | None) -> float | None:
    return None if percent is None else percent / 100
