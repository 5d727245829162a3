"""Every trial of a session for looking: the courses of a group, one trial picked out everywhere."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
import pandas as pd

from armimpedance.conventions import AXES
from armimpedance.files import condition_of
from armimpedance.pages.page import Linked
from armimpedance.plots import aligned_group, outlying_trials
from armimpedance.records import ImpedanceEstimate, Recording

if TYPE_CHECKING:
    import altair as alt

#: Points of one trial that the page holds: what passes the fit's kernel needs no more. Of very many
#: trials fewer are held, so that a page stays small.
POINTS: Final = 60
MOST_ROWS: Final = 50_000
PANEL_PX: Final = (420, 170)


def trial_data(
    recording: Recording, estimates: Sequence[ImpedanceEstimate]
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Which trials there are, and their courses.

    Parameters
    ----------
    recording : Recording
    estimates : sequence of ImpedanceEstimate
        Whose groups are shown.

    Returns
    -------
    trials : DataFrame
        Columns trial, group, direction, look ("outlier", "left out" or "used").
    courses : DataFrame
        Columns trial, ms, and per axis moved (mm, or mrad) and pushed (N, or Nm).
    """
    heads, courses = [], []
    points = max(12, min(POINTS, MOST_ROWS // recording.n_trials))
    for estimate in estimates:
        aligned = aligned_group(recording, estimate.keys)
        outliers = set(outlying_trials(recording, estimate.keys))
        names = aligned.direction_names
        every = max(1, round(len(aligned.lag_s) / points))
        for t, trial in enumerate(aligned.trial.tolist()):
            known = aligned.direction is not None and len(names) > 0
            direction = names[int(aligned.direction[t])] if known else "all"  # type: ignore[index]
            look = "outlier" if trial in outliers else "used" if aligned.used[t] else "left out"
            heads.append((trial, condition_of(estimate), direction, look))
            block = np.column_stack(
                [
                    np.full(len(aligned.lag_s[::every]), trial),
                    1e3 * aligned.lag_s[::every],
                    1e3 * aligned.moved[t, ::every],
                    aligned.pushed[t, ::every],
                ]
            )
            courses.append(block)
    axes = range(1, recording.axes + 1)
    columns = ["trial", "ms", *(f"moved_{i}" for i in axes), *(f"pushed_{i}" for i in axes)]
    frame = pd.DataFrame(np.concatenate(courses), columns=columns).astype({"trial": int})
    return pd.DataFrame(heads, columns=["trial", "group", "direction", "look"]), frame


def linked_trials(recording: Recording, told: pd.DataFrame, trials: str, courses: str) -> Linked:
    """Displacement and force of every trial of the chosen group.

    Parameters
    ----------
    recording : Recording
    told : DataFrame
        Which trials there are, as `trial_data` tells.
    trials, courses : str
        Names of the page's data that hold both tables of `trial_data`.

    Returns
    -------
    Linked
    """
    import altair as alt

    chosen = alt.param(name="chosen", value="")
    trial = alt.param(name="trial", value=-1)
    first = str(told["group"].iloc[0])
    directions = sorted(told["direction"].unique(), key=_angle)
    color = alt.Color(
        "direction:N",
        title="direction",
        sort=directions,
        scale=alt.Scale(domain=directions, scheme="turbo"),
    )
    base = (
        alt.Chart(alt.NamedData(courses))
        .transform_lookup(
            lookup="trial",
            from_=alt.LookupData(
                data=alt.NamedData(trials), key="trial", fields=["group", "direction", "look"]
            ),
        )
        .transform_filter(f"datum.group == (chosen == '' ? {first!r} : chosen)")
        .transform_calculate(
            text="'trial ' + datum.trial + ', ' + datum.direction + ', ' + datum.look"
        )
        .encode(color=color)
    )
    hand = recording.kind == "hand"
    units = ("mm", "N") if hand else ("mrad", "Nm")
    rows = [
        alt.hconcat(
            _panel(base, f"moved_{i + 1}", f"displacement {_axis(hand, i)} ({units[0]})"),
            _panel(base, f"pushed_{i + 1}", f"force {_axis(hand, i)} ({units[1]})"),
        )
        for i in range(recording.axes)
    ]
    picture = alt.vconcat(*rows).add_params(chosen, trial)
    return Linked(
        name="trials",
        spec=picture.to_dict(),
        description=f"Displacement and force of every trial of one group, {first} unless another "
        "is chosen, around the onset.",
        caption="Every trial of the chosen group, less its mean before the onset; force of the "
        "limb on the device. Dashed: unlike the others, or left out. Point at a line to read its "
        "number; choose it to see it in all panels.",
    )


def _angle(direction: str) -> tuple[float, str]:
    """Directions in the order of their angles, other names after them."""
    number = direction.rstrip("°")
    return (float(number) if number.replace(".", "").isdigit() else float("inf"), direction)


def _axis(hand: bool, i: int) -> str:
    return f"along {AXES[i]}" if hand else f"of joint {i + 1}"


def _panel(base: alt.Chart, column: str, title: str) -> alt.Chart:
    import altair as alt

    width, height = PANEL_PX
    return (
        base.mark_line(clip=True)
        .encode(
            x=alt.X("ms:Q", title="time from onset (ms)", scale=alt.Scale(nice=False)),
            y=alt.Y(f"{column}:Q", title=title),
            detail="trial:N",
            strokeDash=alt.condition("datum.look == 'used'", alt.value([1, 0]), alt.value([5, 3])),
            strokeWidth=alt.condition("datum.trial == trial", alt.value(3), alt.value(1.2)),
            opacity=alt.condition(
                "trial == -1 || datum.trial == trial", alt.value(0.9), alt.value(0.15)
            ),
            tooltip=alt.Tooltip("text:N"),
        )
        .properties(width=width, height=height)
    )
