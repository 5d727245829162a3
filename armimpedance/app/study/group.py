"""All sessions together: one table of each kind, the group's own steps, and the page of all."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from armimpedance.app.study.chain import Command, Outcome, Task, carry_out
from armimpedance.app.study.cohort import PAGE_FILE, cohort_of, write_group_page
from armimpedance.app.study.design import PLACES, Design, Step
from armimpedance.app.study.fingerprints import Fingerprints
from armimpedance.app.study.gathering import (
    KEYS,
    ended_sessions,
    gather,
    people,
    sessions_table,
    table_names,
)
from armimpedance.app.study.participants import STORE, lay_out
from armimpedance.app.study.sessions import Session
from armimpedance.app.study.store import Store
from armimpedance.core.errors import InputError

#: Folder of the group below that of the study, and its list of sessions.
GROUP: Final = "group"
SESSIONS_FILE: Final = "sessions.csv"
#: The table whose conditions are compared where the design names no steps of the group.
COMPARED: Final = "hand.csv"
FEWEST_PEOPLE: Final = 3
#: What tells its rows apart.
_NAMED: Final = (KEYS[0], "condition", "session")
#: More groups than this have more pairs than anybody reads.
MOST_GROUPS: Final = 20


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
    page : Path
        Quality of all sessions, outliers, who failed and why.
    """

    folder: Path
    rows: tuple[tuple[str, int], ...]
    unusable: int
    outcome: Outcome
    page: Path


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
    if not ended:
        raise InputError(
            "no session was worked on", file=out, expected="the level participant first"
        )
    known = people(data)
    names = table_names(ended, design.tables)
    folder = out / GROUP
    folder.mkdir(parents=True, exist_ok=True)
    unusable = sessions_table(ended, missing, data, folder / SESSIONS_FILE)
    rows = tuple((name, gather(name, ended, known, folder / name)) for name in names)
    design = replace(design, group_steps=design.group_steps or _default_steps(folder, names))
    places = {"recording": "", "study": str(design.folder), "participant": "", "session": ""}
    given = (folder / SESSIONS_FILE, *(folder / name for name in names))
    prints = Fingerprints()
    store = Store(out / STORE, prints)
    task = Task(GROUP, design.group_steps, places, given)
    outcome = carry_out(task, store, prints, command)
    lay_out(outcome, store, out)
    cohort = cohort_of(ended, missing, {name: folder / name for name in names}, known)
    wrote = [name for one in outcome.done for name in one.result.files]
    write_group_page(cohort, folder, design, wrote, data.resolve().name)
    return Gathered(folder, rows, unusable, outcome, folder / PAGE_FILE)


def _default_steps(folder: Path, names: Sequence[str]) -> tuple[Step, ...]:
    """Conditions compared over people: of each session where people came several times."""
    if COMPARED not in names:
        return ()
    with open(folder / COMPARED, newline="", encoding="utf-8") as stream:
        rows = [tuple(row.get(n) or "" for n in _NAMED) for row in csv.DictReader(stream)]
    for by in (("condition",), ("condition", "session")):
        groups = [(row[0], *(row[_NAMED.index(name)] for name in by)) for row in rows]
        if len(set(groups)) == len(groups):
            return (_comparison(by),) if _enough(groups) else ()
    # Several results of one condition and session: nobody said which belong together.
    return ()


def _comparison(by: Sequence[str]) -> Step:
    columns = [word for name in by for word in ("--by", name)]
    return Step(
        ("compare", COMPARED, *columns, "--subjects", KEYS[0], "--out", "conditions.csv"),
    )


def _enough(groups: Sequence[tuple[str, ...]]) -> bool:
    """Whether enough people share two groups, and the groups are not too many."""
    people: dict[tuple[str, ...], set[str]] = {}
    for person, *group in groups:
        if group[0]:
            people.setdefault(tuple(group), set()).add(person)
    held = list(people.values())
    both = (one & other for i, one in enumerate(held) for other in held[i + 1 :])
    return len(held) <= MOST_GROUPS and any(len(shared) >= FEWEST_PEOPLE for shared in both)
