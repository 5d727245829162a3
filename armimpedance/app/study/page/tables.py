"""States of the sessions: counts, a table of marks, and the reasons of failures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

from armimpedance.core.delimited import read_text_table, text_header
from armimpedance.show.pages import (
    Block,
    Fold,
    Folds,
    Heat,
    Mark,
    Prose,
    Row,
    Section,
    State,
    Table,
    Verdict,
)
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
    """Number of sessions in each state."""
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
    """The verdict of a cohort: usable sessions, what is wrong, and what to do next."""
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
    problems = "; ".join(wrong) or "No session failed, and none is far from the others"
    state: State = "ok" if not wrong and not care else "warning" if good + care else "unusable"
    return Verdict(
        state, trust, f"{problems[0].upper()}{problems[1:]}.", _next_step(count, copies, far)
    )


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
    left_out = f"; {left} more without any trouble are left out" if left else ""
    caption = (
        f"{counted(len(sessions), 'session')} and {counted(len(columns), 'check')}{left_out}. "
        "Those with most trouble stand first. A name leads to the session's report."
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
    problems = "; ".join(wrong)
    problems = problems if len(problems) <= MOST_TOLD else f"{problems[:MOST_TOLD]}..."
    link, log = (relative(session[name]) for name in ("report", "log"))
    return Row(session["name"], link, log, SHOWN[session["state"]], cells, problems)


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


# What sets people and conditions apart, as tables of a page.

#: Rows of outliers on the page; the file beside it holds all.
MOST_ROWS: Final = 200
#: Columns by which a table of `compare --subjects` is known.
_OVER_SUBJECTS: Final = {
    "group_1",
    "group_2",
    "matrix",
    "quantity",
    "change",
    "n_subjects",
    "p_adjusted",
}
#: What a reader of the page sees of each pair of conditions; the file holds all quantities.
_SHOWN: Final = (
    ("stiffness", "size"),
    ("viscosity", "size"),
    ("inertia", "size"),
    ("stiffness", "orientation"),
)

Cells = Mapping[str, Any]


def outliers_table(rows: Sequence[Cells]) -> Table:
    """Who is far from the others, the farthest first: one row a session, with its worst value."""
    sessions: dict[tuple[str, str], list[Cells]] = {}
    for row in rows:
        sessions.setdefault((row["participant"], row["session"]), []).append(row)
    cells = tuple(_far_row(own) for own in list(sessions.values())[:MOST_ROWS])
    more = f", the first {MOST_ROWS} of {len(sessions)}" if len(sessions) > MOST_ROWS else ""
    heads = ("session", "values far", "the farthest", "its value (95 %)", "median", "spreads", "of")
    return Table(f"Sessions far from the others{more}", heads, cells, "outliers")


def _far_row(own: Sequence[Cells]) -> tuple[str, ...]:
    row = own[0]
    quantities = list(dict.fromkeys(str(one["quantity"]).removesuffix("_deg") for one in own))
    more = f" and {len(quantities) - 4} more" if len(quantities) > 4 else ""
    farthest = f"{_quantity(row)}, {row['condition']}" if row["condition"] else _quantity(row)
    return (
        f"{row['participant']} {row['session']}".strip(),
        str(len(own)),
        farthest,
        f"{row['value']:.3g} ({row['ci_low']:.3g} to {row['ci_high']:.3g})",
        f"{row['median']:.3g}",
        f"{row['spreads']:+.1f}",
        f"{', '.join(name.replace('_', ' ', 1) for name in quantities[:4])}{more}",
    )


def _quantity(row: Cells) -> str:
    unit = f" ({row['unit']})" if row["unit"] else ""
    name = str(row["quantity"]).removesuffix("_deg").replace("_", " ", 1)
    return f"{name}{unit}"


def conditions_table(file: Path) -> Table | None:
    """Mean changes over people between conditions; None where a file is no such table."""
    if not set(text_header(file)) >= _OVER_SUBJECTS:
        return None
    rows = read_text_table(file).dicts()
    quantities = dict.fromkeys((row["matrix"], row["quantity"]) for row in rows)
    shown = [name for name in _SHOWN if name in quantities] or list(quantities)[: len(_SHOWN)]
    pairs: dict[tuple[str, str], dict[tuple[str, str], str]] = {}
    people: dict[tuple[str, str], str] = {}
    for row in rows:
        pair = (row["group_1"], row["group_2"])
        people[pair] = row["n_subjects"]
        name = (row["matrix"], row["quantity"])
        if name in shown:
            pairs.setdefault(pair, {})[name] = _change(row)
    cells = tuple(
        (" | ".join(pair), people[pair], *(own.get(name, "") for name in shown))
        for pair, own in pairs.items()
    )
    caption = (
        "Mean change over people from the first condition to the second, with its 95 % interval "
        f"and the adjusted p; ratios of sizes. All quantities: {file.name}"
    )
    return Table(caption, ("conditions", "people", *map(_words, shown)), cells)


def _words(name: tuple[str, str]) -> str:
    """Matrix and quantity, which names its matrix where it is an element."""
    matrix, quantity = name
    return quantity.replace("_", " ", 1) if "_" in quantity else f"{quantity} of {matrix}"


def _change(row: Cells) -> str:
    try:
        value, low, high, p = (
            float(row[name]) for name in ("change", "ci_low", "ci_high", "p_adjusted")
        )
    except (ValueError, KeyError):
        return ""
    sign = "x " if row.get("kind") == "ratio" else ""
    unit = f" {row['unit']}" if row.get("unit") and not sign else ""
    return f"{sign}{value:.3g} ({low:.3g} to {high:.3g}){unit}, p {p:.2g}"


_HOW_GROUPS: Final = Prose(
    (
        "People are the sample: each counts once, with the error of its own estimate. p is "
        "adjusted over the conditions of each quantity and the pairs of groups (Holm); by chance "
        "one quantity in twenty would differ. That no difference was found is no proof of none: "
        "read the intervals.",
    )
)


def groups_sections(rows: Sequence[Cells]) -> list[Section]:
    """One section for each column that parts the people into groups."""
    sections = []
    for column in dict.fromkeys(row["column"] for row in rows):
        own = [row for row in rows if row["column"] == column]
        pairs = dict.fromkeys((row["first"], row["second"]) for row in own)
        blocks = [
            block
            for pair in pairs
            for block in _pair_blocks(
                column, [row for row in own if (row["first"], row["second"]) == pair]
            )
        ]
        sections.append(Section(f"Groups of people: {column}", (_HOW_GROUPS, *blocks)))
    return sections


def _pair_blocks(column: str, rows: Sequence[Cells]) -> tuple[Block, ...]:
    first, second = rows[0]["first"], rows[0]["second"]
    quantities = list(dict.fromkeys((row["table"], row["quantity"]) for row in rows))
    differ = {(row["table"], row["quantity"]) for row in rows if row["p_adjusted"] < 0.05}
    text = (
        f"{first} and {second} ({column}) differ in {len(differ)} of {len(quantities)} quantities."
    )
    order = sorted(rows, key=lambda row: row["p"])
    cells = tuple(_groups_row(row) for row in order[:MOST_ROWS])
    caption = f"{second} against {first}: differences, or of sizes and shapes ratios"
    heads = (
        *("quantity", "condition", f"{first} (people)", f"{second} (people)"),
        *("change (95 %)", "p", "adjusted"),
    )
    return (Prose((text,)), Table(caption, heads, cells, f"groups {column}"))


def _groups_row(row: Cells) -> tuple[str, ...]:
    sign = "x " if row["kind"] == "ratio" else ""
    return (
        _quantity(row),
        str(row["condition"]),
        f"{row['mean_first']:.3g} ({row['n_first']})",
        f"{row['mean_second']:.3g} ({row['n_second']})",
        f"{sign}{row['change']:.3g} ({row['low']:.3g} to {row['high']:.3g})",
        f"{row['p']:.2g}",
        f"{row['p_adjusted']:.2g}",
    )
