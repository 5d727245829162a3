"""Propose what the columns of a file of any layout mean: a mapping file to read and edit.

Examples:
  armimpedance map-columns log.csv
  armimpedance map-columns session.mat --out session.toml
  armimpedance map-columns trials_folder --files "trial_*.csv"
  armimpedance inspect log.csv --mapping columns.toml
  armimpedance convert log.csv session --mapping columns.toml

The file is read, and each column's meaning proposed from its name, its unit and its numbers. What
they cannot tell stands in the file as a comment or as a "?", and is printed; a mapping with a "?"
is refused, by line. Whose force on the other the columns hold is never decided here: only what the
data say of it is told.

Without --out the mapping is written as columns.toml beside the file, where every command finds it.
A file that is there already is replaced only with --replace.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from armimpedance.core.errors import InputError
from armimpedance.core.outputs import staged_file
from armimpedance.show.command.outputs import OutputPath, add_replace


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("file", metavar="FILE", type=Path, help="a table, or a folder of them")
    parser.add_argument(
        "--out",
        type=OutputPath,
        metavar="FILE.toml",
        help="where to (default: columns.toml beside it)",
    )
    parser.add_argument("--files", metavar="PATTERN", help="of a folder, such as 'trial_*.csv'")
    add_replace(parser)


def run(arguments: argparse.Namespace) -> int:
    """Propose, write, say what could not be told."""
    from armimpedance.recordings import propose_mapping

    proposed = propose_mapping(arguments.file, arguments.files)
    out = proposed.place if arguments.out is None else arguments.out
    if out.suffix.lower() != ".toml":
        raise InputError(f"--out {out}", expected="a name that ends in .toml")
    if out.exists() and not arguments.replace:
        raise InputError("exists already", file=out, expected="a new name, or --replace")
    with staged_file(out) as file:
        file.write_text(proposed.text, encoding="utf-8")
    print(f"{arguments.file} -> {out}")
    for line in proposed.found:
        print(f"  {line}")
    print("Cannot tell:")
    for question in proposed.cannot_tell:
        print(f"  {question}")
    beside = "" if out == proposed.place else f" --mapping {out}"
    print(f"Edit {out}, then: armimpedance inspect {arguments.file}{beside}")
    return 0
