"""Look at a Kinarm exam: protocols, blocks, conditions, events, inputs, and what to type next.

Examples:
  armimpedance exam exam.zip
  armimpedance exam exam.kinarm --out trials.csv
  armimpedance exam exam_folder --side left

It takes every form of an exam that `convert` takes, also exams that cannot be converted: it needs
no force sensor, and does not ask whose force it holds. `--out` writes one row per trial: its file,
its state (sound, empty, or what is broken), and the columns that `convert` would give it, which are
those that `--where` of `convert` and `inspect` knows. Subject, operator and dates are neither shown
nor written.
"""

from __future__ import annotations

import argparse
import textwrap
from pathlib import Path

from armimpedance.show.command.outputs import TABLE, Output, add_out, check_outputs


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("exam", metavar="EXAM", type=Path)
    parser.add_argument("--side", choices=("right", "left"), help="arm, where both are recorded")
    add_out(parser, "one row per trial", TABLE)


def run(arguments: argparse.Namespace) -> int:
    """Look, write the trials, print the tables."""
    from armimpedance.recordings import look_at_exam
    from armimpedance.show.files import table_content, write_content
    from armimpedance.show.text import TABLE_WIDTH, aligned_table

    check_outputs(Output("--out", arguments.out, TABLE), reads=[arguments.exam])
    look = look_at_exam(arguments.exam, arguments.side)
    if arguments.out is not None:
        write_content(table_content(look.trials), arguments.out)
    print(arguments.exam)
    for line in look.head:
        print(textwrap.fill(line, TABLE_WIDTH, initial_indent="  ", subsequent_indent="    "))
    for title, header, rows in look.tables:
        print(f"\n{title}\n{aligned_table(header, rows)}")
    call, *notes = look.next
    print(f"\nNext\n  {call}")
    for note in notes:
        print(textwrap.fill(note, TABLE_WIDTH, initial_indent="  ", subsequent_indent="  "))
    if arguments.out is not None:
        print(f"\n{len(look.trials)} trials written to {arguments.out}")
    return 0
