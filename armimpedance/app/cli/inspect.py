"""Say what a recording holds, whether it can be used, and what is missing.

Examples:
  armimpedance inspect session
  armimpedance inspect session --figure quality.png
  armimpedance inspect session --out checks.csv
  armimpedance inspect exam.zip --without-errors
  armimpedance inspect swing.c3d --emg Biceps.EMG4=biceps

Any format that `convert` takes can be inspected. Exit status 0 also where a check warns; 2 where
the recording cannot be used. --out is written in both cases, before anything is printed: one row
for the verdict, one a fact (trials, duration, ...), one a check; a recording that cannot be read at
all leaves no such file.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from armimpedance.show.command.options import add_reading, reading_options
from armimpedance.show.command.outputs import (
    FIGURE,
    TABLE,
    Output,
    add_figure,
    add_out,
    check_outputs,
)

CAPTION = (
    "All trials from their onsets: displacement (a) and change of force (b); what is left of each "
    "trial's way when the disturbance is over, with the 2 % above which a drift correction that "
    "trusts the return goes wrong (c); standard deviation of the force at rest (d); force along "
    "the motion against the motion (e). Red: trials unlike the others of their disturbance; blue, "
    "dashed: trials that estimates leave out. Of a random perturbation: its first second (a, b), "
    "the coherence between motion and force (c), and one against the other (d)."
)


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("recording", metavar="RECORDING", type=Path)
    add_reading(parser)
    parser.add_argument("--skeleton", type=Path, metavar="FILE.json", help="of markers or angles")
    add_out(parser, "the verdict, the facts and the checks", TABLE)
    add_figure(parser, "trials aligned, return, noise, force against motion")


def run(arguments: argparse.Namespace) -> int:
    """Print contents, checks and a verdict."""
    from armimpedance.app.inspection import inspect
    from armimpedance.core.errors import InputError
    from armimpedance.core.records import Recording
    from armimpedance.hand.still.show import plot_quality
    from armimpedance.recordings import read_skeleton
    from armimpedance.show.command.options import draw_picture
    from armimpedance.show.files import write_content
    from armimpedance.show.verbs.results import read

    path = arguments.skeleton
    check_outputs(
        Output("--out", arguments.out, TABLE),
        Output("--figure", arguments.figure, FIGURE),
        reads=[arguments.recording, path],
    )
    skeleton = None if path is None else read_skeleton(path)
    opened = read(arguments.recording, skeleton=skeleton, **reading_options(arguments))
    if arguments.figure is not None and not isinstance(opened, Recording):
        raise InputError(
            "--figure: a recording of markers", expected="one of the hand or of joints"
        )
    inspected = inspect(opened, title=str(arguments.recording))
    if arguments.out is not None:
        write_content(inspected.content, arguments.out)
    print(inspected)
    if isinstance(opened, Recording):
        draw_picture(arguments, lambda: plot_quality(opened), CAPTION)
    if not inspected.usable:
        raise InputError(inspected.verdict, file=arguments.recording)
    return 0
