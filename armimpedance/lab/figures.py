"""Draw the sources' figures and tables from simulated subjects, as PNG, SVG and PDF.

Examples:
  armimpedance figures --out figures
  armimpedance figures --only fig07 --out figures

Each figure's caption stands beside it as a .txt, or below it with --caption; it says what is
simulated and what differs from the source. Tables, and figures of numbers that a reader may want,
have a CSV beside them.
"""

from __future__ import annotations

import argparse

from armimpedance.show.command.outputs import OutputPath, add_look


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("--out", type=OutputPath, required=True, metavar="DIR")
    parser.add_argument(
        "--only",
        action="append",
        default=[],
        metavar="NAME",
        help="draw figures whose name contains this; may be repeated",
    )
    parser.add_argument("--seed", type=int, help="seed of the simulated subjects")
    add_look(parser)


def run(arguments: argparse.Namespace) -> int:
    """Simulate, analyse, draw."""
    from armimpedance.show.command.screen import bar
    from armimpedance.show.plots import drawn_for
    from armimpedance_figures.build_all import build, chosen
    from armimpedance_figures.source_figure import SEED

    figures = chosen(arguments.only)
    seed = SEED if arguments.seed is None else arguments.seed
    baked = arguments.caption
    with drawn_for(arguments.style), bar("drawing figures") as progress:
        for path in build(figures, arguments.out, seed=seed, baked=baked, progress=progress):
            print(path)
    return 0
