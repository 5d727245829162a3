"""Compare groups of trials: what differs, by how much, and whether chance could have done it.

Examples:
  armimpedance compare session --by condition --out differences.csv --figure postures.png
  armimpedance compare session --by condition --against relaxed
  armimpedance compare monday tuesday --by recording
  armimpedance compare ann ben cem dee --by condition --subjects recording --out group.csv
  armimpedance compare hand.csv --by condition

From recordings, p values come from exchanging trials between the two groups, within each direction
of disturbance; from RESULTS.csv, which holds no trials, from the estimates' covariances. p is
reported for each matrix and for all three, and adjusted for the number of pairs (Holm). More than
200 pairs are tested from the covariances, without draws; the screen shows the clearest, --out holds
all. With --subjects the result is the mean change over subjects and the spread between them.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from armimpedance.core.errors import InputError
from armimpedance.hand.comparison.show.options import COMPARE
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

if TYPE_CHECKING:
    from armimpedance.hand.ellipses import Which


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("inputs", nargs="+", metavar="RECORDING|RESULTS.csv", type=Path)
    add_out(parser, "the differences", TABLE, long=True)
    add_figure(parser, "ellipses where the hand was")
    parser.add_argument(
        "--which",
        choices=("stiffness", "viscosity", "inertia"),
        help="matrix that the figure shows (default: stiffness)",
    )
    COMPARE.configure(parser)
    add_choice(parser, "inputs")


def run(arguments: argparse.Namespace) -> int:
    """Compare, write the differences and the figure, print tables."""
    from armimpedance.hand.comparison.show.plot import plot_comparison
    from armimpedance.hand.comparison.show.verb import compare
    from armimpedance.show.command.options import draw_picture
    from armimpedance.show.command.screen import bar

    _check(arguments)
    keywords = COMPARE.keywords(arguments)
    with bar("comparing") as progress:
        comparison = compare(arguments.inputs, **keywords, progress=progress)
    out = arguments.out
    write_result(comparison.content, arguments)
    print(comparison)
    if out is not None:
        rows = (
            f"{len(comparison.pairs)} pairs"
            if comparison.pairs
            else f"{len(comparison.over_subjects)} rows"
        )
        print(f"\n{rows} written to {out}")
    which: Which = arguments.which or "stiffness"
    draw_picture(
        arguments,
        lambda: plot_comparison(comparison.groups, comparison.pairs, which),
        f"Ellipses of {which} of each group where the hand was, with 95 % bands; lines join groups "
        "that differ (adjusted p of T2 at most .05) where there are few of them.",
    )
    return 0


def _check(arguments: argparse.Namespace) -> None:
    """Refuse early what cannot succeed, and options without effect."""
    check_outputs(
        Output("--out", arguments.out, TABLE),
        Output("--figure", arguments.figure, FIGURE),
        reads=arguments.inputs,
    )
    check_long(arguments)
    if arguments.which is not None and arguments.figure is None:
        raise InputError(f"--which {arguments.which} without --figure", expected="a figure to draw")
    if arguments.seed and arguments.subjects is not None:
        raise InputError("--seed with --subjects: nothing is drawn", expected="one of them")
