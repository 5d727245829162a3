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

from armimpedance.hand.show import add_by, add_force_by
from armimpedance.show.command.options import PAGE, add_choice, add_despite, add_leave_out
from armimpedance.show.command.outputs import Output, add_out, check_outputs


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    from armimpedance.show.pages import TOPICS

    parser.add_argument("sources", nargs="+", metavar="SESSION|RESULTS", type=Path)
    add_out(parser, "the page", PAGE, required=True)
    parser.add_argument("--topic", choices=TOPICS.names, help="default: what the source is")
    add_by(parser)
    parser.add_argument(
        "--method", metavar="NAME", help="an estimator of the topic; all: side by side (hand)"
    )
    parser.add_argument(
        "--covariance",
        choices=("cr3", "bootstrap"),
        default="cr3",
        help="of the hand: how intervals follow from the spread between trials (default: cr3)",
    )
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="default: 0")
    parser.add_argument("--robot", type=Path, metavar="ROBOT.json", help="of a therapy session")
    parser.add_argument("--arm", type=Path, metavar="ARM.json", help="of a therapy session")
    add_force_by(parser)
    add_despite(parser)
    add_leave_out(parser)
    add_choice(parser, "sources", leave_out=False)


def run(arguments: argparse.Namespace) -> int:
    """Analyse, write the page, print the verdict."""
    from armimpedance.app.report.write import write_report
    from armimpedance.show.command.screen import bar

    given = [*arguments.sources, arguments.leave_out, arguments.robot, arguments.arm]
    check_outputs(Output("--out", arguments.out, PAGE), reads=given)
    with bar("analysing") as progress:
        page = write_report(
            arguments.sources,
            arguments.out,
            topic=arguments.topic,
            by=arguments.by or "condition",
            method=arguments.method,
            covariance=arguments.covariance,
            seed=arguments.seed,
            force_by=arguments.force_by,
            despite=arguments.despite,
            leave_out=arguments.leave_out,
            robot=arguments.robot,
            arm=arguments.arm,
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
    options = ("topic", "method", "force_by", "leave_out", "mapping", "robot", "arm")
    for name in options:
        value = getattr(arguments, name)
        if value is not None:
            words += [f"--{name.replace('_', '-')}", Path(value).name]
    if arguments.where is not None:
        words += ["--where", arguments.where]
    for column in arguments.by or ():
        words += ["--by", column]
    for check in arguments.despite:
        words += ["--despite", check]
    if arguments.covariance != "cr3":
        words += ["--covariance", arguments.covariance]
    if arguments.seed:
        words += ["--seed", str(arguments.seed)]
    return shlex.join(words)
