"""A datasheet of a dataset: what is known filled in, the other questions left to the owner.

The questions follow Gebru et al. (2021), Datasheets for datasets, doi:10.1145/3458723, shortened.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from armimpedance.show.files.sharing.bids_text import dataset_name
from armimpedance.show.files.sharing.columns import (
    data_files,
    facts,
    missing_words,
    steps,
    variables,
)
from armimpedance.show.files.sharing.form import Form, Shared

_OPEN = "*To be answered by the owner of the data.*"


def _write(shared: Shared, file: Path) -> tuple[str, ...]:
    statement = shared.statement
    sections: dict[str, list[tuple[str, str | None]]] = {
        "Motivation": [
            ("For what purpose was the dataset made?", statement.description),
            ("Who made it?", ", ".join(statement.creators) or None),
            ("Who paid for it?", ", ".join(statement.funding) or None),
        ],
        "Composition": [
            ("What does it hold?", _facts(shared)),
            ("Which variables, in which units?", _variables(shared)),
            ("Which files?", _files(shared)),
            ("Who are the people in it, and could they be recognised?", None),
            ("Is anything missing, or known to be wrong?", None),
        ],
        "Collection": [
            ("How were the data measured, and with which devices?", None),
            ("Who took part, when, and how were they chosen and paid?", None),
            ("Did an ethics committee agree, and the participants?", None),
        ],
        "Preparation": [("What was done to the data?", _steps(shared))],
        "Uses": [
            ("What have they been used for?", None),
            ("What should they not be used for?", None),
        ],
        "Distribution": [
            ("Under which licence?", statement.licence),
            ("Where are they, under which identifier?", statement.identifier or statement.url),
        ],
        "Maintenance": [("Who answers questions, and corrects errors?", None)],
    }
    lines = [f"# Datasheet: {_line(dataset_name(shared))}", ""]
    for title, questions in sections.items():
        lines += [f"## {title}", ""]
        for question, answer in questions:
            lines += [f"**{question}**", "", answer or _OPEN, ""]
    file.write_text("\n".join(lines), encoding="utf-8")
    unanswered = sum(not answer for own in sections.values() for _, answer in own)
    return (*missing_words(shared), f"{unanswered} questions are left to the owner of the data.")


def _facts(shared: Shared) -> str:
    parts = []
    for path, recording in shared.recordings:
        parts.append(f"{_line(path.name)}:\n\n" + _table(("", ""), facts(recording)))
    for table in shared.results:
        rows = f"{len(table.rows)} rows, {len(table.columns)} columns"
        parts.append(f"{_line(table.path.name)}: results, {rows}.")
    return "\n\n".join(parts)


def _variables(shared: Shared) -> str:
    rows = [(v.name, v.words, "" if v.unit == "n/a" else v.unit) for v in variables(shared)]
    return _table(("name", "what", "unit"), rows)


def _files(shared: Shared) -> str:
    rows = [(f.name, str(f.size), f.sha256) for f in data_files(shared)]
    return _table(("file", "bytes", "sha256"), rows)


def _steps(shared: Shared) -> str | None:
    sentences = [step for _, recording in shared.recordings for step in steps(recording)]
    return "\n".join(f"- {_line(step)}" for step in dict.fromkeys(sentences)) or None


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(_line(cell) for cell in line) + " |" for line in lines)


def _line(text: str) -> str:
    """A text that cannot break a table or a line of Markdown."""
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")


FORM = Form(
    what="a datasheet in Markdown, with the questions that only you can answer",
    write=_write,
    endings=(".md",),
)
