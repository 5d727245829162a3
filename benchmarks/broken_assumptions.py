"""What can go wrong, and what you will see: records that break what a command takes for granted.

Every cell is one violation of one size for one command: records are made (by simulators of the
toolkit, by plants of our own in `broken/`, by damage to records), the command is asked, and each
record is *refused*, *named* (a finding that warns bears the violation's name), or its printed
numbers are *right or wide* (the 95 % interval widened by half holds the truth) or *silently wrong*.
Clean records of every rig stand beside them: what warns there is a false alarm. Where a violation
moves no number by more than two standard errors nothing is asked.

Cells run on all cores and are kept as files; a run that was stopped goes on where it was. The same
records come out whatever the number of workers. After a change of a command its files have to be
deleted (--keep), or --again given.

    python benchmarks/broken_assumptions.py                     40 records a cell
    python benchmarks/broken_assumptions.py --records 4 --only elbow
    python benchmarks/broken_assumptions.py --page docs         draw and write the page of the docs
    python benchmarks/broken_assumptions.py --check             1 where something asked is missed
"""

from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import argparse
import json
import sys
import warnings
from functools import lru_cache
from pathlib import Path
from typing import Any

import pandas as pd
from broken import (
    body_cells,
    elbow_cells,
    exam_cells,
    hand_cells,
    model_cells,
    passive_cells,
    random_cells,
    therapy_cells,
)
from broken.advice import ADVICE
from broken.cell import Cell, clean, effect, run_cell
from tqdm import tqdm

from armimpedance.core.outputs import staged_file
from armimpedance.hand.still import in_order

#: What is asked: silently wrong in a cell, clean records alarmed in all and by one check.
WRONG, ALARMED, ALARMED_BY_ONE = 0.02, 0.05, 0.02
#: Only cells whose effect exceeds so many standard errors are judged.
EFFECT_SE = 2.0
TOPICS = (
    elbow_cells,
    hand_cells,
    passive_cells,
    body_cells,
    therapy_cells,
    model_cells,
    exam_cells,
    random_cells,
)
COLUMNS = (
    "command", "rig", "violation", "size", "n", "effect_in_se", "silently_wrong", "named",
    "refused", "wide_or_right", "false_alarm", "worst_check", "records_wrong", "held", "seen",
    "alarms", "named_by", "wrong", "example", "advice", "seconds",
)  # fmt: skip


@lru_cache
def all_cells() -> dict[str, Cell]:
    """Key -> cell; those of clean records first, each rig's beside its broken ones."""
    cells: list[Cell] = []
    for topic in TOPICS:
        cells += [clean(rig) for rig in topic.CLEAN] + topic.cells()
    found = {cell.key: cell for cell in cells}
    if len(found) != len(cells):
        raise ValueError("two cells of one name")
    return found


def kept(keep: Path, key: str, records: int) -> Path:
    """Where a cell's counts lie."""
    return keep / f"{key}-{records}.json"


def run_one(key: str, records: int, keep: str) -> str:
    """Run a cell and write its counts aside."""
    warnings.simplefilter("ignore")
    tally = run_cell(all_cells()[key], records)
    file = kept(Path(keep), key, records)
    with staged_file(file) as staged:
        Path(staged).write_text(json.dumps(tally.to_dict()), encoding="utf-8")
    return key


def run(keys: list[str], records: int, keep: Path, workers: int, again: bool) -> None:
    """Run what is not kept."""
    keep.mkdir(parents=True, exist_ok=True)
    todo = [k for k in keys if again or not kept(keep, k, records).exists()]
    done = in_order(run_one, [(k, records, str(keep)) for k in todo], workers)
    bar = tqdm(done, "cells", len(todo), disable=None)
    for key in bar:
        bar.set_postfix_str(key[:40])


def table(keys: list[str], records: int, keep: Path) -> pd.DataFrame:
    """One row a cell."""
    read = {k: json.loads(kept(keep, k, records).read_text(encoding="utf-8")) for k in keys}
    cells = all_cells()
    sound = {cells[k].rig.command + cells[k].rig.name: v for k, v in read.items()
             if not cells[k].violation}  # fmt: skip
    rows = [row_of(cells[k], v, sound[cells[k].rig.command + cells[k].rig.name])
            for k, v in read.items()]  # fmt: skip
    return pd.DataFrame(rows, columns=COLUMNS)


def row_of(cell: Cell, tally: dict[str, Any], sound: dict[str, Any]) -> dict[str, Any]:
    """A row of the table; the effect is empty for clean records."""
    broken = bool(cell.violation)
    worst = max(tally["alarms"].values(), default=0) / tally["n"]
    return {
        "command": cell.rig.command,
        "rig": cell.rig.name,
        "violation": cell.violation or "none",
        "size": cell.size,
        "n": tally["n"],
        "effect_in_se": round(effect(tally, sound), 2) if broken else None,
        **{k: round(tally[k], 4) for k in ("silently_wrong", "named", "refused", "wide_or_right")},
        "false_alarm": None if broken else round(tally["alarmed"], 4),
        "worst_check": None if broken else round(worst, 4),
        "records_wrong": round(tally["records_wrong"], 4),
        "held": round(tally["held"], 4),
        "seen": cell.seen,
        "alarms": "; ".join(f"{k} ({v})" for k, v in tally["alarms"].items()),
        "named_by": "; ".join(cell.named_by),
        "wrong": "; ".join(f"{k} ({v})" for k, v in tally["wrong"].items()),
        "example": tally["example"],
        "advice": ADVICE.get(cell.violation, ""),
        "seconds": round(tally["seconds"], 1),
    }


def misses(rows: pd.DataFrame) -> list[str]:
    """What is asked and not held, a line each; a single alarm among 40 records is no rate yet."""
    lines = []
    judged = rows[(rows["violation"] != "none") & rows["seen"].astype(bool)]
    for _, row in judged.iterrows():
        if row["effect_in_se"] > EFFECT_SE and row["silently_wrong"] > WRONG:
            lines.append(
                f"{row['command']} ({row['rig']}), {row['violation']} {row['size']}: "
                f"{100 * row['silently_wrong']:.0f} % silently wrong, effect "
                f"{row['effect_in_se']:.1f} se; wrong: {row['wrong'] or 'no word'}; "
                f"said: {row['alarms'] or 'nothing'}"
            )
    for _, row in rows[rows["violation"] == "none"].iterrows():
        often = row["worst_check"] * row["n"] > max(1, ALARMED_BY_ONE * row["n"])
        if row["false_alarm"] > ALARMED or often:
            lines.append(
                f"{row['command']} ({row['rig']}), clean: {100 * row['false_alarm']:.0f} % of the "
                f"records alarmed: {row['alarms']}"
            )
        if row["silently_wrong"] > WRONG or row["refused"] > WRONG:
            lines.append(
                f"{row['command']} ({row['rig']}), clean: {100 * row['silently_wrong']:.0f} % "
                f"wrong ({row['wrong']}), {100 * row['refused']:.0f} % refused: {row['example']}"
            )
    return lines


def report(rows: pd.DataFrame) -> bool:
    """Print the table and what is missed; whether anything is."""
    head = ("effect", "silent", "named", "refused", "right", "alarm")
    print(f"{'':74s} " + " ".join(f"{h:>8s}" for h in head))
    for _, row in rows.iterrows():
        what = f"{row['command']} ({row['rig']}): {row['violation']} {row['size']}"
        shares = ("silently_wrong", "named", "refused", "wide_or_right", "false_alarm")
        effect_se = "" if pd.isna(row["effect_in_se"]) else f"{row['effect_in_se']:.1f}"
        told = ["" if pd.isna(row[s]) else f"{100 * row[s]:.0f} %" for s in shares]
        print(f"{what[:74]:74s} " + " ".join(f"{v:>8s}" for v in (effect_se, *told)))
    lines = misses(rows)
    broken = rows[rows["violation"] != "none"]
    print(f"\n{len(broken)} violations, {len(rows) - len(broken)} clean rigs; missed: {len(lines)}")
    for line in lines:
        print(f"  MISSED {line}")
    return bool(lines)


def main() -> int:
    """Run what is missing, write and print the table; with --check 1 if something is missed."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--records", type=int, default=40, help="of every cell (40)")
    parser.add_argument("--only", nargs="+", metavar="COMMAND", help="such as elbow estimate")
    parser.add_argument("--violation", metavar="TEXT", help="only cells whose name contains it")
    parser.add_argument("--keep", type=Path, default=Path("out/broken_assumptions"))
    parser.add_argument("--again", action="store_true", help="run what is kept once more")
    parser.add_argument("--out", type=Path, help="the table, CSV (broken_assumptions.csv in KEEP)")
    parser.add_argument("--page", type=Path, metavar="DOCS", help="write page and drawing there")
    parser.add_argument("--check", action="store_true", help="exit status 1 if something is missed")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    asked = parser.parse_args()
    cells = all_cells()
    keys = [k for k, c in cells.items() if not asked.only or c.rig.command in asked.only]
    if asked.violation:
        rigs = {(c.rig.command, c.rig.name) for k, c in cells.items()
                if k in keys and asked.violation in k}  # fmt: skip
        keys = [
            k for k in keys
            if asked.violation in k or (not cells[k].violation
            and (cells[k].rig.command, cells[k].rig.name) in rigs)
        ]  # fmt: skip
    run(keys, asked.records, asked.keep, asked.workers, asked.again)
    rows = table(keys, asked.records, asked.keep)
    out = asked.out or asked.keep / "broken_assumptions.csv"
    with staged_file(out) as staged:
        rows.to_csv(staged, index=False)
    missed = report(rows)
    if asked.page is not None:
        from broken.page import write_page

        write_page(rows, asked.page)
    return int(missed and asked.check)


if __name__ == "__main__":
    sys.exit(main())
