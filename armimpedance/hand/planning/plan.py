"""The plan: which disturbances meet a wish, with how many trials, and if none does, why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from armimpedance.core.arrays import FrozenRecord
from armimpedance.core.errors import InputError
from armimpedance.core.progress import Progress
from armimpedance.hand.planning.candidate import Candidate, judge, judge_pilot
from armimpedance.hand.planning.design import Limits
from armimpedance.hand.planning.obstacle import best_of, obstacle
from armimpedance.hand.planning.pilot import Pilot
from armimpedance.hand.planning.profile import Profile
from armimpedance.hand.planning.profile_csv import write_profile
from armimpedance.hand.planning.proposals import NEW
from armimpedance.hand.planning.setting import Setting
from armimpedance.hand.planning.wish import Wish

if TYPE_CHECKING:
    import pandas as pd

#: Trials for which a table shows the precision.
_TRIALS = 40


@dataclass(frozen=True, repr=False)
class Plan(FrozenRecord):
    """All candidates under one wish.

    Attributes
    ----------
    setting : Setting
        Arm, noise and servo that were planned for.
    wish : Wish
    limits : Limits
    delay_s : float
        Delay of the reflex that was asked about.
    candidates : tuple of Candidate
    obstacle : str
        Why the wish cannot be met; empty: it can.
    warnings : tuple of str
        What the checks of the pilot said.

    Examples
    --------
    >>> import armimpedance as ai
    >>> wish = ai.plan(k_percent=10, shape="minimum_jerk", duration_s=0.3)
    >>> wish.best.trials, wish.obstacle
    (136, '')
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
        """The course to run: a new design, or else that with the smallest interval of K."""
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
        """One row a candidate: its course, the trials that the wish needs, and K's interval.

        Parameters
        ----------
        trials : int
            The column `k_part` is the half-width of K's 95 % interval, as a part of K, for so many.
        """
        import pandas as pd

        return pd.DataFrame([_row(c, trials) for c in self.candidates])

    def to_dict(self) -> dict[str, Any]:
        """The wish, what stands in its way, and the rows of `to_frame`."""
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
    pilot: Pilot | None = None,
    progress: Progress | None = None,
) -> Plan:
    """Judge profiles, and a pilot's own where there is one.

    Parameters
    ----------
    setting : Setting
    profiles : sequence of Profile
    wish : Wish
    limits : Limits
        Profiles are within them already.
    delay_s : float
        Delay of the reflex that is asked about.
    pilot : Pilot, optional
        Pilot whose own disturbance is put first, as it was recorded.
    progress : function (done, all), optional
        Called after each profile.

    Returns
    -------
    Plan

    Raises
    ------
    InputError
        A delay outside of 10 to 200 ms.
    """
    if not 0.01 <= delay_s <= 0.2:
        raise InputError(f"a reflex {1e3 * delay_s:g} ms late", expected="10 to 200 ms")
    candidates = [] if pilot is None else [judge_pilot(pilot, wish)]
    for done, profile in enumerate(profiles, start=1):
        candidates.append(judge(setting, profile, wish, delay_s))
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
