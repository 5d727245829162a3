"""Linked pictures of every trial of a session, for inspection and for leaving trials out."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import pandas as pd

from armimpedance.core.conventions import AXES
from armimpedance.core.records import Recording
from armimpedance.hand.still.show.aligned_trials import aligned_group, outlying_trials
from armimpedance.hand.still.show.linked import built_unchecked
from armimpedance.show.pages import Linked, write_html

if TYPE_CHECKING:
    import altair as alt

    from armimpedance.hand.still.show.aligned_trials import Aligned

#: Points of one trial on the page: enough for signals smoothed by the fit's kernel. With very many
#: trials fewer points are kept, so that a page stays small.
POINTS: Final = 60
MOST_ROWS: Final = 50_000
PANEL_PX: Final = (420, 170)


def trial_data(
    recording: Recording,
    groups: Mapping[str, Mapping[str, Any]],
    most_rows: int = MOST_ROWS,
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Table of the trials, and table of their courses.

    `groups`: columns of the trial table and their values.
    `most_rows`: rows of the courses; with very many trials each has fewer points.
    Returns: `trials`: columns trial, group, direction, look ("outlier", "left out" or "used").
    `courses`: columns trial, ms, and per axis moved (mm, or mrad) and pushed (N, or N m).
    """
    heads: list[tuple[int, str, str, str]] = []
    courses = []
    points = max(12, min(POINTS, most_rows // recording.n_trials))
    for name, keys in groups.items():
        aligned = aligned_group(recording, keys)
        outliers = set(outlying_trials(recording, keys))
        step = slice(None, None, max(1, round(len(aligned.lag_s) / points)))
        for t, trial in enumerate(aligned.trial.tolist()):
            look = "outlier" if trial in outliers else "used" if aligned.used[t] else "left out"
            heads.append((trial, name, _direction(aligned, t), look))
            ms = 1e3 * aligned.lag_s[step]
            moved, pushed = 1e3 * aligned.moved[t, step], aligned.pushed[t, step]
            courses.append(np.column_stack([np.full(len(ms), trial), ms, moved, pushed]))
    axes = range(1, recording.axes + 1)
    columns = ["trial", "ms", *(f"moved_{i}" for i in axes), *(f"pushed_{i}" for i in axes)]
    frame = pd.DataFrame(np.concatenate(courses), columns=columns).astype({"trial": int})
    return pd.DataFrame(heads, columns=["trial", "group", "direction", "look"]), frame


def _direction(aligned: Aligned, row: int) -> str:
    """Name of a trial's direction; "all" if none is known."""
    if aligned.direction is None or not aligned.direction_names:
        return "all"
    return aligned.direction_names[int(aligned.direction[row])]


def panels(recording: Recording) -> list[tuple[str, str]]:
    """Columns of the courses and their labels: per axis displacement, then force."""
    hand = recording.kind == "hand"
    units = {"moved": ("displacement", "mm" if hand else "mrad"), "pushed": ("force", "N")}
    if not hand:
        units["pushed"] = ("torque", "N m")
    return [
        (f"{column}_{i + 1}", f"{what} {_axis(hand, i)} ({unit})")
        for i in range(recording.axes)
        for column, (what, unit) in units.items()
    ]


@built_unchecked
def linked_trials(
    recording: Recording, trial_table: pd.DataFrame, trials: str, courses: str
) -> Linked:
    """Displacement and force of every trial of the chosen group.

    `trial_table`: table of the trials from `trial_data`.
    `trials`, `courses`: names of the page's data that hold both tables of `trial_data`.
    """
    import altair as alt

    chosen = alt.param(name="chosen", value="")
    trial = alt.param(name="trial", value=-1)
    first = str(trial_table["group"].iloc[0])
    directions = sorted(trial_table["direction"].unique(), key=_angle)
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
    drawn = [_panel(base, *panel) for panel in panels(recording)]
    picture = alt.concat(*drawn, columns=2).add_params(chosen, trial)
    return Linked(
        name="trials",
        spec=picture.to_dict(validate=False),
        description=f"Displacement and force of every trial of one group, {first} unless another "
        "is chosen, around the onset.",
        caption="Every trial of the chosen group, less its mean before the onset; force of the "
        "limb on the device. Dashed: unlike the others, or left out. Point at a line to read its "
        "number; choose it to see it in all panels.",
        numbers=courses,
    )


def _angle(direction: str) -> tuple[float, str]:
    """Sort key: directions by their angles, other names after them."""
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


# A page for looking at every trial and leaving trials out; the choice is saved as a list.

#: Most rows of the courses on the page.
MOST_ROWS_TO_CHOOSE: Final = 120_000


def write_choice(
    recording: Recording, path: str | Path, title: str, left_out: Mapping[int, str] | None = None
) -> None:
    """Write the page of all trials of a session, whole or not at all.

    Parameters
    ----------
    recording : Recording
    path : path
        The file; its name ends in .html.
    title : str
        Name of the session.
    left_out : mapping from a trial's number to a reason, optional
        Trials that an earlier list leaves out.

    Raises
    ------
    InputError
        No onset is stated or detected.
    """
    names = dict.fromkeys(recording.trials["condition"].astype(str))
    groups = {name: {"condition": name} for name in names}
    trials, courses = trial_data(recording, groups, MOST_ROWS_TO_CHOOSE)
    reasons = left_out or {}
    trials["why"] = trials["trial"].map(reasons)
    write_html(
        path,
        "choice.html.jinja",
        ("shared.js", "choice.js"),
        data={"trials": trials, "courses": courses},
        more={"panels": [list(panel) for panel in panels(recording)], "title": title},
        title=title,
    )
