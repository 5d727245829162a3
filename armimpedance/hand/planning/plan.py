"""The plan: the disturbances that are compared, those that meet the requirements, and obstacles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from armimpedance.core.arrays import FrozenRecord
from armimpedance.core.errors import ArmImpedanceError, InputError, check_number
from armimpedance.core.progress import Progress
from armimpedance.hand.planning.candidate import Candidate, Wish, judge, judge_pilot
from armimpedance.hand.planning.design import Goal, Limits, check_limits, design
from armimpedance.hand.planning.pilot import Pilot
from armimpedance.hand.planning.precision import PlannedMotion, precision
from armimpedance.hand.planning.profile import Profile, Shape, write_profile
from armimpedance.hand.planning.setting import Setting
from armimpedance.hand.planning.shapes import SHAPES

if TYPE_CHECKING:
    import pandas as pd

# The disturbances that a plan compares: named shapes within limits, and new designs.

#: Durations (s) that are compared by default,
DURATIONS_S: Final = (0.15, 0.2, 0.3)
#: and shapes; without the half-sine, which no robot can make.
COMPARED: Final = ("minimum_jerk", "biphasic", "designed", "reflex_separating", "raised_cosine")
#: The name of a disturbance that is designed for a setting.
NEW: Final = "new design"
#: Half the range of delays (s) in the design of a disturbance that separates a reflex.
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

    `shape`: a name of `SHAPES`, or "all" for those that are compared.
    `durations_s`: each named shape is proposed at each duration. Default: `DURATIONS_S`.
    `reduce`: if a shape would exceed the acceleration, take a smaller amplitude. False: refuse a
    named shape that exceeds the acceleration at every duration.
    `designed`: add, as the first one, a disturbance designed for the setting and for K.
    `reflex_delay_s`: design it to separate K from a reflex of this delay, known to 15 ms.
    `progress` function (done, all): called after each start of the design.
    Raises InputError: there is no such shape, or no course keeps to the limits.
    Raises EstimationError: no start of the design converged.
    """
    durations = durations_s or DURATIONS_S
    named = _named_profiles(shape, durations, limits, reduce=reduce, needed=not designed)
    if not designed:
        return named
    goal, degree = Goal(), 5
    if reflex_delay_s is not None:
        around = (reflex_delay_s - _AROUND_S, reflex_delay_s, reflex_delay_s + _AROUND_S)
        goal, degree = Goal(around, delay_known=False), 9
    new_design = design(setting, limits, goal, degree=degree, name=NEW, progress=progress)
    return [new_design.profile, *named]


def _named_profiles(
    shape: str, durations_s: Sequence[float], limits: Limits, *, reduce: bool, needed: bool
) -> list[Profile]:
    """Named shapes at each duration; refuse them if none is possible and one is needed."""
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

    `reduce`: if the acceleration would be too large, take a smaller amplitude instead of refusing.
    Raises InputError: the message names the binding limit and a remedy.
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
    """Named shapes at each duration, with smaller amplitudes if the acceleration requires it.

    Parameters
    ----------
    names : sequence of str
        Of shapes, such as "designed".
    durations : sequence of float
        Durations, s.
    limits : Limits
        Amplitude and acceleration.

    Returns
    -------
    list of Profile
        Each shape at each duration.

    Raises
    ------
    InputError
        There is no such shape, or a course cannot be made.
    """
    return [
        within(SHAPES.named(name), replace(limits, duration_s=duration), reduce=True)
        for name in names
        for duration in durations
    ]


# Reasons why requirements cannot be met, and the binding limit.


def best_of(candidates: Sequence[Candidate]) -> Candidate | None:
    """The recommendable candidate with the fewest trials, then the smallest interval of K."""
    usable = [c for c in candidates if c.recommendable and c.trials is not None]
    return min(usable, key=lambda c: c.cost, default=None)


def obstacle(setting: Setting, wish: Wish, limits: Limits, candidates: Sequence[Candidate]) -> str:
    """Reason why no candidate meets the requirements, with the binding limit; empty if one does."""
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
    """Sentence on the limit whose relaxation saves most trials, by a design for each."""
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
            new_design = design(setting, changed, Goal(), starts=4)
            trials = wish.trials(precision(PlannedMotion(setting, new_design.profile)))
        except ArmImpedanceError:
            continue
        if trials is not None:
            needed[name] = trials
    if not needed:
        return "no change of amplitude, duration or acceleration helps: the noise is too large"
    name = min(needed, key=lambda key: needed[key])
    return f"what binds most: {name} and a disturbance designed for it would need {needed[name]:,}"


#: Number of trials for the precision in a table.
_TRIALS = 40


@dataclass(frozen=True, repr=False)
class Plan(FrozenRecord):
    """All candidates for the stated requirements.

    Attributes
    ----------
    setting : Setting
        Arm, noise and servo of the plan.
    wish : Wish
    limits : Limits
    delay_s : float
        Delay of the reflex for the bias.
    candidates : tuple of Candidate
    obstacle : str
        Why the requirements cannot be met; empty if they can.
    warnings : tuple of str
        Warnings of the pilot's checks.

    Examples
    --------
    >>> import armimpedance as ai
    >>> wish = ai.plan(k_percent=10, shape="minimum_jerk", duration_s=0.3)
    >>> wish.best.trials, wish.obstacle
    (200, '')
    """

    setting: Setting
    wish: Wish
    limits: Limits
    delay_s: float
    candidates: tuple[Candidate, ...]
    obstacle: str = ""
    warnings: tuple[str, ...] = ()

    @property
    def best(self) -> Candidate | None:
        """The recommendable candidate with the fewest trials, then the smallest interval of K."""
        return best_of(self.candidates)

    @property
    def profile(self) -> Profile | None:
        """The course to run: a new design, else the course with the smallest interval of K."""
        able = [
            (c.name != NEW, c.precision.k_part(_TRIALS), c.profile)
            for c in self.candidates
            if c.profile is not None and c.precision is not None and c.recommendable
        ]
        return min(able, key=lambda ranked: ranked[:2])[2] if able else None

    def write_profile(self, path: str | Path) -> Profile:
        """Write `profile` as CSV at 1 kHz, and return it.

        Raises
        ------
        InputError
            No candidate can be recommended.
        """
        if self.profile is None:
            raise InputError("no profile to write: none of these can be recommended")
        write_profile(self.profile, path)
        return self.profile

    def to_frame(self, trials: int = _TRIALS) -> pd.DataFrame:
        """One row per candidate: its course, the trials that it needs, and K's interval.

        Parameters
        ----------
        trials : int
            Number of trials for the column `k_part`, the half-width of K's 95 % interval relative
            to K.
        """
        import pandas as pd

        return pd.DataFrame([_row(c, trials) for c in self.candidates])

    def to_dict(self) -> dict[str, Any]:
        """The requirements, the obstacle, and the rows of `to_frame`."""
        rows = [_row(c, _TRIALS) for c in self.candidates]
        return {
            "wish": self.wish.text,
            "obstacle": self.obstacle,
            "warnings": list(self.warnings),
            "candidates": rows,
        }

    def _head(self) -> str:
        best = self.best
        if self.obstacle or best is None:
            return f"{self.wish.text}: cannot be met, {self.obstacle}"
        head = (
            f"{self.wish.text}: {best.trials:,} trials with {best.name} of {best.duration_s:.3g} s"
        )
        return f"{head}; {best.doubt}" if best.doubt else head

    def __repr__(self) -> str:
        ranked = sorted(
            (c for c in self.candidates if c.recommendable and c.trials is not None),
            key=lambda c: c.cost,
        )
        lines = [f"{c.name}, {c.duration_s:.3g} s: {c.trials:,} trials" for c in ranked[:10]]
        return "\n".join([self._head(), *lines])

    def _repr_html_(self) -> str:
        return (
            f"<p>{escape(self._head())}</p>{self.to_frame().to_html(float_format='{:.3g}'.format)}"
        )


def make_plan(
    setting: Setting,
    profiles: Sequence[Profile],
    wish: Wish,
    limits: Limits,
    *,
    delay_s: float = 0.055,
    conditions: int = 1,
    pilot: Pilot | None = None,
    progress: Progress | None = None,
) -> Plan:
    """Judge profiles, and a pilot's own disturbance if there is a pilot.

    `limits`: limits that the profiles already keep.
    `conditions`: number of conditions with as many trials in a session.
    `delay_s`: delay of the reflex for the bias.
    `pilot`: pilot whose own disturbance is put first, as it was recorded.
    `progress` function (done, all): called after each profile.
    Raises InputError: a delay outside of 10 to 200 ms, or no condition.
    """
    check_number(conditions, f"{conditions} conditions", low=1)
    check_number(1e3 * delay_s, f"a reflex {1e3 * delay_s:g} ms late", low=10, high=200, unit="ms")
    candidates = [] if pilot is None else [judge_pilot(pilot, wish, conditions)]
    for done, profile in enumerate(profiles, start=1):
        candidates.append(judge(setting, profile, wish, delay_s, conditions))
        if progress is not None:
            progress(done, len(profiles))
    why = obstacle(setting, wish, limits, candidates)
    return Plan(setting, wish, limits, delay_s, tuple(candidates), why)


def _row(candidate: Candidate, trials: int) -> dict[str, Any]:
    precision, low_high = candidate.precision, candidate.bias
    return {
        "shape": candidate.name,
        "duration_s": candidate.duration_s,
        "amplitude_m": candidate.amplitude_m,
        "trials": candidate.trials,
        "k_part": None if precision is None else precision.k_part(trials),
        "reflex_bias_low": low_high[0],
        "reflex_bias_high": low_high[1],
        "recommended": candidate.recommendable,
        "problem": candidate.problem,
    }
