"""All sessions together: one table of each kind, the group's own steps, and the page of all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final

from armimpedance.app.study.chain import ChainTask, Command, Outcome, carry_out
from armimpedance.app.study.design import PLACES, StudyDesign, StudyStep
from armimpedance.app.study.gathering import (
    KEYS,
    Ended,
    ended_sessions,
    gather,
    people,
    sessions_table,
    table_names,
)
from armimpedance.app.study.judged import JudgedSession, judged_sessions, worst
from armimpedance.app.study.page.write import write_cohort
from armimpedance.app.study.participants import STORE, lay_out
from armimpedance.app.study.people_groups import (
    GroupsChange,
    Outlier,
    compare_people,
    far_from_others,
    groups_of_people,
)
from armimpedance.app.study.sessions import StudySession
from armimpedance.app.study.store import Fingerprints, Store
from armimpedance.app.study.strips import Strip, strips_of
from armimpedance.core.delimited import read_text_table
from armimpedance.core.errors import InputError
from armimpedance.show.files import table_content, write_content

# What is known of all sessions together: tables of outliers and groups of people, and the page.

#: Within the group's folder.
PAGE_FILE: Final = "index.html"
OUTLIERS_FILE: Final = "outliers.csv"
PEOPLE_FILE: Final = "people_groups.csv"


@dataclass(frozen=True)
class Cohort:
    """All sessions and what sets them apart.

    `strips`: without copies.
    """

    sessions: tuple[JudgedSession, ...]
    strips: tuple[Strip, ...]
    outliers: tuple[Outlier, ...]
    groups: tuple[GroupsChange, ...]


def cohort_of(
    ended: Sequence[Ended],
    missing: Sequence[StudySession],
    tables: Mapping[str, Path],
    people: Mapping[str, Mapping[str, str]],
) -> Cohort:
    """Judge the sessions, find outliers, and compare groups of people.

    `tables`: name -> gathered table.
    `people`: person -> column -> value.
    """
    sessions = judged_sessions(ended, missing)
    # Somebody who stands there twice counts once; what cannot be used says nothing of the others.
    numbers = {
        (one.session.participant, one.session.session): i
        for i, one in enumerate(sessions)
        if not one.copy_of and one.state not in ("unusable", "missing")
    }
    columns = list(dict.fromkeys(column for row in people.values() for column in row))
    own = [*columns, *(f"participant_{column}" for column in columns)]
    strips = strips_of(tables, numbers, own)
    persons = [one.session.participant for one in sessions]
    groups: list[GroupsChange] = []
    present = [persons[i] for i in numbers.values()]
    for column, names in groups_of_people(people, present).items():
        groups += compare_people(strips, persons, people, column, names)
    return Cohort(tuple(sessions), tuple(strips), tuple(far_from_others(strips)), tuple(groups))


def write_group_page(
    cohort: Cohort, folder: Path, design: StudyDesign, made: Sequence[str], title: str
) -> None:
    """Write the tables of outliers and of groups of people, where there are any, and the page.

    `folder`: of the group.
    `made`: files that the group's steps wrote.
    `title`: name of the study.
    """
    tables: dict[str, list[dict[str, Any]]] = {
        OUTLIERS_FILE: [_outlier_row(one, cohort.sessions) for one in cohort.outliers],
        PEOPLE_FILE: [asdict(one) for one in cohort.groups],
    }
    for name, rows in tables.items():
        (folder / name).unlink(missing_ok=True)
        if rows:
            write_content(table_content(rows), folder / name)
    write_cohort(
        folder / PAGE_FILE,
        title,
        sessions=[_session_row(one) for one in cohort.sessions],
        strips=[_strip_row(one) for one in cohort.strips],
        outliers=tables[OUTLIERS_FILE],
        groups=tables[PEOPLE_FILE],
        steps=[str(step) for step in design.steps],
        group_steps=[str(step) for step in design.group_steps],
        files=list(made),
    )


def _session_row(one: JudgedSession) -> dict[str, Any]:
    checks = {name: (c.state, c.message) for name, c in worst(one.checks).items()}
    own = {name: getattr(one, name) for name in ("name", "state", "reason", "kind", "copy_of")}
    who = {"participant": one.session.participant, "session": one.session.session}
    return {**who, **own, "report": one.report, "log": one.log, "checks": checks}


def _outlier_row(one: Outlier, sessions: Sequence[JudgedSession]) -> dict[str, Any]:
    who, strip = sessions[one.session].session, one.strip
    return {
        "participant": who.participant,
        "session": who.session,
        "table": strip.table,
        "condition": strip.condition,
        "quantity": strip.quantity,
        "value": float(strip.values[one.row]),
        "ci_low": float(strip.low[one.row]),
        "ci_high": float(strip.high[one.row]),
        "unit": strip.unit,
        "median": one.middle,
        "spreads": one.spreads,
        "p": one.p,
    }


def _strip_row(strip: Strip) -> dict[str, Any]:
    names = ("table", "condition", "quantity", "unit", "kind")
    parts = ("sessions", "values", "low", "high")
    return {name: getattr(strip, name) for name in (*names, *parts)}


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
    """Outcome of a group of sessions.

    `rows` tuple of (str, int): name of each gathered table, with its number of rows.
    `unusable`: sessions that failed or were not worked on.
    `outcome`: of the group's own steps.
    `page`: quality of all sessions, outliers, who failed and why.
    """

    folder: Path
    rows: tuple[tuple[str, int], ...]
    unusable: int
    outcome: Outcome
    page: Path


def run_group(
    sessions: Sequence[StudySession], design: StudyDesign, data: Path, out: Path, command: Command
) -> Gathered:
    """Gather the tables of all sessions, and do the group's steps with them.

    No recording is read for it.

    Parameters
    ----------
    sessions : sequence of StudySession
    design : StudyDesign
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
    people_by_name = people(data)
    names = table_names(ended, design.tables)
    folder = out / GROUP
    folder.mkdir(parents=True, exist_ok=True)
    unusable = sessions_table(ended, missing, data, folder / SESSIONS_FILE)
    rows = tuple((name, gather(name, ended, people_by_name, folder / name)) for name in names)
    design = replace(design, group_steps=design.group_steps or _default_steps(folder, names))
    places = {"recording": "", "study": str(design.folder), "participant": "", "session": ""}
    given = (folder / SESSIONS_FILE, *(folder / name for name in names))
    prints = Fingerprints()
    store = Store(out / STORE, prints)
    task = ChainTask(GROUP, design.group_steps, places, given)
    outcome = carry_out(task, store, prints, command)
    lay_out(outcome, store, out)
    cohort = cohort_of(ended, missing, {name: folder / name for name in names}, people_by_name)
    wrote = [name for one in outcome.done for name in one.result.files]
    write_group_page(cohort, folder, design, wrote, data.resolve().name)
    return Gathered(folder, rows, unusable, outcome, folder / PAGE_FILE)


def _default_steps(folder: Path, names: Sequence[str]) -> tuple[StudyStep, ...]:
    """Conditions compared over people: of each session where people came several times."""
    if COMPARED not in names:
        return ()
    table = read_text_table(folder / COMPARED)
    rows = [tuple(row.get(n) or "" for n in _NAMED) for row in table.dicts()]
    for by in (("condition",), ("condition", "session")):
        groups = [(row[0], *(row[_NAMED.index(name)] for name in by)) for row in rows]
        if len(set(groups)) == len(groups):
            return (_comparison(by),) if _enough(groups) else ()
    # Several results of one condition and session: nobody said which belong together.
    return ()


def _comparison(by: Sequence[str]) -> StudyStep:
    columns = [word for name in by for word in ("--by", name)]
    return StudyStep(
        ("compare", COMPARED, *columns, "--subjects", KEYS[0], "--out", "conditions.csv"),
    )


def _enough(groups: Sequence[tuple[str, ...]]) -> bool:
    """Return True if enough people share two groups, and the groups are not too many."""
    people: dict[tuple[str, ...], set[str]] = {}
    for person, *group in groups:
        if group[0]:
            people.setdefault(tuple(group), set()).add(person)
    members = list(people.values())
    both = (one & other for i, one in enumerate(members) for other in members[i + 1 :])
    return len(members) <= MOST_GROUPS and any(len(shared) >= FEWEST_PEOPLE for shared in both)
