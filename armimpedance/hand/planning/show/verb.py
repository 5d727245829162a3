"""The verb `plan`: trials needed, the best disturbance, the effect of a reflex."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from math import radians
from pathlib import Path
from typing import Any, Literal

from armimpedance.core.errors import InputError
from armimpedance.core.progress import Progress
from armimpedance.core.records import Recording
from armimpedance.hand.planning.candidate import Wish
from armimpedance.hand.planning.design import Limits
from armimpedance.hand.planning.noise_level import noise_named
from armimpedance.hand.planning.pilot import pilot_of
from armimpedance.hand.planning.plan import Plan, make_plan, proposed_profiles
from armimpedance.hand.planning.setting import PlannedArm, Servo, Setting
from armimpedance.hand.planning.show.options import PLAN
from armimpedance.hand.show.estimates import read_results
from armimpedance.hand.show.quantities import condition_of
from armimpedance.hand.show.wish import DEFAULT_K_PERCENT
from armimpedance.hand.still import in_step
from armimpedance.hand.still.show import checked_response
from armimpedance.show.verbs.results import PathLike, naming, of_condition, read_recording


@PLAN.function
def plan(
    *,
    k_percent: float | None = None,
    orientation_deg: float | None = None,
    max_trials: int = 1000,
    conditions: int = 1,
    pilot: Recording | PathLike | None = None,
    results: PathLike | None = None,
    condition: str | None = None,
    noise: str | None = None,
    force_by: Literal["limb", "device"] | None = None,
    despite: str | Collection[str] = (),
    shape: str = "all",
    duration_s: float | None = None,
    amplitude_m: float | None = None,
    max_acceleration: float = 5.3,
    design: bool = False,
    separate_reflex: bool = False,
    reflex_delay_s: float = 0.055,
    servo: Servo | None = None,
    progress: Progress | None = None,
) -> Plan:
    """Plan an experiment: trials needed, the best disturbance, the effect of a reflex.

    Arm and noise are those of a pilot recording, or the arm of a row of results, or a relaxed arm
    of 70 kg body mass with nominal noise.

    Parameters
    ----------
    {options}
    servo : Servo, optional
        Default: the hand moves as commanded.
    progress : function (done, all), optional
        Called with the number done and the total.

    Returns
    -------
    Plan
        Its attribute `obstacle` says why the requirements cannot be met; empty if they can.

    Raises
    ------
    InputError
        A file cannot be read, an option has no meaning here or is out of range, or no course keeps
        to the limits.
    NotIdentifiableError
        The motion of the pilot does not determine its parameters.
    EstimationError
        No start of the design converged.

    Examples
    --------
    >>> from armimpedance.hand.planning.show import plan
    >>> plan(k_percent=10, shape="minimum_jerk", duration_s=0.2)
    K within 10 %: 112 trials with minimum_jerk of 0.2 s
    minimum_jerk, 0.2 s: 112 trials
    """
    _refuse_without_effect(pilot, results, condition, noise, force_by)
    wish = _wish(k_percent, orientation_deg, max_trials)
    measured, marks = (None, ()) if pilot is None else _pilot(pilot, condition, force_by, despite)
    of_pilot = None if measured is None else measured.setting
    setting = _setting(of_pilot, results, condition, noise, servo or Servo())
    limits = _limits(amplitude_m, duration_s, max_acceleration)
    profiles = proposed_profiles(
        setting,
        limits,
        shape=shape,
        durations_s=None if duration_s is None else (duration_s,),
        reduce=amplitude_m is None,
        designed=design or separate_reflex,
        reflex_delay_s=reflex_delay_s if separate_reflex else None,
        progress=progress,
    )
    result = make_plan(
        setting,
        profiles,
        wish,
        limits,
        delay_s=reflex_delay_s,
        conditions=conditions,
        pilot=measured,
        progress=progress,
    )
    return replace(result, warnings=marks)


def _pilot(
    pilot: Recording | PathLike,
    condition: str | None,
    force_by: Literal["limb", "device"] | None,
    despite: str | Collection[str],
) -> tuple[Any, tuple[str, ...]]:
    """Fit the pilot, and collect its warnings and marks."""
    with naming(pilot):
        recording = read_recording(pilot, force_by=force_by)
        is_there = condition in (None, *recording.trials["condition"].astype(str))
        marks: tuple[str, ...] = ()
        if is_there and recording.perturbation == "returning":
            marks = checked_response(of_condition(recording, condition), despite)
        recording, _ = in_step(recording)
        fitted = pilot_of(recording, condition)
        return fitted, (*marks, *fitted.warnings)


def _limits(amplitude_m: float | None, duration_s: float | None, max_acceleration: float) -> Limits:
    return Limits(
        0.005 if amplitude_m is None else amplitude_m,
        0.3 if duration_s is None else duration_s,
        max_acceleration,
    )


def _wish(k_percent: float | None, orientation_deg: float | None, max_trials: int) -> Wish:
    if k_percent is None and orientation_deg is None:
        k_percent = DEFAULT_K_PERCENT
    return Wish(
        None if k_percent is None else k_percent / 100,
        None if orientation_deg is None else radians(orientation_deg),
        max_trials,
    )


def _setting(
    pilot: Setting | None,
    results: PathLike | None,
    condition: str | None,
    noise: str | None,
    servo: Servo,
) -> Setting:
    """Arm and noise of the pilot, or the arm of a row of results, or a relaxed arm."""
    if pilot is not None:
        return replace(pilot, servo=servo)
    if results is not None:
        return Setting(_arm_of_results(Path(results), condition), noise_named(noise), servo)
    return Setting(noise=noise_named(noise), servo=servo)


def _refuse_without_effect(
    pilot: object, results: object, condition: object, noise: object, force_by: object
) -> None:
    if pilot is not None and results is not None:
        raise InputError("a pilot and results", expected="one of them")
    if pilot is not None and noise is not None:
        raise InputError(
            "a noise level with a pilot", expected="one of them: a pilot brings its own"
        )
    if condition is not None and pilot is None and results is None:
        raise InputError("a condition without a pilot or results", expected="one of them")
    if force_by is not None and pilot is None:
        raise InputError("whose force it is, without a pilot", expected="a Kinarm exam as pilot")


def _arm_of_results(file: Path, condition: str | None) -> PlannedArm:
    rows = read_results(file)
    for row in rows:
        if condition is None or condition == row.keys.get("condition"):
            with naming(file):
                return PlannedArm.of(row, condition_of(row))
    examples = ", ".join(str(row.keys.get("condition")) for row in rows[:5])
    raise InputError(f"no condition {condition!r}", file=file, expected=f"such as {examples}")
