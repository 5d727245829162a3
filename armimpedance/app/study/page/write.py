"""The page of a study: all sessions at a glance, and what sets them apart."""

from __future__ import annotations

import platform
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

import pandas as pd

from armimpedance.app.study.page.strips import strip_pictures
from armimpedance.app.study.page.tables import (
    conditions_table,
    counts_table,
    groups_sections,
    heat_of,
    outliers_table,
    reasons_of,
    relative,
    verdict_of_cohort,
)
from armimpedance.core.program import software
from armimpedance.show.pages import (
    NAMED,
    Block,
    Fold,
    Folds,
    Methods,
    Page,
    Prose,
    Section,
    methods_of,
    write_page,
)
from armimpedance.show.text import counted

Rows = Sequence[Mapping[str, Any]]

FEWEST: Final = 8
_RULE: Final = (
    "How far a session is from the others is counted in spreads: its distance from the median, "
    "over the spread between people (from the median absolute deviation, the sessions' own errors "
    "taken off) and its own standard error together. Those sessions are named that chance does not "
    "explain when all their values and all sessions are looked at (5 %, Benjamini and Hochberg): "
    "among people who are alike nobody is named in about 19 of 20 studies. Who is named may be "
    "rightly measured: look at the report.",
)
_REFERENCES: Final = (
    "Y. Benjamini and Y. Hochberg, Controlling the false discovery rate, J R Stat Soc B 57 (1995) "
    "289-300.",
    "J. Hartung and G. Knapp, On tests of the overall treatment effect in meta-analysis with "
    "normally distributed responses, Stat Med 20 (2001) 1771-1782.",
    "R. C. Paule and J. Mandel, Consensus values and weighting factors, J Res Natl Bur Stand 87 "
    "(1982) 377-385.",
)


def write_cohort(
    path: Path,
    title: str,
    *,
    sessions: Rows,
    strips: Rows,
    outliers: Rows,
    groups: Rows,
    steps: Sequence[str],
    group_steps: Sequence[str],
    files: Sequence[str],
) -> None:
    """Write the page of many sessions as one HTML file that needs no network.

    `path`: the file, in the group's folder; the sessions' folders lie beside that.
    `title`: name of the study.
    `sessions`: participant, session, name, state ("ok", "warning", "unusable", "failed" or
    "missing"), reason, kind (a reason that several share), copy_of, report and log (below the
    study's folder), checks: name -> (state, message).
    `strips`: table, condition, quantity, unit, kind, and arrays sessions, values, low, high.
    `outliers`, `groups`: as the tables outliers.csv and people_groups.csv hold them.
    `steps`, `group_steps`: commands.
    `files`: what the group's steps wrote, in the page's folder.
    """
    far = list(dict.fromkeys(_who(row) for row in outliers))
    page = Page(
        title=f"Study: {title}",
        lead=_lead(sessions),
        verdict=verdict_of_cohort(sessions, far),
        reader=(
            Section("Quality of each session", (counts_table(sessions), heat_of(sessions))),
            *_failed(sessions),
            *_twice(sessions),
            *_far(sessions, strips, outliers),
            *_conditions(path.parent, files, sessions, strips),
            *groups_sections(groups),
        ),
        reviewer=(),
        methods=_methods(sessions, strips, groups, group_steps),
        made=_made(sessions, steps, group_steps),
        data=_data(outliers, groups),
    )
    write_page(page, path)


def _who(row: Mapping[str, Any]) -> str:
    return f"{row['participant']} {row['session']}".strip()


def _lead(sessions: Rows) -> str:
    people = {one["participant"] for one in sessions}
    who = "1 person" if len(people) == 1 else f"{len(people)} people"
    return f"{counted(len(sessions), 'session')} of {who}."


def _failed(sessions: Rows) -> list[Section]:
    folds = reasons_of(sessions)
    return [Section("Who failed, and why", (folds,))] if folds.folds else []


def _twice(sessions: Rows) -> list[Section]:
    copies = [one for one in sessions if one["copy_of"]]
    if not copies:
        return []
    text = (
        "These sessions hold the same bytes as another, or gave the same numbers to the last "
        "digit: a person counted twice, or a file that was copied to the wrong place. The outliers "
        "and the groups of people below take each once; the gathered tables hold both."
    )
    items = tuple((f"{one['name']} = {one['copy_of']}", relative(one["log"])) for one in copies)
    return [
        Section(
            "Held twice",
            (Prose((text,)), Folds((Fold(counted(len(copies), "session"), items),))),
        )
    ]


def _far(sessions: Rows, strips: Rows, outliers: Rows) -> list[Section]:
    if not strips:
        return []
    far: dict[tuple[str, str, str], list[int]] = {}
    number = {(one["participant"], one["session"]): i for i, one in enumerate(sessions)}
    for row in outliers:
        key = (row["table"], row["condition"], row["quantity"])
        far.setdefault(key, []).append(number[row["participant"], row["session"]])
    names = [str(one["name"]) for one in sessions]
    blocks: list[Block] = [Prose(_RULE)]
    most = max(len(strip["values"]) for strip in strips)
    if most < FEWEST:
        blocks = [Prose((f"{most} sessions are too few to say who is far from the others.",))]
    elif outliers:
        blocks.append(outliers_table(outliers))
    else:
        blocks.append(Prose(("Nobody is far from the others by this rule.",)))
    pictures = strip_pictures(strips, far, names)
    return [Section("People side by side", (*blocks, *pictures))]


def _conditions(folder: Path, files: Sequence[str], sessions: Rows, strips: Rows) -> list[Section]:
    tables = [conditions_table(folder / name) for name in files if name.endswith(".csv")]
    blocks: tuple[Block, ...] = tuple(table for table in tables if table is not None)
    copies = sum(1 for one in sessions if one["copy_of"])
    if blocks and copies:
        text = f"The gathered tables hold {counted(copies, 'session')} twice, and so does this one."
        blocks = (Prose((text,)), *blocks)
    if not blocks and len({strip["condition"] for strip in strips}) > 1:
        # Too few people share two conditions, or nobody said which results belong together.
        blocks = (Prose(("Not compared: name the comparison in group_steps of study.toml.",)),)
    return [Section("Conditions over people", blocks)] if blocks else []


def _methods(sessions: Rows, strips: Rows, groups: Rows, group_steps: Sequence[str]) -> Methods:
    good = sum(one["state"] in ("ok", "warning") for one in sessions)
    sentences = [
        f"{counted(len(sessions), 'session')} were analysed with {software()}, each by the same "
        f"steps; {good} of them could be used",
    ]
    if strips:
        sentences.append(
            "Sessions far from the others were found by their distance from the median in robust "
            "spreads (median absolute deviation less the sessions' own errors), held against "
            "Student's t with (n - 1)/3 degrees of freedom, with Bonferroni's correction within a "
            "session and a false discovery rate of 5 % over sessions"
        )
    if any(step.startswith("compare") for step in group_steps):
        sentences.append(
            "Conditions were compared within people; the mean change is that of a random-effects "
            "model with the interval of Hartung and Knapp"
        )
    if groups:
        sentences.append(
            "Groups of people were compared by the means of random-effects models, one value a "
            "person with its own error, with degrees of freedom after Welch and Satterthwaite; p "
            "values were adjusted after Holm over the conditions of each quantity"
        )
    kept = _REFERENCES[: 3 if groups or group_steps else 1] if strips else ()
    return methods_of(sentences, kept)


def _made(
    sessions: Rows, steps: Sequence[str], group_steps: Sequence[str]
) -> tuple[tuple[str, str], ...]:
    versions = ", ".join(f"{name} {version(name)}" for name in NAMED)
    python = f"{platform.python_implementation()} {platform.python_version()}"
    return (
        ("sessions", str(len(sessions))),
        *((f"step {i}", f"armimpedance {step}") for i, step in enumerate(steps, start=1)),
        *((f"step {i} of the group", f"armimpedance {s}") for i, s in enumerate(group_steps, 1)),
        ("versions", f"{versions}, {python}"),
    )


def _data(outliers: Rows, groups: Rows) -> dict[str, pd.DataFrame]:
    data = {"outliers": pd.DataFrame(list(outliers))}
    for column in dict.fromkeys(row["column"] for row in groups):
        data[f"groups {column}"] = pd.DataFrame([r for r in groups if r["column"] == column])
    return data
