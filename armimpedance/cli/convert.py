"""Turn a lab's files into a recording: a folder of three tables that every command reads.

Examples:
  armimpedance convert exam.zip session --force-by device
  armimpedance convert exam_folder session --force-by limb --side right \\
      --onset-event PERTURB_ON --end-event PERTURB_OFF --emg ACH0=biceps_long
  armimpedance convert session session_csv --table csv
  armimpedance convert swing.c3d relaxed --skeleton elbow --mass-kg 70 --height-m 1.75 \\
      --marker RSHO=acromion_right --standing upright.c3d --emg Biceps.EMG4=biceps

Kinarm (Dexterit-E) exams: a folder or zip of BB_TT_RR.c3d and common.c3d. Which body's force the
sensor's columns hold cannot be read from the files: --force-by states it. Personal fields
(subject, operator, dates) stay out unless --keep-personal. What no file says can be given: the
mass between sensor and hand, where the shoulder was (endpoint robots), the subject's size.

Motion capture: a C3D or .trc becomes a recording of markers, a .mot or .sto one of joint angles,
each with a skeleton; `passive` and `body` read them.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from armimpedance.cli.estimate import add_force_by
from armimpedance.cli.parts.convert_motion import (
    add_options,
    convert_motion,
    is_motion_capture,
    pairs,
)

if TYPE_CHECKING:
    from armimpedance.records import Recording

SUBJECT_FIELDS = ("mass_kg", "height_m", "upper_arm_m", "forearm_hand_m")


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
    stated = parser.add_argument_group("what the files do not say")
    stated.add_argument("--handle-mass-kg", type=float, metavar="KG")
    stated.add_argument("--shoulder-m", type=float, nargs=2, metavar=("X", "Y"))
    for field in SUBJECT_FIELDS:
        unit = field.rsplit("_", 1)[1].upper()
        stated.add_argument(f"--{field.replace('_', '-')}", type=float, metavar=unit)
    parser.add_argument("--table", choices=("parquet", "csv"), default="parquet")
    add_options(parser)


def run(arguments: argparse.Namespace) -> int:
    """Read, write, say what was done."""
    from armimpedance.cli.inspect import describe
    from armimpedance.recordings import ReadOptions, open_recording, write_folder

    channels = pairs(arguments.emg, "--emg", "CHANNEL=MUSCLE, as ACH0=biceps_long")
    if is_motion_capture(arguments.input):
        return convert_motion(arguments, channels)
    options = ReadOptions(
        force_by=arguments.force_by,
        side=arguments.side,
        onset_event=arguments.onset_event,
        end_event=arguments.end_event,
        emg_channels=channels,
        keep_personal=arguments.keep_personal,
    )
    recording = _with_statements(open_recording(arguments.input, options), arguments)
    write_folder(recording, arguments.output, table=arguments.table)
    print(describe(recording, f"{arguments.input} -> {arguments.output}"))
    return 0


def _with_statements(recording: Recording, arguments: argparse.Namespace) -> Recording:
    """The recording with what the user knows and the files do not."""
    from dataclasses import replace

    import numpy as np

    from armimpedance.errors import InputError

    changes: dict[str, object] = {}
    if arguments.handle_mass_kg is not None:
        changes["handle_mass_kg"] = arguments.handle_mass_kg
    if arguments.shoulder_m is not None:
        changes["shoulder_m"] = np.array(arguments.shoulder_m)
    known = {name: getattr(arguments, name) for name in SUBJECT_FIELDS}
    sizes = {name: value for name, value in known.items() if value is not None}
    for name, value in sizes.items():
        if not value > 0:
            raise InputError(f"--{name.replace('_', '-')} {value:g}", expected="more than 0")
    if sizes:
        changes["subject"] = replace(recording.subject, **sizes)
    if not changes:
        return recording
    stated = ", ".join(sorted(set(changes) - {"subject"} | set(sizes)))
    return recording.with_step(f"Stated at conversion: {stated}.", **changes)
