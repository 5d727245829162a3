"""A page on which every trial is looked at and can be left out; the choice is saved as a list."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from armimpedance.core.records import Recording
from armimpedance.hand.still.show.linked_trials import panels, trial_data
from armimpedance.show.pages import write_html

#: Rows of the courses that the page holds.
MOST_ROWS: Final = 120_000


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
        What the session is called.
    left_out : mapping from a trial's number to a reason, optional
        What an earlier list leaves out.

    Raises
    ------
    InputError
        No onset is stated or seen.
    """
    names = dict.fromkeys(recording.trials["condition"].astype(str))
    groups = {name: {"condition": name} for name in names}
    trials, courses = trial_data(recording, groups, MOST_ROWS)
    known = left_out or {}
    trials["why"] = trials["trial"].map(known)
    write_html(
        path,
        "choice.html.jinja",
        ("shared.js", "choice.js"),
        data={"trials": trials, "courses": courses},
        more={"panels": [list(panel) for panel in panels(recording)], "title": title},
        title=title,
    )
