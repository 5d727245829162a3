"""Is the stiffness the limb's own, or does a reflex stand in it?

Examples:
  armimpedance reflex session
  armimpedance reflex session --by condition --out reflex.csv --figure reflex.png
  armimpedance reflex session --delay-ms 55

A stretch reflex answers a disturbance some tens of milliseconds late; a fit of M, B and K takes it
for stiffness, and the multiple correlation does not see it. The verdict of each group is one of:
no sign of a reflex (and how large one would have been seen); contaminated from about so many ms
after the onset (and by how much K is overstated); cannot be told. Delays from 30 to 120 ms are
scanned, unless one is given.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from textwrap import fill

from armimpedance.hand.show.options import add_by, add_force_by
from armimpedance.show.command.options import add_choice, add_despite
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
    add_by(parser)
    parser.add_argument(
        "--delay-ms", type=float, metavar="D", help="delay of the reflex, for example from EMG"
    )
    add_out(parser, "the verdicts, one row a group", TABLE, long=True)
    add_figure(parser, "K over the window's end, and the delay")
    parser.add_argument(
        "--seed",
        type=int,
        default=0,
        metavar="N",
        help="seed of the random signs behind p (default: 0)",
    )
    add_force_by(parser)
    add_despite(parser)
    add_choice(parser, "recording")


def run(arguments: argparse.Namespace) -> int:
    """Judge every group, write table and figure, print the verdicts."""
    from armimpedance.hand.still.show.reflex_plot import MOST_GROUPS, plot_reflex
    from armimpedance.hand.still.show.reflex_verb import reflex
    from armimpedance.hand.still.show.text import verdict_text
    from armimpedance.show.command.options import draw_picture
    from armimpedance.show.command.screen import bar

    out, figure = arguments.out, arguments.figure
    check_outputs(
        Output("--out", out, TABLE),
        Output("--figure", figure, FIGURE),
        reads=[arguments.recording],
    )
    check_long(arguments)
    with bar("looking for reflexes") as progress:
        verdicts = reflex(
            arguments.recording,
            by=arguments.by or "condition",
            delay_ms=arguments.delay_ms,
            seed=arguments.seed,
            force_by=arguments.force_by,
            despite=arguments.despite,
            progress=progress,
        )
    write_result(verdicts.content, arguments)
    print(verdict_text(verdicts))
    for warning in verdicts.warnings:
        print("\n" + fill(f"warning: {warning}", 100))
    if out is not None:
        print(f"\n{len(verdicts)} rows written to {out}")
    few = f" The {MOST_GROUPS} groups with the smallest p of {len(verdicts)}."
    draw_picture(
        arguments,
        lambda: plot_reflex(verdicts)[0, 0].figure,
        "Left: principal values of K over the end of the fitted window with 95 % bands; with the "
        "reflex that was found, the intrinsic K dashed and the interval of the delay shaded. "
        "Right: log-likelihood ratio of a reflex of each delay against none."
        + (few if len(verdicts) > MOST_GROUPS else ""),
    )
    return 0
