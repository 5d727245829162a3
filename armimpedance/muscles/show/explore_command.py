"""An arm to play with: drag the hand, and stiffness and viscosity follow, in one page.

Examples:
  armimpedance explore posture.json --recording session --out explore.html
  armimpedance explore posture.json muscles.json hand.csv --out explore.html
  armimpedance explore hand.csv --out explore.html
  armimpedance explore arm.json --upper-arm-m .30 --forearm-hand-m .34 --out explore.html

MODEL is what `fit` wrote, RESULTS what `estimate` or `map` wrote; several stand in one page. The
numbers are those of `predict`, computed in the page: it needs no network. Where the model was never
measured the page says so. The arm's lengths are the recording's, the stated ones, or follow from
hand positions and joint angles in the results.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from armimpedance.show.command.options import PAGE
from armimpedance.show.command.outputs import Output, add_out, check_outputs


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("sources", nargs="+", metavar="MODEL|RESULTS", type=Path)
    add_out(parser, "the page", PAGE, required=True)
    parser.add_argument("--recording", type=Path, metavar="SESSION", help="whose arm it is")
    parser.add_argument("--upper-arm-m", type=float, metavar="M", help="shoulder to elbow")
    parser.add_argument("--forearm-hand-m", type=float, metavar="M", help="elbow to the grip")


def run(arguments: argparse.Namespace) -> int:
    """Write the page."""
    from armimpedance.muscles.show.explore_verb import write_explore

    given = [*arguments.sources, arguments.recording]
    check_outputs(Output("--out", arguments.out, PAGE), reads=given)
    notes = write_explore(
        arguments.sources,
        arguments.out,
        recording=arguments.recording,
        upper_arm_m=arguments.upper_arm_m,
        forearm_hand_m=arguments.forearm_hand_m,
    )
    print("\n".join([*notes, f"page written to {arguments.out}"]))
    return 0
