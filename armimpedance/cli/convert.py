"""Turn a lab's files into a recording: a folder of three tables that every command reads.

Examples:
  armimpedance convert exam.zip session --force-by device
  armimpedance convert exam_folder session --force-by limb --side right \\
      --onset-event PERTURB_ON --end-event PERTURB_OFF --emg ACH0=biceps_long
  armimpedance convert session session_csv --table csv

Kinarm (Dexterit-E) exams: a folder or zip of BB_TT_RR.c3d and common.c3d. Which body's force the
sensor's columns hold cannot be read from the files: --force-by states it. Personal fields
(subject, operator, dates) stay out unless --keep-personal.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from armimpedance.cli.estimate import add_force_by


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("input", metavar="INPUT", type=Path)
    parser.add_argument("output", metavar="OUTPUT_FOLDER", type=Path)
    add_force_by(parser)
    parser.add_argument("--side", choices=("right", "left"), help="arm, where both are recorded")
    parser.add_argument("--onset-event", metavar="LABEL", help="event at the disturbance's onset")
    parser.add_argument("--end-event", metavar="LABEL", help="event when it is back")
    parser.add_argument(
        "--emg",
        action="append",
        default=[],
        metavar="CHANNEL=MUSCLE",
        help="an analog channel that holds EMG, for example ACH0=biceps_long; may be given again",
    )
    parser.add_argument("--keep-personal", action="store_true", help="keep subject and dates")
    parser.add_argument("--table", choices=("parquet", "csv"), default="parquet")


def run(arguments: argparse.Namespace) -> int:
    """Read, write, say what was done."""
    from armimpedance.cli.inspect import describe
    from armimpedance.errors import InputError
    from armimpedance.recordings.convert import ReadOptions, open_recording
    from armimpedance.recordings.folder import write_folder

    channels = {}
    for pair in arguments.emg:
        channel, equals, muscle = pair.partition("=")
        if not (channel and equals and muscle):
            raise InputError(f"--emg {pair}", expected="CHANNEL=MUSCLE, as ACH0=biceps_long")
        channels[channel] = muscle
    options = ReadOptions(
        force_by=arguments.force_by,
        side=arguments.side,
        onset_event=arguments.onset_event,
        end_event=arguments.end_event,
        emg_channels=channels,
        keep_personal=arguments.keep_personal,
    )
    recording = open_recording(arguments.input, options)
    write_folder(recording, arguments.output, table=arguments.table)
    print(describe(recording, f"{arguments.input} -> {arguments.output}"))
    return 0
