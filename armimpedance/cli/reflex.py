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
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from armimpedance.impedance import ReflexVerdict


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    from armimpedance.cli.estimate import add_force_by

    parser.add_argument("recording", metavar="RECORDING", type=Path)
    parser.add_argument(
        "--by",
        action="append",
        metavar="COLUMN",
        help="trials alike in this column form a group; may be given again (default: condition)",
    )
    parser.add_argument(
        "--delay-ms", type=float, metavar="D", help="delay of the reflex, for example from EMG"
    )
    parser.add_argument("--out", type=Path, metavar="TABLE.csv")
    parser.add_argument(
        "--figure", type=Path, metavar="PATH.png", help="K over the window's end, and the delay"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of the signs behind p")
    add_force_by(parser)


def run(arguments: argparse.Namespace) -> int:
    """Judge every group, print the verdicts, write table and figure."""
    from armimpedance.report import verdict_text, write_verdicts

    _check(arguments)
    verdicts = _verdicts(arguments)
    print(verdict_text(verdicts))
    if arguments.out is not None:
        write_verdicts(verdicts, arguments.out)
        print(f"\n{len(verdicts)} rows written to {arguments.out}")
    if arguments.figure is not None:
        _draw(verdicts, arguments.figure)
    return 0


def _check(arguments: argparse.Namespace) -> None:
    """Refuse before any work what cannot end well."""
    from armimpedance.cli.parts.checks import check_outputs, check_seed

    check_seed(arguments.seed)
    check_outputs(figure=arguments.figure, out=arguments.out)


def _verdicts(arguments: argparse.Namespace) -> list[ReflexVerdict]:
    from armimpedance.cli.estimate import open_checked
    from armimpedance.cli.parts.progress import bar
    from armimpedance.errors import ArmImpedanceError, InputError
    from armimpedance.impedance import reflex_guard

    recording = open_checked(arguments.recording, arguments.force_by)
    delay = None if arguments.delay_ms is None else arguments.delay_ms / 1e3
    with bar("looking for reflexes") as progress:
        try:
            return reflex_guard(
                recording,
                by=arguments.by or ["condition"],
                delay_s=delay,
                seed=arguments.seed,
                progress=progress,
            )
        except ArmImpedanceError as error:
            raise InputError(str(error), file=arguments.recording) from error


def _draw(verdicts: list[ReflexVerdict], path: Path) -> None:
    from armimpedance.plots import MOST_GROUPS, plot_reflex, save

    axes = plot_reflex(verdicts)
    written = save(axes[0, 0].figure, path.with_suffix(""), (path.suffix[1:],))
    drawn = f", the {MOST_GROUPS} groups with the smallest p" if len(verdicts) > MOST_GROUPS else ""
    print(f"figure written to {written[0]}{drawn}")
