"""Inertia, viscosity and stiffness of the hand while it reaches, at each phase of the reach.

Examples:
  armimpedance simulate reaches --out reaches              something to try it on
  armimpedance movement reaches --out moving.csv --figure moving.png
  armimpedance movement reaches --course --out course.csv --figure course.png
  armimpedance movement reaches --level joint --out joints.csv
  armimpedance movement reaches --inertia posture.csv --out moving.csv
  armimpedance movement reaches --method mean_difference --out as_gomi.csv

Some reaches are pushed and come back, others are free. trials.csv holds three more columns:
phase (a name for when the push comes), push_deg (its direction) and push_onset_s, all empty where
nobody pushed; push_end_s where it is known. recording.json says "perturbation": "moving" and holds
the arm's two lengths and the shoulder's place.

M, B and K are told for the middle of the fitted window. The turning of the arm stands in the
hand's B and K, which are therefore not symmetric. The inertia is fitted with the rest; --inertia
takes it from the same person's posture experiment, and says if the pushes show another one.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from armimpedance.hand.reaching.show.verb import MOVEMENT, movement
from armimpedance.show.command.options import add_choice
from armimpedance.show.command.outputs import (
    FIGURE,
    TABLE,
    Output,
    add_figure,
    add_out,
    check_long,
    check_outputs,
    write_result,
)


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("recording", metavar="RECORDING", type=Path)
    add_out(parser, "the results, one row a condition and phase", TABLE, long=True)
    add_figure(parser, "ellipses of M, B and K along the path")
    MOVEMENT.configure(parser)
    add_choice(parser, "recording")


def run(arguments: argparse.Namespace) -> int:
    """Estimate, write table and figure, print a table."""
    from armimpedance.hand.reaching.show.plot import plot_movement
    from armimpedance.hand.show.text import summary_table
    from armimpedance.show.command.options import draw_picture
    from armimpedance.show.command.screen import bar

    out, figure = arguments.out, arguments.figure
    reads = [arguments.recording, *MOVEMENT.reads(arguments)]
    check_outputs(Output("--out", out, TABLE), Output("--figure", figure, FIGURE), reads=reads)
    check_long(arguments)
    keywords = MOVEMENT.keywords(arguments)
    with bar(f"fitting {arguments.recording.name}") as progress:
        made = movement(arguments.recording, **keywords, progress=progress)
    write_result(made.content, arguments)
    print(summary_table(made))
    if out is not None:
        print(f"\n{len(made)} rows written to {out}")
    draw_picture(
        arguments,
        lambda: plot_movement(made)[0].figure,
        "The undisturbed path (a), with ellipses of the hand's stiffness and their 95 % bands, and "
        "the force of the robot on the hand (arrows); elements of K (b) and B (c) with 95 % "
        "intervals over the way. The arm's turning stands in the hand's K and B.",
    )
    return 0
