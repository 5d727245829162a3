"""The disturbances that a plan compares: named shapes within limits, and new designs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.core.progress import Progress
from armimpedance.hand.planning.design import Goal, Limits, design
from armimpedance.hand.planning.profile import Profile, Shape
from armimpedance.hand.planning.setting import Setting
from armimpedance.hand.planning.shapes import SHAPES

#: Durations (s) that are compared where none is asked for.
DURATIONS_S: Final = (0.15, 0.2, 0.3)
#: And these shapes; a half-sine no robot makes.
COMPARED: Final = ("minimum_jerk", "biphasic", "designed", "reflex_separating", "raised_cosine")
#: The name of a disturbance that is designed for a setting.
NEW: Final = "new design"
#: Half the range of delays (s) for which a disturbance that tells a reflex apart is designed.
_AROUND_S: Final = 0.015


def proposed_profiles(
    setting: Setting,
    limits: Limits,
    *,
    shape: str = "all",
    durations_s: Sequence[float] | None = None,
    reduce: bool = True,
    designed: bool = False,
    reflex_delay_s: float | None = None,
    progress: Progress | None = None,
) -> list[Profile]:
    """The disturbances that a plan compares.

    Parameters
    ----------
    setting : Setting
    limits : Limits
    shape : str
        A name of `SHAPES`, or "all" for those that are compared.
    durations_s : sequence of float, optional
        Each named shape is proposed at each duration. Default: `DURATIONS_S`.
    reduce : bool
        Where a shape would exceed the acceleration, take a smaller amplitude; False refuses it
        where one shape was named and it exceeds the acceleration at every duration.
    designed : bool
        Put first a disturbance that is designed for the setting and for K.
    reflex_delay_s : float, optional
        Design it for K and a reflex of this delay apart; the delay is known to 15 ms.
    progress : function (done, all), optional
        Called after each start of the design.

    Returns
    -------
    list of Profile

    Raises
    ------
    InputError
        There is no such shape, or no course keeps to the limits.
    EstimationError
        No start of the design led anywhere.
    """
    durations = durations_s or DURATIONS_S
    named = _named_profiles(shape, durations, limits, reduce=reduce, needed=not designed)
    if not designed:
        return named
    goal, degree = Goal(), 5
    if reflex_delay_s is not None:
        around = (reflex_delay_s - _AROUND_S, reflex_delay_s, reflex_delay_s + _AROUND_S)
        goal, degree = Goal(around, delay_known=False), 9
    made = design(setting, limits, goal, degree=degree, name=NEW, progress=progress)
    return [made.profile, *named]


def _named_profiles(
    shape: str, durations_s: Sequence[float], limits: Limits, *, reduce: bool, needed: bool
) -> list[Profile]:
    """Named shapes at each duration; where none is possible and one is needed, it is refused."""
    if shape == "all":
        return candidates_of(COMPARED, durations_s, limits)
    if reduce:
        return candidates_of([shape], durations_s, limits)
    profiles, refused = [], None
    for duration in durations_s:
        try:
            at = replace(limits, duration_s=duration)
            profiles.append(within(SHAPES.named(shape), at, reduce=False))
        except InputError as error:
            refused = error
    if refused is not None and needed and not profiles:
        raise refused
    return profiles


def within(shape: Shape, limits: Limits, *, reduce: bool) -> Profile:
    """A shape at the limits' amplitude and duration.

    Parameters
    ----------
    shape : Shape
    limits : Limits
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
        within(SHAPES.named(name), replace(limits, duration_s=duration), reduce=True)
        for name in names
        for duration in durations
    ]
