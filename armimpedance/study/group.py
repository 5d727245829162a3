"""All sessions together: one table of each kind, and the group's own steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from armimpedance.errors import InputError
from armimpedance.study.chain import Command, Outcome, Task, carry_out
from armimpedance.study.design import PLACES, Design
from armimpedance.study.fingerprints import Fingerprints
from armimpedance.study.gathering import (
    ended_sessions,
    gather,
    people,
    sessions_table,
    table_names,
)
from armimpedance.study.participants import STORE, lay_out
from armimpedance.study.sessions import Session
from armimpedance.study.store import Store

#: Folder of the group below that of the study, and its list of sessions.
GROUP: Final = "group"
SESSIONS_FILE: Final = "sessions.csv"


@dataclass(frozen=True)
class Gathered:
    """What a group came to.

    Attributes
    ----------
    folder : Path
    rows : tuple of (str, int)
        Name of each gathered table, with its number of rows.
    unusable : int
        Sessions that failed or were not worked on.
    outcome : Outcome
        Of the group's own steps.
    """

    folder: Path
    rows: tuple[tuple[str, int], ...]
    unusable: int
    outcome: Outcome


def run_group(
    sessions: Sequence[Session], design: Design, data: Path, out: Path, command: Command
) -> Gathered:
    """Gather the tables of all sessions, and do the group's steps with them.

    No recording is read for it.

    Parameters
    ----------
    sessions : sequence of Session
    design : Design
    data, out : Path
        Folders of the data and of the study.
    command : function
        Runs one command.

    Returns
    -------
    Gathered

    Raises
    ------
    InputError
        The table of people is wrong, or no session has a table that the design names.
    """
    for step in design.group_steps:
        if any(step.names(place) for place in PLACES if place != "study"):
            raise InputError(f"the group's step {str(step)!r}", expected="names of tables; {study}")
    ended, missing = ended_sessions(sessions, out)
    known = people(data)
    names = table_names(ended, design.tables)
    folder = out / GROUP
    folder.mkdir(parents=True, exist_ok=True)
    unusable = sessions_table(ended, missing, data, folder / SESSIONS_FILE)
    rows = tuple((name, gather(name, ended, known, folder / name)) for name in names)
    places = {"recording": "", "study": str(design.folder), "participant": "", "session": ""}
    given = (folder / SESSIONS_FILE, *(folder / name for name in names))
    prints = Fingerprints()
    store = Store(out / STORE, prints)
    task = Task(GROUP, design.group_steps, places, given)
    outcome = carry_out(task, store, prints, command)
    lay_out(outcome, store, out)
    return Gathered(folder, rows, unusable, outcome)
