"""Write an example folder for a laboratory like yours: data, mapping, a script, a notebook.

Examples:
  armimpedance new --for kinarm try_kinarm
  armimpedance new --for custom try_csv && cd try_csv && python analysis.py

The data are those of a simulated subject, in the files of such a laboratory; README.md lists the
commands, and says what to change for your own files. truth.json holds what the simulated subject
really has.
"""

from __future__ import annotations

import argparse

from armimpedance.lab.parts.starter import README, SCRIPT, STARTERS, write_starter
from armimpedance.show.command.outputs import OutputPath, add_replace, check_folder


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("--for", dest="lab", required=True, choices=STARTERS.names)
    parser.add_argument("folder", metavar="DIR", type=OutputPath)
    add_replace(parser)


def run(arguments: argparse.Namespace) -> int:
    """Write the folder, say what to type next."""
    starter = STARTERS[arguments.lab]
    folder = arguments.folder
    check_folder(folder, starter.names, replace=arguments.replace, mark=SCRIPT)
    write_starter(starter, folder)
    print(f"{starter.title}\n")
    for name, what in starter.data:
        print(f"  {folder / name}: {what}")
    print(f"\nNext:\n  cd {folder}\n" + "\n".join(f"  {line}" for _, line in starter.commands))
    print(f"\n{folder / README} says more; {SCRIPT} does the same in Python.")
    return 0
