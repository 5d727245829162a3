"""Results in the layout of a BIDS derivative: a table a person, each column described."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from armimpedance.core.errors import InputError
from armimpedance.show.files.sharing.bids_text import (
    checked_label,
    label,
    write_description,
    write_json,
    write_table,
)
from armimpedance.show.files.sharing.columns import result_column
from armimpedance.show.files.sharing.form import Form, ResultTable, Shared

_README = """\
# {name}

{description}

Results of armimpedance {version} in the layout of a BIDS derivative: tables `_impedance.tsv`, with
every column described in the JSON file of the same name. BIDS has no standard name for such a
table; `.bidsignore` says so to validators.
"""


def _write(shared: Shared, folder: Path) -> tuple[str, ...]:
    if not shared.results or shared.recordings:
        raise InputError("a BIDS derivative", expected="tables of results (RESULTS.csv)")
    statement = shared.statement
    sources = [{"URL": statement.url}] if statement.url else []
    missing = write_description(folder, shared, "derivative", sources)
    (folder / ".bidsignore").write_text("**/*_impedance.tsv\n**/*_impedance.json\n")
    person = checked_label(shared.person, "--subject") if shared.person else "01"
    own = folder / f"sub-{person}" / "motion"
    own.mkdir(parents=True)
    used_names: set[str] = set()
    for table in shared.results:
        stem = _stem(table, shared, person)
        if stem in used_names:
            expected = "files of different names"
            raise InputError("two tables of one name", file=table.path, expected=expected)
        used_names.add(stem)
        write_table(own / f"{stem}.tsv", table.columns, table.rows)
        write_json(own / f"{stem}.json", _described(table))
    text = _README.format(
        name=statement.name or shared.paths[0].resolve().stem,
        description=statement.description or "(No description was given.)",
        version=shared.version,
    )
    (folder / "README.md").write_text(text, encoding="utf-8")
    names = {"License": "--licence", "Authors": "--creator"}
    return tuple(f"Not told, and left out: {name} ({names[name]})." for name in missing)


def _stem(table: ResultTable, shared: Shared, person: str) -> str:
    task = f"_task-{checked_label(shared.task, '--task')}" if shared.task else ""
    return f"sub-{person}{task}_desc-{label(table.path.stem, 'results')}_impedance"


def _described(table: ResultTable) -> dict[str, Any]:
    levels = {row.get("level", "") for row in table.rows}
    level = levels.pop() if len(levels) == 1 else ""
    described: dict[str, Any] = {"Description": "mechanical impedance, one row a group of trials"}
    for name in table.columns:
        words, unit = result_column(name, level or "hand")
        described[name] = {"Description": words or "column of the table"}
        if unit != "n/a":
            described[name]["Units"] = unit
    return described


FORM = Form(
    what="results as a BIDS derivative, every column described",
    write=_write,
    takes=("results",),
)
