"""Say what a recording holds, whether it can be used, and what is missing.

Examples:
  armimpedance inspect session
  armimpedance inspect exam.zip --without-errors
  armimpedance inspect swing.c3d --emg Biceps.EMG4=biceps

Any format that `convert` takes can be inspected. Exit status 0 also where a check warns; 2 where
the recording cannot be used.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from armimpedance.cli.parts.reading import add_reading, reading_options


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("recording", metavar="RECORDING", type=Path)
    add_reading(parser)
    parser.add_argument("--skeleton", type=Path, metavar="FILE.json", help="of markers or angles")


def run(arguments: argparse.Namespace) -> int:
    """Print contents, checks and a verdict."""
    from armimpedance.analyses import inspect
    from armimpedance.errors import InputError
    from armimpedance.recordings import read_skeleton

    path = arguments.skeleton
    skeleton = None if path is None else read_skeleton(path)
    options = reading_options(arguments)
    inspected = inspect(arguments.recording, skeleton=skeleton, **options)
    print(inspected)
    if not inspected.usable:
        raise InputError(inspected.verdict, file=arguments.recording)
    return 0
