"""A page to show: verdict, pictures, intervals, checks and a methods paragraph in one HTML file.

Examples:
  armimpedance report session --out report.html
  armimpedance report hand.csv --out report.html
  armimpedance report session --method all --out report.html
  armimpedance report session --topic reflex --out reflex.html
  armimpedance report monday.csv tuesday.csv --by recording --out compared.html
  armimpedance report session --robot robot.json --arm arm.json --out therapy.html

SESSION is any recording that `inspect` takes, RESULTS what a command wrote: a RESULTS.csv, a
FIT.json, a MODEL.json. The topic follows from it; --topic names another. The file needs no network
and no other file. It says first whether the numbers can be trusted, then shows them, then what a
reviewer asks for, then how it was made, with a paragraph for the methods section of a paper.

Exit status 2, with a page that says why, where the recording cannot be used.
"""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path

from armimpedance.app.report.options import REPORT
from armimpedance.show.command.options import PAGE, add_choice
from armimpedance.show.command.outputs import Output, add_out, check_outputs


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("sources", nargs="+", metavar="SESSION|RESULTS", type=Path)
    add_out(parser, "the page", PAGE, required=True)
    REPORT.configure(parser)
    add_choice(parser, "sources", leave_out=False)


def run(arguments: argparse.Namespace) -> int:
    """Analyse, write the page, print the verdict."""
    from armimpedance.app.report.write import write_report
    from armimpedance.show.command.screen import bar

    given = [*arguments.sources, *REPORT.reads(arguments)]
    check_outputs(Output("--out", arguments.out, PAGE), reads=given)
    with bar("analysing") as progress:
        page = write_report(
            arguments.sources,
            arguments.out,
            **REPORT.keywords(arguments),
            command=_command(arguments),
            progress=progress,
        )
    print("\n".join([page.title, *page.verdict.sentences]))
    print(f"\npage written to {arguments.out}")
    return 2 if page.verdict.state == "unusable" else 0


def _command(arguments: argparse.Namespace) -> str:
    """The command line with the names of the files alone: a page may go to other people."""
    words = ["armimpedance", "report", *(path.name for path in arguments.sources)]
    words += ["--out", arguments.out.name]
    words += REPORT.words(arguments)
    if arguments.mapping is not None:
        words += ["--mapping", arguments.mapping.name]
    if arguments.where is not None:
        words += ["--where", arguments.where]
    return shlex.join(words)
