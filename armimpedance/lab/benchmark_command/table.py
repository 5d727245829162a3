"""Scores of many submissions as tables in Markdown: a table a task, a row a method.

Examples:
  armimpedance benchmark table scores/*.json --out benchmark_table.md

The first of each table has the lowest interval score. A task is shown by its sealed half where all
that attempted it were scored there, else by its public one.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from armimpedance.show.command.outputs import Output, OutputPath, check_outputs


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("scores", type=Path, nargs="+", metavar="SCORES.json")
    parser.add_argument("--out", type=OutputPath, required=True, metavar="TABLE.md")


def run(arguments: argparse.Namespace) -> int:
    """Read, write."""
    from armimpedance.core.outputs import staged_file
    from armimpedance.lab.benchmark import Scores, table_text
    from armimpedance.lab.benchmark_command.tasks import TASKS

    check_outputs(Output("--out", arguments.out, (".md",)), reads=arguments.scores)
    submissions = [Scores.read(file) for file in arguments.scores]
    text = table_text(submissions, {name: TASKS[name].line for name in TASKS})
    with staged_file(arguments.out) as staged:
        staged.write_text(text, encoding="utf-8")
    print(f"{len(submissions)} submissions -> {arguments.out}")
    return 0
