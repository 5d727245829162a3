"""The tables of all sessions as one, with who each row belongs to."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from armimpedance.app.study.participants import read_record
from armimpedance.app.study.sessions import StudySession
from armimpedance.app.study.store import Fingerprints
from armimpedance.core.delimited import TSV, read_text_table, text_header
from armimpedance.core.errors import InputError
from armimpedance.core.outputs import staged_file

#: What BIDS calls the table of people, and its column of names.
PEOPLE_FILE: Final = "participants.tsv"
PERSON: Final = "participant_id"
#: The first columns of every gathered table.
KEYS: Final = ("participant", "session")


@dataclass(frozen=True)
class Ended:
    """A session that has been worked on.

    `record`: what stands in its `SESSION_FILE`.
    """

    session: StudySession
    folder: Path
    record: Mapping[str, Any]


def ended_sessions(
    sessions: Sequence[StudySession], out: Path
) -> tuple[list[Ended], list[StudySession]]:
    """The sessions whose results are there, and those that were never worked on.

    Where somebody took a result away, the session has to be worked on again.

    `out`: the study's folder.
    """
    ended, missing = [], []
    for session in sessions:
        record = read_record(out / session.folder)
        folder = out / session.folder
        if record is None or not all((folder / name).is_file() for name in record["files"]):
            missing.append(session)
        else:
            ended.append(Ended(session, folder, _unchanged(record, folder)))
    return ended, missing


def _unchanged(record: Mapping[str, Any], folder: Path) -> Mapping[str, Any]:
    """The record; without files, and failed, where a table is no longer what the steps wrote."""
    prints = Fingerprints()
    for name, of in record["files"].items():
        if name.endswith(".csv") and prints.of(folder / name) != of:
            reason = f"{name} was changed after it was made: run participant again"
            return {**record, "state": "failed", "reason": reason, "files": {}}
    return record


def people(data: Path) -> dict[str, dict[str, str]]:
    """Columns of ``participants.tsv`` for each person, by the name without ``sub-``.

    `data`: folder of the data.
    Returns: empty where there is no such file.
    Raises InputError: it has no column ``participant_id``, or a person stands in it twice.
    """
    file = data / PEOPLE_FILE
    if not file.is_file():
        return {}
    rows_by_person: dict[str, dict[str, str]] = {}
    table = read_text_table(file, TSV)
    for number, row in zip(table.lines, table.dicts(), strict=True):
        if PERSON not in row:
            raise InputError(f"no column {PERSON}", file=file, expected=PERSON)
        name = row.pop(PERSON).removeprefix("sub-")
        if name in rows_by_person:
            raise InputError(f"{name!r} appears twice", file=file, row=number, expected="once")
        rows_by_person[name] = row
    return rows_by_person


def table_names(ended: Sequence[Ended], tables: Sequence[str]) -> list[str]:
    """Tables to gather: those that the design names, or every CSV that a step wrote.

    Raises InputError: no session has a table that the design names.
    """
    written = {name for one in ended for name in one.record["files"]}
    for name in tables:
        if name not in written:
            raise InputError(f"no session has {name}", expected="a file that a step writes")
    if tables:
        return list(tables)
    return sorted(name for name in written if name.endswith(".csv") and "/" not in name)


def gather(
    name: str, ended: Sequence[Ended], known: Mapping[str, Mapping[str, str]], file: Path
) -> int:
    """Write the rows of all sessions into one table; texts and numbers stay as they are written.

    `name`: of the table in each session's folder.
    `known`: person -> columns of their own, which follow the keys.
    Returns: number of rows.
    """
    those = [one for one in ended if name in one.record["files"]]
    columns: dict[str, None] = dict.fromkeys(KEYS)
    about = dict.fromkeys(column for person in known.values() for column in person)
    for one in those:
        columns |= dict.fromkeys(text_header(one.folder / name))
    own = {column: f"participant_{column}" if column in columns else column for column in about}
    order = [*KEYS, *own.values(), *(column for column in columns if column not in KEYS)]
    count = 0
    with staged_file(file) as temporary, open(temporary, "w", newline="", encoding="utf-8") as to:
        writer = csv.DictWriter(to, order, restval="", lineterminator="\n")
        writer.writeheader()
        for one in those:
            person = known.get(one.session.participant, {})
            keys = dict(zip(KEYS, (one.session.participant, one.session.session), strict=True))
            about_them = {own[column]: value for column, value in person.items()}
            for row in read_text_table(one.folder / name).dicts():
                writer.writerow(row | about_them | keys)
                count += 1
    return count


def sessions_table(
    ended: Sequence[Ended], missing: Sequence[StudySession], data: Path, file: Path
) -> int:
    """Write who was worked on, who failed and why; return how many did not end well.

    `data`: folder of the data.
    """
    rows = [
        (one.session, one.record.get("state", ""), one.record.get("reason", "")) for one in ended
    ]
    rows += [(one, "missing", "no results yet") for one in missing]
    rows.sort(key=lambda row: (row[0].participant, row[0].session))
    with staged_file(file) as temporary, open(temporary, "w", newline="", encoding="utf-8") as to:
        writer = csv.writer(to, lineterminator="\n")
        writer.writerow([*KEYS, "recording", "state", "reason"])
        for session, state, reason in rows:
            where = session.recording.relative_to(data.resolve()).as_posix()
            writer.writerow([session.participant, session.session, where, state, reason])
    return sum(state != "done" for _, state, _ in rows)
