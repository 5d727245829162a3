"""Why a wish cannot be met, and which limit stands in the way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from armimpedance.core.errors import ArmImpedanceError, InputError
from armimpedance.hand.planning.candidate import Candidate
from armimpedance.hand.planning.design import Goal, Limits, check_limits, design
from armimpedance.hand.planning.motion import PlannedMotion
from armimpedance.hand.planning.precision import precision
from armimpedance.hand.planning.setting import Setting
from armimpedance.hand.planning.wish import Wish


def best_of(candidates: Sequence[Candidate]) -> Candidate | None:
    """The recommendable candidate with the fewest trials, then the smallest interval of K."""
    usable = [c for c in candidates if c.recommendable and c.trials is not None]
    return min(usable, key=lambda c: c.cost, default=None)


def obstacle(setting: Setting, wish: Wish, limits: Limits, candidates: Sequence[Candidate]) -> str:
    """Why no candidate meets the wish, and the limit that costs most; empty: one meets it."""
    best = best_of(candidates)
    if best is not None and best.trials is not None and best.trials <= wish.most_trials:
        return ""
    problems = [c.problem for c in candidates if c.problem]
    cautions = [note for c in candidates if not c.recommendable for note in c.notes]
    if best is None and (problems or cautions):
        return (problems or cautions)[0]
    shown = "millions of" if best is None else f"{best.trials:,}"
    needs = f"{wish.text} needs {shown} trials, more than {wish.most_trials:,}"
    return f"{needs}; {_binding_limit(setting, wish, limits)}"


def _binding_limit(setting: Setting, wish: Wish, limits: Limits) -> str:
    """The limit whose loosening saves most trials, tried on disturbances designed for each."""
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
            made = design(setting, changed, Goal(), starts=4)
            trials = wish.trials(precision(PlannedMotion(setting, made.profile)))
        except ArmImpedanceError:
            continue
        if trials is not None:
            needed[name] = trials
    if not needed:
        return "no change of amplitude, duration or acceleration helps: the noise is too large"
    name = min(needed, key=lambda key: needed[key])
    return f"what binds most: {name} and a disturbance designed for it would need {needed[name]:,}"
