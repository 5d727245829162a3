"""An open benchmark: tasks with data and truth, submissions in any language, one table of scores.

Examples:
  armimpedance benchmark make --out benchmark                         the public half
  armimpedance benchmark make --key secret.key --out benchmark        with a sealed half
  armimpedance benchmark score benchmark mine.csv --out mine.json
  armimpedance benchmark score benchmark mine.csv --key secret.key --out mine.json
  armimpedance benchmark table scores/*.json --out benchmark_table.md

A submission is a CSV with the columns task, record, quantity, value, and perhaps low, high, unit,
warned, time_s; `tasks/*/asked.csv` in the folder lists what is asked. docs/evidence/benchmark.md
"""

from __future__ import annotations

import argparse

#: Step -> its line in the overview; the module of this folder that bears its name holds the rest.
STEPS = {
    "make": "write the tasks: records, the truth of the public half, hashes of the sealed one",
    "score": "score one submission: errors, intervals, what is silently wrong",
    "table": "submissions side by side, a table a task",
}


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command: one subcommand a step."""
    from armimpedance.show.command.options import add_commands

    add_commands(parser, STEPS, "armimpedance.lab.benchmark_command", "STEP")
