"""State of each session: usable, with care, unusable, failed or missing; and duplicates."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from armimpedance.app.study.gathering import Ended
from armimpedance.app.study.participants import LOG_FILE
from armimpedance.app.study.sessions import StudySession
from armimpedance.core.delimited import read_text_table, text_header
from armimpedance.core.errors import InputError

#: By which the table of `inspect --out` is known.
_OF_CHECKS: Final = {"kind", "name", "state", "message"}
#: From the most trouble to none.
STATES: Final = ("failed", "unusable", "missing", "warning", "ok")
#: Of a check that stands in several rows the worst one counts.
_WORST: Final = ("unusable", "warning", "cannot tell", "missing", "ok")
_REPORT: Final = "report.html"


@dataclass(frozen=True)
class Check:
    """Result of one check of one session."""

    name: str
    state: str
    message: str


@dataclass(frozen=True)
class JudgedSession:
    """A session and what became of it.

    `state`: one of `STATES`.
    `reason`: why it is not usable; "" where it is.
    `kind`: the reason without what is the session's own: equal ones stand together.
    `checks`: of `inspect --out`; empty where no step wrote such a table.
    `report`, `log`: below the study's folder; "" where there is none.
    `copy_of`: an earlier session that holds the same bytes, or gave the same table to the last
    digit.
    """

    session: StudySession
    state: str
    reason: str
    kind: str
    checks: tuple[Check, ...]
    report: str
    log: str
    copy_of: str = ""

    @property
    def name(self) -> str:
        """Person and session."""
        return str(self.session)


def judged_sessions(ended: Sequence[Ended], missing: Sequence[StudySession]) -> list[JudgedSession]:
    """All sessions of a study, by person and session.

    `missing`: not worked on.
    """
    twice = _copies(ended)
    judged = [_judged(one, twice.get(one.session.folder, "")) for one in ended]
    why = "no results yet"
    judged += [JudgedSession(one, "missing", why, why, (), "", "") for one in missing]
    return sorted(judged, key=lambda one: (one.session.participant, one.session.session))


def _judged(one: Ended, copy_of: str) -> JudgedSession:
    rows = _checks_rows(one)
    checks = tuple(Check(r["name"], r["state"], r["message"]) for r in rows if r["kind"] == "check")
    verdict = next((row for row in rows if row["kind"] == "verdict"), {})
    reason = str(one.record.get("reason", ""))
    state = verdict.get("state", "ok")
    if state == "unusable":
        reason = verdict.get("message", "") or reason
    elif one.record.get("state") != "done":
        state = "failed"
    elif state not in STATES:
        state = "warning"
    kind = _kind_of(one, state, reason, checks)
    report = _report(one)
    place = one.session.folder
    log = f"{place}/{LOG_FILE}" if (one.folder / LOG_FILE).is_file() else ""
    return JudgedSession(one.session, state, reason, kind, checks, report, log, copy_of)


def _kind_of(one: Ended, state: str, reason: str, checks: Sequence[Check]) -> str:
    """A reason that sessions share: the check that stops, or the message without its own path."""
    if state == "unusable":
        stops = dict.fromkeys(c.name or c.message for c in checks if c.state == "unusable")
        return f"cannot be used: {', '.join(stops)}" if stops else reason
    if state != "failed":
        return ""
    own = str(one.session.recording)
    kind = reason.replace(f"{own}: ", "").replace(own, "the recording")
    # What would have been expected is in the log, and here in the way.
    return kind.split(" (expected ")[0].removeprefix("armimpedance ")


def _checks_rows(one: Ended) -> list[dict[str, str]]:
    for name in one.record["files"]:
        if name.endswith(".csv") and (rows := _rows_of_checks(one.folder / name)):
            return rows
    return []


def _rows_of_checks(file: Path) -> list[dict[str, str]]:
    """The rows of a table of checks; nothing of any other, or of one that somebody took away."""
    try:
        if not set(text_header(file)) >= _OF_CHECKS:
            return []
        rows = read_text_table(file).dicts()
    except InputError:
        return []
    return [{name: row[name] for name in _OF_CHECKS} for row in rows]


def _report(one: Ended) -> str:
    pages = [name for name in one.record["files"] if name.endswith(".html")]
    name = _REPORT if _REPORT in pages else next(iter(pages), "")
    return f"{one.session.folder}/{name}" if name and (one.folder / name).is_file() else ""


def worst(checks: Sequence[Check]) -> dict[str, Check]:
    """Name of a check -> the worst that it said; what has no name stands under "other"."""
    worst_by_name: dict[str, Check] = {}
    for one in checks:
        name = one.name or "other"
        rank = _rank(one)
        if name not in worst_by_name or rank < _rank(worst_by_name[name]):
            worst_by_name[name] = one
    return worst_by_name


def _rank(one: Check) -> int:
    return _WORST.index(one.state) if one.state in _WORST else 1


def _copies(ended: Sequence[Ended]) -> dict[str, str]:
    """Folder of a session -> name of an earlier one with the same bytes."""
    seen: dict[tuple[str, str], str] = {}
    copies: dict[str, str] = {}
    for one in sorted(ended, key=lambda one: (one.session.participant, one.session.session)):
        marks = list(_marks(one))
        first = next((seen[mark] for mark in marks if mark in seen), None)
        if first is not None:
            copies[one.session.folder] = first
        for mark in marks:
            seen.setdefault(mark, first or str(one.session))
    return copies


def _marks(one: Ended) -> Iterator[tuple[str, str]]:
    """Marks that equal recordings share: keys of steps that read them, tables of numbers.

    A session without any result has none: two empty folders are no person counted twice.
    """
    files: Mapping[str, Any] = one.record["files"]
    if not files:
        return
    steps: Sequence[Mapping[str, Any]] = one.record.get("steps", ())
    reads = (step for step in steps if "{recording}" in str(step.get("command", "")))
    if (first := next(reads, None)) is not None and first.get("key"):
        yield "key", str(first["key"])
    for name, of in files.items():
        if name.endswith(".csv") and _has_numbers(one.folder / name):
            yield name, str(of)


def _has_numbers(file: Path) -> bool:
    """Return True if a table holds numbers with intervals, which never agree by chance."""
    try:
        return any(cell.startswith("ci_low_") for cell in text_header(file))
    except InputError:
        return False
