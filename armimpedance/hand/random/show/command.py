"""M, B, K and a reflex of a hand, wrist or ankle under random perturbations in two or three axes.

Examples:
  armimpedance simulate random --out session              something to try it on
  armimpedance random session --out hand.csv --figure response.png
  armimpedance simulate random --axes 3 --imposed force --reflex 0.25 --out session
  armimpedance random session --band 2 15 --out hand.json
  armimpedance simulate wrist --out wrist                 about two axes, N m and rad
  armimpedance random wrist --out wrist.csv

The robot moves the limb, or pushes it, at random along all axes for seconds to minutes.
recording.json says "perturbation": "stochastic"; the columns command_x, command_y and command_z of
the samples (of joints q1_command_rad or tau1_perturbation_Nm, and so on) hold what the robot was
told, in any unit: they tell what the limb does of its own accord from what was done to it. A
recording without them is taken where recording.json says "imposed": "position".

K is what answers at once; a delayed answer, where the record shows one, is told beside it with its
delay. Where it cannot be decided the intervals hold both.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from armimpedance.hand.random.show.verb import RANDOM, random
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
    add_out(parser, "the results, one row a group", TABLE, long=True)
    add_figure(parser, "impedance over frequency with bands, coherence, and the model")
    RANDOM.configure(parser)
    add_choice(parser, "recording")


def run(arguments: argparse.Namespace) -> int:
    """Estimate, write table and figure, print a table."""
    from armimpedance.hand.random.show.plot import plot_response_matrix
    from armimpedance.hand.show.text import summary_table
    from armimpedance.show.command.options import draw_picture
    from armimpedance.show.command.screen import bar

    out, figure = arguments.out, arguments.figure
    check_outputs(
        Output("--out", out, TABLE), Output("--figure", figure, FIGURE), reads=[arguments.recording]
    )
    check_long(arguments)
    keywords = RANDOM.keywords(arguments)
    with bar(f"fitting {arguments.recording.name}") as progress:
        made = random(arguments.recording, **keywords, progress=progress)
    write_result(made.content, arguments)
    print(summary_table(made))
    if out is not None:
        print(f"\n{len(made)} rows written to {out}")
    draw_picture(
        arguments,
        lambda: plot_response_matrix(made.fits[0]).figure,
        "Size of each element of the impedance over frequency, without a model (points with 95 % "
        "bands) and by M, B, K and the reflex (lines), of the first group; at the top the "
        "coherence of each force with the motion of all axes.",
    )
    return 0
