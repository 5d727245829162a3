"""What is known of all sessions together: tables of outliers and groups of people, and the page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from armimpedance.app.study.design import Design
from armimpedance.app.study.gathering import Ended
from armimpedance.app.study.judged import Judged, judged_sessions, worst
from armimpedance.app.study.outliers import Outlier, far_from_others
from armimpedance.app.study.page.write import write_cohort
from armimpedance.app.study.people_groups import GroupsChange, compare_people, groups_of_people
from armimpedance.app.study.sessions import Session
from armimpedance.app.study.strips import Strip, strips_of
from armimpedance.show.files import table_content, write_content

#: Within the group's folder.
PAGE_FILE: Final = "index.html"
OUTLIERS_FILE: Final = "outliers.csv"
PEOPLE_FILE: Final = "people_groups.csv"


@dataclass(frozen=True)
class Cohort:
    """All sessions and what sets them apart.

    Attributes
    ----------
    sessions : tuple of Judged
    strips : tuple of Strip
        Without copies.
    outliers : tuple of Outlier
    groups : tuple of GroupsChange
    """

    sessions: tuple[Judged, ...]
    strips: tuple[Strip, ...]
    outliers: tuple[Outlier, ...]
    groups: tuple[GroupsChange, ...]


def cohort_of(
    ended: Sequence[Ended],
    missing: Sequence[Session],
    tables: Mapping[str, Path],
    people: Mapping[str, Mapping[str, str]],
) -> Cohort:
    """Judge the sessions, find outliers, and compare groups of people.

    Parameters
    ----------
    ended : sequence of Ended
    missing : sequence of Session
    tables : mapping
        Name -> gathered table.
    people : mapping
        Person -> column -> value.

    Returns
    -------
    Cohort
    """
    sessions = judged_sessions(ended, missing)
    # Somebody who stands there twice counts once; what cannot be used says nothing of the others.
    numbers = {
        (one.session.participant, one.session.session): i
        for i, one in enumerate(sessions)
        if not one.copy_of and one.state not in ("unusable", "missing")
    }
    known = list(dict.fromkeys(column for row in people.values() for column in row))
    own = [*known, *(f"participant_{column}" for column in known)]
    strips = strips_of(tables, numbers, own)
    persons = [one.session.participant for one in sessions]
    groups: list[GroupsChange] = []
    present = [persons[i] for i in numbers.values()]
    for column, names in groups_of_people(people, present).items():
        groups += compare_people(strips, persons, people, column, names)
    return Cohort(tuple(sessions), tuple(strips), tuple(far_from_others(strips)), tuple(groups))


def write_group_page(
    cohort: Cohort, folder: Path, design: Design, made: Sequence[str], title: str
) -> None:
    """Write the tables of outliers and of groups of people, where there are any, and the page.

    Parameters
    ----------
    cohort : Cohort
    folder : Path
        Of the group.
    design : Design
    made : sequence of str
        Files that the group's steps wrote.
    title : str
        Name of the study.
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


def _session_row(one: Judged) -> dict[str, Any]:
    checks = {name: (c.state, c.message) for name, c in worst(one.checks).items()}
    own = {name: getattr(one, name) for name in ("name", "state", "reason", "kind", "copy_of")}
    who = {"participant": one.session.participant, "session": one.session.session}
    return {**who, **own, "report": one.report, "log": one.log, "checks": checks}


def _outlier_row(one: Outlier, sessions: Sequence[Judged]) -> dict[str, Any]:
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
