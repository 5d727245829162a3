"""What became of each session: counts, a table of marks, and who failed for which reason."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final
from urllib.parse import quote

from armimpedance.show.pages import Fold, Folds, Heat, Mark, Row, State, Table, Verdict
from armimpedance.show.text import counted

#: One session as `write_cohort` takes it.
SessionRow = Mapping[str, Any]
#: State -> how it looks and what it is called; the most trouble first.
SHOWN: Final[Mapping[str, Mark]] = {
    "failed": Mark("stop", "✗", "failed"),
    "unusable": Mark("stop", "✗", "unusable"),
    "missing": Mark("gap", "…", "missing"),
    "warning": Mark("care", "!", "with care"),
    "ok": Mark("ok", "✓", "usable"),
}
#: State of a check -> how it looks; what is in order is not said in words 25 times a row.
CELLS: Final[Mapping[str, Mark]] = {
    "ok": Mark("ok", "✓"),
    "warning": Mark("care", "!", "warning"),
    "unusable": Mark("stop", "✗", "unusable"),
    "cannot tell": Mark("care", "?", "cannot tell"),
    "missing": Mark("gap", "–", "not known"),
}
NOT_ASKED: Final = Mark("", "")
#: More checks than this have no room beside each other; those without trouble go first.
MOST_COLUMNS: Final = 36
#: Of what is wrong with a session the table holds this much; its log holds all.
MOST_TOLD: Final = 220
_TROUBLE: Final = ("unusable", "warning", "cannot tell")


def counts_table(sessions: Sequence[SessionRow]) -> Table:
    """How many sessions are in each state."""
    meant = {
        "ok": "no check found anything",
        "warning": "a check warns: read it before the numbers",
        "unusable": "a check says that no number would mean anything",
        "failed": "a step ended with an error",
        "missing": "no results yet",
    }
    count = {state: sum(s["state"] == state for s in sessions) for state in meant}
    rows = tuple(
        (f"{SHOWN[state].sign} {SHOWN[state].word}", str(count[state]), text)
        for state, text in meant.items()
    )
    return Table("Sessions by what became of them", ("state", "sessions", "meaning"), rows)


def verdict_of_cohort(sessions: Sequence[SessionRow], far: Sequence[str]) -> Verdict:
    """How many sessions can be used, what is wrong, and what to do next."""
    count = {state: sum(s["state"] == state for s in sessions) for state in SHOWN}
    good, care = count["ok"], count["warning"]
    with_care = f", {care} of them with care" if care else ""
    trust = f"{good + care} of {counted(len(sessions), 'session')} can be used{with_care}."
    copies = [s["name"] for s in sessions if s["copy_of"]]
    lost = [f"{count[s]} {SHOWN[s].word}" for s in ("unusable", "failed", "missing") if count[s]]
    wrong = [", ".join(lost)] if lost else []
    if copies:
        wrong.append(f"{counted(len(copies), 'session')} held twice ({_some(copies)})")
    if far:
        wrong.append(f"{counted(len(far), 'session')} far from the others ({_some(far)})")
    said = "; ".join(wrong) or "No session failed, and none is far from the others"
    state: State = "ok" if not wrong and not care else "warning" if good + care else "unusable"
    return Verdict(state, trust, f"{said[0].upper()}{said[1:]}.", _next_step(count, copies, far))


def _next_step(count: Mapping[str, int], copies: Sequence[str], far: Sequence[str]) -> str:
    if copies:
        return "First take out the recordings that are there twice: a person counts once."
    if count["failed"] or count["unusable"]:
        return "Read below why sessions failed, begin with the reason that most share, run again."
    if count["missing"]:
        return "Run the level participant for the sessions that are missing, then this one again."
    if far:
        return "Look at the reports of those far from the others: did rig or task differ?"
    if count["warning"]:
        return "Read the warnings, and decide whether they matter for your question."
    return "Go on with the tables beside this page."


def _some(names: Sequence[str]) -> str:
    return ", ".join(names[:3]) + (", ..." if len(names) > 3 else "")


def heat_of(sessions: Sequence[SessionRow]) -> Heat:
    """Sessions and checks, those with most trouble first."""
    columns, left = _columns(sessions)
    order = sorted(sessions, key=lambda s: (*_trouble(s), s["name"]))
    told = f"; {left} more without any trouble are left out" if left else ""
    caption = (
        f"{counted(len(sessions), 'session')} and {counted(len(columns), 'check')}{told}. Those "
        "with most trouble stand first. A name leads to the session's report."
    )
    none = Mark("", " ", "not looked at")
    legend = (Mark("ok", "✓", "in order"), *list(CELLS.values())[1:], none)
    states = tuple(m.word for s, m in SHOWN.items() if any(x["state"] == s for x in sessions))
    return Heat(caption, columns, tuple(_row(s, columns) for s in order), legend, states)


def _columns(sessions: Sequence[SessionRow]) -> tuple[tuple[str, ...], int]:
    """Names of the checks in their order, and how many found no room."""
    trouble: dict[str, int] = {}
    for session in sessions:
        for name, (state, _) in session["checks"].items():
            trouble[name] = trouble.get(name, 0) + (state in _TROUBLE)
    kept = sorted(trouble, key=lambda name: -trouble[name])[:MOST_COLUMNS]
    return tuple(name for name in trouble if name in kept), len(trouble) - len(kept)


def _trouble(session: SessionRow) -> tuple[int, int, int]:
    states = [state for state, _ in session["checks"].values()]
    grave, light = states.count("unusable"), sum(s in _TROUBLE for s in states)
    rank = list(SHOWN).index(session["state"])
    twice = min(rank, list(SHOWN).index("warning")) if session["copy_of"] else rank
    return twice, -grave, -light - bool(session["copy_of"])


def _row(session: SessionRow, columns: Sequence[str]) -> Row:
    checks = session["checks"]
    cells = tuple(_cell(*checks[c]) if c in checks else NOT_ASKED for c in columns)
    wrong = [f"{name}: {message}" for name, (state, message) in checks.items() if state in _TROUBLE]
    if session["state"] in ("failed", "missing"):
        wrong.insert(0, session["kind"] or session["reason"])
    if session["copy_of"]:
        wrong.insert(0, f"holds the same as {session['copy_of']}")
    told = "; ".join(wrong)
    told = told if len(told) <= MOST_TOLD else f"{told[:MOST_TOLD]}..."
    link, log = (relative(session[name]) for name in ("report", "log"))
    return Row(session["name"], link, log, SHOWN[session["state"]], cells, told)


def _cell(state: str, message: str) -> Mark:
    seen = CELLS.get(state, CELLS["cannot tell"])
    return Mark(seen.style, seen.sign, seen.word, message if state in _TROUBLE else "")


def relative(path: str) -> str:
    """The address of a file below the study's folder, from the group's; "" where there is none."""
    return f"../{quote(path)}" if path else ""


def reasons_of(sessions: Sequence[SessionRow]) -> Folds:
    """Who failed, by reason; what most share stands first."""
    groups: dict[str, list[SessionRow]] = {}
    for session in sessions:
        if session["state"] in ("failed", "unusable", "missing"):
            key = session["kind"] or session["reason"] or SHOWN[session["state"]].word
            groups.setdefault(key, []).append(session)
    folds = [
        Fold(
            f"{counted(len(own), 'session')}: {reason}",
            tuple((s["name"], relative(s["log"])) for s in own),
        )
        for reason, own in sorted(groups.items(), key=lambda item: -len(item[1]))
    ]
    return Folds(tuple(folds))
