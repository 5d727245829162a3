"""A page to look at every trial: leave out with a key, save the list for `estimate --leave-out`.

Examples:
  armimpedance trials session --out choice.html
  armimpedance trials session --leave-out left_out.csv --out choice.html
  armimpedance estimate session --leave-out left_out.csv --out hand.csv

The page needs no network. Each trial is shown in front of those of the same condition and
direction; those that run unlike the others are marked. The saved list is a CSV with the columns
trial and why.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from armimpedance.hand.show.options import FORCE_BY
from armimpedance.show.command.options import PAGE, add_choice
from armimpedance.show.command.outputs import Output, add_out, check_outputs
from armimpedance.show.verbs.options import LEAVE_OUT


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("recording", metavar="SESSION", type=Path)
    add_out(parser, "the page", PAGE, required=True)
    replace(LEAVE_OUT, help="start from this list, as `trials` saves it").add(parser)
    FORCE_BY.add(parser)
    add_choice(parser, "recording", leave_out=False)


def run(arguments: argparse.Namespace) -> int:
    """Write the page."""
    from armimpedance.hand.still.show.linked_trials import write_choice
    from armimpedance.show.files import read_left_out
    from armimpedance.show.verbs.results import naming, read_recording

    check_outputs(Output("--out", arguments.out, PAGE), reads=[arguments.recording])
    earlier = {} if arguments.leave_out is None else read_left_out(arguments.leave_out)
    recording = read_recording(arguments.recording, force_by=arguments.force_by)
    with naming(arguments.recording):
        write_choice(recording, arguments.out, arguments.recording.stem, earlier)
    print(f"{recording.n_trials} trials; page written to {arguments.out}")
    return 0
